"""Samples of a periodic motion from Taylor series about equally spaced points of one period."""

from __future__ import annotations

from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import reals, skip, wholes

_ROUNDER = 6755399441055744.0  # 1.5·2⁵²: adding it leaves no digits after the point
_TURN = 6.283185307179586
TERMS = 9


@njit(fastmath={"contract"})
def _orbit(n: int, points: int, p: Any, t: Any, series: Any, theta: Any, omega: Any) -> None:
    period, lost, phase0, direction, turns, over = p[0], p[1], p[2], p[3], p[4], p[5]
    per_second = direction / period
    for i in range(n):
        count = (t[i] * (1.0 / period) + _ROUNDER) - _ROUNDER
        now = (t[i] - count * period) - count * lost
        phase = phase0 + now * per_second
        more = (phase + _ROUNDER) - _ROUNDER
        x = (phase - more) * points
        near = (x + _ROUNDER) - _ROUNDER
        x -= near
        c = skip(series, (int(near) + points // 2) * TERMS)
        v, d = c[TERMS - 1], 0.0
        for k in range(TERMS - 2, -1, -1):
            d = d * x + v
            v = v * x + c[k]
        theta[i] = v + over * _TURN * (direction * count + more) + turns
        omega[i] = d * (points * per_second)


def orbit(places: Any) -> None:
    """places: count, points a period; period (rounded, lost), phase, direction, turns, over the top; t; series; θ, ω."""
    sizes = wholes(places, 0)
    _orbit(sizes[0], sizes[1], reals(places, 1), reals(places, 2), reals(places, 3), reals(places, 4), reals(places, 5))

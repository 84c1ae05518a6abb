"""Samples of a bare pendulum's motion from Taylor series about equally spaced points of one period."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import reals, skip, wholes
from toolkit.motion.kernels.sampling import sample_step
from toolkit.motion.routes import ROW, SPARE

_ROUNDER = 6755399441055744.0  # 1.5·2⁵²: adding it leaves no digits after the point
_TURN = 6.283185307179586
_DEGREE = 17  # enough for 1e-17 at half the spacing that `elliptic` takes


@njit(fastmath={"contract"})
def _expand(c: Any, square: float, s: Any) -> None:
    """Fill the row of θ and after it that of θ', whose first numbers are given, by θ'' = −square·sin θ; s : two rows."""
    w, o = skip(c, ROW), skip(s, ROW)
    s[0] = math.sin(c[0])
    o[0] = math.cos(c[0])
    for k in range(1, _DEGREE + 1):
        x = y = 0.0
        for j in range(k):
            x += w[j] * o[k - 1 - j]
            y -= w[j] * s[k - 1 - j]
        c[k] = w[k - 1] / k
        w[k] = -square * s[k - 1] / k
        s[k] = x / k
        o[k] = y / k


@njit(fastmath={"contract"})
def _orbit(n: int, points: int, p: Any, t: Any, starts: Any, work: Any, out: Any) -> None:
    period, lost, phase0, direction, turns, over, square = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    spare, scratch, rows = work, skip(work, SPARE), skip(work, SPARE + 2 * ROW)
    for j in range(points + 1):
        c = skip(rows, 2 * j * ROW)
        c[0] = starts[j]
        c[ROW] = starts[points + 1 + j]
        _expand(c, square, scratch)
    step = period / points
    i = 0
    while i < n:
        count = (t[i] * (1.0 / period) + _ROUNDER) - _ROUNDER
        now = (t[i] - count * period) - count * lost
        phase = phase0 + now * direction / period
        more = (phase + _ROUNDER) - _ROUNDER
        x = (phase - more) * points
        near = (x + _ROUNDER) - _ROUNDER
        cell = int(near) + points // 2
        c = skip(rows, 2 * cell * ROW)
        c[0] = starts[cell] + (over * _TURN * (direction * count + more) + turns)
        since = direction * (x - near) * step  # seconds from the cell's middle to this sample
        i = sample_step(t, i, n, t[i], -since, 0.5001 * step, c, c, 0, _DEGREE, out, 1.0, spare)


def orbit(places: Any) -> None:
    """places: count, points a period; period (rounded, lost), phase, direction, turns, over the top, ω_g²; increasing
    times; θ and θ̇ at the points; memory; θ and θ̇, to be filled."""
    sizes = wholes(places, 0)
    _orbit(
        sizes[0], sizes[1], reals(places, 1), reals(places, 2), reals(places, 3), reals(places, 4), reals(places, 5)
    )  # fmt: skip

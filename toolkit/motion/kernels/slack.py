"""Where a string goes slack: the first time in a step at which its tension falls below zero.

Compiled by itself and called by its address, so that integrators compile no longer for it.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import call_terms, skip
from toolkit.motion.routes import ROW

_PARTS = 8  # looks of a step, of which there are about twenty a swing


@njit
def _tension(address: int, q: Any, c: Any, n: int, now: float, x: float, s: Any) -> float:
    w = skip(c, ROW)
    theta, rate = c[n], w[n]
    for k in range(n - 1, -1, -1):
        theta = theta * x + c[k]
        rate = rate * x + w[k]
    s[0] = now + x
    s[1] = theta
    s[2] = rate
    pull = skip(s, 4)
    call_terms(address, q, s, pull)
    return pull[0]


def slack(address: int, q: Any, s: Any, c: Any, n: int) -> None:
    """Put into s[2] the first time in [0, h] at which the tension is below zero, to the last digit; −1 where it never is.

    address : of the equation's `tension`.    s : the present time, h, ·, the sign of w, and room for two.    c : the
    series of θ, and a row on that of w, of order n.
    """
    s[2] = _first(address, q, s, c, n, s[0], s[1])


@njit
def _first(address: int, q: Any, s: Any, c: Any, n: int, now: float, h: float) -> float:
    part = h / _PARTS
    last, here = _tension(address, q, c, n, now, -part, s), _tension(address, q, c, n, now, 0.0, s)
    if here < 0.0:
        return 0.0
    for i in range(_PARTS + 1):
        x = part * i
        ahead = _tension(address, q, c, n, now, x + part, s)
        if ahead < 0.0 and i < _PARTS:
            return _narrowed(address, q, s, c, n, now, x, x + part)
        if here <= last and here <= ahead and here < last - 2.0 * here + ahead:
            # a minimum that a parabola through three looks would take below zero
            left, right = max(x - part, 0.0), min(x + part, h)
            below = _below(address, q, s, c, n, now, left, right)
            if below >= 0.0:
                return _narrowed(address, q, s, c, n, now, left, below)
        last, here = here, ahead
    return -1.0


@njit
def _below(address: int, q: Any, s: Any, c: Any, n: int, now: float, left: float, right: float) -> float:
    """A time near a minimum at which the tension is below zero, or −1, by golden sections."""
    least = 1e-10 * (right - left)
    while right - left > least:
        first, second = left + 0.382 * (right - left), right - 0.382 * (right - left)
        at_first, at_second = _tension(address, q, c, n, now, first, s), _tension(address, q, c, n, now, second, s)
        if at_first < 0.0:
            return first
        if at_second < 0.0:
            return second
        if at_first < at_second:
            right = second
        else:
            left = first
    return -1.0


@njit
def _narrowed(address: int, q: Any, s: Any, c: Any, n: int, now: float, taut: float, slack: float) -> float:
    for _ in range(80):
        middle = 0.5 * (taut + slack)
        if not taut < middle < slack:
            break
        if _tension(address, q, c, n, now, middle, s) < 0.0:
            slack = middle
        else:
            taut = middle
    return slack

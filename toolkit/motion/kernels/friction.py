"""What happens at rest: which way the pendulum starts, or whether friction holds it and until when."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import call_jet, call_terms
from toolkit.motion.routes import ROW


@njit
def force_at_rest(
    address: int, is_jet: bool, q: Any, s: Any, W: Any, R: Any, columns: Any, F: Any, sign: float
) -> float:
    """w' at s = (τ, θ, 0, ·) for a start in the direction `sign`.

    columns, F : of the equation's row; before its first column stands their count.
    """
    s[3] = sign
    if is_jet:
        call_jet(address, q, s, W, R, 1)
        return W[2 * ROW]
    call_terms(address, q, s, W)
    total = 0.0
    for e in range(columns[0]):
        total += F[e] * W[columns[1 + e]]
    return total


@njit
def leave_rest(
    address: int, is_jet: bool, q: Any, s: Any, W: Any, R: Any, columns: Any, F: Any, holds: int, sign: float
) -> tuple[bool, float, float]:
    """(held, sign of the motion to come, ratio of the accelerations after and before the turning point)."""
    up = force_at_rest(address, is_jet, q, s, W, R, columns, F, 1.0)
    down = force_at_rest(address, is_jet, q, s, W, R, columns, F, -1.0)
    before = up if sign > 0.0 else down
    if holds != 0 and up <= 0.0 and down >= 0.0:
        return True, sign, 0.0
    after = 0.0
    if up > 0.0:
        sign, after = 1.0, up
    elif down < 0.0:
        sign, after = -1.0, down
    return False, sign, after / before if before != 0.0 else 1.0


@njit
def held_until(
    address: int, is_jet: bool, q: Any, s: Any, W: Any, R: Any, columns: Any, F: Any, rate: float, start: float, end: float
) -> tuple[float, float]:  # fmt: skip
    """(time at which the torque first exceeds the friction, direction of the slip); (end, 0) if it never does.

    Looks 128 times a cycle of the fastest time dependence `rate`, then narrows down to the last digit.
    """
    step = math.pi / 64.0 / rate
    left = start
    while left < end:
        right = left + step if left + step < end else end
        way = 1.0
        for _side in range(2):
            s[0] = right
            if way * force_at_rest(address, is_jet, q, s, W, R, columns, F, way) > 0.0:
                low, high = left, right
                for _ in range(200):
                    middle = 0.5 * (low + high)
                    if middle <= low or middle >= high:
                        break
                    s[0] = middle
                    if way * force_at_rest(address, is_jet, q, s, W, R, columns, F, way) > 0.0:
                        high = middle
                    else:
                        low = middle
                return high, way
            way = -1.0
        left = right
    return end, 0.0

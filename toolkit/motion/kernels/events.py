"""Events of a run, written into its report."""

from __future__ import annotations

from typing import Any

from numba import njit

from toolkit.motion.kernels.pointer import skip
from toolkit.motion.routes import MOST_EVENTS

STICK, SLIP, SLACK = 0, 1, 2


@njit
def note(report: Any, found: int, kind: int, tau: float, theta: float, w: float) -> int:
    """Write an event down and give their number; when there is no more room, only the one with which a run ends."""
    if found == MOST_EVENTS:
        if kind != SLACK:
            return found
        found -= 1
    event = skip(report, 4 + 4 * found)
    event[0] = kind
    event[1] = tau
    event[2] = theta
    event[3] = w
    return found + 1

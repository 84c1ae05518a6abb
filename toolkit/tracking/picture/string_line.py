"""The string as a straight line: its direction in one frame, to a few thousandths of a degree.

The direction that stands out most among those some 15 degrees to either side of the pivot's (which may not be known
well yet) is refined by least squares: a ridge of Gaussian profile, each cross-section on its own level (the mean of its
ends), first on the piece near the bob, then on the whole length.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from toolkit.motion.compiled import address, call, kernel


class StringLine(NamedTuple):
    """A point on the string (px), the direction pivot → bob (rad from the downward image axis, positive to the
    right), the standard uncertainties of the direction and of the line's place at the point, the ridge's height
    over its own uncertainty, and by how much (tangent) the line leaves the direction in which the pivot was thought to be."""

    x_px: float
    y_px: float
    angle_rad: float
    sigma_angle_rad: float
    sigma_px: float
    strength: float
    slope: float


_ROOM = 4096  # numbers that the kernel works in, and more
_AS_CLEAR = 0.7  # times the line of late: one that is less clear where that was may be no string


def measure_string(
    luma: np.ndarray,
    bob: tuple[float, float],
    pivot: tuple[float, float],
    radius_px: float,
    far: bool = False,
    before: StringLine | None = None,
) -> StringLine | None:
    """The string in one frame from where bob and pivot are thought to be; None where no string is seen. It is looked for as far
    as the pivot or, where that is farther (or with `far`, whatever it is), the picture's rim. `before`, the line on a frame of
    late, tells about its slope: it is looked for there first."""
    reach = _to_rim(luma.shape, bob, pivot)
    if far or reach < 1.0:
        pivot = bob[0] + reach * (pivot[0] - bob[0]), bob[1] + reach * (pivot[1] - bob[1])
    slope = math.nan if before is None else before.slope
    numbers, out, room = np.array([*bob, *pivot, radius_px, _start(radius_px), slope]), np.zeros(9), np.empty(_ROOM)
    addresses = luma.ctypes.data, address(numbers), address(out), address(room)
    ridge = kernel("ridge", "toolkit.tracking.picture._string_kernel", "the string's measurement")
    call(ridge, *addresses, *luma.shape, *luma.strides)
    found, x, y, along_x, along_y, sigma_angle, sigma, strength, slope = out.tolist()
    if before is not None and not (found and strength > _AS_CLEAR * before.strength):
        return measure_string(luma, bob, pivot, radius_px, far)
    if not (found and strength > 8 and np.all(np.isfinite(out))):
        return None
    return StringLine(x, y, math.atan2(-along_x, -along_y), sigma_angle, sigma, strength, slope)


def seen_half(distance_px: np.ndarray, radius_px: float) -> np.ndarray:
    """Half the length of the piece of string that was measured, from how far the line's point is from the bob's centre."""
    return np.asarray(distance_px - _start(radius_px))


def _to_rim(shape: tuple[int, ...], bob: tuple[float, float], pivot: tuple[float, float]) -> float:
    """How far it is from the bob by the pivot to the picture's rim, in distances to the pivot."""
    ways = [((0.0 if q < p else size - 1.0) - p) / (q - p) for p, q, size in zip(bob, pivot, reversed(shape)) if q != p]
    return max(0.0, min(ways, default=1.0))


def _start(radius_px: float) -> float:
    """How far from the bob's centre the string is looked at first."""
    return radius_px + 6.0 + 0.15 * radius_px

"""The picture looked at in a few spots on the bob: cheap enough for every frame."""

from __future__ import annotations

from ctypes import addressof, c_double
from typing import NamedTuple

import numpy as np

from toolkit.motion.compiled import address, call, kernel
from toolkit.trackers.localiser import Patch
from toolkit.tracking.picture.front import WITHIN

_WITHIN = np.array(WITHIN, order="C")
_WITHIN_AT = address(_WITHIN)


class Told(NamedTuple):
    """Of a disc's spots how many nothing stands before, on how many of these the bob could be told from what stands still there,
    and on how many it is the bob."""

    seen: int
    tells: int
    bobs: int


def tell_bob(
    patch: Patch,
    still: np.ndarray,
    front: np.ndarray | None,
    disc: tuple[float, float, float],
    shade: float,
    light: float,
    least: float,
    streak: tuple[float, float] = (0.0, 0.0),
) -> Told | None:
    """Does the patch show a bob of this shade on the disc (x, y, radius) under so bright a light, and not what stands `still`,
    (h, w) float32 of the whole picture? On its streak (px) the bob is before each spot for a part of the exposure only, and the spot
    of a brightness between. What would differ by no more than `least` without it tells nothing; nor do spots that
    something stands before, by `front` (h, w) bool. None where the patch does not hold the disc."""
    x, y, radius = disc
    numbers = (c_double * 14)(
        x - patch.x_px, y - patch.y_px, radius, shade, light, least, patch.x_px, patch.y_px, *streak
    )  # fmt: skip
    at, image = addressof(numbers), patch.image
    told = kernel("told", "toolkit.tracking.picture._spots_kernel", "the looks at the bob")
    call(
        told, image.ctypes.data, _WITHIN_AT, at, at + 80, WITHIN.shape[1], *image.shape,
        image.strides[0] // 4, address(still), 0 if front is None else front.ctypes.data, *still.shape,
    )  # fmt: skip
    whole, seen, tells, bobs = numbers[10:]
    return Told(int(seen), int(tells), int(bobs)) if whole else None

"""Pictures that are shown twice: a camera or a codec repeats the last one where it has no new one."""

from __future__ import annotations

import numpy as np

from toolkit.video import Frame


def thinned(frame: Frame) -> np.ndarray:
    """A few of its pixels, int16."""
    return frame.luma[4::16, 4::16].astype(np.int16)


def alike(one: Frame, other: Frame) -> bool:
    """Do two pictures show the same, but for rounding? A few rows tell most that do not."""
    for every in (128, 16):
        apart = one.luma[4::every, 4::16] - other.luma[4::every, 4::16]  # of bytes: −1 is 255, and 0 once one is added
        if (apart + 1 > 2).any():
            return False
    return True


def repeats(batch: list[Frame]) -> frozenset[int]:
    """Frames that show the one before once more; none where that is no exception (nothing moves between frames)."""
    found = frozenset(i for i in range(1, len(batch)) if alike(batch[i], batch[i - 1]))
    return found if len(found) < 0.3 * len(batch) else frozenset()

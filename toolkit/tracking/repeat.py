"""Pictures that are shown twice: a camera or a codec repeats the last one where it has no new one."""

from __future__ import annotations

import numpy as np

from toolkit.video import Frame


def thinned(frame: Frame) -> np.ndarray:
    """A few of its pixels, int16."""
    return frame.luma[4::16, 4::16].astype(np.int16)


def alike(one: np.ndarray, other: np.ndarray) -> bool:
    """Do two thinned pictures show the same, but for rounding?"""
    return bool(np.abs(one - other).max() <= 1)


def repeats(batch: list[Frame]) -> frozenset[int]:
    """Frames that show the one before once more; none where that is no exception (nothing moves between frames)."""
    pictures = [thinned(f) for f in batch]
    found = frozenset(i for i in range(1, len(batch)) if alike(pictures[i], pictures[i - 1]))
    return found if len(found) < 0.3 * len(batch) else frozenset()

"""Pictures that are shown twice: a camera or a codec repeats the last one where it has no new one."""

from __future__ import annotations

import numpy as np

from toolkit.video import Frame


def thinned(frame: Frame, every: int = 16) -> np.ndarray:
    """A few of its pixels, of every so many rows, int16."""
    return frame.luma[4::every, 4::16].astype(np.int16)


def alike(one: Frame, other: Frame) -> bool:
    """Do two pictures show the same, but for rounding? A few rows tell most that do not."""
    return all(np.abs(thinned(one, every) - thinned(other, every)).max(initial=0) <= 1 for every in (128, 16))


def repeats(batch: list[Frame]) -> frozenset[int]:
    """Frames that show the one before once more; none where that is no exception (nothing moves between frames)."""
    found = frozenset(i for i in range(1, len(batch)) if alike(batch[i], batch[i - 1]))
    return found if len(found) < 0.3 * len(batch) else frozenset()

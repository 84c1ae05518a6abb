"""Do two things go along beside one another, as a bob and its shadow do?"""

from __future__ import annotations

import numpy as np

_TOGETHER, _MOSTLY = 0.4, 0.7  # of the radius, and of the places: what strays less on so many goes along


def go_side_by_side(one_px: np.ndarray, other_px: np.ndarray, radius_px: float) -> bool:
    """Are two paths, (2, n) px at the same times, of two things that keep about the same way apart, farther than this radius? On some
    of the places they may not."""
    off = one_px - other_px
    if not off.size:
        return False
    usual = np.median(off, axis=1, keepdims=True)
    together = np.hypot(*(off - usual)) < _TOGETHER * radius_px
    return bool(np.hypot(*usual[:, 0]) > radius_px and np.mean(together) > _MOSTLY)

"""How sound a track is: what decides whether the clip is looked at again, and which of two tracks is kept."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from toolkit.sentence import said

_POOR = frozenset({"track.strays", "track.few"})  # warnings that the places may be wrong
_TENTH = 0.1  # of the frames: a warning weighs as much
SOUND = _TENTH  # with fewer faults there is no reason to look at a clip again
_APART_PX = 1.0
_TOGETHER, _MOSTLY = 0.4, 0.7  # of the radius, and of the frames: what strays less on so many goes along


def faults(ok: np.ndarray, warnings: Iterable[str]) -> float:
    """The share of frames on which the bob was not measured, and a tenth for each warning that its places may be wrong. A bob that does
    not look as it should is none: it would not on a longer look."""
    told = {getattr(warning, "key", "") for warning in warnings}
    return 1.0 - float(np.mean(ok)) + _TENTH * len(told & _POOR)


def go_side_by_side(one_px: np.ndarray, other_px: np.ndarray, radius_px: float) -> bool:
    """Are two tracks, (2, n) px on the frames that both measured, of two things that go along beside one another: a bob and its
    shadow?"""
    off = one_px - other_px
    if not off.size:
        return False
    usual = np.median(off, axis=1, keepdims=True)
    together = np.hypot(*(off - usual)) < _TOGETHER * radius_px
    return bool(np.hypot(*usual[:, 0]) > radius_px and np.mean(together) > _MOSTLY)


def apart_told(one_px: np.ndarray, other_px: np.ndarray) -> list[str]:
    """A warning where two tracks, (2, n) px on the frames that both measured, have the bob at different places."""
    off = np.hypot(*(one_px - other_px))
    apart = float(np.median(off)) if off.size else np.inf
    if apart < _APART_PX:
        return []
    if not np.isfinite(apart):
        return [
            said(
                "track.never_both",
                "Looked at twice, the clip shows the bob on no common frame: the track may be of something else. See in the report's "
                "picture of a frame, or with --overlay, whether the circle is on the bob; if not, give --bob X,Y",
            )
        ]
    return [
        said(
            "track.apart",
            "Looked at twice, the clip shows the bob at places that lie {apart_px:.1f} px apart (median): the track may be of something "
            "else. See in the report's picture of a frame, or with --overlay, whether the circle is on the bob; if not, give --bob X,Y",
            apart_px=apart,
        )
    ]

"""How sound a track is: what decides whether the clip is looked at again, and which of two tracks is kept."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from toolkit.sentence import said

_POOR = frozenset({"track.strays", "track.few", "track.poor_picture"})  # warnings that the places may be wrong
_TENTH = 0.1  # of the frames, or of the contrast: a warning weighs as much
SOUND = _TENTH  # with fewer faults there is no reason to look at a clip again
_APART_PX = 1.0


def faults(ok: np.ndarray, unexplained: float, warnings: Iterable[str]) -> float:
    """The share of frames on which the bob was not measured, that of its contrast which its looks leave `unexplained` (a shadow that
    was not told from it), and a tenth for each warning that its places may be wrong."""
    told = {getattr(warning, "key", "") for warning in warnings}
    return 1.0 - float(np.mean(ok)) + unexplained + _TENTH * len(told & _POOR)


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
                "Looked at twice, the clip shows the bob on no common frame: the track may be of something else",
            )
        ]
    return [
        said(
            "track.apart",
            "Looked at twice, the clip shows the bob at places that lie {apart_px:.1f} px apart (median): the track may be of something "
            "else; look at the overlay",
            apart_px=apart,
        )
    ]

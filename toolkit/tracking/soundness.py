"""How sound a track is: what decides whether the clip is looked at again, and which of two tracks is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.geometry.beside import go_side_by_side
from toolkit.tracking.result import Track

_POOR = frozenset({"track.strays", "track.few"})  # warnings that the places may be wrong
_HELD = frozenset({"track.released", "track.held_still"})
_TENTH = 0.1  # of the frames: a warning weighs as much
SOUND = _TENTH  # with fewer faults there is no reason to look at a clip again
HOPELESS = 1.0  # with more it is no track of the bob
_ASTRAY = 0.5  # of its radius: places that stray farther from a swing are none of the bob's
_APART_PX = 1.0
_CLEARLY = 0.2  # of the frames: a track with so many more of them is better though it is not sound


def faults(track: Track) -> float:
    """The share of frames on which the bob was not measured, and a tenth for each warning that its places may be wrong; one more where
    they stray so far that they are not the bob's. A bob that does not look as it should is none: it would not on a longer look."""
    told, logged = ({getattr(line, "key", "") for line in track.meta[name]} for name in ("warnings", "log"))
    ok = np.trim_zeros(track.ok) if logged & _HELD else track.ok  # a hand held it at first or at last
    astray = track.meta["residual_rms_px"] > _ASTRAY * track.radius_px
    return 1.0 - float(np.mean(ok)) + _TENTH * len(told & _POOR) + HOPELESS * astray


def soundest(tracks: list[Track]) -> Track:
    """The best of some tracks of a clip, but no shadow's; it warns where another has the bob elsewhere."""
    tracks = [track for track in tracks if faults(track) < HOPELESS] or tracks
    best, *later = [track for track in tracks if not any(_is_shadow_of(track, other) for other in tracks)] or tracks
    for track in later:  # a longer look is no better in itself
        if faults(track) < max(SOUND, faults(best) - _CLEARLY):
            best = track
    told: list[str] = []
    for other in tracks:
        told = told or _apart_told(*_on_common_frames(best, other))
    return replace(best, meta={**best.meta, "warnings": [*best.meta["warnings"], *told]})


def _is_shadow_of(one: Track, other: Track) -> bool:
    """Is the one of something that goes along beside the other, fainter and softer?"""
    fainter = abs(one.meta["contrast"]) < abs(other.meta["contrast"]) and one.meta["edge_px"] > other.meta["edge_px"]
    return fainter and go_side_by_side(*_on_common_frames(one, other), max(one.radius_px, other.radius_px))


def _on_common_frames(one: Track, other: Track) -> tuple[np.ndarray, np.ndarray]:
    """Both tracks' places, (2, n) px, on the frames that both measured."""
    both = one.ok & other.ok
    return np.array([one.x_px, one.y_px])[:, both], np.array([other.x_px, other.y_px])[:, both]


def _apart_told(one_px: np.ndarray, other_px: np.ndarray) -> list[str]:
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

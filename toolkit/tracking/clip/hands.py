"""A bob that a hand holds before it lets go, or when it has caught it: it stands still, and that is none of its swing."""

from __future__ import annotations

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import fit_swing, start_swing

# of the swing's extent (a hand trembles by some mm where a bob swings some dm), and px: what moves less stands still
_STILL, _STILL_PX = 0.03, 0.5
_LEAST_S = 0.2  # a pendulum turns in less
_EVENER = 0.3  # times as far strays what is left from a swing, where a hand held the bob


def held_still(places: Places, log: list[str]) -> Places:
    """The places without those at the clip's start and end at which the bob stands still, where what is left is far more a
    swing without them; and a sentence on it in the log."""
    some = np.flatnonzero(places.good)
    held = np.zeros(places.good.size, bool)
    for way in (some, some[::-1]):
        stays = _stays(places, way)
        if abs(places.t_s[way[max(stays - 1, 0)]] - places.t_s[way[0]]) > _LEAST_S:
            held[way[:stays]] = True
    left = places.without(held)
    if not held.any() or left.good.sum() < 0.3 * some.size or not _strays_px(left) < _EVENER * _strays_px(places):
        return places
    seen = places.t_s[left.good]
    log.append(
        said(
            "track.held_still",
            "the bob is held still at first or at last; only what lies between t = {begin_s:.2f} s and {end_s:.2f} s was measured",
            begin_s=float(seen[0]),
            end_s=float(seen[-1]),
        )
    )
    return left


def not_swinging_yet(places: Places) -> int:
    """On how many frames, from the first on, a hand holds the bob or hides it; 0 where that is no longer than other things hide it."""
    if places.good.sum() < 8:  # no motion to speak of
        return 0
    released = int(np.argmax(held_still(places, []).good))
    return released if places.t_s[released] - places.t_s[0] > _LEAST_S else 0


def _stays(places: Places, order: np.ndarray) -> int:
    """On how many frames, in this order, the bob is where it is on the first ones."""
    points = np.column_stack([places.x_px, places.y_px])[order]
    far = np.hypot(*(points - np.median(points[:5], axis=0)).T) > max(_STILL_PX, _STILL * places.extent_px)
    return int(np.argmax(far)) if far.any() else far.size


def _strays_px(places: Places) -> float:
    """How far the places stray from the swing that goes through them best; infinite where none does."""
    some = places.some(200)
    t, x, y = places.t_s[some], places.x_px[some], places.y_px[some]
    start = start_swing(t, x, y)
    swing = None if start is None else fit_swing(t, x, y, np.full(t.size, 0.1), start)
    return np.inf if swing is None else swing.rms_px

"""A motion too small, or too flat, for its arc to bend tells no pivot: then the string's lines do."""

from __future__ import annotations

import numpy as np

from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.verdict import STRAIGHT
from toolkit.tracking.geometry.pivot import line_pivot
from toolkit.tracking.geometry.swing import NAMES, Swing, fit_swing
from toolkit.tracking.geometry.view_fit import Lines

_AS_WELL = 1.2  # times what places stray from the motion without a string: with more, the lines are none of its string


def held_swing(swing: Swing, places: Places, lines: Lines | None, size_px: tuple[int, int]) -> Swing:
    """The motion about the point in which the string's lines meet, where by its arc the pivot ran out of all bounds of a picture
    of `size_px`; else, or where the lines meet no nearer or the bob does not swing about that point, as it is."""
    beyond = STRAIGHT * float(np.hypot(*size_px))
    if swing.length_px <= beyond or lines is None:
        return swing
    meet = line_pivot(lines.x_px, lines.y_px, lines.angle_rad, np.ones(lines.x_px.size))
    some = places.some()
    t, x, y = places.t_s[some], places.x_px[some], places.y_px[some]
    if meet is None or not np.hypot(*(meet.xy - (x.mean(), y.mean()))) < beyond:
        return swing
    px, py = meet.xy
    direction = np.arctan2(x - px, y - py)
    length = float(np.median(np.hypot(x - px, y - py)))
    along = np.array([np.cos(direction[0]), -np.sin(direction[0])])
    start = swing.values_at(t[0])
    start[:4] = px, py, length, direction.mean()
    start[5:] = 0.0, 0.0, direction[0] - direction.mean(), float(along @ np.ravel(swing.velocity(t[:1]))) / length
    free = tuple(name for name in NAMES if not name.startswith("pivot"))
    held = fit_swing(t, x, y, np.full(some.size, 0.1), start, free=free)
    return held if held is not None and held.rms_px < _AS_WELL * swing.rms_px else swing

"""Error bars and the view of the camera, each of which needs the other."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from toolkit.tracking.clip.bars import Bars, ErrorBars
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.shake import Shake
from toolkit.tracking.geometry.swing import Swing
from toolkit.tracking.geometry.view import View
from toolkit.tracking.geometry.view_fit import Lines, fit_view

_VIEWS = 4  # at most
# times as far as the places may be off: so far a localiser may err for long, on a bob of one shade or of more
_EVEN, _UNEVEN = 0.5, 2.0
_BENT = 0.3  # of that: such an error of a bob of more than one shade returns with the place, and looks like the camera's view
_SETTLED = 0.6  # another view is fitted only where the last made σ smaller than this share of what it was fitted with


class Camera(NamedTuple):
    """What is known of the camera before a view is fitted: the picture's size, the pivot if given, along which axis its rows
    are read, how far the places may be off the bob's centre, true frame rate over the file's, whether the bob is of one shade,
    whether it casts a shadow beside it, and for how long (of the places' time) the shutter is open."""

    size_px: tuple[int, int]
    pivot_px: tuple[float, float] | None
    rows_along_x: bool
    off_px: float
    fps_factor: float
    even: bool = True
    shaded: bool = False
    exposure_s: float = 0.0


class Joint(NamedTuple):
    """The view (None where none fits), the error bars, and where the motion so seen has the bob, (n,) px."""

    view: View | None
    bars: ErrorBars
    x_px: np.ndarray
    y_px: np.ndarray


def fit_jointly(
    places: Places, swing: Swing, shake: Shake, time_sigma_s: float, lines: Lines | None, camera: Camera
) -> Joint:
    """The camera's view of the motion, and the error bars about it.

    A bob of one shade that is found in its middle has no errors that return with the place, but for its shadow's: what a view with every camera effect free
    explains is the camera's then, though too little of it to be shown, and no error of the places.
    """
    t, good = places.t_s, places.good
    velocity = np.array(swing.velocity(t))
    late_x, late_y = np.hypot(velocity * time_sigma_s, shake.sigma)
    slow_px = (_EVEN if camera.even else _UNEVEN) * camera.off_px
    unsteady_px = min(shake.unseen_px, np.inf if lines is None else lines.apart_px)
    bars = Bars(places, shake, velocity, time_sigma_s, unsteady_px, slow_px, camera.even)
    start = swing.values_at(t[good][0], camera.fps_factor)
    when = t / camera.fps_factor
    mx, my = swing.position(t)
    # the places are means over the exposure: a view is one of where the bob was in the middle of it
    mean_x, mean_y = swing.over_exposure(t, camera.exposure_s)
    joint = Joint(None, bars.about(mx + mean_x, my + mean_y, rough=True), mx + mean_x, my + mean_y)
    for _ in range(_VIEWS):
        scale = joint.bars
        found = fit_view(
            when[good],
            (places.x_px - mean_x)[good],
            (places.y_px - mean_y)[good],
            np.sqrt(scale.sigma_x_px**2 + late_x**2 + scale.shake_px**2)[good],
            np.sqrt(scale.sigma_y_px**2 + late_y**2 + scale.shake_px**2)[good],
            start,
            camera.size_px,
            lines,
            None if camera.pivot_px is None else (*camera.pivot_px, 1.0),
            rows_along_x=camera.rows_along_x,
            off_px=camera.off_px,
            bent_px=0.0 if camera.even else _BENT * camera.off_px,
        )
        if found is None:
            break
        drawn = found.position(when, joint.x_px, joint.y_px)
        plain = camera.even and not camera.shaded and "bob" not in found.shown
        best = found.likeliest if plain else None
        x, y = drawn if best is None else replace(found, values=best).position(when, joint.x_px, joint.y_px)
        scaled = bars.about(x + mean_x, y + mean_y, full=best is not None)
        joint = Joint(found, scaled, drawn[0] + mean_x, drawn[1] + mean_y)
        after = joint.bars
        if not found.shown or min(after.x / scale.x, after.y / scale.y) > _SETTLED:
            break
    return joint

"""Error bars and the view of the camera, each of which needs the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.scatter import Factors, true_sigma
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
    are read, how far the places may be off the bob's centre, true frame rate over the file's, whether the bob is of one shade."""

    size_px: tuple[int, int]
    pivot_px: tuple[float, float] | None
    rows_along_x: bool
    off_px: float
    fps_factor: float
    even: bool = True


class Joint(NamedTuple):
    """The view (None where none fits), what makes σ true, and where the motion so seen has the bob, (n,) px."""

    view: View | None
    factors: Factors
    x_px: np.ndarray
    y_px: np.ndarray


def fit_jointly(
    places: Places, swing: Swing, shake: Shake, time_sigma_s: float, lines: Lines | None, camera: Camera
) -> Joint:
    """The camera's view of the motion, and the factors of σ about it."""
    t, good = places.t_s, places.good
    vx, vy = swing.velocity(t)
    late_x, late_y = (np.hypot(v * time_sigma_s, shake.sigma) for v in (vx, vy))

    slow_px = (_EVEN if camera.even else _UNEVEN) * camera.off_px
    unsteady = min(shake.unseen_px, np.inf if lines is None else lines.apart_px)

    def factors(x: np.ndarray, y: np.ndarray, rough: bool = False) -> Factors:
        rx, ry = (places.x_px - x)[good], (places.y_px - y)[good]
        sx, sy = places.sigma_x_px[good], places.sigma_y_px[good]
        velocity = vx[good], vy[good]
        found = true_sigma(
            t[good], (rx, ry), (sx, sy), velocity, shake.sigma[good], time_sigma_s, unsteady, rough, slow_px
        )
        if not shake.taken:
            return found
        # the picture's own places hold the shake, which is smooth, but not the error with which it was measured
        picture = rx + shake.x[good], ry + shake.y[good]
        own = true_sigma(t[good], picture, (sx, sy), velocity, 0 * shake.sigma[good], time_sigma_s, rough=True)
        if not shake.by_string:
            return found._replace(x=own.x, y=own.y)
        # by the string each place is at its length from the pivot, and what strays is along the motion: the camera's roll
        left = float(np.mean(rx**2 + ry**2)) - float(np.mean(shake.sigma[good] ** 2))
        return Factors(own.x, own.y, float(np.sqrt(max(left, 0.0))))

    start = swing.values_at(t[good][0], camera.fps_factor)
    when = t / camera.fps_factor
    mx, my = swing.position(t)
    joint = Joint(None, factors(mx, my, rough=True), mx, my)
    for _ in range(_VIEWS):
        scale = joint.factors
        found = fit_view(
            when[good],
            places.x_px[good],
            places.y_px[good],
            np.sqrt((places.sigma_x_px * scale.x) ** 2 + late_x**2 + scale.shake_px**2)[good],
            np.sqrt((places.sigma_y_px * scale.y) ** 2 + late_y**2 + scale.shake_px**2)[good],
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
        seen = found.position(when, joint.x_px, joint.y_px)
        joint = Joint(found, factors(*seen), *seen)
        after = joint.factors
        if not found.shown or min(after.x / scale.x, after.y / scale.y) > _SETTLED:
            break
    return joint

"""Where a camera shows what: from the scene's metres and seconds to pixels, through swing, pinhole, lens, shake and rolling shutter."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from toolkit.camera.outline import bent_shapes, centre_of_light, seen_ball
from toolkit.camera.shoot import Shoot


class Outlines(NamedTuple):
    """A ball's outline in the picture at k moments, see `cover_disc`; and its light: the centre (k, 2) and the radius (k,) of
    a disc of its area."""

    shapes: np.ndarray
    rests: np.ndarray | None
    light_px: np.ndarray
    radii_px: np.ndarray


class Optics:
    """What the camera of a staged film shows at any moment of a motion `theta`: times (…) in s to angles (…) in rad."""

    def __init__(self, shoot: Shoot, theta: Callable[[np.ndarray], np.ndarray]) -> None:
        self.shoot, self.theta = shoot, theta

    def _project(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (…, 2) before the lens bends them, and pixels a metre (…) there, of scene points (…, 3) in m."""
        shoot = self.shoot
        if shoot.distance_m is None:
            return np.array(shoot.pivot_px) + shoot.px_per_m * xyz[..., :2], np.full(xyz.shape[:-1], shoot.px_per_m)
        seen = self._from_camera(xyz, shoot.distance_m)
        scale = shoot.px_per_m * shoot.distance_m / seen[..., 2]
        return shoot.middle_px + scale[..., None] * seen[..., :2], scale

    def _from_camera(self, xyz: np.ndarray, distance_m: float) -> np.ndarray:
        """The same points in m as a camera sees them from `distance_m`: right, down, ahead."""
        shoot = self.shoot
        aim = np.append((shoot.middle_px - np.array(shoot.pivot_px)) / shoot.px_per_m, 0.0)
        seen = (xyz - aim) @ _turn(shoot.yaw_rad, shoot.pitch_rad, shoot.roll_rad).T + [0.0, 0.0, distance_m]
        seen[..., 2] = np.maximum(seen[..., 2], 1e-6)
        return seen

    def _bend(self, points: np.ndarray, t_s: np.ndarray) -> np.ndarray:
        """The same points after lens and hand shake at times t_s (…)."""
        for bend in self.shoot.lens:
            points = bend(points)
        return self.shaken(points, t_s)

    def shaken(self, points: np.ndarray, t_s: np.ndarray) -> np.ndarray:
        for shake in self.shoot.shake:
            dx, dy, roll = shake(np.asarray(t_s))
            offset = points - self.shoot.middle_px
            c, s = np.cos(roll), np.sin(roll)
            turned = np.stack(
                [c * offset[..., 0] - s * offset[..., 1], s * offset[..., 0] + c * offset[..., 1]], axis=-1
            )
            points = self.shoot.middle_px + turned + np.stack([dx, dy], axis=-1)
        return points

    def _world(self, along: np.ndarray, t_s: np.ndarray) -> np.ndarray:
        """Scene points (…, 3) in m on the string: along = 0 the pivot, 1 the bob's centre, at times t_s (…)."""
        theta = self.theta(t_s)
        xyz = self.shoot.length_m * np.stack([np.sin(theta), np.cos(theta), np.zeros_like(theta)], axis=-1)
        for sway in self.shoot.sway:
            xyz = sway(t_s, xyz)
        return xyz * along[..., None]

    def see(self, along: np.ndarray, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the picture shows those points, and when: each at the moment at which its own row is exposed."""
        along, t_s = np.broadcast_arrays(np.asarray(along, float), np.asarray(t_s, float))
        when = t_s
        points = self._bend(self._project(self._world(along, when))[0], when)
        if self.shoot.readout_s:
            for _ in range(8):
                when = t_s + self.shoot.row_delay_s(points[..., 1])
                points = self._bend(self._project(self._world(along, when))[0], when)
        return points, when

    def outlines(self, centres: np.ndarray, when: np.ndarray) -> Outlines:
        """The ball's outline at times `when` (k,), the image of its centre being at `centres` (k, 2).

        Before the lens it is a circle; lens and shake act by their Jacobian, the rolling shutter by the shear
        d -> d − v τ d_y of a disc that moves at v px/s while rows are τ s apart. What a lens or a near camera add to this
        first order is in `rests`, and moves the light beside the image of the centre.
        """
        shoot, ones = self.shoot, np.ones_like(when)
        flat, scale = self._project(self._world(ones, when))
        radius = shoot.radius_m * scale
        step = 0.5
        columns = [
            (self._bend(flat + step * axis, when) - self._bend(flat - step * axis, when)) / (2 * step)
            for axis in np.eye(2)
        ]
        shapes = np.linalg.inv(np.stack(columns, axis=-1) * radius[:, None, None])
        shear = np.broadcast_to(np.eye(2), shapes.shape).copy()
        if shoot.readout_s:
            dt = 1e-5
            before, after = (self._bend(self._project(self._world(ones, w))[0], w) for w in (when - dt, when + dt))
            speed = (after - before) / (2 * dt)
            shear[:, :, 1] -= speed * (shoot.readout_s / shoot.height_px)
            shapes = shapes @ shear
        if shoot.distance_m is None and not shoot.lens:
            return Outlines(shapes, None, centres, 1 / np.sqrt(np.abs(np.linalg.det(shapes))))
        middle, spread = flat, radius[:, None, None] * np.eye(2)
        if shoot.distance_m is not None:
            seen = self._from_camera(self._world(ones, when), shoot.distance_m)
            middle, spread = seen_ball(seen, shoot.radius_m, shoot.px_per_m * shoot.distance_m)
            middle = shoot.middle_px + middle
        unrolled = np.swapaxes(np.linalg.inv(shear), 1, 2)
        straight = self._bend(flat, when)[:, None]

        def bend(points: np.ndarray) -> np.ndarray:
            return centres[:, None] + (self._bend(points, when[:, None]) - straight) @ unrolled

        light, radii = centre_of_light(bend, middle, spread)
        return Outlines(shapes, bent_shapes(bend, flat, shapes, middle, spread), light, radii)


def _turn(yaw: float, pitch: float, roll: float) -> np.ndarray:
    """(3, 3) from scene axes (x right, y down, z away) to those of a camera turned by yaw, then pitch, then roll."""
    cy, sy, cp, sp, cr, sr = (f(a) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    about_y = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cp, sp], [0, -sp, cp]])
    about_z = np.array([[cr, sr, 0], [-sr, cr, 0], [0, 0, 1]])
    return about_z @ about_x @ about_y

"""The joint second pass: motion, pivot, and what the camera did to them, as far as the clip can tell.

One model of all positions and string lines at once: a pendulum in a plane that a pinhole camera sees at a slant (yaw,
pitch) from a finite distance (1/focal length), through a lens that bends (k1), swinging out of its plane (two
amplitudes), rows exposed one after the other (readout). Weak priors say what cameras do; what the clip cannot tell
keeps its prior's width, and so shows in the uncertainty of the angles. A camera effect is only taken out where the
clip shows it (Occam); its uncertainty counts always.

How the period depends on amplitude is kept out of it by a free factor between the motion's angle and the picture's:
that evidence belongs to the fit of the physics, which would else count it twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from toolkit.tracking.least_squares import Minimum, least_squares
from toolkit.tracking.swing import NAMES as SWING_NAMES
from toolkit.tracking.swing import Swing, solve_swing

NAMES = (*SWING_NAMES, "factor", "yaw", "pitch", "log_nearness", "k1", "sway_sin", "sway_cos", "readout")
_AT = {name: i for i, name in enumerate(NAMES)}
_STEPS = np.array(
    [1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-5, 1e-5, 1e-4, 1e-6, 1e-5, 1e-5, 1e-7]
)
# Standard deviations of what cameras do, by judgement: some 10 degrees off square, lenses that bend 5 % at the corner,
# swings 3 degrees out of the plane, readouts of 15 ms; focal lengths of 1.2 to 3.3 picture widths (nearness = width / focal length).
_PRIOR = {
    "factor": (1.0, 0.3), "yaw": (0.0, 0.2), "pitch": (0.0, 0.12), "log_nearness": (-0.7, 0.5), "k1": (0.0, 0.05),
    "sway_sin": (0.0, 0.05), "sway_cos": (0.0, 0.05), "readout": (0.0, 0.015),
}  # fmt: skip
_GROUPS = {"tilt": ("yaw", "pitch"), "lens": ("k1",), "sway": ("sway_sin", "sway_cos"), "readout": ("readout",)}
_UNITS = {"k1": "", "readout": "_s"}
_TILTS = ((0.1, 0.05), (-0.1, 0.05), (0.1, -0.05), (-0.1, -0.05))  # mirrored views are minima of their own
_SQUARE = (*SWING_NAMES, "factor")
_GEOMETRY = tuple(_AT[n] for n in NAMES if n not in SWING_NAMES[4:] and n != "factor")
_MOST = 300  # positions, and a third as many lines, are enough to see what the camera did
_CLEAR = 25.0  # by how much χ² must fall before a camera effect is believed


class Lines(NamedTuple):
    """The string on some frames: a point (px), its direction (rad from the downward axis, positive to the right),
    and the uncertainties of direction and place."""

    x_px: np.ndarray
    y_px: np.ndarray
    angle_rad: np.ndarray
    sigma_rad: np.ndarray
    sigma_px: np.ndarray


@dataclass(frozen=True)
class View:
    """How the camera saw the swing. `values` in the order of `NAMES`; `covariance` of all of them, from the model with every
    camera effect free, whose values are `everything`; `shown` names the effects that the clip shows (the others are zero in
    `values`); square_covariance is that of the model chosen.

    inflation : by how much the residuals exceed the positions' own σ, their correlation included.
    """

    values: np.ndarray
    covariance: np.ndarray
    square_covariance: np.ndarray
    everything: np.ndarray
    shown: tuple[str, ...]
    middle_px: tuple[float, float]
    t0_s: float
    inflation: float
    rows_along_x: bool = False

    def __getitem__(self, name: str) -> float:
        return float(self.values[_AT[name]])

    @property
    def pivot_px(self) -> tuple[float, float]:
        """The pivot in the picture."""
        where = self._lens(self.values, np.array([self["pivot_x"]]), np.array([self["pivot_y"]]))
        return float(where[0][0]), float(where[1][0])

    @property
    def pivot_sigma_px(self) -> tuple[float, float]:
        """Standard uncertainties of the pivot in the model that was chosen."""
        return float(np.sqrt(self.square_covariance[0, 0])), float(np.sqrt(self.square_covariance[1, 1]))

    def camera(self) -> dict[str, float]:
        """The camera effects that the clip shows, by name, in rad, in the lens's own measure (k1) and s."""
        return {f"{name}{_UNITS.get(name, '_rad')}": self[name] for group in self.shown for name in _GROUPS[group]}

    def swing(self, fps_factor: float = 1.0) -> Swing:
        """The motion alone, with times as they were before fps_factor divided them."""
        f = np.ones(9)
        f[4], f[[5, 8]] = fps_factor**-2, 1 / fps_factor
        values = self.values[:9] * f
        return Swing(values, self.square_covariance[:9, :9] * np.outer(f, f), self.t0_s * fps_factor, 0.0)

    def row_time(self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
        """When the bob's own row was exposed."""
        return np.asarray(t_s + self["readout"] * self._rows(x_px, y_px))

    def position(self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the motion has the bob in the picture at stamps t_s; x_px, y_px tell its row."""
        return self._positions(self.values, t_s - self.t0_s, self._rows(x_px, y_px))

    def angles(self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """θ (rad from the vertical) of places in the picture, and how the place moves with θ, (2, n) px/rad."""
        return self._angles(self.values, t_s - self.t0_s, x_px, y_px)

    def uncertainty(
        self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray
    ) -> tuple[float, float, float, np.ndarray]:
        """Of the zero (rad), of the scale of all angles, what of it the pivot alone gives, and of what is neither zero nor
        scale (n,) rad: what pivot, vertical and camera, as far as the clip tells, may do to the angles."""
        some = np.unique(np.linspace(0, t_s.size - 1, 200).astype(int))
        t, x, y = t_s[some] - self.t0_s, x_px[some], y_px[some]
        theta = self._angles(self.values, t, x, y)[0]
        slopes = np.empty((some.size, len(_GEOMETRY)))
        for column, i in enumerate(_GEOMETRY):
            moved = self.values.copy()
            moved[i] += 10 * _STEPS[i]
            slopes[:, column] = (self._angles(moved, t, x, y)[0] - theta) / (10 * _STEPS[i])
        design = np.column_stack([np.ones(some.size), theta])
        common = np.linalg.lstsq(design, slopes, rcond=None)[0]
        other = slopes - design @ common
        block = np.ix_(_GEOMETRY, _GEOMETRY)
        # the slope with a camera effect that the clip does not show is taken where the effect is zero, where some slopes
        # vanish: their second order is the square of what the prior leaves
        full = common @ self.covariance[block] @ common.T
        alone = common @ self.square_covariance[block] @ common.T
        rest = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", other, self.covariance[block], other), 0.0))
        second = self._second_order(t, x, y, theta, design)
        other_model = self._angles(self.everything, t, x, y)[0] - theta
        zero_off, scale_off = np.linalg.lstsq(design, other_model, rcond=None)[0]
        order = np.argsort(theta)
        spread = np.interp(self._angles(self.values, t_s - self.t0_s, x_px, y_px)[0], theta[order], rest[order])
        return (
            float(np.sqrt(max(full[0, 0], 0.0) + zero_off**2)),
            float(np.sqrt(max(full[1, 1], 0.0) + second**2 + scale_off**2)),
            float(np.sqrt(max(alone[1, 1], 0.0))),
            spread,
        )

    def _second_order(
        self, t: np.ndarray, x: np.ndarray, y: np.ndarray, theta: np.ndarray, design: np.ndarray
    ) -> float:
        """What camera effects of one standard deviation do to the scale beyond their slopes (a cosine of a small tilt)."""
        total = 0.0
        for name in ("yaw", "pitch"):
            i = _AT[name]
            size = float(np.sqrt(max(self.covariance[i, i], 0.0)))
            both = []
            for sign in (1, -1):
                moved = self.values.copy()
                moved[i] += sign * size
                both.append(self._angles(moved, t, x, y)[0])
            bend = 0.5 * (both[0] + both[1]) - theta
            total += float(np.linalg.lstsq(design, bend, rcond=None)[0][1]) ** 2
        if "sway" in self.shown:
            # how much of the depth is yaw, and how much a swing before and behind the plane, is a matter of words
            phase = np.arctan2(self.values[7] * np.sqrt(abs(self.values[4])), self.values[8])
            in_phase = self["sway_sin"] * np.cos(phase) + self["sway_cos"] * np.sin(phase)
            turn = abs(self["yaw"]) + abs(in_phase) / max(float(np.abs(theta).max()), 1e-3)
            total += (0.5 * turn**2) ** 2
        return float(np.sqrt(total))

    # --- the model ------------------------------------------------------------------------------------------------

    def _rows(self, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
        """Which row is exposed, −½ (first) to ½ (last)."""
        mx, my = self.middle_px
        return (x_px - mx) / (2 * mx) if self.rows_along_x else (y_px - my) / (2 * my)

    def _positions(self, v: np.ndarray, t: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        when = t + v[16] * rows
        return self._see(v, v[9] * solve_swing(v, when)[0], self._sway(v, when))

    @staticmethod
    def _sway(v: np.ndarray, t: np.ndarray) -> np.ndarray | float:
        if v[14] == 0 and v[15] == 0:
            return 0.0
        phase = np.sqrt(abs(v[4])) * t
        return np.asarray(v[14] * np.sin(phase) + v[15] * np.cos(phase))

    def _see(self, v: np.ndarray, theta: np.ndarray, sway: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        direction = theta + v[3]
        in_plane = v[2] * np.cos(sway)
        x, y, z = in_plane * np.sin(direction), in_plane * np.cos(direction), v[2] * np.sin(sway)
        sy, cy, sp, cp = np.sin(v[10]), np.cos(v[10]), np.sin(v[11]), np.cos(v[11])
        x, z = cy * x - sy * z, sy * x + cy * z
        y, z = cp * y + sp * z, cp * z - sp * y
        mx, my = self.middle_px
        near = np.maximum(1 + np.exp(min(v[12], 1.5)) / (2 * max(mx, my)) * z, 0.05)
        return self._lens(v, mx + (v[0] - mx + x) / near, my + (v[1] - my + y) / near)

    def _lens(self, v: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if v[13] == 0:
            return x, y
        mx, my = self.middle_px
        dx, dy = x - mx, y - my
        grow = 1 + v[13] * np.minimum((dx * dx + dy * dy) / (mx * mx + my * my), 4.0)
        return mx + dx * grow, my + dy * grow

    def _straight(self, v: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where a lens that does not bend would show what is seen at x, y."""
        if v[13] == 0:
            return x, y
        mx, my = self.middle_px
        px, py = x, y
        for _ in range(6):
            grow = 1 + v[13] * np.minimum(((px - mx) ** 2 + (py - my) ** 2) / (mx * mx + my * my), 4.0)
            px, py = mx + (x - mx) / grow, my + (y - my) / grow
        return px, py

    def _angles(self, v: np.ndarray, t: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sway = self._sway(v, t + v[16] * self._rows(x, y))
        qx, qy = self._straight(v, x, y)
        theta = np.unwrap(np.arctan2(qx - v[0], qy - v[1])) - v[3]
        for _ in range(4):
            ax, ay = self._see(v, theta, sway)
            bx, by = self._see(v, theta + 1e-5, sway)
            tx, ty = (bx - ax) / 1e-5, (by - ay) / 1e-5
            theta = theta + ((x - ax) * tx + (y - ay) * ty) / (tx * tx + ty * ty)
            if v[10] == 0 and v[11] == 0 and v[13] == 0:
                break
        return theta, np.array([tx, ty])


def fit_view(
    t_s: np.ndarray,
    x_px: np.ndarray,
    y_px: np.ndarray,
    sigma_x_px: np.ndarray,
    sigma_y_px: np.ndarray,
    start: np.ndarray,
    size_px: tuple[int, int],
    lines: Lines | None = None,
    pivot: tuple[float, float, float] | None = None,
    rows_along_x: bool = False,
) -> View | None:
    """Fit the joint model to positions (n,) with standard uncertainties at stamps t_s, from a swing's values (9,), whose
    state is that at t_s[0]. `pivot` is (x, y, σ) where it is known otherwise. None where no pendulum motion fits.
    """
    n = t_s.size
    some = np.unique(np.linspace(0, n - 1, min(n, _MOST)).astype(int))
    nothing = np.zeros((len(NAMES), len(NAMES)))
    view = View(
        np.concatenate([start, [1.0], np.zeros(7)]), nothing, nothing, np.zeros(0), (),
        ((size_px[0] - 1) / 2, (size_px[1] - 1) / 2), float(t_s[0]), 1.0, rows_along_x,
    )  # fmt: skip
    view.values[_AT["log_nearness"]] = _PRIOR["log_nearness"][0]
    problem = _Problem(view, t_s[some], x_px[some], y_px[some], sigma_x_px[some], sigma_y_px[some], lines, pivot)
    square = problem.solve(view.values, _SQUARE, 25)
    if square is None:
        return None
    problem.trim(square.values)
    chosen = problem.solve(square.values, _SQUARE, 8) or square
    shown: tuple[str, ...] = ()
    full = problem.solve(chosen.values, NAMES, 8)
    if full is None:
        return None
    # from the simplest on, effects are added while one explains much of what is left
    while len(shown) < len(_GROUPS):
        inflation = problem.inflation(full)
        if (chosen.chi2 - full.chi2) / inflation**2 < _CLEAR and problem.inflation(chosen) < 1.5 * inflation:
            break
        best, winner = chosen, ""
        for group in _GROUPS:
            if group in shown:
                continue
            for start_at in _TILTS if group == "tilt" else ((0.0, 0.0),):
                trial = chosen.values.copy()
                if group == "tilt":
                    trial[[_AT["yaw"], _AT["pitch"]]] = start_at
                found = problem.solve(trial, _names((*shown, group)), 8)
                if found is not None and found.chi2 < best.chi2:
                    best, winner = found, group
        inflation = min(inflation, problem.inflation(best))
        if not winner or (chosen.chi2 - best.chi2) / inflation**2 < _CLEAR:
            break
        shown = (*shown, winner)
        problem.trim(best.values)
        chosen = problem.solve(best.values, _names(shown), 12) or best
        full = problem.solve(chosen.values, NAMES, 12) or full
    inflation = problem.inflation(full)
    try:
        covariance = problem.covariance(full, NAMES, inflation)
        square_covariance = problem.covariance(chosen, _names(shown), inflation)
    except np.linalg.LinAlgError:
        return None
    return View(
        chosen.values,
        covariance,
        square_covariance,
        full.values,
        shown,
        view.middle_px,
        view.t0_s,
        inflation,
        rows_along_x,
    )


def _names(shown: tuple[str, ...]) -> tuple[str, ...]:
    """The parameters that are free where these camera effects are in the model."""
    more = [name for group in shown for name in _GROUPS[group]]
    if "tilt" in shown or "sway" in shown:
        more.append("log_nearness")
    return tuple(name for name in NAMES if name in _SQUARE or name in more)


class _Problem:
    """The residuals of a clip."""

    def __init__(
        self,
        view: View,
        t_s: np.ndarray,
        x: np.ndarray,
        y: np.ndarray,
        sx: np.ndarray,
        sy: np.ndarray,
        lines: Lines | None,
        pivot: tuple[float, float, float] | None,
    ) -> None:
        self.view, self.t, self.x, self.y = view, t_s - view.t0_s, x, y
        self.wx, self.wy = 1 / sx, 1 / sy
        self.rows = view._rows(x, y)
        if lines is not None and lines.x_px.size > _MOST // 3:
            every = np.unique(np.linspace(0, lines.x_px.size - 1, _MOST // 3).astype(int))
            lines = Lines(*(column[every] for column in lines))
        self.lines, self.pivot = lines, pivot
        self.line_weight = np.zeros(0) if lines is None else np.ones(lines.x_px.size)
        self.steps = _STEPS.copy()
        self.steps[4] *= abs(view.values[4])
        self.solved_for: tuple[float, ...] = ()
        self.solved: tuple[np.ndarray, np.ndarray] = (self.t, self.t)

    def rest(self, v: np.ndarray) -> np.ndarray:
        """Positions (x then y), lines, priors, over their standard uncertainties."""
        key = (*v[4:9], v[16])
        if key != self.solved_for:  # most columns of a Jacobian leave the motion as it is
            when = self.t + v[16] * self.rows
            self.solved_for, self.solved = key, (when, solve_swing(v, when)[0])
        when, angle = self.solved
        x, y = self.view._see(v, v[9] * angle, self.view._sway(v, when))
        parts = [(x - self.x) * self.wx, (y - self.y) * self.wy]
        if self.lines is not None:
            parts.append(self.line_rest(v) * self.line_weight)
        pulls = [(v[_AT[name]] - value) / sigma for name, (value, sigma) in _PRIOR.items()]
        if self.pivot is not None:
            pulls += [(v[0] - self.pivot[0]) / self.pivot[2], (v[1] - self.pivot[1]) / self.pivot[2]]
        return np.concatenate([*parts, pulls])

    def line_rest(self, v: np.ndarray) -> np.ndarray:
        """How far each line passes the pivot, over its uncertainty there."""
        assert self.lines is not None
        k = self.lines
        qx, qy = self.view._straight(v, k.x_px, k.y_px)
        dx, dy = np.sin(k.angle_rad), np.cos(k.angle_rad)
        if v[13]:
            ex, ey = self.view._straight(v, k.x_px + dx, k.y_px + dy)
            dx, dy = ex - qx, ey - qy
            size = np.hypot(dx, dy)
            dx, dy = dx / size, dy / size
        away = dy * (v[0] - qx) - dx * (v[1] - qy)
        reach = np.hypot(v[0] - qx, v[1] - qy)
        return np.asarray(away / np.hypot(np.hypot(k.sigma_rad * reach, k.sigma_px), 1e-3))

    def solve(self, start: np.ndarray, names: tuple[str, ...], turns: int) -> Minimum | None:
        values = start.copy()
        for name in NAMES[10:]:
            if name not in names and name != "log_nearness":
                values[_AT[name]] = 0.0
        return least_squares(self.rest, values, self.steps, [_AT[n] for n in names], turns=turns, settled=1e-6)

    def trim(self, values: np.ndarray) -> None:
        """Leave out strays, and let the lines weigh as they scatter."""
        x, y = self.view._positions(values, self.t, self.rows)
        size = np.hypot((x - self.x) * self.wx, (y - self.y) * self.wy)
        off = size > max(8.0, 6 * float(np.median(size)))
        if 0 < off.sum() < 0.1 * off.size:
            self.wx, self.wy = np.where(off, 0.0, self.wx), np.where(off, 0.0, self.wy)
        if self.lines is not None:
            rest = self.line_rest(values)
            spread = max(1.0, 1.4826 * float(np.median(np.abs(rest))))
            self.line_weight = np.where(np.abs(rest) < 4 * spread, 1 / spread, 0.0)

    def covariance(self, least: Minimum, names: tuple[str, ...], inflation: float) -> np.ndarray:
        """Of all parameters, zero where held: the data's weight lowered by the inflation, the priors' not."""
        prior = np.array([_PRIOR[name][1] ** -2 if name in _PRIOR else 0.0 for name in names])
        normal = (least.normal - np.diag(prior)) / inflation**2 + np.diag(prior)
        index = [_AT[name] for name in names]
        whole = np.zeros((len(NAMES), len(NAMES)))
        whole[np.ix_(index, index)] = np.linalg.inv(normal)
        return whole

    def inflation(self, least: Minimum) -> float:
        """How far the residuals exceed their σ, with their correlation from frame to frame.

        At least as if half of σ were no scatter but a bent error that returns with the place (a shadow's, a shading's),
        such as a handful of points along the arc would have.
        """
        n = self.t.size
        block = max(2, min(20, n // 12))
        whole = n // block * block
        found = 1.0 + 0.25 * n / 5
        for r in (least.rest[:n], least.rest[n : 2 * n]):
            sums = r[:whole].reshape(-1, block).sum(axis=1)
            found = max(found, float(np.mean(r**2)), float(np.mean(sums**2)) / block)
        return float(np.sqrt(found))

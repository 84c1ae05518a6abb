"""How a camera saw a swing: a pendulum in a plane that a pinhole camera sees at a slant (yaw, pitch) from a finite
distance (1/focal length), through a lens that bends (k1), swinging out of its plane (two amplitudes), rows exposed one
after the other (readout), the place found a little off the bob's centre (a shadow, a highlight).

All functions of the model take parameters `v` of shape (19,), in the order of `NAMES`, or (19, k, 1) for k sets at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolkit.motion.compiled import address, call, kernel
from toolkit.tracking.geometry.swing import NAMES as SWING_NAMES
from toolkit.tracking.geometry.swing import Swing, solve_swing

NAMES = (
    *SWING_NAMES, "factor", "yaw", "pitch", "log_nearness", "k1", "sway_sin", "sway_cos", "readout", "off_x", "off_y",
)  # fmt: skip
AT = {name: i for i, name in enumerate(NAMES)}
GROUPS = {
    "tilt": ("yaw", "pitch"), "lens": ("k1",), "sway": ("sway_sin", "sway_cos"), "readout": ("readout",),
    "bob": ("off_x", "off_y"),
}  # fmt: skip
_UNITS = {"k1": "", "readout": "_s", "off_x": "_px", "off_y": "_px"}
_ANGLES_SHOWN = 61  # places along the arc at which samples of the view are compared


def motion_of(v: np.ndarray) -> np.ndarray:
    """The motion's own values (…, 9) of views (…, 19), whose angle and rate at the start are the picture's: what a clip
    tells does not change with the factor then."""
    motion = v[..., :9].copy()
    motion[..., 7:] /= v[..., 9:10]
    return motion


@dataclass(frozen=True)
class View:
    """How the camera saw the swing. `values` in the order of `NAMES`; `shown` names the effects that the clip shows (the
    others are zero in `values`); `covariance` is that of `values` in the model so chosen.

    samples (m, 19), weights (m,) : what else the clip and the priors allow, every camera effect free.
    inflation : by how much the residuals exceed the positions' own σ, their correlation included.
    likeliest : (19,), the values that explain the clip best with every effect free, shown or not.
    """

    values: np.ndarray
    covariance: np.ndarray
    samples: np.ndarray
    weights: np.ndarray
    shown: tuple[str, ...]
    middle_px: tuple[float, float]
    t0_s: float
    inflation: float
    rows_along_x: bool = False
    likeliest: np.ndarray | None = None

    def __getitem__(self, name: str) -> float:
        return float(self.values[AT[name]])

    @property
    def pivot_px(self) -> tuple[float, float]:
        """The pivot in the picture."""
        x, y = self.bend(self.values, self.values[0], self.values[1])
        return float(x), float(y)

    @property
    def pivot_sigma_px(self) -> tuple[float, float]:
        """Standard uncertainties of the pivot in the model that was chosen."""
        return float(np.sqrt(self.covariance[0, 0])), float(np.sqrt(self.covariance[1, 1]))

    def camera(self) -> dict[str, float]:
        """The camera effects that the clip shows, by name, in rad, in the lens's own measure (k1), px and s."""
        return {f"{name}{_UNITS.get(name, '_rad')}": self[name] for group in self.shown for name in GROUPS[group]}

    def swing(self, fps_factor: float = 1.0) -> Swing:
        """The motion alone, with times as they were before fps_factor divided them."""
        f = np.ones(9)
        f[4], f[5], f[7], f[8] = fps_factor**-2, 1 / fps_factor, 1 / self["factor"], 1 / (fps_factor * self["factor"])
        values = self.values[:9] * f
        return Swing(values, self.covariance[:9, :9] * np.outer(f, f), self.t0_s * fps_factor, 0.0)

    def row_time(self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
        """When the bob's own row was exposed. Where the clip does not show a readout clearly it is the mean of what clip and prior
        allow (Bayes' estimate), not none: rows that are read at other times bend θ(t) as laws of drag do."""
        return np.asarray(t_s + self.readout_s * self.rows(x_px, y_px))

    @property
    def readout_s(self) -> float:
        """How much later the last row is exposed than the first, as `row_time` has it."""
        return self["readout"] if "readout" in self.shown else float(self.weights @ self.samples[:, AT["readout"]])

    @property
    def readout_u_s(self) -> float:
        """How far the views that the clip allows have the readout from the one used (rms)."""
        return float(np.sqrt(self.weights @ (self.samples[:, AT["readout"]] - self.readout_s) ** 2))

    def rows_by_angle(self, theta_rad: np.ndarray) -> tuple[float, float]:
        """(a, ψ): at θ the bob is in the row a·cos(θ − ψ), up to a constant. ψ (rad) is the angle of a string that hangs along the
        way rows are read, and a the string's length in picture heights."""
        theta = np.linspace(theta_rad.min(), theta_rad.max(), _ANGLES_SHOWN)
        still = self.values.copy()
        still[[AT["sway_sin"], AT["sway_cos"]]] = 0.0
        rows = self.rows(*self.see(still, theta, np.zeros_like(theta)))
        design = np.column_stack([np.ones_like(theta), np.cos(theta), np.sin(theta)])
        _, along, across = np.linalg.lstsq(design, rows)[0]
        return float(np.hypot(along, across)), float(np.arctan2(across, along))

    def position(self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the motion has the bob in the picture at stamps t_s; x_px, y_px tell its row."""
        v = self.values
        when = t_s - self.t0_s + v[AT["readout"]] * self.rows(x_px, y_px)
        return self.see(v, v[9] * solve_swing(motion_of(v), when)[0], when)

    def angles(self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """θ (rad from the vertical) of places in the picture, and how the place moves with θ, (2, n) px/rad."""
        return self._angles(self.values, t_s - self.t0_s, x_px, y_px)

    def uncertainty(
        self, t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray
    ) -> tuple[float, float, float, np.ndarray]:
        """Of the zero (rad), of the scale of all angles, what of it the pivot alone gives, and of what is neither zero nor
        scale (n,) rad: how far the views that the clip allows have the angles from the view chosen (rms)."""
        everywhere = self._angles(self.values, t_s - self.t0_s, x_px, y_px)[0]
        some = np.unique(np.argsort(everywhere)[np.linspace(0, t_s.size - 1, _ANGLES_SHOWN).astype(int)])
        t, x, y, theta = t_s[some] - self.t0_s, x_px[some], y_px[some], everywhere[some]
        design = np.column_stack([np.ones(some.size), theta])
        reading = np.linalg.pinv(design)
        off = self._angles(self.samples.T[..., None], t, x, y)[0] - theta
        common = off @ reading.T
        rest = np.sqrt(self.weights @ (off - common @ design.T) ** 2)
        zero, scale = np.sqrt(self.weights @ common**2)
        steps = np.sqrt(np.diag(self.covariance)) + 1e-12
        index = np.flatnonzero(steps > 1e-9)
        moved = self.values[:, None] + 0.1 * np.diag(steps)[:, index]
        slopes = (self._angles(moved[..., None], t, x, y)[0] - theta) @ reading[1] / (0.1 * steps[index])
        alone = slopes @ self.covariance[np.ix_(index, index)] @ slopes
        order = np.argsort(theta)
        return (
            float(zero),
            float(scale),
            float(np.sqrt(max(alone, 0.0))),
            np.interp(everywhere, theta[order], rest[order]),
        )

    # --- the model ------------------------------------------------------------------------------------------------

    def rows(self, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
        """Which row is exposed, −½ (first) to ½ (last)."""
        mx, my = self.middle_px
        return (x_px - mx) / (2 * mx) if self.rows_along_x else (y_px - my) / (2 * my)

    def see(self, v: np.ndarray, theta: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the picture shows a bob that is at θ at times t, (n,) or (k, n)."""
        x, y = self._by_kernel("see", v, (theta, t), 2)
        return x, y

    def bend(self, v: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the lens shows what a straight one would show at x, y."""
        mx, my = self.middle_px
        dx, dy = x - mx, y - my
        grow = 1 + v[13] * np.minimum((dx * dx + dy * dy) / (mx * mx + my * my), 4.0)
        return mx + dx * grow, my + dy * grow

    def straight(self, v: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where a lens that does not bend would show what is seen at x, y."""
        if not np.any(v[13]):
            return x, y
        x, y = self._by_kernel("straight", v, (x, y), 2)
        return x, y

    def _by_kernel(self, name: str, v: np.ndarray, given: tuple[np.ndarray, ...], found: int) -> np.ndarray:
        """What the kernel of that name finds for `v` from the numbers given of each point, (n,) or (k, n) each."""
        sets, middle = np.array(v.reshape(len(NAMES), -1).T, order="C"), np.array(self.middle_px)
        lists = np.empty((len(given) + found, len(sets), given[0].shape[-1]))
        for row, numbers in zip(lists, given):
            row[:] = numbers
        work = kernel(name, "toolkit.tracking.geometry._view_kernel", "the camera's view")
        call(work, address(sets), address(middle), address(lists), *lists.shape[1:])
        return lists[len(given) :] if v.ndim > 1 else lists[len(given) :, 0]

    def _angles(self, v: np.ndarray, t: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        when = t + v[16] * self.rows(x, y)
        qx, qy = self.straight(v, x - v[17], y - v[18])
        theta = np.unwrap(np.arctan2(qx - v[0], qy - v[1])) - v[3]
        flat = not (np.any(v[10]) or np.any(v[11]) or np.any(v[13]))
        for _ in range(1 if flat else 4):
            ax, ay = self.see(v, theta, when)
            bx, by = self.see(v, theta + 1e-5, when)
            tx, ty = (bx - ax) / 1e-5, (by - ay) / 1e-5
            theta = theta + ((x - ax) * tx + (y - ay) * ty) / (tx * tx + ty * ty)
        return theta, np.array([tx, ty])

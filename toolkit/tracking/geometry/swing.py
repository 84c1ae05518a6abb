"""The motion of a pendulum as a camera sees it, fitted to positions in the picture.

θ'' = −ω² sin θ − 2γ θ' − β |θ'| θ' about a fixed pivot; the bob is at pivot + L (sin(θ + v), cos(θ + v)), v being the
direction of the vertical in the picture. Used to predict hidden frames, to tell a pendulum from what is none, and to
see how much the measured positions scatter. It is not the fit of the physics: that is `toolkit.fit`.
"""

from __future__ import annotations

from ctypes import addressof, c_double, c_void_p, cast
from dataclasses import dataclass
from functools import cache
from math import cos, hypot, remainder, sin, tau
from typing import Any

import numpy as np

from toolkit.motion.compiled import address, call, kernel
from toolkit.tracking.geometry.least_squares import least_squares

NAMES = ("pivot_x", "pivot_y", "length", "vertical", "omega2", "gamma", "beta", "theta0", "rate0")
CALM = {"gamma": (0.0, 0.1), "beta": (0.0, 0.5)}
"""The damping of a pendulum of which little is known yet, as a prior."""
LANES = 128
"""Numbers that the kernel works in, and more."""


@dataclass(frozen=True)
class Swing:
    """A fitted motion. `values` (9,) in the order of `NAMES` (px, rad, 1/s², 1/s); the state is that at t0_s.

    covariance : (9, 9) of the values, scaled by the scatter found; rows of parameters held fixed are zero.
    rms_px : scatter per axis about the motion.
    """

    values: np.ndarray
    covariance: np.ndarray
    t0_s: float
    rms_px: float

    @property
    def pivot_px(self) -> tuple[float, float]:
        """The fitted pivot."""
        return float(self.values[0]), float(self.values[1])

    @property
    def pivot_sigma_px(self) -> tuple[float, float]:
        """Standard uncertainties of the pivot."""
        return float(np.sqrt(self.covariance[0, 0])), float(np.sqrt(self.covariance[1, 1]))

    @property
    def length_px(self) -> float:
        """Pivot to bob centre."""
        return float(self.values[2])

    @property
    def period_s(self) -> float:
        """Period at small amplitude."""
        return float(2 * np.pi / np.sqrt(max(self.values[4], 1e-9)))

    def angle(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """θ (rad, from the fitted vertical) and θ' (rad/s) at times t_s (n,), sorted or not."""
        out = solve_swing(self.values, np.atleast_1d(np.asarray(t_s, float)) - self.t0_s)
        return out[0], out[1]

    def angles_at(self, times_s: list[float]) -> tuple[list[float], list[float]]:
        """`angle` at a few times: what is asked on every frame is quicker without arrays."""
        n = len(times_s)
        room = (c_double * (9 + 3 * n + LANES))(*self.values.tolist(), *(t - self.t0_s for t in times_s))
        at = addressof(room)
        call(_kernel(), at, at + 8 * (9 + 3 * n), n, 1)
        return room[9 + n : 9 + 2 * n], room[9 + 2 * n : 9 + 3 * n]

    def position(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x, y in px at times t_s."""
        theta, _ = self.angle(t_s)
        return _place(self.values, theta)

    def velocity(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """dx/dt, dy/dt in px/s at times t_s."""
        theta, rate = self.angle(t_s)
        direction = theta + self.values[3]
        speed = self.values[2] * rate
        return speed * np.cos(direction), -speed * np.sin(direction)

    def acceleration_at(self, x_px: float, y_px: float, vx: float, vy: float) -> tuple[float, float]:
        """x'', y'' (px/s²) of a bob there, at this velocity (px/s): by gravity along the arc, by the string towards the pivot."""
        px, py, length, vertical, omega2, *_ = self.values.tolist()
        dx, dy = x_px - px, y_px - py
        away = max(hypot(dx, dy), 1.0)
        ux, uy = dx / away, dy / away
        drawn = omega2 * length * (ux * cos(vertical) - uy * sin(vertical))
        inward = (vx * vx + vy * vy) / away
        return -drawn * uy - inward * ux, drawn * ux - inward * uy

    def over_exposure(self, t_s: np.ndarray, exposure_s: float) -> tuple[np.ndarray, np.ndarray]:
        """By how much (px) the mean place over an exposure about t_s (n,) lies beside the place at t_s (Simpson's rule)."""
        before, at, after = (np.array(self.position(t_s + k * exposure_s)) for k in (-0.5, 0.0, 0.5))
        x, y = (before - 2 * at + after) / 6
        return x, y

    def values_at(self, t_s: float, fps_factor: float = 1.0) -> np.ndarray:
        """The values (9,) with the state at t_s, for times divided by `fps_factor`."""
        theta, rate = self.angle(np.array([t_s]))
        values = self.values.copy()
        values[7:] = theta[0], rate[0] * fps_factor
        values[4] *= fps_factor**2
        values[5] *= fps_factor
        return values


def _place(values: np.ndarray, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    direction = np.where(np.isfinite(theta), theta, np.nan) + values[3]
    return values[0] + values[2] * np.sin(direction), values[1] + values[2] * np.cos(direction)


def solve_swing(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(2, n): θ and its rate at times t (n,) after that of the state in `values`, integrated from each to the next; NaN of a motion
    that would turn thousands of times more often than frames could tell.

    Of several motions at once, `values` (k, 9 or more) each at its own times (k, n): (k, 2, n).
    """
    n = t.shape[-1]
    room = np.empty((*t.shape[:-1], 9 + 3 * n))  # of each motion: the values, the times, the angles and their rates
    room[..., :9] = values[..., :9]
    room[..., 9 : 9 + n] = t
    lanes = np.empty(LANES)
    call(_kernel(), address(room), address(lanes), n, room.size // (9 + 3 * n))
    return room[..., 9 + n :].reshape(*t.shape[:-1], 2, n)


def _kernel() -> Any:
    return kernel("swing", "toolkit.tracking.geometry._swing_kernel", "the swing")


@cache
def swing_address() -> int:
    """Where the compiled swing is, for another kernel to call."""
    return int(cast(_kernel(), c_void_p).value or 0)


def small_steps(values: np.ndarray) -> np.ndarray:
    """(9,) by how much each of the values (9,) is moved to see what the places do."""
    return np.array([1e-3, 1e-3, 1e-3, 1e-6, 1e-6 * abs(values[4]), 1e-6, 1e-6, 1e-6, 1e-6])


def fit_swing(
    t_s: np.ndarray,
    x_px: np.ndarray,
    y_px: np.ndarray,
    sigma_px: np.ndarray,
    start: np.ndarray,
    *,
    free: tuple[str, ...] = NAMES,
    prior: dict[str, tuple[float, float]] | None = None,
    turns: int = 25,
) -> Swing | None:
    """Least squares of the motion to positions (n,) with standard uncertainties, from `start` (9,).

    Levenberg–Marquardt with forward differences; names that are not in `free` keep their start. `prior` maps a name
    to (value, σ). None where it does not converge to finite numbers.
    """
    t = np.asarray(t_s, float)
    t0 = float(t[0])
    t = t - t0
    weight = 1 / np.asarray(sigma_px, float)
    index = [NAMES.index(name) for name in free]
    tied = {NAMES.index(name): pair for name, pair in (prior or {}).items() if name in free}

    def rest(values: np.ndarray) -> np.ndarray:
        x, y = _place(values, solve_swing(values, t)[0])
        pulls = [(values[i] - value) / sigma for i, (value, sigma) in tied.items()]
        return np.concatenate([(x - x_px) * weight, (y - y_px) * weight, pulls])

    def slopes(values: np.ndarray) -> np.ndarray:
        sets = values + np.concatenate([np.zeros((1, 9)), np.eye(9)[moving] * steps])
        angles = solve_swing(sets, np.tile(t, (len(sets), 1)))[:, 0]
        turns = np.zeros((9, t.size))  # by each of the values, of the direction
        turns[3] = 1.0
        turns[moving] = (angles[1:] - angles[0]) / steps[moving][:, None]
        right, down = values[2] * np.sin(angles[0] + values[3]), values[2] * np.cos(angles[0] + values[3])
        along_x, along_y = turns * down, turns * -right
        along_x[0], along_y[1], along_x[2], along_y[2] = 1.0, 1.0, right / values[2], down / values[2]
        pulls = [np.eye(9)[i] / sigma for i, (_, sigma) in tied.items()]
        found = [along_x * weight, along_y * weight, np.reshape(pulls, (-1, 9)).T]
        return np.concatenate(found, axis=1)[index].T

    steps, moving = small_steps(start), [i for i in index if i >= 4]  # the angle does not depend on the rest
    least = least_squares(rest, start, steps, index, turns=turns, slopes=slopes)
    if least is None:
        return None
    dof = max(1, 2 * t.size - len(index))
    chi2 = float(least.rest[: 2 * t.size] @ least.rest[: 2 * t.size])
    covariance = np.zeros((9, 9))
    try:
        covariance[np.ix_(index, index)] = np.linalg.inv(least.normal) * max(chi2 / dof, 1e-300)
    except np.linalg.LinAlgError:
        return None
    x, y = _place(least.values, solve_swing(least.values, t)[0])
    rms = float(np.sqrt((np.sum((x - x_px) ** 2) + np.sum((y - y_px) ** 2)) / dof))
    values = least.values.copy()
    values[3], values[7] = (remainder(angle, tau) for angle in (values[3], values[7]))  # whole turns change no place
    return Swing(values, covariance, t0, rms)


def fit_circle(x: np.ndarray, y: np.ndarray, weight: np.ndarray | None = None) -> tuple[float, float, float, float]:
    """Centre x, y, radius and rms distance of the circle through points: Taubin's algebraic fit, then Gauss–Newton
    on the geometric distance. Points on a line give an infinite radius."""
    w = np.ones(x.size) if weight is None else weight / weight.mean()
    mx, my = np.average(x, weights=w), np.average(y, weights=w)
    dx, dy = x - mx, y - my
    z = dx * dx + dy * dy
    mz = np.average(z, weights=w)
    if not mz > 0:
        return float(mx), float(my), 0.0, 0.0
    design = np.column_stack([(z - mz) / (2 * np.sqrt(mz)), dx, dy]) * np.sqrt(w)[:, None]
    a, b, c = np.linalg.svd(design, full_matrices=False)[2][2]
    a = a / (2 * np.sqrt(mz))
    if abs(a) < 1e-12 * np.hypot(b, c):
        return float("inf"), float("inf"), float("inf"), float(np.sqrt(np.average((b * dx + c * dy) ** 2, weights=w)))
    p = np.array([mx - b / (2 * a), my - c / (2 * a), np.sqrt(b * b + c * c + 4 * a * a * mz) / (2 * abs(a))])
    for _ in range(10):
        ex, ey = x - p[0], y - p[1]
        d = np.hypot(ex, ey)
        jacobian = np.column_stack([-ex / d, -ey / d, -np.ones(x.size)]) * np.sqrt(w)[:, None]
        try:
            step = np.linalg.lstsq(jacobian, -(d - p[2]) * np.sqrt(w), rcond=None)[0]
        except np.linalg.LinAlgError:
            break
        p += step
        if np.abs(step).max() < 1e-9 * p[2]:
            break
    rest = np.hypot(x - p[0], y - p[1]) - p[2]
    return float(p[0]), float(p[1]), float(p[2]), float(np.sqrt(np.average(rest**2, weights=w)))


def start_swing(t_s: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray | None:
    """A start (9,) for `fit_swing` from positions alone: circle, then θ'' = −ω² sin(θ) by weak (integrated) form.

    None where the positions lie on no arc with its centre above them.
    """
    t = np.asarray(t_s, float) - t_s[0]
    cx, cy, length, _ = fit_circle(x_px, y_px)
    spread = max(float(np.ptp(x_px)), float(np.ptp(y_px)))
    below = cy > np.mean(y_px)  # bends the wrong way: a hand-held camera and a small swing, or no pendulum
    if below or not np.isfinite(length) or length > 40 * spread:
        length = 5 * spread  # too flat to tell: any long pendulum will do as a start
        cx, cy = float(np.mean(x_px)), float(np.mean(y_px)) - length
    direction = np.unwrap(np.arctan2(x_px - cx, y_px - cy))
    # θ(t) = θ0 + rate0 t − ω² ∫∫ sin(θ − v): linear in (θ0, rate0, ω² cos v, ω² sin v)
    s2 = _twice_integrated(t, np.sin(direction))
    c2 = _twice_integrated(t, np.cos(direction))
    design = np.column_stack([np.ones(t.size), t, -s2, c2])
    d0, rate0, wc, ws = np.linalg.lstsq(design, direction, rcond=None)[0]
    w2, vertical = float(np.hypot(wc, ws)), float(np.arctan2(ws, wc))
    if wc <= 0 or abs(vertical) > 0.5:  # an arc too flat, or a hand too unsteady, to tell: about the middle
        vertical = float(np.mean(direction))
        once = _twice_integrated(t, np.sin(direction - vertical))
        d0, rate0, w2 = np.linalg.lstsq(np.column_stack([np.ones(t.size), t, -once]), direction, rcond=None)[0]
        if w2 <= 0:
            return None
    return np.array([cx, cy, length, vertical, w2, 0.0, 0.0, d0 - vertical, rate0])


def _twice_integrated(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    step = np.diff(t)
    once = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * step)])
    return np.concatenate([[0.0], np.cumsum(0.5 * (once[1:] + once[:-1]) * step)])

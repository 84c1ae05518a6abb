"""A fit, posed: which numbers are free, what is known of the others, what the camera should see, residuals and Jacobian."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import PendulabError, UsageError
from toolkit.fitting.guess import point_noise
from toolkit.fitting.parameters import reduce
from toolkit.models import load_model
from toolkit.models.model import Model, Motion
from toolkit.registry import did_you_mean

if TYPE_CHECKING:
    from toolkit.fit import FitResult
    from toolkit.scene import Scene
    from toolkit.series import ThetaSeries

_LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
_NUISANCES = ("angle_scale", "time_scale", "row_time")
_IN_SERIES = {"angle_scale": "angle_scale_relative_u", "row_time": "row_time_u_s"}
"""Where a series' meta gives their priors."""
IMPOSSIBLE = 1e10
"""The residual of values that no motion belongs to."""


@dataclass(frozen=True)
class Problem:
    """One model on one series.

    values : name -> value held or to start from.    free : names fitted, in order.    priors : name -> (mean, u) of
    nuisance and other parameters measured beforehand; each adds one residual.    sigma : (n,) weights' σ.
    prior_weight : how much the points overstate what they know (correlated residuals): the priors count that much more.
    prior_scale : the points' true σ over `sigma`, where that is not known beforehand.
    """

    series: ThetaSeries
    scene: Scene
    model: Model
    free: tuple[str, ...]
    values: Mapping[str, float]
    priors: Mapping[str, tuple[float, float]]
    sigma: np.ndarray
    sigma_known: bool
    loss: str = "linear"
    time_sigma_s: float = 0.0
    shift_s: float = 0.0
    prior_weight: float = 1.0
    prior_scale: float = 1.0
    _last: dict[Any, Any] = field(init=False, default_factory=dict, repr=False, compare=False)
    _thinned: dict[int, Problem] = field(init=False, default_factory=dict, repr=False, compare=False)

    @cached_property
    def t_s(self) -> np.ndarray:
        """Times of the points with the start at t = 0 (the series' own, unless it starts late or before zero)."""
        return self.series.t_s - self.shift_s

    @cached_property
    def point_noise_rad(self) -> float:
        """Scatter of a point about its neighbours, never zero."""
        return max(point_noise(self.series.theta_rad), 1e-12)

    @property
    def common_share(self) -> float:
        """What share of σ is of errors that return with the angle."""
        return float(self.series.meta.get("sigma_common_share") or 0.0)

    @cached_property
    def row_lag(self) -> np.ndarray:
        """By how much later each point was seen, for one unit of `row_time`: cos(θ − ψ) less that of the first, whose time stays.

        `row_time` is the time, beyond what the series' times allow for, in which a camera reads as many rows as the string is
        long, and ψ the direction in which it reads them, as an angle of the string. The measured angle tells the row well enough:
        its noise moves a time by row_time·σ only.
        """
        turned = self.series.theta_rad - float(self.series.meta.get("row_direction_rad") or 0.0)
        return np.asarray(np.cos(turned) - math.cos(turned[0]))

    def reduce(self, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
        """Reduced coefficients, and name -> {coefficient: derivative} for each reported name."""
        return reduce(values, self.scene, self.shift_s)

    def motion(
        self,
        values: Mapping[str, float],
        t_s: np.ndarray | None = None,
        names: Sequence[str] = (),
        rates: bool = True,
    ) -> Motion:
        """The model at t_s (default: the points, each when its row was read) with derivatives of θ and (`rates`) θ̇ by the reported
        `names`."""
        times = self.t_s if t_s is None else t_s
        reduced, by = self.reduce(values)
        self._refuse_runaway(reduced, float(times[-1]))
        needed = list(dict.fromkeys(c for name in names for c in by.get(name, {})))
        stretched = times * (1 + values.get("time_scale", 0.0))
        by_rows = t_s is None and "row_time" in values
        if by_rows:
            stretched = stretched + values["row_time"] * self.row_lag
        base = self.model.motion(reduced, stretched, needed, rates)
        d_theta = np.zeros((len(names), times.size)).T  # column by column in memory
        d_omega = np.zeros((len(names), times.size if rates else 0)).T
        for i, name in enumerate(names):
            for coefficient, factor in by.get(name, {}).items():
                column = needed.index(coefficient)
                d_theta[:, i] += factor * base.d_theta[:, column]
                if rates:
                    d_omega[:, i] += factor * base.d_omega[:, column]
            if name == "time_scale":
                d_theta[:, i] = base.omega * times
            elif name == "row_time" and by_rows:
                d_theta[:, i] = base.omega * self.row_lag
        return Motion(base.theta, base.omega, d_theta, d_omega, base.method)

    def _refuse_runaway(self, reduced: Mapping[str, float], stop_s: float) -> None:
        """What costs an integrator dearly and is never the answer: negative drag that multiplies the swing, swings faster
        than the points can show, drag that stops everything between two points."""
        omega, peak = reduced["omega_g"], abs(reduced["theta0"])
        fastest = math.pi * max(len(self.series) - 1, 1) / max(stop_s - float(self.t_s[0]), 1e-12)
        if not (0 < omega < 4 * fastest and math.isfinite(peak)):
            raise ArithmeticError("no such pendulum")
        stiff = reduced.get("alpha_d", 0.0) + reduced.get("beta", 0.0) * omega * min(peak, 3.0)
        if not (stiff < 4 * fastest and stiff * stop_s < 2e4 and reduced.get("mu", 0.0) < 100 * omega**2):
            raise ArithmeticError("no such drag")
        rate = (
            min(reduced.get("alpha_d", 0.0), 0.0)
            + 4 / (3 * math.pi) * min(reduced.get("beta", 0.0), 0.0) * omega * peak
        )
        rate += 2 * min(reduced.get("mu", 0.0), 0.0) / (math.pi * omega * max(peak, 1e-3))
        steeper = 4 / (3 * math.pi) * min(reduced.get("beta", 0.0), 0.0) * omega * peak
        if rate * stop_s < -3 or steeper * stop_s < -0.7:  # at −1 such a swing grows beyond bounds
            raise ArithmeticError("negative drag makes the motion run away")

    def predict(self, values: Mapping[str, float], names: Sequence[str]) -> tuple[np.ndarray, np.ndarray, Motion]:
        """What the camera should see, (n,), its derivatives (n, k) by `names`, and the motion itself.

        The last two answers are kept: a minimiser asks for the residuals and the Jacobian of one point in turn.
        """
        point = (frozenset(values.items()), tuple(names))
        if point not in self._last:
            while len(self._last) > 1:
                del self._last[next(iter(self._last))]
            self._last[point] = self._predicted(values, names)
        answer: tuple[np.ndarray, np.ndarray, Motion] = self._last[point]
        return answer

    def _predicted(self, values: Mapping[str, float], names: Sequence[str]) -> tuple[np.ndarray, np.ndarray, Motion]:
        motion = self.motion(values, None, names, rates=False)
        scale = 1 + values.get("angle_scale", 0.0)
        seen = scale * motion.theta + values.get("theta_offset", 0.0)
        by = scale * motion.d_theta
        for i, name in enumerate(names):
            if name == "theta_offset":
                by[:, i] = 1.0
            elif name == "angle_scale":
                by[:, i] = motion.theta
        return seen, by, motion

    def residuals(self, values: Mapping[str, float], free: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """(n + priors,) residuals over σ and their derivatives (n + priors, k); IMPOSSIBLE where the model has no value."""
        measured, rows = self.series.theta_rad, len(self.priors)
        try:
            seen, by, _ = self.predict(values, free)
            whole = math.isfinite(float(seen.sum()) + float(by.sum()))
        except (PendulabError, ValueError, ArithmeticError, RuntimeError):
            whole = False
        if not whole:
            return np.full(measured.size + rows, IMPOSSIBLE), np.zeros((measured.size + rows, len(free)))
        residual = np.empty(measured.size + rows)
        jacobian = np.zeros((len(free), measured.size + rows)).T
        residual[: measured.size] = (measured - seen) / self.sigma
        np.divide(by, -self.sigma[:, None], out=jacobian[: measured.size])
        for i, (name, (mean, u)) in enumerate(self.priors.items(), start=measured.size):
            weight_here = self.prior_weight * self.prior_scale / u
            residual[i] = (values[name] - mean) * weight_here
            if name in free:
                jacobian[i, list(free).index(name)] = weight_here
        return residual, jacobian

    def every(self, step: int) -> Problem:
        """The same problem on every `step`-th point; made once."""
        if step not in self._thinned:
            self._thinned[step] = self.part(slice(None, None, step))
        return self._thinned[step]

    def part(self, points: slice) -> Problem:
        """The same problem on some of the points."""
        series = self.series
        some = replace(series, t_s=series.t_s[points], theta_rad=series.theta_rad[points], sigma_theta_rad=None)
        return replace(self, series=some, sigma=self.sigma[points])

    def prior_precision(self) -> np.ndarray:
        """(k,) what the priors add to the diagonal of the normal matrix of the points in units of their σ."""
        weight2 = self.prior_weight**2
        return np.array([weight2 / self.priors[name][1] ** 2 if name in self.priors else 0.0 for name in self.free])

    def with_input(self, name: str, change: float) -> Problem:
        """The same problem with an input moved: mass, length, g, bob_radius (SI), vertical (rad), angle_scale and
        time_scale (relative)."""
        scene, series, values = self.scene, self.series, dict(self.values)
        pendulum = scene.pendulum
        if name == "mass" and pendulum.mass_kg is not None:
            scene = scene.with_(pendulum=replace(pendulum, mass_kg=pendulum.mass_kg + change))
        elif name == "length" and pendulum.length_m is not None:
            scene = scene.with_(pendulum=replace(pendulum, length_m=pendulum.length_m + change))
            values["length"] = pendulum.length_m + change
        elif name == "bob_radius" and pendulum.bob_radius_m is not None:
            scene = scene.with_(pendulum=replace(pendulum, bob_radius_m=pendulum.bob_radius_m + change))
        elif name == "g":
            g = scene.environment.gravity_m_per_s2 + change
            scene = scene.with_(environment=replace(scene.environment, g_m_per_s2=g, latitude_deg=None))
        elif name == "angle_scale":
            series = replace(series, theta_rad=series.theta_rad * (1 + change))
        elif name == "time_scale":
            series = replace(series, t_s=series.t_s * (1 + change))
        elif name == "vertical":
            series = replace(series, theta_rad=series.theta_rad + change)
        else:
            raise UsageError(f"no input {name!r} here")
        model = load_model(self.model.name).within(scene, self.shift_s)
        return replace(self, scene=scene, series=series, values=values, model=model)

    def normal_inverse(self, result: FitResult) -> np.ndarray:
        """(k, k) inverse of the normal matrix JᵀJ/σ² + priors at a fit: how the parameters follow the data."""
        values = {name: p.value for name, p in result.parameters.items()}
        _, by, _ = self.predict(values, self.free)
        sigma = self.sigma if self.sigma_known else self.sigma * float(result.noise["sigma_rad"])
        jacobian = by / sigma[:, None]
        prior = self.prior_precision()
        scale = 1 / np.sqrt(np.sum(jacobian**2, axis=0) + prior)
        scaled = jacobian * scale
        inverse = np.linalg.pinv(scaled.T @ scaled + np.diag(prior * scale**2), rcond=1e-15, hermitian=True)
        return np.asarray(inverse * np.outer(scale, scale))

    def solve(self, start: Mapping[str, float], thorough: bool = True) -> FitResult:
        """The best fit from `start` (or the guess), judged; see `toolkit.fit.fit`."""
        from toolkit.fitting.solve import solve

        return solve(self, start, thorough)

    def cost_at(self, values: Mapping[str, float], free: tuple[str, ...]) -> float:
        """Weighted sum of squares (priors included) at `values`, or the least over `free` from there; inf where none."""
        if free:
            from toolkit.fitting.descent import search

            found = search(self, values, free)
            return math.inf if found is None else found.cost
        residual, _ = self.residuals(values, ())
        cost = float(residual @ residual)
        return cost if cost < IMPOSSIBLE else math.inf

    def values_at_best(self, start: Mapping[str, float]) -> dict[str, float] | None:
        """Parameter values of the best fit from `start`, drags ≥ 0, without error bars; None where it fails."""
        from toolkit.fitting.descent import search_bounded

        found = search_bounded(self, {**self.values, **start})
        return None if found is None else found.values


def pose(
    series: ThetaSeries,
    scene: Scene,
    model: str,
    free: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, float] | None = None,
    loss: str = "linear",
    time_sigma_s: float = 0.0,
) -> Problem:
    """What `fit` solves. See there for the arguments and errors."""
    if loss not in _LOSSES:
        raise UsageError(f"unknown loss {loss!r}{did_you_mean(loss, _LOSSES)}")
    first = float(series.t_s[0])
    shift = first if first < 0 or first > series.duration_s else 0.0
    within = load_model(model).within(scene, shift)
    mass, length = scene.pendulum.mass_kg, scene.pendulum.length_m
    both = mass is not None and length is not None
    reported = {
        "alpha_d": "k_d" if mass is not None else "alpha_d",
        "beta": "c" if both else "beta",
        "mu": "torque" if both else "mu",
    }
    names = [reported[name] for name in within.drags] + ["theta0", "phi"]
    values: dict[str, float] = dict.fromkeys(names, 0.0)
    fixed = dict(fixed or {})
    if length is None:
        names.append("omega_g")
        values["omega_g"] = 0.0
    else:
        values["length"] = length
    names.append("theta_offset")
    values["theta_offset"] = 0.0
    if "cosine_drive" in within.effects:
        if not both:
            raise UsageError("a driven scene needs the pendulum's mass and length: give --mass-kg and --length-m")
        from toolkit.effects import check_parameters

        drive = check_parameters("cosine_drive", scene.effects["cosine_drive"])
        values |= {"f0": drive["f0_n"], "f": drive["f_hz"], "drive_phase": drive.get("phase_rad", 0.0)}
    told = dict(priors or {})
    for name, key in _IN_SERIES.items():
        if name not in told and series.meta.get(key):
            told[name] = float(series.meta[key])
    known: dict[str, tuple[float, float]] = {}
    for name, u in told.items():
        if not u > 0:
            raise UsageError(f"the prior of {name} must be a positive standard uncertainty, got {u}")
        if name in _NUISANCES:
            values[name] = 0.0
        elif name not in values:
            raise UsageError(f"no parameter {name!r} in {model}{did_you_mean(name, list(values))}")
        known[name] = (values[name], u)
        if name not in names:
            names.append(name)
    for name in free:
        if name not in values:
            if name == "length" and length is None:
                raise UsageError("there is no length to free; without one omega_g is fitted: leave `length` out")
            raise UsageError(f"no parameter {name!r} in {model}{did_you_mean(name, list(values))}")
        if name not in names:
            names.append(name)
    for name, value in fixed.items():
        if name not in values:
            raise UsageError(f"no parameter {name!r} in {model}{did_you_mean(name, list(values))}")
        values[name] = float(value)
        names = [n for n in names if n != name]
        known.pop(name, None)
    sigma = series.sigma_theta_rad
    return Problem(
        series=series,
        scene=scene,
        model=within,
        free=tuple(names),
        values=values,
        priors=known,
        sigma=np.ones(len(series)) if sigma is None else np.asarray(sigma),
        sigma_known=sigma is not None,
        loss=loss,
        time_sigma_s=time_sigma_s,
        shift_s=shift,
    )

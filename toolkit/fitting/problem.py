"""A fit, posed: which numbers are free, what is known of the others, residuals and Jacobian; and its solution."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import PendulabError, UsageError
from toolkit.fit import FitResult, FittedParameter
from toolkit.fitting.guess import Guess, guess, guess_from_integrals, point_noise
from toolkit.fitting.noise import measure_noise, spread
from toolkit.models import load_model
from toolkit.models.model import Model, Motion
from toolkit.registry import did_you_mean
from toolkit.sentence import Sentence

if TYPE_CHECKING:
    from toolkit.scene import Scene
    from toolkit.series import ThetaSeries

UNITS = {
    "k_d": "kg/s",
    "alpha_d": "1/s",
    "c": "kg/m",
    "beta": "1",
    "torque": "N m",
    "mu": "1/s^2",
    "theta0": "rad",
    "phi": "rad",
    "omega_g": "rad/s",
    "length": "m",
    "theta_offset": "rad",
    "f0": "N",
    "f": "Hz",
    "drive_phase": "rad",
    "angle_scale": "1",
    "time_scale": "1",
}
_DRAG_NAMES = ("k_d", "alpha_d", "c", "beta", "torque", "mu")
_NOT_GUESSED = ("theta_offset", "angle_scale", "time_scale", "f0", "f", "drive_phase")
_LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
_BAD = 1e10
_SEEN = 40.0


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

    @property
    def t_s(self) -> np.ndarray:
        """Times of the points with the start at t = 0 (the series' own, unless it starts late or before zero)."""
        return self.series.t_s - self.shift_s

    # -- from the names of the report to those of the reduced equation ------------------------------------------

    def reduce(self, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
        """Reduced coefficients, and name -> {coefficient: derivative} for each reported name."""
        mass, gravity = self.scene.pendulum.mass_kg, self.scene.environment.gravity_m_per_s2
        reduced = {"theta0": values["theta0"], "phi": values["phi"]}
        by: dict[str, dict[str, float]] = {"theta0": {"theta0": 1.0}, "phi": {"phi": 1.0}}
        length = values.get("length")
        if length is None:
            reduced["omega_g"] = values["omega_g"]
            by["omega_g"] = {"omega_g": 1.0}
        else:
            reduced["omega_g"] = math.sqrt(gravity / length) if length > 0 else math.nan
            by["length"] = {"omega_g": -reduced["omega_g"] / (2 * length)}
        m, el = mass or math.nan, length or math.nan
        table = {  # reported name: coefficient, factor, power of the length in the factor
            "alpha_d": ("alpha_d", 1.0, 0),
            "k_d": ("alpha_d", 1 / (2 * m), 0),
            "beta": ("beta", 1.0, 0),
            "c": ("beta", el / m, 1),
            "mu": ("mu", 1.0, 0),
            "torque": ("mu", 1 / (m * el**2), -2),
            "f0": ("drive", 1 / (m * el), -1),
            "f": ("f", 1.0, 0),
            "drive_phase": ("drive_phase", 1.0, 0),
        }
        for name, (coefficient, factor, power) in table.items():
            if name in values:
                reduced[coefficient] = factor * values[name]
                by[name] = {coefficient: factor}
                if power and "length" in by:
                    by["length"][coefficient] = by["length"].get(coefficient, 0.0) + power * reduced[coefficient] / el
        if "drive_phase" in reduced:
            reduced["drive_phase"] += 2 * math.pi * reduced["f"] * self.shift_s
        return reduced, by

    def motion(
        self,
        values: Mapping[str, float],
        t_s: np.ndarray | None = None,
        names: Sequence[str] = (),
        rates: bool = True,
    ) -> Motion:
        """The model at t_s (default: the points) with derivatives of θ and (`rates`) θ̇ by the reported `names`."""
        times = self.t_s if t_s is None else t_s
        reduced, by = self.reduce(values)
        self._refuse_runaway(reduced, float(times[-1]))
        needed = list(dict.fromkeys(c for name in names for c in by.get(name, {})))
        stretched = times * (1 + values.get("time_scale", 0.0))
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

    # -- solving ------------------------------------------------------------------------------------------------

    def solve(self, start: Mapping[str, float], thorough: bool = True) -> FitResult:
        """The best fit from `start` (or the guess), with several starts only where the first fails.

        thorough : False takes the first that converges; for a model beside another that already follows the record.
        """
        n, k = len(self.series), len(self.free) - len(self.priors)
        if n <= k:
            few = f"{n} points cannot fix {k} parameters; record for longer or at a higher frame rate"
            return self._failed(Sentence(few, "fit.too_few_points", points=n, parameters=k), None)
        attempts = []
        for begin in self._starts(start):
            found = self._descend_bounded(begin)
            if found is None:
                continue
            attempts.append(found)
            if self._good(found) or (found.success and not thorough):
                break
        if not attempts:
            none = "the equation could not be solved from any start; check the times and angles"
            return self._failed(Sentence(none, "fit.unsolvable"), None)
        best = min(attempts, key=lambda a: a.cost)
        return self._weighed(best, self._report(best))

    def _weighed(self, found: Solved, result: FitResult) -> FitResult:
        """The fit once more where points and priors were not weighed as the residuals say: points with correlated noise, or
        of unknown σ, would else pull a parameter off its prior, or be held by it, with a weight that is not theirs."""
        weight = float(result.noise["inflation"])
        scale = 1.0 if self.sigma_known else float(result.noise["sigma_rad"])
        if not self.priors or not result.success or not (weight * scale > 0) or 0.8 < weight * scale < 1.25:
            return result
        values = dict(found.values)
        if "angle_scale" in values:
            values["theta0"] *= 1 + values["angle_scale"]
        values |= {name: mean for name, (mean, _) in self.priors.items()}
        again = replace(self, prior_weight=weight, prior_scale=scale)
        better = again._descend_bounded(values)
        return result if better is None or not better.success else again._report(better)

    def _prior_precision(self) -> np.ndarray:
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
        model = load_model(self.model.name).within(scene)
        return replace(self, scene=scene, series=series, values=values, model=model)

    def normal_inverse(self, result: FitResult) -> np.ndarray:
        """(k, k) inverse of the normal matrix JᵀJ/σ² + priors at a fit: how the parameters follow the data."""
        values = {name: p.value for name, p in result.parameters.items()}
        _, by, _ = self.predict(values, self.free)
        sigma = self.sigma if self.sigma_known else self.sigma * float(result.noise["sigma_rad"])
        jacobian = by / sigma[:, None]
        prior = self._prior_precision()
        scale = 1 / np.sqrt(np.sum(jacobian**2, axis=0) + prior)
        scaled = jacobian * scale
        inverse = np.linalg.pinv(scaled.T @ scaled + np.diag(prior * scale**2), rcond=1e-15, hermitian=True)
        return np.asarray(inverse * np.outer(scale, scale))

    def cost_at(self, values: Mapping[str, float], free: tuple[str, ...]) -> float:
        """Weighted sum of squares (priors included) at `values`, or the least over `free` from there; inf where none."""
        if free:
            found = self._descend(values, free)
            return math.inf if found is None else found.cost
        residual, _ = self._residuals(values, (), self.series.theta_rad, 1 / self.sigma)
        cost = float(residual @ residual)
        return cost if cost < _BAD else math.inf

    def values_at_best(self, start: Mapping[str, float]) -> dict[str, float] | None:
        """Parameter values of the best fit from `start`, drags ≥ 0, without error bars; None where it fails."""
        found = self._descend_bounded({**self.values, **start})
        return None if found is None else found.values

    def _starts(self, start: Mapping[str, float]) -> Iterator[dict[str, float]]:
        """First the guess (with what is given in its place), then others, each cheaper to compute than a fit."""
        given = {name: value for name, value in start.items() if name in self.free}
        guessed = [name for name in self.free if name not in _NOT_GUESSED]
        whole = all(name in given for name in guessed)
        near = whole and self._follows({**self.values, **given})
        if near:
            yield {**self.values, **given}
        begin = {**self.values, **self._from_guess(self._guess())}
        if given and not whole and self._follows({**begin, **given}):
            yield {**begin, **given}
        yield begin
        yield from self._grown()

    def _follows(self, values: Mapping[str, float]) -> bool:
        """Whether a start already explains half of the record's spread; one that does not is worth less than the guess."""
        free = tuple(name for name in self.free if name not in self._held(values))  # the minimiser asks for these next
        residual, _ = self._residuals(values, free, self.series.theta_rad, np.ones(len(self.series)))
        measured = residual[: len(self.series)]
        return bool(np.mean(measured**2) < 0.5 * np.var(self.series.theta_rad))

    def _guess(self) -> Guess:
        drive = self._drive()
        if drive is not None and drive[0] != 0:
            omega = self._known_omega()
            span = None if omega is None else 3 * 2 * math.pi / omega
            return guess_from_integrals(
                self.t_s, self.series.theta_rad, small_angle=self.model.small_angle, drive=drive, span_s=span
            )
        return guess(self.t_s, self.series.theta_rad, self.model.drags, self.model.small_angle)

    def _drive(self) -> tuple[float, float, float] | None:
        if "cosine_drive" not in self.model.effects:
            return None
        reduced, _ = self.reduce({**self.values, "theta0": 0.1, "phi": 0.0, "omega_g": self.values.get("omega_g", 1.0)})
        return reduced["drive"], reduced["f"], reduced["drive_phase"]

    def _known_omega(self) -> float | None:
        length = self.values.get("length")
        return None if length is None else math.sqrt(self.scene.environment.gravity_m_per_s2 / length)

    def _from_guess(self, first: Guess) -> dict[str, float]:
        """The guess under the reported names, for those that are free."""
        omega = first.omega_g
        theta0, phi = first.theta0, first.phi
        if self.model.closed_form:  # the paper's phase: θ̇(0) = θ₀(|ω_u| cos φ − α sin φ)
            at_zero, slope = theta0 * math.sin(phi), theta0 * omega * math.cos(phi)
            rate = math.sqrt(abs(omega**2 - first.alpha_d**2)) or omega
            slope = (slope + first.alpha_d * at_zero) / rate
            if first.alpha_d > 0.3 * omega:
                theta0, phi = math.hypot(at_zero, slope), math.atan2(at_zero, slope)
        length = self.values.get("length")
        if length is not None:
            length = self.scene.environment.gravity_m_per_s2 / omega**2 if "length" in self.free else length
        m, el = self.scene.pendulum.mass_kg or math.nan, length or math.nan
        table = {
            "theta0": theta0,
            "phi": phi,
            "omega_g": omega,
            "length": el,
            "theta_offset": first.theta_offset,
            "alpha_d": first.alpha_d,
            "k_d": 2 * m * first.alpha_d,
            "beta": first.beta,
            "c": first.beta * m / el,
            "mu": first.mu,
            "torque": first.mu * m * el**2,
        }
        return {name: value for name, value in table.items() if name in self.free}

    def _grown(self) -> Iterator[dict[str, float]]:
        """Fit the first periods, then twice as many, and so on: the phase is never lost on the way."""
        t, theta = self.t_s, self.series.theta_rad
        rough = guess(t, theta, self.model.drags, self.model.small_angle)
        omega = self._known_omega() or rough.omega_g
        span = 3 * 2 * math.pi / omega
        drive = self._drive()
        begin = {
            **self.values,
            **self._from_guess(
                guess_from_integrals(t, theta, small_angle=self.model.small_angle, drive=drive, span_s=span)
            ),
        }
        while span < t[-1] - t[0]:
            stop = int(np.searchsorted(t, t[0] + span))
            span *= 2
            if stop < 3 * len(self.free):
                continue
            part = replace(
                self,
                series=replace(
                    self.series,
                    t_s=self.series.t_s[:stop],
                    theta_rad=theta[:stop],
                    sigma_theta_rad=None,
                ),
                sigma=self.sigma[:stop],
            )
            found = part._descend_bounded(begin)
            if found is not None:
                begin = found.values
        yield begin

    def _good(self, found: Solved) -> bool:
        if not found.success:
            return False
        residual = self.series.theta_rad - found.seen
        noise = max(point_noise(self.series.theta_rad), 1e-12)
        rms = float(np.sqrt(np.mean(residual**2)))
        spread = float(np.var(self.series.theta_rad))
        if residual.size * (spread - rms**2) < _SEEN * rms**2:  # no more than a sine takes from noise
            return False
        return rms < 5 * noise or rms < 0.3 * float(np.std(self.series.theta_rad))

    def _descend(self, begin: Mapping[str, float], free: tuple[str, ...]) -> Solved | None:
        """lmfit's Levenberg–Marquardt from `begin`. None where the equation cannot be solved there."""
        import lmfit

        cache: dict[tuple[float, ...], tuple[np.ndarray, np.ndarray]] = {}
        held = {name: value for name, value in begin.items() if name not in free}
        weight = 1 / self.sigma
        measured = self.series.theta_rad

        def evaluate(parameters: Any) -> tuple[np.ndarray, np.ndarray]:
            valued = parameters.valuesdict()
            point = tuple(valued[name] for name in free)
            if point not in cache:
                while len(cache) > 2:
                    del cache[next(iter(cache))]
                cache[point] = self._residuals({**held, **dict(zip(free, point))}, free, measured, weight)
            return cache[point]

        parameters = lmfit.Parameters()
        for name in free:
            if not math.isfinite(begin[name]):
                return None
            parameters.add(name, value=begin[name])
        minimizer = lmfit.Minimizer(
            lambda p: evaluate(p)[0], parameters, scale_covar=False, max_nfev=100, nan_policy="propagate"
        )
        with np.errstate(all="ignore"):
            try:
                if self.loss == "linear":
                    outcome = minimizer.minimize(
                        method="leastsq",
                        Dfun=lambda p: evaluate(p)[1].T,
                        col_deriv=1,
                        ftol=1e-7,
                        xtol=1e-9,
                        factor=1.0,
                    )
                else:
                    sizes = np.linalg.norm(evaluate(parameters)[1], axis=0)
                    outcome = minimizer.minimize(
                        method="least_squares",
                        jac=lambda p: evaluate(p)[1],
                        loss=self.loss,
                        f_scale=self._loss_scale(),
                        x_scale=1 / np.where(sizes > 0, sizes, 1.0),
                    )
            except (ValueError, TypeError, FloatingPointError, np.linalg.LinAlgError, ArithmeticError):
                return None
            values = {**held, **dict(zip(free, (float(outcome.params[name].value) for name in free)))}
            residual, _ = self._residuals(values, free, measured, weight)
        if not np.all(np.isfinite(residual)) or residual[0] >= _BAD:
            return None
        seen = measured - residual[: measured.size] * self.sigma
        return Solved(values, seen, float(residual @ residual), bool(outcome.success), outcome)

    def _loss_scale(self) -> float:
        if self.sigma_known:
            return 1.345
        return 1.345 * max(point_noise(self.series.theta_rad), 1e-12) / float(np.median(self.sigma))

    def _residuals(
        self, values: Mapping[str, float], free: tuple[str, ...], measured: np.ndarray, weight: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(n + priors,) residuals over σ and their derivatives (n + priors, k); huge where the model has no value."""
        rows = len(self.priors)
        try:
            seen, by, _ = self.predict(values, free)
            whole = math.isfinite(float(seen.sum()) + float(by.sum()))
        except (PendulabError, ValueError, ArithmeticError, RuntimeError):
            whole = False
        if not whole:
            return np.full(measured.size + rows, _BAD), np.zeros((measured.size + rows, len(free)))
        residual = np.empty(measured.size + rows)
        jacobian = np.zeros((len(free), measured.size + rows)).T
        residual[: measured.size] = (measured - seen) * weight
        np.multiply(by, -weight[:, None], out=jacobian[: measured.size])
        for i, (name, (mean, u)) in enumerate(self.priors.items(), start=measured.size):
            weight_here = self.prior_weight * self.prior_scale / u
            residual[i] = (values[name] - mean) * weight_here
            if name in free:
                jacobian[i, free.index(name)] = weight_here
        return residual, jacobian

    def _held(self, values: Mapping[str, float]) -> tuple[str, ...]:
        """The drags that start at zero wait there until the fit asks for them, all but the first of a drag-free start."""
        drags = [name for name in self.free if name in _DRAG_NAMES]
        zero = [name for name in drags if not values[name] > 0]
        return tuple(zero[1:] if len(zero) == len(drags) else zero)

    def _descend_bounded(self, begin: Mapping[str, float]) -> Solved | None:
        """The least cost with every drag ≥ 0, by Lawson and Hanson's active set: drags that come out negative are held at
        zero, and of those held the one is freed that promises most, until none promises anything."""
        zero = self._held(begin)
        values = {n: max(v, 0.0) if n in _DRAG_NAMES and n in self.free else v for n, v in begin.items()}
        best: Solved | None = None
        for _ in range(12):
            found = self._descend(values, tuple(name for name in self.free if name not in zero))
            if found is None:
                return best
            negative = tuple(n for n in self.free if n in _DRAG_NAMES and n not in zero and found.values[n] < 0)
            zero += negative
            if negative:
                values = self._moved_to_zero(found.values, negative, zero)
                continue
            values = found.values
            if best is not None and found.cost >= best.cost:
                return best
            best = replace(found, at_zero=zero)
            wanted = self._wanted(found, zero)
            if wanted is None:
                return best
            zero = tuple(name for name in zero if name != wanted)
        return best

    def _moved_to_zero(
        self, values: Mapping[str, float], drags: tuple[str, ...], zero: tuple[str, ...]
    ) -> dict[str, float]:
        """`drags` at zero and the free parameters moved along, to first order, so that the motion stays as near as can be."""
        nothing = dict.fromkeys(drags, 0.0)
        residual, jacobian = self._residuals(values, self.free, self.series.theta_rad, 1 / self.sigma)
        rest = [i for i, name in enumerate(self.free) if name not in zero]
        if not residual[0] < _BAD:
            return {**values, **nothing}
        own = jacobian[:, rest]
        size = np.linalg.norm(own, axis=0)
        size = np.where(size > 0, size, 1.0)
        taken = sum(jacobian[:, self.free.index(name)] * values[name] for name in drags)
        change = np.linalg.lstsq(own / size, taken, rcond=1e-10)[0] / size
        return {**values, **nothing, **{self.free[i]: values[self.free[i]] + float(d) for i, d in zip(rest, change)}}

    def _wanted(self, found: Solved, zero: tuple[str, ...]) -> str | None:
        """Which of the drags held at zero would lower the cost most if it grew, to first order; None where none would."""
        if not zero:
            return None
        residual, jacobian = self._residuals(found.values, self.free, self.series.theta_rad, 1 / self.sigma)
        if not residual[0] < _BAD:
            return None
        own = jacobian[:, [i for i, name in enumerate(self.free) if name not in zero]]
        size = np.linalg.norm(own, axis=0)
        basis, _ = np.linalg.qr(own / np.where(size > 0, size, 1.0))
        gains = {}
        for name in zero:
            column = jacobian[:, self.free.index(name)]
            column = column - basis @ (basis.T @ column)
            slope, length2 = float(column @ residual), float(column @ column)
            gains[name] = slope**2 / length2 if slope < 0 and length2 > 0 else 0.0
        wanted = max(gains, key=lambda name: gains[name])
        return wanted if gains[wanted] > 1e-3 * found.cost / residual.size else None

    def _report(self, found: Solved) -> FitResult:
        from toolkit.fitting.derived import derive

        values = _tidied(found.values, self.model.small_angle)
        seen, by, motion = self.predict(values, self.free)
        residual = self.series.theta_rad - seen
        n, k = residual.size, len(self.free) - len(self.priors)
        sigma = self.sigma
        if self.time_sigma_s > 0:
            sigma = np.hypot(sigma, self.time_sigma_s * motion.omega)
        rss = float(np.sum((residual / sigma) ** 2))
        dof = n - k
        if not self.sigma_known:
            sigma = sigma * math.sqrt(rss / max(dof, 1)) if rss > 0 else sigma
        normalised = residual / sigma
        reduced, _ = self.reduce(values)
        step = float(np.median(np.diff(self.t_s)))
        noise = measure_noise(normalised, sigma, self.sigma_known, reduced["omega_g"], step, k)
        jacobian = by / sigma[:, None]
        covariance, singular = self._covariance(jacobian, noise)
        warnings = []
        parameters = {}
        for name, value in values.items():
            i = self.free.index(name) if name in self.free else None
            u = None if i is None or not math.isfinite(covariance[i, i]) else math.sqrt(max(covariance[i, i], 0.0))
            parameters[name] = FittedParameter(
                value, u, UNITS[name], i is None, minimum=0.0 if name in _DRAG_NAMES else None
            )
        for name in found.at_zero:
            bound = f"{name} came out negative and is held at its bound 0: the record does not show this drag"
            warnings.append(Sentence(bound, "fit.at_zero", name=name))
        for name, (mean, prior_u) in self.priors.items():
            if name in self.free and abs(values[name] - mean) > 2.5 * prior_u:
                off = abs(values[name] - mean) / prior_u
                left = (
                    f"{name} left what was measured beforehand by {off:.1f} of its standard uncertainties: the record "
                    "contradicts it, or the model is not the one for this record"
                )
                warnings.append(Sentence(left, "fit.prior_left", name=name, sigmas=off))
        chi2 = float(normalised @ normalised)
        inflation2 = noise.inflation**2
        success, message = found.success, Sentence("the fit converged", "fit.converged")
        if singular:
            success = False
            names = ", ".join(singular)
            message = Sentence(
                f"the record cannot fix {names}: the covariance is singular; fit a simpler model or record for longer",
                "fit.singular",
                names=names,
            )
        elif not found.success and self._nearly_critical(reduced):
            message = Sentence(
                "the damping is near critical, where the paper's decaying sine has no frequency left to tell amplitude and phase "
                "by; use a full-sine model, which starts from θ(0) and θ̇(0), or give the length so that ω_g is held",
                "fit.near_critical",
            )
        elif not found.success:
            reason = found.lmfit.message.strip()
            message = Sentence(
                f"the fit did not settle ({reason}); give a start value or a shorter stretch",
                "fit.unsettled",
                reason=reason,
            )
        elif not self._good(found) and not self.model.small_angle:
            success = False
            message = Sentence(
                "the model does not follow the record from any start tried; look for frames that jump, a second motion, "
                "or cut the record with --start and --stop",
                "fit.not_followed",
            )
        result = FitResult(
            model=self.model.name,
            parameters=_ordered(parameters),
            free=self.free,
            covariance=covariance,
            chi2=chi2,
            dof=dof,
            aic=chi2 / inflation2 + 2 * len(self.free),
            bic=chi2 / inflation2 + len(self.free) * math.log(max(noise.effective_points, 2.0)),
            residuals_rad=residual,
            theta_rad=seen,
            omega_rad_per_s=motion.omega,
            success=success,
            message=message,
            noise={**noise.as_dict(), "rss": float(residual @ residual), "loss": self.loss, "start_s": self.shift_s},
            equation_latex=self.model.latex,
            method=motion.method,
            warnings=tuple(warnings),
            lmfit=found.lmfit,
            problem=self,
        )
        return replace(result, derived=derive(result, self))

    def _nearly_critical(self, reduced: Mapping[str, float]) -> bool:
        """Whether the closed form is asked for a motion that hardly swings back, by the fit or by the first guess."""
        if not self.model.closed_form:
            return False
        first = self._guess()
        return reduced["alpha_d"] > 0.7 * reduced["omega_g"] or first.alpha_d > 0.7 * first.omega_g

    def _covariance(self, jacobian: np.ndarray, noise: Any) -> tuple[np.ndarray, list[str]]:
        """(k, k) covariance that allows for the noise and the priors, and the names that the record cannot fix."""
        size = np.linalg.norm(jacobian, axis=0)
        prior = self._prior_precision()
        scale = 1 / np.sqrt(size**2 + prior)
        blind = [name for name, s in zip(self.free, scale) if not math.isfinite(s)]
        if blind:
            return np.full((len(self.free), len(self.free)), np.nan), blind
        scaled = jacobian * scale
        normal = scaled.T @ scaled + np.diag(prior * scale**2)
        eigenvalue, vector = np.linalg.eigh(normal)
        singular = eigenvalue[0] < 1e-13 * eigenvalue[-1]
        eigenvalue = np.maximum(eigenvalue, 1e-15 * eigenvalue[-1])
        inverse = (vector / eigenvalue) @ vector.T
        middle = spread(scaled, noise) + np.diag(prior * (self.prior_weight * scale) ** 2)
        covariance = (inverse @ middle @ inverse) * np.outer(scale, scale)
        covariance = (covariance + covariance.T) / 2
        loose = [self.free[i] for i in np.flatnonzero(np.abs(vector[:, 0]) > 0.3)] if singular else []
        return covariance, loose

    def _failed(self, message: Sentence, found: Any) -> FitResult:
        n = len(self.series)
        nothing = np.full(n, np.nan)
        parameters = {
            name: FittedParameter(float(value), None, UNITS[name], name not in self.free)
            for name, value in self.values.items()
        }
        return FitResult(
            model=self.model.name,
            parameters=_ordered(parameters),
            free=self.free,
            covariance=np.full((len(self.free), len(self.free)), np.nan),
            chi2=math.nan,
            dof=n - len(self.free),
            aic=math.inf,
            bic=math.inf,
            residuals_rad=nothing,
            theta_rad=nothing,
            omega_rad_per_s=nothing,
            success=False,
            message=message,
            noise={"sigma_rad": math.nan, "source": "none", "rho1": 0.0, "inflation": 1.0, "rss": math.inf},
            lmfit=found,
            problem=self,
        )


@dataclass(frozen=True)
class Solved:
    """Where one descent ended."""

    values: dict[str, float]
    seen: np.ndarray
    cost: float
    success: bool
    lmfit: Any
    at_zero: tuple[str, ...] = ()


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
    within = load_model(model).within(scene)
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
    if priors is None or "angle_scale" not in told:
        relative = series.meta.get("angle_scale_relative_u")
        if relative:
            told["angle_scale"] = float(relative)
    known: dict[str, tuple[float, float]] = {}
    for name, u in told.items():
        if not u > 0:
            raise UsageError(f"the prior of {name} must be a positive standard uncertainty, got {u}")
        if name in ("angle_scale", "time_scale"):
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
    first = float(series.t_s[0])
    shift = first if first < 0 or first > series.duration_s else 0.0
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


def _tidied(values: Mapping[str, float], small_angle: bool) -> dict[str, float]:
    """θ₀ ≥ 0 (and ≤ π with the full sine) and −π < φ ≤ π: the same motion."""
    tidy = dict(values)
    if not small_angle and not abs(tidy["theta0"]) <= math.pi:  # only sin(θ₀/2) counts
        tidy["theta0"] = 2 * math.asin(math.sin(tidy["theta0"] / 2))
    if tidy["theta0"] < 0:
        tidy["theta0"], tidy["phi"] = -tidy["theta0"], tidy["phi"] + math.pi
    if abs(tidy["phi"]) > math.pi:
        tidy["phi"] = math.remainder(tidy["phi"], 2 * math.pi)
    return tidy


_ORDER = ("k_d", "alpha_d", "c", "beta", "torque", "mu", "theta0", "phi", "omega_g", "length", "theta_offset")


def _ordered(parameters: Mapping[str, FittedParameter]) -> dict[str, FittedParameter]:
    first = [name for name in _ORDER if name in parameters]
    return {name: parameters[name] for name in [*first, *(n for n in parameters if n not in first)]}

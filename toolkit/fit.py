"""Fits of pendulum models to θ(t): lmfit outside, our equation of motion and its sensitivities inside."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import PendulabError, UsageError
from toolkit.progress import Progress, silent
from toolkit.scene import Scene
from toolkit.sentence import said

if TYPE_CHECKING:
    from toolkit.series import ThetaSeries


@dataclass(frozen=True)
class FittedParameter:
    """A fitted (or held) number. `stderr` is None where it was held fixed or could not be estimated."""

    value: float
    stderr: float | None
    unit: str
    fixed: bool = False
    initial: float | None = None
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True)
class FitResult:
    """One model fitted to one series.

    parameters : name -> FittedParameter, SI.    covariance : (k, k) over `free`, the names of the free parameters
    in order.    chi2, dof, aic, bic : of the fit with the σ used (`noise` says which).    residuals_rad : (n,)
    measured minus model.    theta_rad, omega_rad_per_s : (n,) the model at the series' times.
    success False comes with a `message` that says what happened and the remedy; nothing is raised.
    message and warnings are `Sentence`s, whose `key` and `values` another language is written from:
    fit.converged · fit.too_few_points (points, parameters) · fit.unsolvable · fit.singular (names) · fit.near_critical ·
    fit.unsettled (reason) · fit.not_followed · fit.at_zero (name) · fit.prior_left (name, sigmas) ·
    fit.length_contradicted (given_m, fitted_m, fitted_u_m).
    noise : sigma_rad used, where it came from, residual autocorrelation (rho1), inflation of the error bars.
    derived : name -> FittedParameter of what follows from the parameters (T0_s, Q, length_m …).
    lmfit : lmfit's own MinimizerResult.    problem : what was solved (`toolkit.fitting.problem.Problem`), to solve it again.
    """

    model: str
    parameters: Mapping[str, FittedParameter]
    free: tuple[str, ...]
    covariance: np.ndarray
    chi2: float
    dof: int
    aic: float
    bic: float
    residuals_rad: np.ndarray
    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    success: bool
    message: str
    noise: Mapping[str, Any] = field(default_factory=dict)
    derived: Mapping[str, FittedParameter] = field(default_factory=dict)
    equation_latex: str = ""
    method: str = ""
    cpu_s: float = 0.0
    warnings: tuple[str, ...] = ()
    lmfit: Any = None
    problem: Any = field(default=None, repr=False, compare=False)

    @property
    def reduced_chi2(self) -> float:
        """χ² per degree of freedom."""
        return self.chi2 / self.dof if self.dof > 0 else float("nan")

    @property
    def prior_chi2(self) -> float:
        """What it costs that parameters left what was measured of them beforehand, Σ ((value − mean)/u)². χ² is of the points alone;
        models are compared by both together."""
        known = {} if self.problem is None else self.problem.priors
        return float(sum(((self.parameters[name].value - mean) / u) ** 2 for name, (mean, u) in known.items()))

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import fit_html

        return fit_html(self)


def fit(
    series: ThetaSeries,
    scene: Scene | None = None,
    model: str = "full_linear_drag",
    *,
    free: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    priors: Mapping[str, float] | None = None,
    loss: str = "linear",
    time_sigma_s: float = 0.0,
    thorough: bool = True,
) -> FitResult:
    """Fit one model to θ(t) and say how far to trust it.

    free : names to free that are held otherwise: `length` (held at the scene's), `f0`, `f`, `drive_phase` of a drive.
    fixed : name -> value to hold (`{"theta_offset": 0.0}`).    start : name -> first value, instead of the guess.
    priors : name -> standard uncertainty of what was measured beforehand: `angle_scale` and `time_scale` (relative),
        `length` in m, `theta_offset` in rad, `row_time` in s. `angle_scale` and `row_time` come from the series' meta where
        they are there.
    loss : "linear", or a robust one for outliers: "soft_l1", "huber", "cauchy".
    time_sigma_s : standard uncertainty of each time; it adds (σ_t θ̇)² to each σ².
    thorough : False takes the first start that converges, without looking whether the model then follows the record.

    Drag coefficients are ≥ 0. Error bars allow for correlated residuals (see `toolkit.fitting.noise`). Poor data gives a
    result with success False, a message and a remedy. Raises UsageError for unknown names or a scene that lacks what
    the model needs.
    """
    from toolkit.fitting.problem import pose

    began = time.process_time()
    problem = pose(series, scene or Scene(), model, free, fixed or {}, priors, loss, time_sigma_s)
    return replace(problem.solve(start or {}, thorough), cpu_s=time.process_time() - began)


def fit_models(
    series: ThetaSeries,
    scene: Scene | None = None,
    models: Sequence[str] | None = None,
    *,
    progress: Progress = silent,
    **options: Any,
) -> dict[str, FitResult]:
    """Fit several models so that they can be compared; by default the five of the ladder, and `scene` where the scene names
    what none of them has (a thread's drag, buoyancy, a formula …).

    Where the series has no σ, all models are weighed with the scatter left by the best of them; where the residuals
    are correlated, AIC and BIC of all use the number of points that are effectively independent under the best of
    them. A given length that contradicts the record is freed for all models, with a warning. `options` go to `fit`.
    """
    scene = scene or Scene()
    names = tuple(models or _ladder(scene))
    fits = _fit_all(series, scene, names, options, progress)
    freed = _freed_length(series, scene, fits, options)
    if freed is not None:
        loose = {**options, "free": (*options.get("free", ()), "length")}
        again = _fit_all(series, scene, names, loose, progress)
        fits = {name: replace(result, warnings=(*result.warnings, freed)) for name, result in again.items()}
    progress("fitting", 1.0)
    return _compared(fits)


def _ladder(scene: Scene) -> tuple[str, ...]:
    from toolkit.models import STANDARD
    from toolkit.models.model import REDUCED

    known = scene.pendulum.mass_kg is not None and scene.pendulum.length_m is not None
    more = [name for name in scene.effects if name not in REDUCED and name != "slack_string"]
    return (*STANDARD, "scene") if more and known else STANDARD


def has_full_sine(result: FitResult) -> bool:
    """Whether a fit's equation has sin θ, not θ."""
    return result.model.startswith("full") if result.problem is None else not result.problem.model.small_angle


def _fit_all(
    series: ThetaSeries, scene: Scene, names: Sequence[str], options: Mapping[str, Any], progress: Progress
) -> dict[str, FitResult]:
    """The most general smooth model first, without a given start: it finds the phase that the others then keep."""
    order = sorted(names, key=lambda name: (not name.startswith("full"), name != _LEADER, names.index(name)))
    given = dict(options.get("start") or {})
    fits: dict[str, FitResult] = {}
    lead: FitResult | None = None
    for i, name in enumerate(order):
        progress("fitting", i / len(order))
        chosen = {**options}
        if lead is not None:
            full = name.startswith("full")
            chosen |= {"start": {**(_shared(lead, name) if full else {}), **given}, "thorough": False}
        fits[name] = fit(series, scene, name, **chosen)
        if lead is None and fits[name].success and name.startswith("full"):
            lead = fits[name]
    return {name: fits[name] for name in names}


_LEADER = "full_linear_quadratic_drag"


def _shared(lead: FitResult, model: str) -> dict[str, float]:
    """What another full-sine model starts from: the leader's swing, and its drags where the other has them all."""
    from toolkit.models import load_model

    drags = ("k_d", "alpha_d", "c", "beta", "torque", "mu")
    keeps = set(load_model(lead.model).drags) <= set(load_model(model).drags)
    return {name: p.value for name, p in lead.parameters.items() if not p.fixed and (keeps or name not in drags)}


def choose_model(fits: Mapping[str, FitResult]) -> str:
    """The name of the preferred model: the simplest whose AIC is within 2 of the lowest, among those that converged
    (fewest parameters; of two alike, linear drag).

    A small-angle model is preferred only where every full-sine model is worse by more than 2 and its own ω_g is not off by
    what the finite swing does to the period: the full sine is the exact equation with as many parameters, and a free ω_g
    can hide what small angles get wrong.
    """
    if not fits:
        raise UsageError("there are no fits to choose from; fit at least one model")
    good = {name: result for name, result in fits.items() if result.success} or dict(fits)
    sound = {name: result for name, result in good.items() if not _too_large(result)}
    good = sound if any(has_full_sine(result) for result in sound.values()) else good
    lowest = min(result.aic for result in good.values())
    near = [name for name, result in good.items() if result.aic <= lowest + 2]
    exact = [name for name in near if has_full_sine(good[name])]
    by_simplicity = {name: (len(good[name].free), not name.endswith("linear_drag"), good[name].aic) for name in good}
    return min(exact or near or list(good), key=lambda name: by_simplicity[name])


def _too_large(result: FitResult) -> bool:
    """Whether a small-angle model's swing lengthens the period, by A²/16, by more than twice what ω_g is known to."""
    if has_full_sine(result):
        return False
    omega = result.parameters.get("omega_g") or result.derived.get("omega_g")
    if omega is None or not omega.stderr:
        return False
    offset = result.parameters["theta_offset"].value if "theta_offset" in result.parameters else 0.0
    return float(np.max(np.abs(result.theta_rad - offset))) ** 2 / 16 > 2 * omega.stderr / omega.value


def _freed_length(
    series: ThetaSeries, scene: Scene, fits: dict[str, FitResult], options: Mapping[str, Any]
) -> str | None:
    """A warning, if the record contradicts the length given."""
    held = {
        n: r for n, r in fits.items() if has_full_sine(r) and "length" in r.parameters and r.parameters["length"].fixed
    }
    if not held or "length" in (options.get("fixed") or {}):
        return None
    name = _LEADER if _LEADER in held else min(held, key=lambda n: held[n].chi2)
    trial = fit(series, scene, name, **{**options, "free": (*options.get("free", ()), "length")})
    if not trial.success:
        return None
    fitted, given = trial.parameters["length"], held[name].parameters["length"].value
    if fitted.stderr is None or abs(fitted.value - given) <= 4 * fitted.stderr:
        return None
    return said(
        "fit.length_contradicted",
        "the length given, {given_m:.4g} m, contradicts the period: the record asks for {fitted_m:.5g} m "
        "± {fitted_u_m:.1g} m; the length was fitted. Measure from the pivot to the bob's centre.",
        given_m=given,
        fitted_m=fitted.value,
        fitted_u_m=fitted.stderr,
    )


def _compared(fits: dict[str, FitResult]) -> dict[str, FitResult]:
    """χ², AIC and BIC of all on one footing: the noise of the best model."""
    good = [r for r in fits.values() if r.success and math.isfinite(r.chi2) and r.dof > 0]
    if not good:
        return fits
    best = min(good, key=lambda r: r.noise["rss"] if r.noise["source"] == "residuals" else r.chi2)
    inflation2 = float(best.noise["inflation"]) ** 2
    compared = {}
    for name, result in fits.items():
        chi2 = result.chi2
        if best.noise["source"] == "residuals":
            chi2 = result.noise["rss"] / best.noise["sigma_rad"] ** 2
        count = len(result.free)
        effective = max(
            result.residuals_rad.size * float(best.noise["effective_points"]) / best.residuals_rad.size, 2.0
        )
        compared[name] = replace(
            result,
            chi2=chi2,
            aic=chi2 / inflation2 + result.prior_chi2 + 2 * count,
            bic=chi2 / inflation2 + result.prior_chi2 + count * math.log(effective),
            noise={**result.noise, "comparison_inflation": math.sqrt(inflation2)},
        )
    return compared


__all__ = ["FitResult", "FittedParameter", "PendulabError", "choose_model", "fit", "fit_models"]

"""A posed fit, solved and judged: starts, the best of them, its error bars, and a sentence where it failed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from toolkit.fit import FitResult, FittedParameter
from toolkit.fitting.derived import derive
from toolkit.fitting.descent import Solved, descend
from toolkit.fitting.noise import Noise, measure_noise, spread
from toolkit.fitting.parameters import DRAGS, UNITS, ordered, tidied
from toolkit.fitting.starts import first_guess, starts
from toolkit.sentence import Sentence

if TYPE_CHECKING:
    from toolkit.fitting.problem import Problem

_SEEN = 40.0


def solve(problem: Problem, start: Mapping[str, float], thorough: bool = True) -> FitResult:
    """The best fit from `start` (or the guess), with several starts only where the first fails.

    thorough : False takes the first that converges; for a model beside another that already follows the record.
    """
    n, k = len(problem.series), len(problem.free) - len(problem.priors)
    if n <= k:
        few = f"{n} points cannot fix {k} parameters; record for longer or at a higher frame rate"
        return _failed(problem, Sentence(few, "fit.too_few_points", points=n, parameters=k))
    attempts = []
    for begin in starts(problem, start):
        found = descend(problem, begin)
        if found is None:
            continue
        attempts.append(found)
        if _good(problem, found) or (found.success and not thorough):
            break
    if not attempts:
        none = "the equation could not be solved from any start; check the times and angles"
        return _failed(problem, Sentence(none, "fit.unsolvable"))
    best = min(attempts, key=lambda a: a.cost)
    return _weighed(problem, best, _report(problem, best))


def _weighed(problem: Problem, found: Solved, result: FitResult) -> FitResult:
    """The fit once more where points and priors were not weighed as the residuals say: points with correlated noise, or
    of unknown σ, would else pull a parameter off its prior, or be held by it, with a weight that is not theirs."""
    weight = float(result.noise["inflation"])
    scale = 1.0 if problem.sigma_known else float(result.noise["sigma_rad"])
    if not problem.priors or not result.success or not (weight * scale > 0) or 0.8 < weight * scale < 1.25:
        return result
    values = dict(found.values)
    if "angle_scale" in values:
        values["theta0"] *= 1 + values["angle_scale"]
    values |= {name: mean for name, (mean, _) in problem.priors.items()}
    again = replace(problem, prior_weight=weight, prior_scale=scale)
    better = descend(again, values)
    return result if better is None or not better.success else _report(again, better)


def _good(problem: Problem, found: Solved) -> bool:
    """Whether the motion follows the record: near its points, and better than a sine follows noise."""
    if not found.success:
        return False
    residual = problem.series.theta_rad - found.seen
    rms = float(np.sqrt(np.mean(residual**2)))
    spread = float(np.var(problem.series.theta_rad))
    if residual.size * (spread - rms**2) < _SEEN * rms**2:  # no more than a sine takes from noise
        return False
    return rms < 5 * problem.point_noise_rad or rms < 0.3 * float(np.std(problem.series.theta_rad))


def _report(problem: Problem, found: Solved) -> FitResult:
    """The result of a descent: parameters with error bars that allow for the noise, χ², what follows, what to say."""
    values = tidied(found.values, problem.model.small_angle)
    seen, by, motion = problem.predict(values, problem.free)
    residual = problem.series.theta_rad - seen
    n, k = residual.size, len(problem.free) - len(problem.priors)
    sigma = problem.sigma
    if problem.time_sigma_s > 0:
        sigma = np.hypot(sigma, problem.time_sigma_s * motion.omega)
    rss = float(np.sum((residual / sigma) ** 2))
    dof = n - k
    if not problem.sigma_known:
        sigma = sigma * math.sqrt(rss / max(dof, 1)) if rss > 0 else sigma
    normalised = residual / sigma
    reduced, _ = problem.reduce(values)
    step = float(np.median(np.diff(problem.t_s)))
    jacobian = by / sigma[:, None]
    noise = measure_noise(
        normalised, sigma, problem.sigma_known, reduced["omega_g"], step, k, jacobian, problem.common_share
    )
    covariance, singular = _covariance(problem, jacobian, noise)
    parameters = {}
    for name, value in values.items():
        i = problem.free.index(name) if name in problem.free else None
        u = None if i is None or not math.isfinite(covariance[i, i]) else math.sqrt(max(covariance[i, i], 0.0))
        parameters[name] = FittedParameter(value, u, UNITS[name], i is None, minimum=0.0 if name in DRAGS else None)
    chi2 = float(normalised @ normalised)
    inflation2 = noise.inflation**2
    success, message = _verdict(problem, found, reduced, singular)
    result = FitResult(
        model=problem.model.name,
        parameters=ordered(parameters),
        free=problem.free,
        covariance=covariance,
        chi2=chi2,
        dof=dof,
        aic=chi2 / inflation2 + 2 * len(problem.free),
        bic=chi2 / inflation2 + len(problem.free) * math.log(max(noise.effective_points, 2.0)),
        residuals_rad=residual,
        theta_rad=seen,
        omega_rad_per_s=motion.omega,
        success=success,
        message=message,
        noise={**noise.as_dict(), "rss": float(residual @ residual), "loss": problem.loss, "start_s": problem.shift_s},
        equation_latex=problem.model.latex,
        method=motion.method,
        warnings=tuple(_warnings(problem, found, values)),
        lmfit=found.lmfit,
        problem=problem,
    )
    told = result.prior_chi2
    return replace(result, aic=result.aic + told, bic=result.bic + told, derived=derive(result, problem))


def _warnings(problem: Problem, found: Solved, values: Mapping[str, float]) -> list[Sentence]:
    """What the reader of a fit that converged should still know."""
    warnings = []
    for name in found.at_zero:
        bound = f"{name} came out negative and is held at its bound 0: the record does not show this drag"
        warnings.append(Sentence(bound, "fit.at_zero", name=name))
    for name, (mean, prior_u) in problem.priors.items():
        if name in problem.free and abs(values[name] - mean) > 2.5 * prior_u:
            off = abs(values[name] - mean) / prior_u
            left = (
                f"{name} left what was measured beforehand by {off:.1f} of its standard uncertainties: the record "
                "contradicts it, or the model is not the one for this record"
            )
            warnings.append(Sentence(left, "fit.prior_left", name=name, sigmas=off))
    return warnings


def _verdict(
    problem: Problem, found: Solved, reduced: Mapping[str, float], singular: list[str]
) -> tuple[bool, Sentence]:
    """Whether the fit may be used, and the sentence that says so or says what happened and what to do."""
    if singular:
        names = ", ".join(singular)
        message = f"the record cannot fix {names}: the covariance is singular; fit a simpler model or record for longer"
        return False, Sentence(message, "fit.singular", names=names)
    if not found.success and _nearly_critical(problem, reduced):
        message = (
            "the damping is near critical, where the paper's decaying sine has no frequency left to tell amplitude and phase "
            "by; use a full-sine model, which starts from θ(0) and θ̇(0), or give the length so that ω_g is held"
        )
        return False, Sentence(message, "fit.near_critical")
    if not found.success:
        reason = found.lmfit.message.strip()
        message = f"the fit did not settle ({reason}); give a start value or a shorter stretch"
        return False, Sentence(message, "fit.unsettled", reason=reason)
    if not problem.model.small_angle and not _good(problem, found):
        message = (
            "the model does not follow the record from any start tried; look for frames that jump, a second motion, "
            "or cut the record with --start and --stop"
        )
        return False, Sentence(message, "fit.not_followed")
    return True, Sentence("the fit converged", "fit.converged")


def _nearly_critical(problem: Problem, reduced: Mapping[str, float]) -> bool:
    """Whether the closed form is asked for a motion that hardly swings back, by the fit or by the first guess."""
    if not problem.model.closed_form:
        return False
    first = first_guess(problem)
    return reduced["alpha_d"] > 0.7 * reduced["omega_g"] or first.alpha_d > 0.7 * first.omega_g


def _covariance(problem: Problem, jacobian: np.ndarray, noise: Noise) -> tuple[np.ndarray, list[str]]:
    """(k, k) covariance that allows for the noise and the priors, and the names that the record cannot fix."""
    size = np.linalg.norm(jacobian, axis=0)
    prior = problem.prior_precision()
    with np.errstate(divide="ignore"):
        scale = 1 / np.sqrt(size**2 + prior)
    blind = [name for name, s in zip(problem.free, scale) if not math.isfinite(s)]
    if blind:
        return np.full((len(problem.free), len(problem.free)), np.nan), blind
    scaled = jacobian * scale
    normal = scaled.T @ scaled + np.diag(prior * scale**2)
    eigenvalue, vector = np.linalg.eigh(normal)
    singular = eigenvalue[0] < 1e-13 * eigenvalue[-1]
    eigenvalue = np.maximum(eigenvalue, 1e-15 * eigenvalue[-1])
    inverse = (vector / eigenvalue) @ vector.T
    middle = spread(scaled, noise) + np.diag(prior * (problem.prior_weight * scale) ** 2)
    covariance = (inverse @ middle @ inverse) * np.outer(scale, scale)
    covariance = (covariance + covariance.T) / 2
    loose = [problem.free[i] for i in np.flatnonzero(np.abs(vector[:, 0]) > 0.3)] if singular else []
    return covariance, loose


def _failed(problem: Problem, message: Sentence) -> FitResult:
    n = len(problem.series)
    nothing = np.full(n, np.nan)
    parameters = {
        name: FittedParameter(float(value), None, UNITS[name], name not in problem.free)
        for name, value in problem.values.items()
    }
    return FitResult(
        model=problem.model.name,
        parameters=ordered(parameters),
        free=problem.free,
        covariance=np.full((len(problem.free), len(problem.free)), np.nan),
        chi2=math.nan,
        dof=n - len(problem.free),
        aic=math.inf,
        bic=math.inf,
        residuals_rad=nothing,
        theta_rad=nothing,
        omega_rad_per_s=nothing,
        success=False,
        message=message,
        noise={"sigma_rad": math.nan, "source": "none", "rho1": 0.0, "inflation": 1.0, "rss": math.inf},
        problem=problem,
    )

"""Where a fit begins: what it was given, the guess from the data, and what a growing stretch of the record leads to."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from toolkit.fitting.descent import distance, thinned
from toolkit.fitting.guess import Guess, guess, guess_from_integrals
from toolkit.fitting.parameters import NOT_GUESSED

if TYPE_CHECKING:
    from toolkit.fitting.problem import Problem


def starts(problem: Problem, start: Mapping[str, float]) -> Iterator[dict[str, float]]:
    """First the guess (with what is given in its place), then others, each cheaper to compute than a fit."""
    given = {name: value for name, value in start.items() if name in problem.free}
    guessed = [name for name in problem.free if name not in NOT_GUESSED]
    whole = all(name in given for name in guessed)
    near = whole and _follows(problem, {**problem.values, **given})
    if near:
        yield {**problem.values, **given}
    begin = {**problem.values, **_from_guess(problem, first_guess(problem))}
    if given and not whole and _follows(problem, {**begin, **given}):
        yield {**begin, **given}
    yield begin
    yield from _grown(problem)


def _follows(problem: Problem, values: Mapping[str, float]) -> bool:
    """Whether a start already explains half of the record's spread; one that does not is worth less than the guess."""
    return distance(thinned(problem, values), values) ** 2 < 0.5 * float(np.var(problem.series.theta_rad))


def first_guess(problem: Problem) -> Guess:
    """Start values from the record alone."""
    drive = _drive(problem)
    if drive is not None and drive[0] != 0:
        omega = _known_omega(problem)
        span = None if omega is None else 3 * 2 * math.pi / omega
        return guess_from_integrals(
            problem.t_s, problem.series.theta_rad, small_angle=problem.model.small_angle, drive=drive, span_s=span
        )
    return guess(problem.t_s, problem.series.theta_rad, problem.model.drags, problem.model.small_angle)


def _drive(problem: Problem) -> tuple[float, float, float] | None:
    if "cosine_drive" not in problem.model.effects:
        return None
    reduced, _ = problem.reduce(
        {**problem.values, "theta0": 0.1, "phi": 0.0, "omega_g": problem.values.get("omega_g", 1.0)}
    )
    return reduced["drive"], reduced["f"], reduced["drive_phase"]


def _known_omega(problem: Problem) -> float | None:
    length = problem.values.get("length")
    return None if length is None else math.sqrt(problem.scene.environment.gravity_m_per_s2 / length)


def _from_guess(problem: Problem, first: Guess) -> dict[str, float]:
    """The guess under the reported names, for those that are free."""
    omega = first.omega_g
    theta0, phi = first.theta0, first.phi
    if problem.model.closed_form:  # the paper's phase: θ̇(0) = θ₀(|ω_u| cos φ − α sin φ)
        at_zero, slope = theta0 * math.sin(phi), theta0 * omega * math.cos(phi)
        rate = math.sqrt(abs(omega**2 - first.alpha_d**2)) or omega
        slope = (slope + first.alpha_d * at_zero) / rate
        if first.alpha_d > 0.3 * omega:
            theta0, phi = math.hypot(at_zero, slope), math.atan2(at_zero, slope)
    length = problem.values.get("length")
    if length is not None:
        length = problem.scene.environment.gravity_m_per_s2 / omega**2 if "length" in problem.free else length
    m, el = problem.scene.pendulum.mass_kg or math.nan, length or math.nan
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
    return {name: value for name, value in table.items() if name in problem.free}


def _grown(problem: Problem) -> Iterator[dict[str, float]]:
    """Fit the first periods, then twice as many, and so on: the phase is never lost on the way."""
    t, theta = problem.t_s, problem.series.theta_rad
    rough = guess(t, theta, problem.model.drags, problem.model.small_angle)
    omega = _known_omega(problem) or rough.omega_g
    span = 3 * 2 * math.pi / omega
    drive = _drive(problem)
    begin = {
        **problem.values,
        **_from_guess(
            problem, guess_from_integrals(t, theta, small_angle=problem.model.small_angle, drive=drive, span_s=span)
        ),
    }
    while span < t[-1] - t[0]:
        stop = int(np.searchsorted(t, t[0] + span))
        span *= 2
        if stop < 3 * len(problem.free):
            continue
        begin = problem.part(slice(stop)).values_at_best(begin) or begin
    yield begin

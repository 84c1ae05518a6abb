"""What follows from a fit: period, quality factor, equivalent length …, each with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from toolkit.fit import FitResult, FittedParameter
    from toolkit.fitting.problem import Problem


def propagate(result: FitResult, function: Callable[[dict[str, float]], float], unit: str) -> FittedParameter:
    """A function of the fitted values with its standard uncertainty, u² = gᵀ C g, g by central differences."""
    from toolkit.fit import FittedParameter

    values = {name: p.value for name, p in result.parameters.items()}
    at = function(values)
    gradient = np.zeros(len(result.free))
    for i, name in enumerate(result.free):
        u = math.sqrt(max(float(result.covariance[i, i]), 0.0))
        step = max(0.01 * u, 1e-7 * abs(values[name])) or 1e-9
        gradient[i] = (
            function({**values, name: values[name] + step}) - function({**values, name: values[name] - step})
        ) / (2 * step)
    u2 = float(gradient @ result.covariance @ gradient)
    return FittedParameter(at, math.sqrt(u2) if u2 >= 0 else None, unit, True)


def derive(result: FitResult, problem: Problem) -> dict[str, FittedParameter]:
    """T0, omega_g, Q and log_decrement at θ₀, damping rates, and the equivalent length; what applies to the model.

    `equivalent_alpha_d` (and `equivalent_k_d` where the mass is known) is the linear rate that takes the same energy in a
    cycle at θ₀; `decay_time` is its inverse. `g_from_length` = ω_g² ℓ with the scene's ℓ, where the fit freed it.

    Q = ω_g/(2 α_eq) and log_decrement = 2π α_eq/ω_g with the equivalent linear rate
    α_eq = α_d + (4/3π) β ω_g θ₀ + 2 μ/(π ω_g θ₀) (physics: averaged energy loss of a cycle at amplitude θ₀).
    """
    if not np.all(np.isfinite(result.covariance)):
        return {}

    def omega(values: dict[str, float]) -> float:
        return problem.reduce(values)[0]["omega_g"]

    def rate(values: dict[str, float]) -> float:
        r = problem.reduce(values)[0]
        w, a = r["omega_g"], max(abs(r["theta0"]), 1e-9)
        return (
            r.get("alpha_d", 0.0)
            + 4 / (3 * math.pi) * r.get("beta", 0.0) * w * a
            + 2 * r.get("mu", 0.0) / (math.pi * w * a)
        )

    gravity = problem.scene.environment.gravity_m_per_s2
    derived = {"T0": propagate(result, lambda v: 2 * math.pi / omega(v), "s")}
    if "omega_g" not in result.parameters:
        derived["omega_g"] = propagate(result, omega, "rad/s")
    if "length" not in result.parameters:
        derived["equivalent_length"] = propagate(result, lambda v: gravity / omega(v) ** 2, "m")
    elif "length" in result.free and problem.scene.pendulum.length_m is not None:
        given = problem.scene.pendulum.length_m
        derived["g_from_length"] = propagate(result, lambda v: omega(v) ** 2 * given, "m/s^2")
    for name, coefficient, unit in (("k_d", "alpha_d", "1/s"), ("c", "beta", "1"), ("torque", "mu", "1/s^2")):
        if name in result.parameters:
            derived[coefficient] = propagate(result, _pick(problem, coefficient), unit)
    if problem.model.drags and rate({n: p.value for n, p in result.parameters.items()}) > 0:
        derived["Q"] = propagate(result, lambda v: omega(v) / (2 * rate(v)) if rate(v) else math.inf, "1")
        derived["log_decrement"] = propagate(result, lambda v: 2 * math.pi * rate(v) / omega(v), "1")
        derived["equivalent_alpha_d"] = propagate(result, rate, "1/s")
        if problem.scene.pendulum.mass_kg is not None:
            twice = 2 * problem.scene.pendulum.mass_kg
            derived["equivalent_k_d"] = propagate(result, lambda v: twice * rate(v), "kg/s")
        if "alpha_d" in problem.model.drags:
            derived["decay_time"] = propagate(result, lambda v: 1 / rate(v) if rate(v) else math.inf, "s")
    return {name: p for name, p in derived.items() if math.isfinite(p.value)}


def _pick(problem: Problem, coefficient: str) -> Callable[[dict[str, float]], float]:
    return lambda values: problem.reduce(values)[0][coefficient]

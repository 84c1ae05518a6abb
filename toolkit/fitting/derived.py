"""What follows from a fit: period, quality factor, equivalent length …, each with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from toolkit.fit import FitResult, FittedParameter
    from toolkit.fitting.problem import Problem

_UNITS = {
    "T0": "s",
    "omega_g": "rad/s",
    "equivalent_length": "m",
    "g_from_length": "m/s^2",
    "alpha_d": "1/s",
    "beta": "1",
    "mu": "1/s^2",
    "Q": "1",
    "log_decrement": "1",
    "equivalent_alpha_d": "1/s",
    "equivalent_k_d": "kg/s",
    "decay_time": "s",
}
_REDUCED_BY = {"k_d": "alpha_d", "c": "beta", "torque": "mu"}


def derive(result: FitResult, problem: Problem) -> dict[str, FittedParameter]:
    """T0, omega_g, Q and log_decrement at θ₀, damping rates, and the equivalent length; what applies to the model.

    `equivalent_alpha_d` (and `equivalent_k_d` where the mass is known) is the linear rate that takes the same energy in a
    cycle at θ₀; `decay_time` is its inverse. `g_from_length` = ω_g² ℓ with the scene's ℓ, where the fit freed it.

    Q = ω_g/(2 α_eq) and log_decrement = 2π α_eq/ω_g with the equivalent linear rate
    α_eq = α_d + (4/3π) β ω_g θ₀ + 2 μ/(π ω_g θ₀) (physics: averaged energy loss of a cycle at amplitude θ₀).
    The uncertainty is u² = gᵀ C g with the gradient g by central differences.
    """
    from toolkit.fit import FittedParameter

    if not np.all(np.isfinite(result.covariance)):
        return {}
    at, by = derived_with_gradients(result, problem)
    derived = {}
    for name, value in at.items():
        u2 = float(by[name] @ result.covariance @ by[name])
        if math.isfinite(value):
            derived[name] = FittedParameter(value, math.sqrt(u2) if u2 >= 0 else None, _UNITS[name], True)
    return derived


def derived_with_gradients(result: FitResult, problem: Problem) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Every derived value, and its derivatives (k,) by the free parameters."""
    values = {name: p.value for name, p in result.parameters.items()}
    at = _quantities(values, result, problem)
    by = {name: np.zeros(len(result.free)) for name in at}
    for i, name in enumerate(result.free):
        u = math.sqrt(max(float(result.covariance[i, i]), 0.0))
        step = max(0.01 * u, 1e-7 * abs(values[name])) or 1e-9
        up, down = (_quantities({**values, name: values[name] + s}, result, problem) for s in (step, -step))
        for quantity, gradient in by.items():
            gradient[i] = (up.get(quantity, math.nan) - down.get(quantity, math.nan)) / (2 * step)
    return at, by


def _quantities(values: Mapping[str, float], result: FitResult, problem: Problem) -> dict[str, float]:
    reduced = problem.reduce(values)[0]
    omega, peak = reduced["omega_g"], max(abs(reduced["theta0"]), 1e-9)
    rate = reduced.get("alpha_d", 0.0) + 4 / (3 * math.pi) * reduced.get("beta", 0.0) * omega * peak
    rate += 2 * reduced.get("mu", 0.0) / (math.pi * omega * peak)
    pendulum, gravity = problem.scene.pendulum, problem.scene.environment.gravity_m_per_s2
    found = {"T0": 2 * math.pi / omega}
    if "omega_g" not in values:
        found["omega_g"] = omega
    if "length" not in values:
        found["equivalent_length"] = gravity / omega**2
    elif "length" in result.free and pendulum.length_m is not None:
        found["g_from_length"] = omega**2 * pendulum.length_m
    found |= {coefficient: reduced[coefficient] for name, coefficient in _REDUCED_BY.items() if name in values}
    if problem.model.drags and rate:
        found |= {"Q": omega / (2 * rate), "log_decrement": 2 * math.pi * rate / omega, "equivalent_alpha_d": rate}
        if pendulum.mass_kg is not None:
            found["equivalent_k_d"] = 2 * pendulum.mass_kg * rate
        if "alpha_d" in problem.model.drags:
            found["decay_time"] = 1 / rate
    return found

"""A GUM budget of one result: what each input contributes to its uncertainty, statistical and systematic apart.

JCGM 100:2008: u² = Σ (c_i u_i)², effective degrees of freedom by Welch and Satterthwaite (G.2b), U = k u with
k = t_p(ν_eff). Sensitivities of what the fit holds or assumes are found by fitting again with the input moved by ± u.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from toolkit.errors import UsageError
from toolkit.fit import FitResult, FittedParameter
from toolkit.registry import did_you_mean

DISTRIBUTIONS = {"normal": 1.0, "rectangular": math.sqrt(3), "triangular": math.sqrt(6)}
_INPUTS = {
    "mass": "kg",
    "length": "m",
    "g": "m/s^2",
    "bob_radius": "m",
    "angle_scale": "1",
    "time_scale": "1",
    "vertical": "rad",
}


@dataclass(frozen=True)
class Input:
    """What is known of an input beforehand: standard uncertainty for `normal`, half width for `rectangular` and
    `triangular`, SI (relative for angle_scale and time_scale); dof of the statement, infinite where it is certain."""

    half_width: float
    distribution: str = "normal"
    dof: float = math.inf

    @property
    def u(self) -> float:
        """Standard uncertainty."""
        return self.half_width / DISTRIBUTIONS[self.distribution]


@dataclass(frozen=True)
class Row:
    """One line: `contribution` = sensitivity · u, in the result's unit; kind "A" or "B" (GUM's type)."""

    quantity: str
    estimate: float
    unit: str
    u: float
    kind: str
    distribution: str
    sensitivity: float
    contribution: float
    dof: float


@dataclass(frozen=True)
class Budget:
    """The result with its rows; u_statistical and u_systematic add in squares to u; expanded = coverage_factor · u."""

    quantity: str
    estimate: float
    unit: str
    rows: tuple[Row, ...]
    u_statistical: float
    u_systematic: float
    u: float
    effective_dof: float
    coverage_factor: float
    expanded: float
    level: float


MAIN = (
    *("k_d", "alpha_d", "c", "beta", "torque", "mu", "theta0", "phi", "omega_g", "length"),
    *("T0", "equivalent_length", "g_from_length", "Q"),
)
"""What a report of an experiment states, where the fit has it."""


def budget(
    result: FitResult, quantity: str = "k_d", inputs: Mapping[str, Input] | None = None, level: float = 0.95
) -> Budget:
    """The budget of a fitted or derived quantity (`k_d`, `omega_g`, `T0`, `equivalent_length` …); see `budgets`."""
    return budgets(result, (quantity,), inputs, level)[quantity]


def budgets(
    result: FitResult,
    quantities: Sequence[str] | None = None,
    inputs: Mapping[str, Input] | None = None,
    level: float = 0.95,
) -> dict[str, Budget]:
    """Budgets of several quantities, by default of all of `MAIN` that the fit has with an uncertainty; each input is moved
    once for all of them.

    inputs : of mass, length, g, bob_radius, angle_scale, time_scale, vertical. Nuisance parameters that the fit itself
    freed within a prior get their row from the fit. Raises UsageError for unknown names or a fit that failed.
    """
    if result.problem is None or not np.all(np.isfinite(result.covariance)):
        raise UsageError(f"the fit of {result.model} failed ({result.message}); there is no budget to draw up")
    inputs = dict(inputs or {})
    for name, told in inputs.items():
        if name not in _INPUTS:
            raise UsageError(f"unknown input {name!r} of a budget{did_you_mean(name, list(_INPUTS))}")
        if told.distribution not in DISTRIBUTIONS or not told.half_width > 0:
            raise UsageError(f"input {name} needs a positive width and one of {', '.join(DISTRIBUTIONS)}")
        if name in result.problem.priors:
            raise UsageError(f"{name} is already free within a prior in this fit; leave it out of the inputs")
    table = {**result.parameters, **result.derived}
    if quantities is None:
        quantities = [name for name in MAIN if name in table and table[name].stderr]
    ends = {name: _with_input_moved(result, name, told.u) for name, told in inputs.items()}
    inverse = result.problem.normal_inverse(result)
    return {name: _budget(result, name, inputs, ends, inverse, level) for name in quantities}


def _budget(
    result: FitResult,
    quantity: str,
    inputs: Mapping[str, Input],
    ends: Mapping[str, tuple[FitResult, FitResult]],
    inverse: np.ndarray,
    level: float,
) -> Budget:
    at, problem = _value(result, quantity), result.problem
    gradient = _gradient(result, quantity)
    rows = []
    for name, (mean, u) in problem.priors.items():
        unit = _INPUTS.get(name, result.parameters[name].unit)
        by = float(gradient @ inverse[:, result.free.index(name)]) * problem.prior_weight**2 / u**2
        rows.append(Row(name, mean, unit, u, "B", "normal", by, by * u, math.inf))
    prior2 = sum(row.contribution**2 for row in rows)
    statistical = math.sqrt(max(float(gradient @ result.covariance @ gradient) - prior2, 0.0))
    dof = max(float(result.noise["effective_points"]) - len(result.free), 1.0)
    rows.insert(0, Row("scatter of the points", at.value, at.unit, statistical, "A", "normal", 1.0, statistical, dof))
    for name, told in inputs.items():
        up, down = (_value(end, quantity).value for end in ends[name])
        by = (up - down) / (2 * told.u)
        estimate = _estimate(result, name)
        rows.append(Row(name, estimate, _INPUTS[name], told.u, "B", told.distribution, by, by * told.u, told.dof))
    return add_up(quantity, at.value, at.unit, rows, level)


def add_up(quantity: str, estimate: float, unit: str, rows: Sequence[Row], level: float = 0.95) -> Budget:
    """The budget that these rows make."""
    from scipy.special import stdtrit

    statistical, systematic = (
        math.sqrt(sum(row.contribution**2 for row in rows if row.kind == kind)) for kind in ("A", "B")
    )
    u = math.hypot(statistical, systematic)
    fourth = sum(row.contribution**4 / row.dof for row in rows if row.dof > 0)
    effective = u**4 / fourth if fourth > 0 else math.inf
    factor = float(stdtrit(min(effective, 1e9), 0.5 + level / 2))
    return Budget(
        quantity, estimate, unit, tuple(rows), statistical, systematic, u, effective, factor, factor * u, level
    )


def _value(result: FitResult, quantity: str) -> FittedParameter:
    table = {**result.parameters, **result.derived}
    if quantity not in table:
        raise UsageError(f"no quantity {quantity!r} in this fit{did_you_mean(quantity, list(table))}")
    return table[quantity]


def _gradient(result: FitResult, quantity: str) -> np.ndarray:
    """Derivatives of the quantity by the free parameters (exact for a parameter, numerical for a derived one)."""
    if quantity in result.free:
        return np.eye(len(result.free))[result.free.index(quantity)]
    from toolkit.fitting.derived import derived_with_gradients

    return derived_with_gradients(result, result.problem)[1][quantity]


def _estimate(result: FitResult, name: str) -> float:
    scene = result.problem.scene
    known = {
        "mass": scene.pendulum.mass_kg,
        "length": scene.pendulum.length_m,
        "g": scene.environment.gravity_m_per_s2,
        "bob_radius": scene.pendulum.bob_radius_m,
        "angle_scale": 1.0,
        "time_scale": 1.0,
        "vertical": 0.0,
    }[name]
    if known is None:
        raise UsageError(f"the scene does not give {name}, so nothing depends on it; leave it out of the inputs")
    return float(known)


def _with_input_moved(result: FitResult, name: str, u: float) -> tuple[FitResult, FitResult]:
    """The fit again with an input one u higher, and one u lower."""
    _estimate(result, name)
    start = {n: p.value for n, p in result.parameters.items() if not p.fixed}
    up, down = (result.problem.with_input(name, sign * u).solve(start, thorough=False) for sign in (1, -1))
    return up, down

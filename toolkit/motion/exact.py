"""The closed form of the linear equation and the elliptic solution of the bare pendulum, for an equation's parameters."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.motion.solver import START, Solution
from toolkit.trajectory import SolveCost

if TYPE_CHECKING:
    from toolkit.motion.equation import Equation


def solve_exactly(
    equation: Equation, p: tuple[float, ...], theta0: float, omega0: float, t: np.ndarray,
    sensitivities: tuple[str, ...], start_s: float, compiled: bool,
) -> Solution | None:  # fmt: skip
    """θ(t) and its derivatives, or None where neither solution fits; compiled : see `elliptic.solve_pendulum`."""
    began = time.process_time()
    restoring, damping, drive, f_hz, phase = equation.reduced_numbers(p)
    if not restoring > 0:
        return None
    rate = math.sqrt(restoring)
    if not equation.small_angle:
        if damping != 0 or drive != 0 or sensitivities:
            return None
        from toolkit.motion.elliptic import solve_pendulum

        exact = solve_pendulum(t - start_s if start_s else t, theta0, omega0, rate, compiled)
        none = np.empty((t.size, 0))
        cost = SolveCost(time.process_time() - began)
        error = 4e-16 * (abs(theta0) + math.pi + abs(float(exact.theta_rad[-1])))
        return Solution(t, exact.theta_rad, exact.omega_rad_per_s, none, none, "exact: elliptic functions", cost, error)
    from toolkit.motion.closed_form import solve_linear

    turn = 2 * math.pi * f_hz
    inputs = ("alpha_per_s", "omega_g_rad_per_s", "drive_rad_per_s2", "omega_f_rad_per_s", "phase_rad")
    wanted = (*START, *inputs) if sensitivities else ()
    solved = solve_linear(
        t - start_s, theta0, omega0, damping / 2, rate, drive, turn, phase + turn * start_s, derivatives=wanted
    )
    chain = np.zeros((len(wanted), len(sensitivities)))
    for column, name in enumerate(sensitivities):
        if name in START:
            chain[START.index(name), column] = 1.0
        elif equation.index_of(name) is not None:
            k, d, a, f, ph = _derivative(equation, p, name)
            by_turn = 2 * math.pi * f
            chain[2:, column] = d / 2, k / (2 * rate), a, by_turn, ph + by_turn * start_s
    cost = SolveCost(time.process_time() - began)
    error = 1e-15 * (1 + float(np.abs(solved.theta_rad).max()))
    shape = (t.size, len(sensitivities))
    by_theta = solved.d_theta @ chain if sensitivities else np.empty(shape)
    by_omega = solved.d_omega @ chain if sensitivities else np.empty(shape)
    method = "exact: closed form of the linear equation"
    return Solution(t, solved.theta_rad, solved.omega_rad_per_s, by_theta, by_omega, method, cost, error)


def _derivative(equation: Equation, p: Sequence[Any], name: str) -> tuple[float, ...]:
    """Derivatives of the reduced equation's five numbers, by a complex step: to the last digit."""
    step = 1e-30
    moved = [v + 1j * step if n == name else v for n, v in zip(equation.parameters, p)]
    return tuple(complex(v).imag / step for v in equation.reduced(moved))

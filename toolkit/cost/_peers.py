"""SciPy's integrators on the same problems, as a careful user calls them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from toolkit.cost.problems import Problem, exact_coefficients
from toolkit.scene import Scene

PEERS = ("RK45", "DOP853", "LSODA", "Radau", "odeint")
SOLVE_IVP = PEERS[:4]
Solve = Callable[[float], tuple[np.ndarray, int, str]]
"""tolerance -> θ, evaluations, name of the route"""


def peers_for(problem: Problem) -> tuple[str, ...]:
    """Those that can solve it at all: explicit methods would crawl on a stiff one, odeint stops at no event."""
    if problem.stiff:
        return ("LSODA", "Radau", "odeint")
    return PEERS if "slack_string" not in problem.scene.effects else SOLVE_IVP


def peer(name: str, problem: Problem) -> Solve:
    """The named one, at rtol = atol = tolerance."""
    from scipy.integrate import odeint, solve_ivp

    slope, t = _slope(problem.scene), problem.t_s
    start = [problem.scene.release.theta0_rad, problem.scene.release.omega0_rad_per_s]
    if "slack_string" in problem.scene.effects:
        return lambda tolerance: _with_slack(name, problem, tolerance)
    if name == "odeint":

        def run_odeint(tolerance: float) -> tuple[np.ndarray, int, str]:
            path, info = odeint(
                slope, start, t, tfirst=True, rtol=tolerance, atol=tolerance, mxstep=1_000_000, full_output=True
            )
            return path[:, 0], int(info["nfe"][-1]), name

        return run_odeint

    def run_solve_ivp(tolerance: float) -> tuple[np.ndarray, int, str]:
        solved = solve_ivp(
            slope, (0.0, t[-1]), start, method=name, t_eval=t, rtol=max(tolerance, 3e-14), atol=tolerance
        )
        return solved.y[0], int(solved.nfev), name

    return run_solve_ivp


def _slope(scene: Scene) -> Callable[[float, Any], tuple[float, float]]:
    """The right-hand side as a careful user of SciPy writes it: scalars and `math`, only the terms that act."""
    sin, cos = (math.sin if not scene.approximations.small_angle else float), math.cos
    two_alpha, beta, gravity, drive, rate = _coefficients(scene)
    if drive and two_alpha:
        return lambda t, y: (y[1], drive * cos(rate * t) - gravity * sin(y[0]) - two_alpha * y[1])
    if beta:
        return lambda t, y: (y[1], -gravity * sin(y[0]) - beta * abs(y[1]) * y[1])
    if two_alpha:
        return lambda t, y: (y[1], -gravity * sin(y[0]) - two_alpha * y[1])
    return lambda t, y: (y[1], -gravity * sin(y[0]))


def _coefficients(scene: Scene) -> tuple[float, float, float, float, float]:
    exact = exact_coefficients(scene)
    two_alpha, beta, gravity, drive, f_hz = (float(v) for v in exact)
    return two_alpha, beta, gravity, drive, 2 * math.pi * f_hz


def _with_slack(name: str, problem: Problem, tolerance: float) -> tuple[np.ndarray, int, str]:
    """Swing and flight joined by terminal events, as a user of solve_ivp writes it."""
    from scipy.integrate import solve_ivp

    scene, t = problem.scene, problem.t_s
    length, g = float(scene.pendulum.length_m or 1.0), scene.environment.gravity_m_per_s2
    options: dict[str, Any] = {"method": name, "rtol": max(tolerance, 3e-14), "atol": tolerance}

    def swing(t: float, y: Any) -> tuple[float, float]:
        return y[1], -g / length * math.sin(y[0])

    def tension(t: float, y: Any) -> float:
        return length * y[1] ** 2 + g * math.cos(y[0])

    def fall(t: float, y: Any) -> tuple[float, float, float, float]:
        return y[2], y[3], 0.0, -g

    def stretched(t: float, y: Any) -> float:
        return y[0] ** 2 + y[1] ** 2 - length**2 * (1 + 1e-12)

    tension.terminal, tension.direction = True, -1.0  # type: ignore[attr-defined]
    stretched.terminal, stretched.direction = True, 1.0  # type: ignore[attr-defined]
    theta, now, state, evaluations = np.empty(0), 0.0, [scene.release.theta0_rad, scene.release.omega0_rad_per_s], 0
    taut = True
    while theta.size < t.size:
        ahead = t[theta.size :]
        solved = solve_ivp(
            swing if taut else fall,
            (now, t[-1] + 1e-9),
            state,
            t_eval=ahead,
            events=tension if taut else stretched,
            **options,
        )
        evaluations += int(solved.nfev)
        y = solved.y
        angle = y[0] if taut else np.unwrap(np.concatenate([theta[-1:], np.arctan2(y[0], -y[1])]))[1:]
        theta = np.concatenate([theta, angle])
        if not solved.t_events[0].size:
            break
        now, end = float(solved.t_events[0][0]), solved.y_events[0][0]
        if taut:
            a, w = end
            state = [length * math.sin(a), -length * math.cos(a), length * w * math.cos(a), length * w * math.sin(a)]
        else:
            raw = math.atan2(end[0], -end[1])
            a = raw + 2 * math.pi * round((theta[-1] - raw) / (2 * math.pi))
            state = [a, (end[2] * math.cos(a) + end[3] * math.sin(a)) / length]
        taut = not taut
    return theta, evaluations, name

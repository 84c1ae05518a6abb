"""simulate: the motion of a scene, with tension and energy, by the cheapest route that holds the accuracy asked for."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.errors import UsageError
from toolkit.motion.equation import Equation, build_equation
from toolkit.motion.solver import Solution
from toolkit.scene import Scene
from toolkit.trajectory import SolveCost, Trajectory


def simulate(scene: Scene, t_s: Any, accuracy_rad: float = 1e-9) -> Trajectory:
    """θ, θ̇, string tension and energy of a scene at the times t_s (n,) in s, from t = 0 on.

    accuracy_rad : the largest error of θ allowed, 1e-3 … 1e-11; where the motion itself forbids it (chaos), the trajectory
    comes with a warning and its error estimate. The trajectory says which route was taken and what it cost.
    Raises UsageError where the scene lacks what its effects need.
    """
    equation = scene_equation(scene)
    parameters = scene_parameters(scene, equation)
    t = np.ascontiguousarray(t_s, dtype=float)
    release = scene.release
    if "slack_string" in scene.effects:
        return _simulate_slack(scene, equation, parameters, t, accuracy_rad)
    solution = equation.solve(parameters, release.theta0_rad, release.omega0_rad_per_s, t, accuracy_rad, spare_rows=2)
    return _trajectory(scene, equation, parameters, solution, accuracy_rad)


def scene_equation(scene: Scene) -> Equation:
    """The equation of motion of the scene's effects."""
    formulas = {name: table["torque"] for name, table in scene.effects.items() if name == "formula"}
    return build_equation(tuple(scene.effects), scene.approximations.small_angle, formulas)


def scene_parameters(scene: Scene, equation: Equation) -> dict[str, float]:
    """Values of the equation's parameters from the scene. Raises UsageError for what the scene does not give."""
    pendulum, environment = scene.pendulum, scene.environment
    values: dict[str, float | None] = {
        "mass_kg": pendulum.mass_kg,
        "length_m": pendulum.length_m,
        "bob_radius_m": pendulum.bob_radius_m,
        "g_m_per_s2": environment.gravity_m_per_s2,
        "fluid_density_kg_per_m3": environment.fluid_density_kg_per_m3,
        "fluid_viscosity_pa_s": environment.fluid_viscosity_pa_s,
    }
    for name, table in scene.effects.items():
        for key, value in table.items():
            if not isinstance(value, str):
                values[f"{name}.{key}"] = value
    for name in equation.parameters:
        if values.get(name) is None:
            wanting = " and ".join(e.name for e in equation.effects if name in e.needs) or "the pendulum"
            raise UsageError(f"the scene does not give {name}, which {wanting} needs; add it to the scene")
    return {name: value for name, value in values.items() if value is not None}


def _trajectory(
    scene: Scene, equation: Equation, parameters: Mapping[str, float], solution: Solution, accuracy_rad: float
) -> Trajectory:
    began = time.process_time()
    t, theta, omega = solution.t_s, solution.theta_rad, solution.omega_rad_per_s
    warnings = solution.warnings
    if scene.pendulum.mass_kg is None:
        tension = energy = np.full(t.shape, np.nan)
        warnings += ("the scene gives no mass: tension and energy are left out",)
    else:
        integrated = solution.cost.steps > 0
        tension, energy = equation.tension_and_energy(parameters, t, theta, omega, integrated, solution.spare)
        if t.size and tension.min() < 0:
            first = int(np.argmax(tension < 0))
            warnings += (
                f"the tension is negative from t = {t[first]:.4g} s on: a string would go slack; "
                "add [effects.slack_string] for a string, or read it as a rod",
            )
    cost = solution.cost
    cost = SolveCost(cost.cpu_s + time.process_time() - began, cost.compile_s, cost.evaluations, cost.steps)
    return Trajectory(
        t, theta, omega, tension, energy, solution.method, cost, accuracy_rad, solution.error_estimate_rad,
        solution.events, warnings, equation.latex,
    )  # fmt: skip


def _simulate_slack(
    scene: Scene, equation: Equation, parameters: Mapping[str, float], t: np.ndarray, accuracy_rad: float
) -> Trajectory:
    """The string goes slack where T < 0; taut again, the bob has lost its velocity along the string."""
    from toolkit.motion.slack import solve_with_slack

    if scene.pendulum.mass_kg is None:
        raise UsageError("slack_string needs mass_kg to find the tension; add it to [pendulum]")
    if scene.approximations.small_angle:
        raise UsageError("slack_string needs angles beyond 90°; leave out small_angle")
    began = time.process_time()
    inner = min(accuracy_rad * 1e-2, 1e-9)
    release = scene.release
    solution = solve_with_slack(equation, parameters, release.theta0_rad, release.omega0_rad_per_s, t, inner)
    motion = equation.terms_at(parameters, t, solution.theta_rad, solution.omega_rad_per_s)
    mass, g = parameters["mass_kg"], parameters["g_m_per_s2"]
    aloft = solution.in_flight
    radial = np.nan_to_num(solution.radial_velocity_m_per_s)
    speed2 = radial**2 + (solution.radius_m * solution.omega_rad_per_s) ** 2
    height = parameters["length_m"] - solution.radius_m * np.cos(solution.theta_rad)
    in_air = mass * speed2 / 2 + mass * g * height
    return Trajectory(
        t, solution.theta_rad, solution.omega_rad_per_s, np.where(aloft, 0.0, motion.tension),
        np.where(aloft, in_air, motion.energy), "swings joined by free flights",
        SolveCost(time.process_time() - began, 0.0, solution.evaluations, solution.steps),
        accuracy_rad, None, solution.events, (), equation.latex, {"radius_m": solution.radius_m},
    )  # fmt: skip

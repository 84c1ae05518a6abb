"""simulate against whole-number arithmetic on random scenes; a failure names the scene by its two numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toolkit.cost.problems import Problem, random_problem, random_stiff_problem, true_angles
from toolkit.scene import Environment, Pendulum, Release, Scene
from toolkit.simulate import simulate

SEED = 7


@pytest.mark.parametrize("first", range(0, 40, 8))
def test_accuracy_asked_for_is_reached_or_said_to_be_out_of_reach(first):
    print(f"seed {SEED}, scenes {first} … {first + 7}")
    missed = []
    for number in range(first, first + 8):
        problem = random_problem(SEED, number)
        judged, truth = true_angles(problem, 60)
        for asked in (1e-3, 1e-6, 1e-9):
            trajectory = simulate(problem.scene, problem.t_s, asked)
            error = float(np.max(np.abs(trajectory.theta_rad[judged] - truth)))
            warned = any("asked for" in w for w in trajectory.warnings)
            if error > asked and not warned:
                missed.append(f"scene {number}, {asked:g}: {error:.2g} ({trajectory.method}; {problem.what})")
    assert not missed, "\n".join(missed)


@pytest.mark.parametrize("number", range(6))
def test_strong_drag_of_any_strength_is_reached(number):
    problem = random_stiff_problem(SEED, number)
    judged, truth = true_angles(problem, 60)
    for asked in (1e-4, 1e-7, 1e-10):
        trajectory = simulate(problem.scene, problem.t_s, asked)
        assert "Rodas" in trajectory.method, problem.name
        assert np.max(np.abs(trajectory.theta_rad[judged] - truth)) < asked, (problem.name, asked)


@pytest.mark.parametrize("push", [0.0, 8.0, -3.0])
@pytest.mark.parametrize("strength", [20.0, 600.0])
def test_overdamped_motion_is_reached_between_the_steps_too(strength, push):
    """The start counts: the velocity settles within a moment, and a first step over all of that moment would blur it."""
    rate = math.sqrt(9.8 / 0.5)
    effects = {
        "linear_drag": {"k_d_kg_per_s": 2 * 0.25 * rate * strength},
        "cosine_drive": {"f0_n": 0.5, "f_hz": 0.2, "phase_rad": 0.0},
    }
    scene = Scene(Pendulum(0.25, 0.5), Release(1.0, push), Environment(g_m_per_s2=9.8), effects)
    duration = 20.0 if strength < 100 else 0.6
    problem = Problem("stiff", "", scene, duration, 40, duration)
    judged, truth = true_angles(problem)
    for asked in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11):
        trajectory = simulate(scene, problem.t_s, asked)
        assert "Rodas" in trajectory.method
        assert np.max(np.abs(trajectory.theta_rad[judged] - truth)) < asked

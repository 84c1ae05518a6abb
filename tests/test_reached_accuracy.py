"""simulate against whole-number arithmetic on random scenes; a failure names the scene by its two numbers."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.cost.integrators import random_problem, true_angles
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

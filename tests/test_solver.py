"""A prepared solver gives what a single solve gives, whatever it was asked before."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from toolkit.errors import UsageError
from toolkit.motion import build_equation

P = {
    "mass_kg": 0.25,
    "length_m": 0.5,
    "g_m_per_s2": 9.8,
    "quadratic_drag.c_kg_per_m": 1e-3,
    "cosine_drive.f0_n": 0.15,
    "cosine_drive.f_hz": 0.15,
    "cosine_drive.phase_rad": 0.4,
}
EQUATION = build_equation(["quadratic_drag", "cosine_drive"])
T = np.linspace(0, 4, 41)
NAMES = ("theta0_rad", "length_m", "quadratic_drag.c_kg_per_m")


def test_what_was_asked_before_leaves_no_trace():
    solver = EQUATION.prepare(T, 1e-9, NAMES)
    for length, theta0 in ((0.5, 1.0), (0.5, -0.3), (5.0, 1.0), (0.5, 1.0), (0.4, 2.0)):
        p = {**P, "length_m": length}
        prepared, single = solver.solve(p, theta0, 0.1), EQUATION.solve(p, theta0, 0.1, T, 1e-12, NAMES)
        np.testing.assert_allclose(prepared.theta_rad, single.theta_rad, atol=1e-9)
        np.testing.assert_allclose(prepared.omega_rad_per_s, single.omega_rad_per_s, atol=2e-8)
        size = np.abs(single.d_theta).max(axis=0)
        np.testing.assert_allclose(prepared.d_theta / size, single.d_theta / size, atol=1e-7)
    first, second = solver.solve(P, 0.5, 0.0), solver.solve(P, 0.9, 0.0)
    assert not np.shares_memory(first.theta_rad, second.theta_rad)


def test_the_same_solve_gives_the_same_digits():
    """What a solver learns from a call does not leak into single solves."""
    chaos = {**P, "cosine_drive.f0_n": 2.0}
    first = EQUATION.solve(chaos, 1.0, 0.0, T, 1e-9).theta_rad
    EQUATION.solve(P, 0.1, 0.0, T, 1e-9)
    assert np.array_equal(first, EQUATION.solve(chaos, 1.0, 0.0, T, 1e-9).theta_rad)


def test_times_changed_in_place_are_seen():
    t = T.copy()
    EQUATION.solve(P, 1.0, 0.0, t, 1e-9)
    t *= 0.5
    half = EQUATION.solve(P, 1.0, 0.0, t, 1e-9).theta_rad
    np.testing.assert_allclose(half[::2], EQUATION.solve(P, 1.0, 0.0, T, 1e-9).theta_rad[:21], atol=2e-9)


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 15, 16, 17, 33, 40, 65, 500])
def test_the_number_of_samples_changes_no_digit(count):
    """Samples are read off in vectors of many widths, and beyond a step's end: each must come out as if it were alone."""
    t = np.linspace(0, 4, 500)
    all_of_them = EQUATION.solve(P, 1.0, 0.3, t, 1e-9, NAMES)
    few = EQUATION.solve(P, 1.0, 0.3, np.append(t[:count], 4.0), 1e-9, NAMES)
    for one, other in zip(few[1:5], all_of_them[1:5]):
        np.testing.assert_array_equal(one[:count], other[:count])
        np.testing.assert_array_equal(one[-1], other[-1])


def test_threads_do_not_share_memory():
    alone = {a: EQUATION.solve(P, a, 0.0, T, 1e-10).theta_rad for a in (0.5, 1.5)}
    wrong = []

    def work(angle):
        for _ in range(200):
            if not np.array_equal(EQUATION.solve(P, angle, 0.0, T, 1e-10).theta_rad, alone[angle]):
                wrong.append(angle)

    threads = [threading.Thread(target=work, args=(a,)) for a in alone]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_misuse():
    with pytest.raises(UsageError, match="sort them"):
        EQUATION.prepare([1.0, 0.5])
    with pytest.raises(UsageError, match="needs mass_kg"):
        EQUATION.prepare(T).solve({n: v for n, v in P.items() if n != "mass_kg"}, 1.0, 0.0)

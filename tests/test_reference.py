"""The truth that `cost integrators` measures with, held to exact solutions of mpmath and of paper and pencil."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from toolkit.cost._reference import ExactPendulum, solve_exactly


def test_bare_pendulum_is_the_elliptic_function():
    t = [0.5, 7.25, 30.0]
    theta, omega = solve_exactly(ExactPendulum(Fraction(9.8) / Fraction(0.5)), 3.1, 0.0, t)
    with mp.workdps(40):
        w = mp.sqrt(mp.mpf(9.8) / mp.mpf(0.5))
        m = mp.sin(mp.mpf(3.1) / 2) ** 2
        phase = [w * mp.mpf(s) + mp.ellipk(m) for s in t]
        exact = [float(2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", p, m=m))) for p in phase]
        rate = [float(2 * mp.sqrt(m) * w * mp.ellipfun("cn", p, m=m)) for p in phase]
    assert theta == exact
    assert np.allclose(omega, rate, rtol=1e-15)


@pytest.mark.parametrize(
    ("beta", "start", "turns"),
    [
        (0.1, 1.5, [1.21895006, 1.03428590, 0.90126648]),
        (0.01, 1.0, [0.98590037, 0.97222081, 0.95894158]),
        (0.5, 1.0, [0.58347709, 0.41680469, 0.32508580]),
    ],
)
def test_quadratic_drag_turns_where_the_exact_formula_says(beta, start, turns):
    t = np.linspace(0, 11, 1101)
    theta = np.array(solve_exactly(ExactPendulum(Fraction(1), beta=Fraction(beta)), start, 0.0, list(t))[0])
    size = np.abs(theta)
    tops = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    for top, expected in zip(tops, turns):
        near = np.polyfit(t[top - 1 : top + 2], size[top - 1 : top + 2], 2)
        assert near[2] - near[1] ** 2 / (4 * near[0]) == pytest.approx(expected, abs=3e-7)


def test_from_rest_on_either_side():
    problem = ExactPendulum(Fraction(1), beta=Fraction(1, 2))
    right, left = (solve_exactly(problem, s, 0.0, [1.0, 4.0, 9.0])[0] for s in (1.0, -1.0))
    assert right == pytest.approx([-x for x in left], abs=1e-15)


def test_drive_and_drag_against_mpmaths_own_integrator():
    problem = ExactPendulum(
        Fraction(1), Fraction(1, 2), drive=Fraction(3, 2), omega_f=Fraction(2, 3), phase=Fraction(1, 5)
    )
    theta, _ = solve_exactly(problem, 0.2, 0.0, [3.0])
    with mp.workdps(25):
        path = mp.odefun(
            lambda t, y: [y[1], mp.mpf(3) / 2 * mp.cos(2 * t / 3 + mp.mpf(1) / 5) - mp.sin(y[0]) - y[1] / 2],
            0, [mp.mpf(0.2), mp.mpf(0)],
        )  # fmt: skip
        assert theta[0] == pytest.approx(float(path(mp.mpf(3))[0]), abs=1e-15)


def test_frequency_in_hertz_is_exact():
    one = solve_exactly(ExactPendulum(Fraction(1), drive=Fraction(1), omega_f=Fraction(2 * math.pi)), 0.0, 0.0, [5.0])
    other = solve_exactly(ExactPendulum(Fraction(1), drive=Fraction(1), f_hz=Fraction(1)), 0.0, 0.0, [5.0])
    assert one[0] == pytest.approx(other[0], abs=1e-14)

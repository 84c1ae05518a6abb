"""A user's own formula: what it can say, and that hostile text is refused in one line with nothing executed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from independent import integrate

from toolkit import Scene, simulate
from toolkit.effects import check_parameters
from toolkit.errors import UsageError
from toolkit.motion import build_equation

P = {"mass_kg": 0.25, "length_m": 0.5, "g_m_per_s2": 9.81}
T = np.linspace(0, 4, 9)


def test_a_formula_that_repeats_an_effect_gives_the_same_motion():
    text = "-k * length_m**2 * omega - c * length_m**3 * abs(omega) * omega"
    mine = build_equation(["formula"], formulas={"formula": text})
    values = {**P, "formula.k": 0.05, "formula.c": 0.02}
    truth = integrate({**P, "linear_drag.k_d_kg_per_s": 0.05, "quadratic_drag.c_kg_per_m": 0.02}, 1.0, 0.0, T)
    solved = mine.solve(values, 1.0, 0.0, T, 1e-11, ["formula.k", "formula.c"])
    np.testing.assert_allclose(solved.theta_rad, truth, atol=1e-11)
    known = build_equation(["linear_drag", "quadratic_drag"]).solve(
        {**P, "linear_drag.k_d_kg_per_s": 0.05, "quadratic_drag.c_kg_per_m": 0.02}, 1.0, 0.0, T, 1e-11,
        ["linear_drag.k_d_kg_per_s", "quadratic_drag.c_kg_per_m"],
    )  # fmt: skip
    np.testing.assert_allclose(solved.d_theta, known.d_theta, atol=1e-9)


def test_functions_and_time():
    text = "a * sin(2*pi*t) * exp(-t) - b * tanh(omega) + 0 * sqrt(1 + theta**2) - 0.001 * omega ** 3"
    mine = build_equation(["formula"], formulas={"formula": text})
    from scipy.integrate import solve_ivp

    def slope(t, y):
        torque = 0.1 * math.sin(2 * math.pi * t) * math.exp(-t) - 0.02 * math.tanh(y[1]) - 0.001 * y[1] ** 3
        return y[1], -9.81 / 0.5 * math.sin(y[0]) + torque / (0.25 * 0.25)

    truth = solve_ivp(slope, (0, 4), (0.7, 0), "DOP853", T, rtol=1e-12, atol=1e-13).y[0]
    np.testing.assert_allclose(
        mine.solve({**P, "formula.a": 0.1, "formula.b": 0.02}, 0.7, 0.0, T, 1e-11).theta_rad, truth, atol=2e-11
    )


def test_in_a_scene():
    scene = Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.25, "length_m": 0.5},
            "release": {"theta0_rad": 0.4},
            "effects": {"formula": {"torque": "-a*theta", "a": 0.3}},
        }
    )
    assert Scene.from_dict(scene.to_dict()) == scene
    motion = simulate(scene, T)
    assert r"\theta" in motion.equation_latex
    assert np.abs(motion.theta_rad).max() <= 0.4 + 1e-12


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('echo hostile > /tmp/hostile')",
        "().__class__.__bases__[0].__subclasses__()",
        "theta.__class__",
        "theta.real",
        "open('x')",
        "eval('1')",
        "exec('1')",
        "print(theta)",
        "sin(theta, 2)",
        "sin(*theta)",
        "sin(x=theta)",
        "sin",
        "(lambda: 1)()",
        "[theta for theta in (1,)]",
        "theta if omega else 1",
        "theta < 1",
        "theta and omega",
        "f'{theta}'",
        "'text'",
        "b'x'",
        "1j * theta",
        "True",
        "None",
        "...",
        "theta := 3",
        "theta; omega",
        "import os",
        "theta ** 1000000",
        "9 ** 9 ** 9 ** 9",
        "theta ** omega",
        "2 ** theta",
        "theta ** (1 / 0)",
        "1e400",
        "1" * 400,
        "_theta",
        "__builtins__",
        "θ + 1",
        "theta @ omega",
        "theta // 2",
        "theta % 2",
        "theta << 60",
        "~theta",
        "not theta",
        "theta[0]",
        "{theta}",
        "",
        "   ",
        "(" * 300 + "1" + ")" * 300,
        "-" * 200 + "theta",
        "theta + " * 200_000 + "1",
        "a" * 1_000_000,
        "theta\x00",
        "sin(theta",
    ],
)
def test_hostile_formulas_are_refused_in_one_line(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError) as caught:
        check_parameters("formula", {"torque": text})
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300
    assert not list(tmp_path.iterdir())
    with pytest.raises(UsageError):
        build_equation(["formula"], formulas={"formula": text})


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, "needs torque"),
        ({"torque": 3}, "needs torque"),
        ({"torque": "-a*theta"}, "add a ="),
        ({"torque": "-a*theta", "a": "x"}, "finite number"),
        ({"torque": "-a*theta", "a": 1, "b": 2}, "does not use"),
        ({"torque": "-a*thetta", "a": 1}, "did you mean 'theta'"),
    ],
)
def test_tables(table, words):
    with pytest.raises(UsageError, match=words):
        check_parameters("formula", table)

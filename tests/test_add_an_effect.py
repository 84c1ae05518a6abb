"""docs/add-an-effect.md is true: its code block, put in as a file, is an effect that runs."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import toolkit.effects
from toolkit import Scene, simulate
from toolkit.effects import effect_names, load_effect
from toolkit.motion import build_equation

GUIDE = Path(__file__).resolve().parents[1] / "docs" / "add-an-effect.md"


def block(language):
    found = re.search(rf"```{language}\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert found
    return found.group(1)


@pytest.fixture
def table_magnet(tmp_path, monkeypatch):
    """The guide's file in a folder that the package also looks into, as if it had been added there."""
    (tmp_path / "table_magnet.py").write_text(block("python"), encoding="utf-8")
    monkeypatch.setattr(toolkit.effects, "__path__", [*toolkit.effects.__path__, str(tmp_path)])
    return load_effect("table_magnet")


def test_the_worked_example_runs(table_magnet):
    assert "table_magnet" in effect_names()
    scene = Scene.from_dict(tomllib.loads(block("toml")))
    t = np.linspace(0, 5, 51)
    motion = simulate(scene, t, 1e-10)
    assert "U" in motion.equation_latex

    def slope(_t, y):
        well = 2 * 0.05 * y[0] / 0.01 / (1 + y[0] ** 2 / 0.01) ** 2
        return y[1], -9.80665 / 0.5 * np.sin(y[0]) - well / (0.25 * 0.25)

    truth = solve_ivp(slope, (0, 5), (0.3, 0), "DOP853", t, rtol=1e-12, atol=1e-13).y[0]
    np.testing.assert_allclose(motion.theta_rad, truth, atol=2e-10)
    assert np.ptp(motion.energy_j) < 1e-9 * motion.energy_j[0]  # a well keeps the energy


def test_its_sensitivities_come_with_it(table_magnet):
    equation = build_equation(["table_magnet"])
    p = {
        "mass_kg": 0.25,
        "length_m": 0.5,
        "g_m_per_s2": 9.8,
        "table_magnet.depth_j": 0.05,
        "table_magnet.width_rad": 0.1,
    }
    t = np.linspace(0, 2, 5)
    solved = equation.solve(p, 0.3, 0.0, t, 1e-12, ["table_magnet.depth_j"])
    h = 1e-5
    far = [equation.solve({**p, "table_magnet.depth_j": 0.05 + s}, 0.3, 0.0, t, 1e-13).theta_rad for s in (h, -h)]
    np.testing.assert_allclose(solved.d_theta[:, 0], (far[0] - far[1]) / (2 * h), atol=1e-5)


def test_the_contract_of_effects_takes_it_as_it_is(table_magnet, monkeypatch):
    """As the guide says: nothing is listed for a new effect, no unit and no value either."""
    import test_effects as contract

    given = {f"table_magnet.{p.name}": contract.some_value(p) for p in table_magnet.parameters}
    monkeypatch.setattr(contract, "VALUES", contract.VALUES | given)
    contract.test_documented("table_magnet")
    contract.test_dimensionally_consistent("table_magnet")
    contract.test_stored_energy_belongs_to_the_torque("table_magnet")
    contract.test_absent_effect_is_not_in_the_code("table_magnet")


def test_without_the_file_there_is_no_such_effect():
    assert "table_magnet" not in effect_names()

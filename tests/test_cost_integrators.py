"""The bookkeeping of `cost integrators`, its peers and its truths; nothing here looks at a time."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from toolkit.cost import integrators
from toolkit.cost._peers import PEERS, peer
from toolkit.cost._work_precision import OURS, Measured, Run, ratios
from toolkit.cost.problems import exact_coefficients, problems, true_angles

BY_NAME = {p.name: p for p in problems()}


@pytest.mark.parametrize("name", ["P1", "P5", "D", "S", "L"])
def test_peers_and_we_agree_with_the_truth(name):
    """The peers solve the same equation as we do: both come to the truth as their tolerance falls."""
    problem = replace(BY_NAME[name], duration_s=4.0, samples=81)
    judged, truth = true_angles(problem)
    for method in ("solve", "simulate"):
        theta, _, route = integrators._ours(method, problem)(1e-9)
        assert route
        assert np.max(np.abs(theta[judged] - truth)) < 1e-9
    theta, evaluations, _ = peer("DOP853", problem)(1e-11)
    assert evaluations > 100
    assert np.max(np.abs(theta[judged] - truth)) < (1e-6 if name == "S" else 1e-9)


def test_p4_and_p3_are_the_problems_of_their_names():
    two_alpha, beta, gravity, drive, _ = (float(x) for x in exact_coefficients(BY_NAME["P4"].scene))
    assert two_alpha / 2 == pytest.approx(1000 * gravity**0.5)
    two_alpha, beta, gravity, drive, _ = (float(x) for x in exact_coefficients(BY_NAME["P3"].scene))
    assert (two_alpha, drive) == (0, 0)
    assert beta == pytest.approx(3e-4 * 0.5 / 0.05)


def test_ratios_compare_at_equal_accuracy():
    runs = (
        Run("P1", "solve", 1e-5, 2e-6, 1.0, 100),
        Run("P1", "simulate", 1e-5, 2e-6, 2.0, 100),
        Run("P1", "RK45", 1e-5, 1e-3, 5.0, 100),  # cheap but not accurate enough for any row
        Run("P1", "RK45", 1e-9, 1e-8, 400.0, 100),
        Run("P1", "DOP853", 1e-9, 1e-8, 300.0, 100),
        Run("P1", "odeint", 1e-6, 8e-6, 40.0, 100),
    )
    table = ratios(Measured((BY_NAME["P1"],), runs))
    first, second = table[0], next(r for r in table if r["error_rad"] == 1e-8)
    assert first["error_rad"] == 1e-5
    assert first["solve_ivp/solve"] == 300.0
    assert first["odeint/solve"] == 40.0
    assert first["solve_ivp/simulate"] == 150.0
    assert second["solve"] is None  # ours is only known to be good to 2e-6
    assert second["solve_ivp/solve"] is None


def test_measure_writes_tables_figure_and_text(tmp_path, monkeypatch):
    short = replace(BY_NAME["P1"], duration_s=2.0, quick_s=1.0, samples=41)
    monkeypatch.setattr(integrators, "problems", lambda: (short,))
    monkeypatch.setattr(integrators, "first_calls", lambda *_: {"P1 cold": 2.0, "P1 warm": 1.0, "P1 process": 1.5})
    text = integrators.measure(tmp_path, quick=True)
    assert "P1: cold 2.00, warm 1.00" in text
    rows = list(csv.DictReader((tmp_path / "integrators.csv").open(encoding="utf-8")))
    assert {r["method"] for r in rows} == {*OURS, *PEERS}
    assert all(float(r["error_rad"]) < 1e-2 and int(r["evaluations"]) > 0 for r in rows)
    found = {p.name for p in tmp_path.iterdir()}
    assert {"integrators.csv", "ratios.csv", "integrators.txt", "work_precision.png", "work_precision.svg"} <= found

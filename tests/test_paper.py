"""The paper again: its formulas, its misprints, its claims and the files that `paper` writes."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from toolkit.paper import reproduce_paper
from toolkit.paper.claims import _swellings, _turning_points, amplitude, weigh_claims
from toolkit.paper.misprints import driven_part, misprint_errors
from toolkit.paper.table1 import MODELS, SWEEPS, Case, solve_case


@pytest.fixture(scope="module")
def judgements():
    return {(j.claim, j.regime, j.phi, j.model): j for j in weigh_claims()}


def test_derived_18_and_19_solve_the_linear_equation():
    case, t = Case(), np.linspace(0, 20, 201)
    solved = solve_ivp(
        lambda t, y: (
            y[1],
            case.f0_n / (case.mass_kg * case.length_m) * math.cos(2 * math.pi * case.f_hz * t)
            - 2 * case.alpha_d_per_s * y[1]
            - case.omega_g_rad_per_s**2 * y[0],
        ),
        (0, 20), [0.0, 0.0], method="DOP853", t_eval=t, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    theta, rate = driven_part(case, t)
    assert np.max(np.abs(theta - solved.y[0])) < 1e-11
    assert np.max(np.abs(rate - solved.y[1])) < 1e-10


def test_misprints_are_as_wrong_as_published():
    theta, rate, between = misprint_errors()
    assert (round(theta, 3), round(rate, 3), round(between, 3)) == (0.060, 0.013, 0.135)


def test_both_models_start_alike_and_tension_is_newtons():
    t = np.linspace(0, 5, 501)
    case = Case()
    for phi in (0.0, math.pi / 2):
        small, full = (solve_case(case, model, phi, t) for model in MODELS)
        assert small.theta[0] == pytest.approx(full.theta[0], abs=1e-12)
        assert small.omega[0] == pytest.approx(full.omega[0], abs=1e-12)
        weight = case.mass_kg * case.g_m_per_s2
        centripetal = case.mass_kg * case.length_m * full.omega**2
        assert np.allclose(full.tension, weight * np.cos(full.theta) + centripetal, rtol=1e-12)
        assert np.allclose(
            small.tension, weight * (1 - small.theta**2 / 2) + case.mass_kg * case.length_m * small.omega**2
        )


def test_twelve_panels():
    assert sorted(p for s in SWEEPS for p in s.panels) == sorted(f"{i}{x}" for i in range(2, 8) for x in "ab")


def test_every_claim_is_weighed_everywhere(judgements):
    assert len(judgements) == 7 * 2 * 2 * 2
    assert {j.verdict for j in judgements.values()} == {"holds", "holds in part", "fails"}
    assert all(any(c.isdigit() for c in j.numbers) for j in judgements.values())


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("phi", ["0", "π/2"])
def test_verdicts_that_physics_decides(judgements, model, phi):
    # with the transient gone, the drive alone sets the period and θ₀ is forgotten
    assert judgements["C1", "steady", phi, model].verdict == "fails"
    assert "6.667, 6.667, 6.667 s" in judgements["C1", "steady", phi, model].numbers
    assert judgements["C6", "steady", phi, model].verdict == "fails"
    assert judgements["C1", "transient", phi, model].verdict == "holds"
    # far below resonance drag does not matter; the amplitude is f0/(m(g − ℓω_f²))
    assert judgements["C5", "steady", phi, model].verdict == "fails"
    assert judgements["C5", "transient", phi, model].verdict == "holds in part"
    assert judgements["C3", "steady", phi, model].verdict == "holds in part"


def test_amplitudes_turning_points_and_swellings_of_known_signals():
    t = np.arange(0, 60, 0.01)
    beat = np.cos(2 * np.pi * t) * np.cos(2 * np.pi * t / 20)
    assert amplitude(3 * np.cos(t)) == pytest.approx(3, rel=1e-4)
    tops = [time for time, _, is_top in _turning_points(t, np.cos(2 * np.pi * t)) if is_top]
    assert np.allclose(np.diff(tops), 1.0, atol=1e-6)
    spans = np.abs(np.diff([v for _, v, _ in _turning_points(t, beat)]))
    assert _swellings(spans) == 5  # the envelope |cos(2πt/20)| rises and falls again every 10 s; the last is cut off
    decay = np.exp(-0.1 * t) * np.cos(2 * np.pi * t)
    assert _swellings(np.abs(np.diff([v for _, v, _ in _turning_points(t, decay)]))) == 0


def test_files(tmp_path):
    text = reproduce_paper(tmp_path)
    names = {p.name for p in tmp_path.iterdir()}
    panels = {f"panel_{i}{x}.{kind}" for i in range(2, 8) for x in "ab" for kind in ("png", "svg")}
    overviews = {
        f"{stem}.{kind}" for stem in ("overview_phi_90", "overview_phi_0", "misprints") for kind in ("png", "svg")
    }
    assert names == panels | overviews | {"claims.csv"}
    rows = list(csv.DictReader((tmp_path / "claims.csv").open(encoding="utf-8")))
    assert len(rows) == 56
    assert set(rows[0]) == {"claim", "statement", "regime", "phi", "model", "verdict", "deciding_numbers"}
    assert "0.060 rad" in text
    assert text.count("steady") == 14


def test_both_models_come_to_the_same_verdicts(judgements):
    for (claim, regime, phi, model), judgement in judgements.items():
        if model == "small angle":
            assert judgement.verdict == judgements[claim, regime, phi, "full equation"].verdict

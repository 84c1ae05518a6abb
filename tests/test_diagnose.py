"""Verdicts: each check fires on the record that breaks its assumption and is silent on the one that does not."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from synthetic_swing import swing

from toolkit.checks import check_names
from toolkit.diagnose import diagnose
from toolkit.errors import UsageError
from toolkit.fit import fit_models
from toolkit.scene import Pendulum, Scene
from toolkit.series import ThetaSeries

CLEAN = {"theta0": 0.6, "duration_s": 40.0, "alpha_d": 0.01, "beta": 0.02}


@functools.cache
def clean() -> ThetaSeries:
    return swing(**CLEAN)


def verdicts(series: ThetaSeries, scene: Scene | None = None):
    return {f.assumption: f for f in diagnose(series, fit_models(series, scene), scene)}


@functools.cache
def clean_verdicts():
    return verdicts(clean())


def test_two_verdicts_come_first_and_always():
    found = diagnose(clean(), fit_models(clean(), models=["full_linear_drag"]))
    assert [f.assumption for f in found[:2]] == ["small_angle", "linear_drag"]
    with pytest.raises(UsageError, match="at least one fit"):
        diagnose(clean(), {})


def test_every_check_is_silent_on_a_clean_record():
    assert {"clock", "geometry", "frictionless_pivot", "no_drive", "taut_string", "white_residuals"} < set(
        check_names()
    )
    for name, finding in clean_verdicts().items():
        if name not in ("small_angle", "linear_drag"):
            assert finding.verdict == "holds", finding.sentence
        assert finding.sentence
        assert finding.words_key.startswith(name)


@pytest.mark.parametrize(
    ("case", "small_angle", "linear_drag"),
    [
        ({"theta0": 0.8, "alpha_d": 0.02}, "fails", "holds"),
        ({"theta0": 0.8, "alpha_d": 0.0, "beta": 0.1}, "fails", "fails"),
        ({"theta0": 0.05, "alpha_d": 0.05, "duration_s": 40}, "holds", "holds"),
        ({"theta0": 0.04, "alpha_d": 0.0, "beta": 2.0, "duration_s": 40, "noise_rad": 2e-4}, "holds", "fails"),
        ({"theta0": 0.8, "alpha_d": 0.005, "mu": 0.08}, "fails", "fails"),
        ({"theta0": 0.05, "alpha_d": 1e-5}, "holds", "not_distinguishable"),
        ({"theta0": 0.2, "alpha_d": 1e-5, "noise_rad": 2e-3}, "not_distinguishable", "not_distinguishable"),
    ],
    ids=[
        "large linear",
        "large quadratic",
        "small linear",
        "small quadratic",
        "friction",
        "no drag",
        "free omega hides it",
    ],
)
def test_verdicts(case, small_angle, linear_drag):
    found = verdicts(swing(**case))
    assert found["small_angle"].verdict == small_angle, found["small_angle"].sentence
    assert found["linear_drag"].verdict == linear_drag, found["linear_drag"].sentence


def test_where_it_fails():
    found = verdicts(swing(theta0=0.8, alpha_d=0.05, beta=0.1, duration_s=60))
    where = found["small_angle"].where
    assert 0.02 < where["amplitude_above_rad"] < 0.8
    assert where["t_start_s"] == 0.0
    drag = found["linear_drag"].where
    equal = drag["amplitude_equal_loss_rad"]
    assert equal == pytest.approx(3 * np.pi * 0.05 / (4 * 0.1 * 4.43), rel=0.15)
    assert 0 < drag["amplitude_above_rad"] < equal
    assert drag["t_stop_s"] < 60.0
    assert found["linear_drag"].words_key == "linear_drag.fails"
    always = verdicts(swing(theta0=0.8, alpha_d=0.002, beta=0.2, duration_s=20))["linear_drag"]
    assert always.words_key == "linear_drag.fails.throughout"
    assert "at every swing of this record" in always.sentence


def test_friction_fails_at_small_swings():
    finding = verdicts(swing(theta0=0.6, alpha_d=0.02, mu=0.01, duration_s=40))["linear_drag"]
    assert finding.verdict == "fails"
    assert "amplitude_below_rad" in finding.where
    assert finding.words_key == "linear_drag.fails.friction.throughout"
    assert "at every swing of this record" in finding.sentence


def test_pivot_friction_fires():
    assert (
        verdicts(swing(theta0=0.6, alpha_d=0.01, beta=0.01, mu=0.02, duration_s=40))["frictionless_pivot"].verdict
        == "fails"
    )


def test_correlated_residuals_fire():
    finding = verdicts(swing(**CLEAN, rho=0.9))["white_residuals"]
    assert finding.verdict == "fails"
    assert finding.evidence["inflation"] > 2


@pytest.mark.parametrize("kind", ["jump", "rate", "repeated"])
def test_clock_fires(kind):
    t, theta = clean().t_s.copy(), clean().theta_rad.copy()
    if kind == "jump":
        t[1000:] += 0.02
    elif kind == "rate":
        t[1200:] = t[1200] + (t[1200:] - t[1200]) * 1.002
    else:
        theta[5::6] = theta[4::6][: theta[5::6].size]
    found = verdicts(ThetaSeries(t, theta, clean().sigma_theta_rad))
    assert found["clock"].verdict == "fails"
    assert found["clock"].words_key == f"clock.{kind}"
    assert found["geometry"].verdict != "fails"
    if kind == "jump":
        assert found["clock"].where["t_start_s"] == pytest.approx(1000 / 60, abs=0.6)
        assert abs(found["clock"].evidence["jump_s"]) == pytest.approx(0.02, rel=0.1)


def test_angle_scale_fires_as_geometry_and_not_as_clock():
    found = verdicts(ThetaSeries(clean().t_s, clean().theta_rad * 1.03, clean().sigma_theta_rad))
    assert found["geometry"].verdict == "fails"
    assert found["geometry"].evidence["angle_scale"] == pytest.approx(0.03, rel=0.1)
    assert found["clock"].verdict != "fails"


def test_pivots_that_disagree_fire():
    told = ThetaSeries(
        clean().t_s, clean().theta_rad, clean().sigma_theta_rad, {"calibration": {"pivot_disagreement_sigma": 8.0}}
    )
    assert verdicts(told)["geometry"].words_key == "geometry.pivots"


def test_drive_fires_unless_the_scene_names_it():
    length = 9.80665 / 4.43**2
    series = swing(**CLEAN, drive=(0.05, 0.31))
    assert verdicts(series)["no_drive"].where["frequency_hz"] == pytest.approx(0.31, abs=0.01)
    scene = Scene(
        pendulum=Pendulum(0.1, length),
        effects={"cosine_drive": {"f0_n": 0.05 * 0.1 * length, "f_hz": 0.31, "phase_rad": 0.0}},
    )
    found = verdicts(series, scene)
    assert "no_drive" not in found
    assert found["white_residuals"].verdict == "holds"


def test_slack_string_fires_only_above_the_horizontal():
    assert "taut_string" not in clean_verdicts()
    assert verdicts(swing(theta0=2.6, alpha_d=0.03))["taut_string"].verdict == "fails"
    assert verdicts(swing(theta0=1.55, alpha_d=0.03)).get("taut_string") is None


@pytest.mark.parametrize("name", ["yyz/lab1_tracker.txt", "jlefebvre/q2_data.txt"])
def test_real_recordings(shared_data, name):
    table = np.loadtxt(shared_data / name, skiprows=1, usecols=(0, 1))
    theta = np.radians(table[:, 1]) if "yyz" in name else table[:, 1]
    found = verdicts(ThetaSeries(table[:, 0], theta).between(0, 100))
    assert found["small_angle"].verdict == "fails"
    assert found["linear_drag"].verdict == "fails"
    assert 0 < found["small_angle"].where["amplitude_above_rad"] < 0.5
    reached = np.abs(theta[table[:, 0] < 100])
    assert 0 < found["linear_drag"].where["amplitude_above_rad"] < reached.max()


def drifting_clock() -> ThetaSeries:
    """The clock of yyz's second run in the extreme: its drift hides what the amplitude does to the period."""
    series = swing(theta0=0.35, alpha_d=0.02, duration_s=60, fps=30, noise_rad=2e-3)
    rate = 1 - (0.35 * np.exp(-0.02 * series.t_s)) ** 2 / 16  # steps of time that make every period alike
    t = np.concatenate([[0.0], np.cumsum(rate[1:] * np.diff(series.t_s))])
    return ThetaSeries(t, series.theta_rad, series.sigma_theta_rad)


def test_small_angles_better_than_the_exact_equation_are_not_believed():
    finding = verdicts(drifting_clock())["small_angle"]
    assert finding.verdict == "not_distinguishable"
    assert finding.words_key == "small_angle.contradicted"
    assert abs(finding.evidence["period_growth_per_rad2"]) < 0.02


def scaled() -> ThetaSeries:
    return ThetaSeries(clean().t_s, clean().theta_rad * 1.03, clean().sigma_theta_rad)


def late() -> ThetaSeries:
    t = clean().t_s.copy()
    t[1000:] += 0.02
    return ThetaSeries(t, clean().theta_rad, clean().sigma_theta_rad)


BREAKING = {
    "clock": late,
    "frictionless_pivot": lambda: swing(theta0=0.6, alpha_d=0.01, beta=0.01, mu=0.02, duration_s=40),
    "geometry": scaled,
    "linear_drag": lambda: swing(theta0=0.8, alpha_d=0.0, beta=0.1),
    "no_drive": lambda: swing(**CLEAN, drive=(0.05, 0.31)),
    "small_angle": lambda: swing(theta0=0.8),
    "taut_string": lambda: swing(theta0=2.6, alpha_d=0.03),
    "white_residuals": lambda: swing(**CLEAN, rho=0.9),
}
"""For each check a record that breaks its assumption; a new check needs its own here."""


@functools.cache
def small_verdicts():
    return verdicts(swing(theta0=0.05, alpha_d=0.05, duration_s=40))


def test_every_check_has_a_record_that_breaks_it():
    assert set(check_names()) == set(BREAKING)


@pytest.mark.parametrize("name", sorted(BREAKING))
def test_a_check_fires_where_its_assumption_breaks_and_is_silent_where_it_holds(name):
    finding = verdicts(BREAKING[name]())[name]
    assert finding.verdict == "fails", finding.sentence
    assert finding.remedy
    assert finding.words_key.startswith(name)
    silent = small_verdicts() if name in ("small_angle", "linear_drag") else clean_verdicts()
    assert name not in silent or silent[name].verdict == "holds"


def test_a_record_may_begin_before_zero():
    """As where a rolling shutter reads the bob's row before the middle of the first frame."""
    t = np.arange(600) / 60
    theta = 0.3 * np.exp(-0.02 * t) * np.cos(4.4 * t) + np.random.default_rng(1).normal(0, 1e-3, t.size)
    verdicts = []
    for begin_s in (0.0, -0.003):
        series = ThetaSeries(t + begin_s, theta, np.full(t.size, 1e-3))
        found = diagnose(series, fit_models(series, Scene()), Scene())
        verdicts.append([(finding.assumption, finding.verdict) for finding in found])
    assert verdicts[0] == verdicts[1]

"""Rows of a picture that are read one after the other: what is not known of it is in the fit, and takes no law of drag for another."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from independent import integrate
from scipy.interpolate import CubicSpline
from test_view import strings

from toolkit import calibrate, read_series, track
from toolkit.calibrate import write_calibration_json
from toolkit.checks.evidence import Evidence
from toolkit.checks.linear_drag import check
from toolkit.fit import choose_model, fit, fit_models
from toolkit.fitting.problem import pose
from toolkit.render import stage
from toolkit.scene import Scene
from toolkit.series import ThetaSeries
from toolkit.track import Track
from toolkit.tracking.geometry.swing import start_swing
from toolkit.tracking.geometry.view import NAMES, View
from toolkit.tracking.geometry.view_fit import fit_view

ALPHA, OMEGA = 0.004, math.sqrt(9.8 / 0.7)
U_S = 0.008
"""Of the time to read one string's length of rows: a phone of 20 ms that is known to 6 ms, as the classroom's is."""


@cache
def motion(beta: float = 0.0) -> CubicSpline:
    """θ(t) of a release at 0.3 rad, by SciPy."""
    p = {"mass_kg": 1.0, "length_m": 0.7, "g_m_per_s2": 9.8, "linear_drag.k_d_kg_per_s": 2 * ALPHA}
    p["quadratic_drag.c_kg_per_m"] = beta / 0.7
    t = np.arange(0, 12.2, 1e-3)
    return CubicSpline(t, integrate(p, 0.3, 0.0, t, rtol=1e-11))


def filmed(seed: int, told: bool = True, beta: float = 0.0, psi: float = 0.0) -> tuple[ThetaSeries, float]:
    """A film of it, its times wrong by a row time drawn from the prior, and that row time."""
    rng = np.random.default_rng(seed)
    row_time = U_S * rng.normal()
    t = 0.05 + np.arange(357) / 30
    when = t.copy()
    for _ in range(30):  # the bob is in the row that is read when it is in that row
        when = t + row_time * (np.cos(motion(beta)(when) - psi) - np.cos(psi))
    theta = motion(beta)(when) + 1e-4 * rng.normal(size=t.size)
    meta = {"row_time_u_s": U_S, "row_direction_rad": psi} if told else {}
    return ThetaSeries(t - t[0], theta, np.full(t.size, 1e-4), meta), row_time


def judged(series: ThetaSeries):
    fits = fit_models(series)
    return check(Evidence(series, fits, Scene(), choose_model(fits)))


def test_a_row_time_is_found_within_its_error_bar_and_widens_those_of_others():
    pulls = []
    for seed in range(60):
        series, truth = filmed(seed, psi=0.3)
        found = fit(series).parameters
        true = {"alpha_d": ALPHA, "omega_g": OMEGA, "row_time": truth, "angle_scale": 0.0}
        pulls.append([(found[n].value - true[n]) / found[n].stderr for n in found if n in true])
    assert np.abs(np.mean(pulls, axis=0)).max() < 4 / math.sqrt(60)
    assert np.sqrt(np.mean(np.square(pulls), axis=0)).min() > 0.75
    assert np.sqrt(np.mean(np.square(pulls), axis=0)).max() < 1.35


def test_rows_read_one_after_the_other_are_not_taken_for_another_law_of_drag():
    """Of 100 films of linear drag some 8 have p < 0.05, as of records without a row time (the better of two rivals counts): more
    than 14 come once in a hundred times. Untold, most are said to fail."""
    chances = {told: [judged(filmed(s, told)[0]).evidence["p_value"] for s in range(100)] for told in (True, False)}
    assert np.sum(np.array(chances[True]) < 0.05) <= 14
    assert min(chances[True]) > 5e-4
    assert np.sum(np.array(chances[False]) < 5e-4) > 50


def test_drag_that_is_not_linear_is_still_found():
    for seed in range(5):
        finding = judged(filmed(seed, beta=0.02)[0])
        assert finding.verdict == "fails"
        assert finding.evidence["quadratic_share_at_start"] == pytest.approx(0.70, abs=0.25)


def test_the_jacobian_is_the_slope_of_what_the_camera_sees():
    series, _ = filmed(3, psi=0.3)
    problem = pose(series, Scene(), "full_linear_quadratic_drag", priors={"angle_scale": 0.01, "time_scale": 1e-3})
    values = {**problem.values, "alpha_d": 0.01, "beta": 0.02, "theta0": 0.3, "phi": 1.5, "omega_g": 3.7}
    values |= {"angle_scale": 0.01, "time_scale": 1e-3, "theta_offset": 0.01, "row_time": 0.02}
    _, by, _ = problem.predict(values, problem.free)
    for i, name in enumerate(problem.free):
        step = 1e-5 * max(abs(values[name]), 0.01)
        up, down = (problem.predict({**values, name: values[name] + s * step}, ())[0] for s in (1, -1))
        assert np.abs((up - down) / (2 * step) - by[:, i]).max() < 1e-5 * np.abs(by[:, i]).max() + 1e-6, name


def test_a_series_that_does_not_tell_has_no_row_time():
    assert "row_time" not in fit(filmed(0, told=False)[0]).parameters
    held = fit(filmed(0)[0], fixed={"row_time": 0.0})
    assert held.parameters["row_time"].fixed
    assert held.chi2 == pytest.approx(fit(filmed(0, told=False)[0]).chi2, rel=1e-9)


def test_models_are_compared_with_what_their_priors_cost():
    series, _ = filmed(1)
    result = fit(series)
    pull = result.parameters["row_time"].value / U_S
    assert result.prior_chi2 == pytest.approx(pull**2)
    assert result.aic == pytest.approx(result.chi2 / result.noise["inflation"] ** 2 + pull**2 + 2 * len(result.free))


@pytest.mark.parametrize(("along_x", "psi"), [(False, -0.1), (True, math.pi / 2 - 0.1)])
def test_the_rows_of_a_turned_camera(along_x, psi):
    """Pivot in the middle of 640×480, a string of 200 px, the picture turned by 0.1 rad."""
    values = np.zeros(len(NAMES))
    values[:4], values[9], values[12] = (319.5, 239.5, 200.0, 0.1), 1.0, -0.7
    readout = np.array([0.010, 0.014])
    samples = np.tile(values, (2, 1))
    samples[:, NAMES.index("readout")] = readout
    view = View(values, np.zeros((19, 19)), samples, np.array([0.5, 0.5]), (), (319.5, 239.5), 0.0, 1.0, along_x)
    length, turned = view.rows_by_angle(np.array([-0.2, 0.2]))
    assert length == pytest.approx(200 / (639 if along_x else 479))
    assert turned == pytest.approx(psi)
    assert (view.readout_s, view.readout_u_s) == pytest.approx((0.012, 0.002))


def seen_through_a_camera(seed: int, c_kg_per_m: float = 0.0) -> ThetaSeries:
    """12 s of a bob, before a camera as the priors have them: exact places with noise, the string's lines."""
    rng = np.random.default_rng(seed)
    yaw, pitch, k1, sway = rng.normal(0, (0.12, 0.08, 0.02, 0.02))
    readout = float(np.clip(abs(rng.normal(0, 0.015)), 1e-3, 0.03))
    theta0 = float(rng.choice([0.15, 0.25, 0.4, 0.6]))
    away = {"amplitude_rad": abs(sway) * theta0, "phase_rad": float(rng.uniform(0, 6.28)), "distance_m": 2.0}
    camera = {
        "width_px": 640,
        "height_px": 480,
        "fps": 30,
        "duration_s": 12,
        "px_per_m": 620,
        "pivot_px": [318.0, 30.5],
    }
    camera |= {"rolling_shutter": {"readout_s": readout}, "lens_distortion": {"k1": k1}, "out_of_plane": away}
    camera |= {"perspective": {"yaw_rad": yaw, "pitch_rad": pitch, "distance_m": 2.0}}
    table = {
        "pendulum": {"mass_kg": 0.1, "length_m": 0.6, "bob_radius_m": 0.02},
        "release": {"theta0_rad": theta0},
        "effects": {"linear_drag": {"k_d_kg_per_s": 1e-3}, "quadratic_drag": {"c_kg_per_m": c_kg_per_m}},
        "camera": camera,
    }
    studio = stage(Scene.from_dict(table))
    t, n, sigma = studio.truth.stamp_s, studio.truth.t_s.size, np.full(studio.truth.t_s.size, 0.03)
    x, y = studio.truth.x_px + rng.normal(0, 0.03, n), studio.truth.y_px + rng.normal(0, 0.03, n)
    view = fit_view(t, x, y, sigma, sigma, start_swing(t, x, y), (640, 480), strings(studio, t[::3], rng))
    assert view is not None
    frames, ok, pivot = np.arange(n), np.full(n, "ok"), (view.pivot_px, view.pivot_sigma_px)
    meta = {"view": view, "width_px": 640, "height_px": 480}
    return calibrate(Track(frames, t, x, y, sigma, sigma, ok, 12.0, *pivot, "disc", meta))


@pytest.mark.slow
def test_cameras_of_all_kinds_are_not_taken_for_another_law_of_drag():
    """Tilt, lens, swing in depth and shutter at once. By chance, one film in three such sets has p < 0.01. Told neither what the times
    share nor what of σ returns with the angle, four in this have."""
    told, untold = [], []
    for seed in range(30):
        series = seen_through_a_camera(seed)
        bare = {k: v for k, v in series.meta.items() if k not in ("row_time_u_s", "sigma_common_share")}
        told.append(judged(series).evidence["p_value"])
        untold.append(judged(replace(series, meta=bare)).evidence["p_value"])
    assert np.sum(np.array(told) < 0.01) <= 2
    assert np.sum(np.array(untold) < 0.01) >= 4


def test_quadratic_drag_is_found_through_cameras_of_all_kinds():
    assert [judged(seen_through_a_camera(seed, 4e-3)).verdict for seed in range(5)] == ["fails"] * 5


@pytest.fixture(scope="module")
def classroom() -> ThetaSeries:
    """The sample, whose phone reads its rows in 20 ms."""
    return calibrate(track(Path(__file__).resolve().parents[1] / "data" / "samples" / "classroom.mp4"))


def test_the_classroom_is_not_told_what_its_clip_cannot_tell(classroom):
    """A third of its drag is quadratic, which 12 s and 3 % of decay cannot show: its exact θ with the same noise cannot either.
    Taken for read at once, or with a readout a little off and taken for exact, it was said to fail, and all of it to be quadratic."""
    calibration = classroom.meta["calibration"]
    assert abs(calibration["readout_s"] - 0.020) < 2 * calibration["readout_u_s"]
    assert 0.002 < calibration["readout_u_s"] < 0.010
    assert classroom.meta["row_time_u_s"] == pytest.approx(calibration["readout_u_s"] * 0.7 * 700 / 359, rel=0.01)
    assert judged(classroom).verdict == "not_distinguishable"
    untold = ThetaSeries(classroom.t_s, classroom.theta_rad, classroom.sigma_theta_rad)
    assert judged(untold).evidence["p_value"] < 0.2 * judged(classroom).evidence["p_value"]
    found = fit(classroom, model="full_linear_quadratic_drag").parameters["row_time"]
    assert found.value == pytest.approx((0.020 - calibration["readout_s"]) * 0.7 * 700 / 359, abs=2 * found.stderr)


def test_theta_csv_is_read_with_the_calibration_beside_it(classroom, tmp_path):
    classroom.to_csv(tmp_path / "theta.csv")
    write_calibration_json(classroom, tmp_path / "calibration.json")
    back = read_series(tmp_path / "theta.csv")
    for name in ("row_time_u_s", "row_direction_rad", "angle_scale_relative_u", "vertical_sigma_rad"):
        assert back.meta[name] == classroom.meta[name]
    assert fit(back).parameters["alpha_d"] == fit(classroom).parameters["alpha_d"]
    classroom.to_csv(tmp_path / "alone.csv")  # of another name: who knows whose calibration that is
    assert "row_time_u_s" not in read_series(tmp_path / "alone.csv").meta
    for unfit in ("{", "[1]", "[" * 100_000, json.dumps({"row_time_u_s": "much"})):
        (tmp_path / "calibration.json").write_text(unfit, encoding="utf-8")
        assert "row_time_u_s" not in read_series(tmp_path / "theta.csv").meta

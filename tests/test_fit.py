"""fit, fit_models, choose_model: truth comes back within its error bars, in every regime; failures are results."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk
from synthetic_swing import swing

from toolkit.errors import UsageError
from toolkit.fit import choose_model, fit, fit_models
from toolkit.fitting.descent import descend
from toolkit.fitting.problem import pose
from toolkit.fitting.solve import _verdict
from toolkit.models import STANDARD
from toolkit.scene import Environment, Pendulum, Scene
from toolkit.series import ThetaSeries
from toolkit.simulate import simulate

OMEGA = math.sqrt(9.80665 / 0.5)


def pulls(result, **truth):
    return {n: (result.parameters[n].value - v) / result.parameters[n].stderr for n, v in truth.items()}


def within(result, sigmas=4.0, **truth):
    assert result.success, result.message
    for name, pull in pulls(result, **truth).items():
        assert abs(pull) < sigmas, (name, pull)


def test_full_model_returns_the_truth():
    truth = {"alpha_d": 0.02, "beta": 0.05, "theta0": 1.0, "phi": 1.2, "omega_g": 4.43, "theta_offset": 0.01}
    result = fit(swing(theta0=1.0, beta=0.05), model="full_linear_quadratic_drag")
    within(result, **truth)
    assert result.reduced_chi2 == pytest.approx(1, abs=0.2)
    assert result.lmfit.success
    assert result.covariance.shape == (len(result.free), len(result.free))


@pytest.mark.parametrize(
    "case",
    [
        {"theta0": 0.02, "noise_rad": 1e-4},
        {"theta0": 1.5, "duration_s": 60},
        {"theta0": 2.7, "duration_s": 40, "fps": 120},
        {"theta0": 0.6, "alpha_d": 0.32},
        {"theta0": 0.5, "duration_s": 1.0},
        {"theta0": 0.5, "duration_s": 150, "alpha_d": 0.003, "fps": 20},
        {"theta0": 0.8, "phi": -2.5, "fps": 8},
        {"theta0": 0.5, "alpha_d": 5.5, "duration_s": 4, "phi": 1.4, "noise_rad": 1e-4},
    ],
    ids=[
        "tiny",
        "86 degrees",
        "155 degrees",
        "the paper's damping",
        "less than a period",
        "100 periods",
        "8 fps",
        "overdamped",
    ],
)
def test_every_regime_starts_from_the_data_alone(case):
    series = swing(**case)
    full = {"theta0": 0.5, "phi": 1.2, "omega_g": 4.43, "alpha_d": 0.02, **case}
    truth = {name: full[name] for name in ("theta0", "phi", "omega_g", "alpha_d")}
    within(fit(series, model="full_linear_drag"), **truth)


def test_gaps_and_uneven_times():
    rng = np.random.default_rng(3)
    t = np.sort(rng.uniform(0, 40, 900))
    t = t[(t < 6) | (t > 15)]
    within(
        fit(swing(t_s=t, beta=0.02), model="full_linear_quadratic_drag"),
        theta0=0.5,
        phi=1.2,
        omega_g=4.43,
        alpha_d=0.02,
        beta=0.02,
    )


def test_times_that_start_late_or_before_zero():
    series = swing(theta0=0.4)
    late = ThetaSeries(series.t_s + 1000.0, series.theta_rad, series.sigma_theta_rad)
    within(fit(late), theta0=0.4, omega_g=4.43)
    assert fit(late).noise["start_s"] == 1000.0


@pytest.mark.parametrize("alpha", [0.3, 4.2, 9.0], ids=["underdamped", "nearly critical", "overdamped"])
def test_papers_model_in_every_regime(alpha):
    series = swing(theta0=0.05, alpha_d=alpha, small_angle=True, duration_s=6, noise_rad=1e-5, offset=0.0, phi=1.0)
    result = fit(series, model="small_angle_linear_drag", fixed={"omega_g": 4.43, "theta_offset": 0.0})
    assert result.success
    assert result.free == ("alpha_d", "theta0", "phi")
    assert result.parameters["alpha_d"].value == pytest.approx(alpha, rel=2e-3)
    assert result.reduced_chi2 < 1.5


@pytest.mark.parametrize("alpha", [4.43, 4.429])
def test_critical_damping_is_fitted_or_said(alpha):
    series = swing(theta0=0.05, alpha_d=alpha, small_angle=True, duration_s=4, noise_rad=1e-5, offset=0.0, phi=1.0)
    for held in ({}, {"omega_g": 4.43, "theta_offset": 0.0}):
        result = fit(series, model="small_angle_linear_drag", fixed=held)
        assert (result.success and result.reduced_chi2 < 1.5) or "near critical" in result.message
        assert np.all(np.isfinite(result.covariance))


def test_paper_with_given_length_fits_k_d_theta0_phi():
    series = swing(theta0=0.03, omega_g=OMEGA, alpha_d=0.32, small_angle=True, noise_rad=1e-4)
    scene = Scene(pendulum=Pendulum(mass_kg=0.25, length_m=0.5))
    result = fit(series, scene, "small_angle_linear_drag")
    assert result.parameters["k_d"].value == pytest.approx(0.16, rel=0.01)
    assert result.parameters["k_d"].unit == "kg/s"
    assert result.parameters["length"].fixed
    assert result.derived["alpha_d"].value == pytest.approx(0.32, rel=0.01)


def test_coefficients_in_the_scenes_units():
    scene = Scene(pendulum=Pendulum(mass_kg=0.05, length_m=0.5))
    series = swing(theta0=0.8, omega_g=OMEGA, alpha_d=0.02, beta=0.05, duration_s=40)
    result = fit(series, scene, "full_linear_quadratic_drag", free=("length",))
    within(result, k_d=2 * 0.05 * 0.02, c=0.05 * 0.05 / 0.5, length=0.5)
    assert result.derived["g_from_length"].value == pytest.approx(
        9.80665, abs=5 * result.derived["g_from_length"].stderr
    )


def test_without_mass_no_k_d_is_invented():
    result = fit(swing(), Scene(pendulum=Pendulum(length_m=9.80665 / 4.43**2)))
    assert "k_d" not in result.parameters
    assert "alpha_d" in result.parameters
    free = fit(swing())
    assert free.derived["equivalent_length"].value == pytest.approx(9.80665 / 4.43**2, rel=1e-4)


def test_drive_held_and_fitted():
    m, length = 0.25, 0.5
    scene = Scene(
        pendulum=Pendulum(m, length), effects={"cosine_drive": {"f0_n": 0.15, "f_hz": 0.15, "phase_rad": 0.0}}
    )
    series = swing(theta0=0.6, omega_g=OMEGA, alpha_d=0.32, drive=(0.15 / (m * length), 0.15))
    within(fit(series, scene, "full_linear_drag"), k_d=0.16, theta0=0.6, phi=1.2)
    wrong = Scene(
        pendulum=Pendulum(m, length), effects={"cosine_drive": {"f0_n": 0.12, "f_hz": 0.155, "phase_rad": 0.1}}
    )
    found = fit(series, wrong, "full_linear_drag", free=("f0", "f", "drive_phase"))
    within(found, k_d=0.16, f0=0.15, f=0.15, drive_phase=0.0)


def test_drag_is_never_negative():
    for seed in range(4):
        result = fit(swing(alpha_d=0.0, seed=seed, duration_s=6), model="full_linear_quadratic_coulomb")
        assert all(result.parameters[n].value >= 0 for n in ("alpha_d", "beta", "mu"))
        assert result.success


def test_wrong_length_is_freed_and_said():
    scene = Scene(pendulum=Pendulum(mass_kg=0.1, length_m=0.43))
    fits = fit_models(swing(theta0=0.4, omega_g=OMEGA), scene)
    best = fits[choose_model(fits)]
    assert best.parameters["length"].value == pytest.approx(0.5, abs=1e-4)
    assert any("contradicts" in warning for warning in best.warnings)


def test_right_length_stays_held():
    scene = Scene(pendulum=Pendulum(mass_kg=0.1, length_m=0.5))
    fits = fit_models(swing(theta0=0.4, omega_g=OMEGA), scene)
    assert all(result.parameters["length"].fixed for result in fits.values())


@pytest.mark.parametrize("sigma_known", [True, False])
def test_choose_model_finds_the_drag(sigma_known):
    cases = {
        "full_linear_drag": {"alpha_d": 0.03},
        "full_quadratic_drag": {"alpha_d": 0.0, "beta": 0.1},
        "full_linear_quadratic_drag": {"alpha_d": 0.02, "beta": 0.05},
    }
    for name, drag in cases.items():
        fits = fit_models(swing(theta0=0.8, duration_s=40, sigma_known=sigma_known, **drag))
        assert tuple(fits) == STANDARD
        assert choose_model(fits) == name
        assert fits[name].reduced_chi2 == pytest.approx(1, abs=0.15)
        assert fits["small_angle_linear_drag"].reduced_chi2 > 10


def test_angle_scale_prior_widens_theta0_only_as_it_should():
    series = swing(theta0=0.2)
    told = ThetaSeries(series.t_s, series.theta_rad, series.sigma_theta_rad, {"angle_scale_relative_u": 0.01})
    result = fit(told, model="small_angle_linear_drag")
    assert result.parameters["theta0"].stderr == pytest.approx(0.01 * result.parameters["theta0"].value, rel=0.05)
    assert result.parameters["omega_g"].stderr == pytest.approx(
        fit(series, model="small_angle_linear_drag").parameters["omega_g"].stderr, rel=0.1
    )


def test_a_small_angle_model_is_not_preferred_where_its_omega_is_off():
    series = swing(theta0=0.35, noise_rad=3e-3, duration_s=10, fps=20, alpha_d=0.01)
    fits = fit_models(series)
    small, full = fits["small_angle_linear_drag"], fits["full_linear_drag"]
    assert small.aic < full.aic + 10
    assert abs(small.parameters["omega_g"].value / 4.43 - 1) > 5 * small.parameters["omega_g"].stderr / 4.43
    assert choose_model(fits) == "full_linear_drag"
    assert choose_model({"small_angle_linear_drag": small}) == "small_angle_linear_drag"


@pytest.mark.parametrize("sigma_known", [True, False])
def test_correlated_residuals_do_not_pull_a_prior(sigma_known):
    series = swing(theta0=0.4, duration_s=15, fps=30, rho=0.99, noise_rad=5e-3, seed=2)
    sigma = np.full(len(series), 5e-4) if sigma_known else None
    told = ThetaSeries(series.t_s, series.theta_rad, sigma, {"angle_scale_relative_u": 0.03})
    result = fit(told)
    scale = result.parameters["angle_scale"]
    assert abs(scale.value) < 0.06
    assert 0.015 < scale.stderr <= 0.031
    within(result, theta0=0.4, omega_g=4.43)


def test_a_prior_that_the_record_contradicts_is_said():
    series = swing(theta0=0.8)
    told = ThetaSeries(series.t_s, 1.05 * series.theta_rad, series.sigma_theta_rad, {"angle_scale_relative_u": 0.005})
    result = fit(told)
    assert result.parameters["angle_scale"].value == pytest.approx(0.05, abs=0.01)
    (said,) = [warning for warning in result.warnings if warning.key == "fit.prior_left"]
    assert said.startswith("angle_scale left what was measured")


def test_drags_that_would_be_negative_end_where_the_simpler_model_does():
    series = swing(theta0=0.07, alpha_d=1e-6, noise_rad=3e-3, duration_s=22, fps=20, seed=4)
    both = fit(series, model="full_linear_quadratic_coulomb")
    drags = ("alpha_d", "beta", "mu")
    alone = [fit(series, model=m).chi2 for m in ("full_linear_drag", "full_quadratic_drag", "full_undamped")]
    assert both.success
    assert all(both.parameters[name].value >= 0 for name in drags)
    assert both.chi2 <= min(alone) + 1e-3
    assert np.all(np.isfinite(both.covariance))


def test_outliers_and_robust_loss():
    series = swing(theta0=0.5)
    theta = series.theta_rad.copy()
    theta[::40] += 0.3
    bad = ThetaSeries(series.t_s, theta, series.sigma_theta_rad)
    plain, robust = (fit(bad, loss=loss).parameters["theta_offset"].value for loss in ("linear", "soft_l1"))
    assert abs(robust - 0.01) < 0.2 * abs(plain - 0.01)


def test_time_jitter_is_allowed_for():
    rng = np.random.default_rng(0)
    series = swing(theta0=0.6, noise_rad=1e-4)
    jitter = np.sort(series.t_s + rng.normal(size=len(series)) * 1e-3)
    assert np.all(np.diff(jitter) > 0)
    record = ThetaSeries(jitter, series.theta_rad, series.sigma_theta_rad)
    assert fit(record).reduced_chi2 > 50
    assert fit(record, time_sigma_s=1e-3).reduced_chi2 == pytest.approx(1, abs=0.3)


def test_failures_are_results_with_a_remedy():
    short = swing().between(0, 0.05)
    result = fit(short, model="full_linear_quadratic_coulomb")
    assert not result.success
    assert "record for longer" in result.message
    assert result.message.key == "fit.too_few_points"
    assert result.message.values == {"points": len(short), "parameters": 7}
    assert pickle.loads(pickle.dumps(result.message)).values == result.message.values
    rng = np.random.default_rng(1)
    noise = ThetaSeries(np.arange(300) / 30.0, rng.normal(size=300))
    assert not fit(noise).success
    assert fit(noise).message
    assert choose_model({"full_linear_drag": result}) == "full_linear_drag"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"model": "nothing"}, "unknown model"),
        ({"loss": "square"}, "unknown loss"),
        ({"fixed": {"k_d": 0.1}}, "no parameter 'k_d'"),
        ({"free": ("length",)}, "no length to free"),
        ({"priors": {"angle_scale": -1.0}}, "positive"),
    ],
)
def test_misuse(options, words):
    with pytest.raises(UsageError, match=words):
        fit(swing(duration_s=2), **options)


def test_gravity_of_the_place_is_used():
    scene = Scene(environment=Environment(g_m_per_s2=9.783))
    result = fit(swing(), scene)
    assert result.derived["equivalent_length"].value == pytest.approx(9.783 / 4.43**2, rel=1e-4)


def test_random_starts_reach_the_same_minimum():
    series = swing(theta0=1.0, beta=0.05, duration_s=30)
    best = fit(series, model="full_linear_quadratic_drag")
    truth = {n: best.parameters[n].value for n in best.free}
    rng = np.random.default_rng(7)
    for _ in range(8):
        start = {n: v * 2 ** rng.uniform(-1, 1) for n, v in truth.items()}
        assert fit(series, model="full_linear_quadratic_drag", start=start).chi2 == pytest.approx(best.chi2, rel=1e-6)


def test_coverage_on_forty_records():
    found = []
    for seed in range(40):
        result = fit(swing(theta0=0.4, duration_s=8, fps=20, seed=seed, alpha_d=0.05))
        found.append(list(pulls(result, alpha_d=0.05, theta0=0.4, phi=1.2, omega_g=4.43).values()))
    pull = np.array(found)
    assert np.all(np.abs(pull.mean(axis=0)) < 0.55)
    assert np.all((pull.std(axis=0) > 0.7) & (pull.std(axis=0) < 1.35))


def test_correlated_noise_widens_the_bars_by_the_spectrum_at_the_swing():
    pull, inflation = [], []
    for seed in range(25):
        result = fit(swing(theta0=0.3, rho=0.9, seed=seed, alpha_d=0.05))
        inflation.append(result.noise["inflation"])
        pull.append(list(pulls(result, alpha_d=0.05, theta0=0.3, phi=1.2, omega_g=4.43).values()))
    rho, phase = 0.9, 4.43 / 60
    expected = math.sqrt((1 - rho**2) / abs(1 - rho * np.exp(-1j * phase)) ** 2)
    assert np.mean(inflation) == pytest.approx(expected, rel=0.1)
    spread = np.array(pull).std(axis=0)
    assert np.all((spread > 0.6) & (spread < 1.5))


@pytest.mark.parametrize(
    ("name", "t0", "u"), [("yyz/lab1_tracker.txt", 1.1026, 0.0004), ("jlefebvre/q2_data.txt", 2.0660, 0.002)]
)
def test_real_recordings(shared_data, name, t0, u):
    table = np.loadtxt(shared_data / name, skiprows=1, usecols=(0, 1))
    theta = np.radians(table[:, 1]) if "yyz" in name else table[:, 1]
    result = fit(ThetaSeries(table[:, 0], theta), model="full_linear_quadratic_drag")
    assert result.success
    assert result.derived["T0"].value == pytest.approx(t0, abs=4 * u)
    assert result.noise["inflation"] > 1.5


@pytest.mark.parametrize(("points", "periods"), [(100, 1), (1500, 300), (100_000, 1000)])
def test_from_a_hundred_to_a_hundred_thousand_points_over_one_to_a_thousand_periods(points, periods):
    """Without drag, by SciPy's elliptic functions."""
    peak, omega = 0.5, 4.43
    modulus = math.sin(peak / 2) ** 2
    quarter = ellipk(modulus)
    t = np.linspace(0, periods * 4 * quarter / omega, points)
    theta = 2 * np.arcsin(math.sin(peak / 2) * ellipj(omega * t + quarter, modulus)[0])
    noisy = theta + 1e-3 * np.random.default_rng(5).normal(size=points)
    result = fit(ThetaSeries(t, noisy, np.full(points, 1e-3)), fixed={"theta_offset": 0.0})
    assert result.success, result.message
    assert result.parameters["alpha_d"].value < 4 * result.parameters["alpha_d"].stderr + 1e-12
    for name, truth in (("theta0", peak), ("phi", math.pi / 2), ("omega_g", omega)):
        p = result.parameters[name]
        assert abs(p.value - truth) < 5 * p.stderr, name


def test_a_drives_derivatives_on_a_record_that_starts_late():
    m, length = 0.25, 0.5
    drive = {"f0_n": 0.15, "f_hz": 0.15, "phase_rad": 0.2}
    scene = Scene(pendulum=Pendulum(m, length), effects={"cosine_drive": drive})
    series = swing(duration_s=10)
    late = ThetaSeries(series.t_s + 50.0, series.theta_rad, series.sigma_theta_rad)
    problem = pose(late, scene, "full_linear_drag", ("f0", "f", "drive_phase", "length"))
    values = {**problem.values, "k_d": 0.1, "theta0": 0.5, "phi": 1.0}
    _, by, _ = problem.predict(values, problem.free)
    for i, name in enumerate(problem.free):
        up, down = (problem.predict({**values, name: values[name] + s * 1e-5}, ())[0] for s in (1, -1))
        np.testing.assert_allclose(by[:, i], (up - down) / 2e-5, atol=1e-4 * (1 + np.abs(by[:, i]).max()), err_msg=name)


def test_what_the_record_cannot_fix_is_named():
    """The phase of a drive without force."""
    drive = {"f0_n": 0.0, "f_hz": 0.2, "phase_rad": 0.0}
    scene = Scene(pendulum=Pendulum(0.25, 0.5), effects={"cosine_drive": drive})
    result = fit(swing(omega_g=OMEGA), scene, free=("drive_phase",))
    assert not result.success
    assert result.message.key == "fit.singular"
    assert "drive_phase" in result.message
    assert "simpler model" in result.message


def test_two_motions_in_one_record_are_not_followed():
    first, second = swing(theta0=0.5, duration_s=20), swing(theta0=0.5, duration_s=20, phi=-2.0, omega_g=7.0)
    theta = np.concatenate([first.theta_rad[:600], second.theta_rad[600:]])
    result = fit(ThetaSeries(first.t_s, theta, first.sigma_theta_rad))
    assert not result.success
    assert result.message.key == "fit.not_followed"
    assert "--start" in result.message


def test_a_drag_at_its_bound_is_said():
    result = fit(swing(alpha_d=-0.001, duration_s=30))
    assert result.success
    assert result.parameters["alpha_d"].value == 0.0
    assert [w.key for w in result.warnings] == ["fit.at_zero"]
    assert result.warnings[0].values == {"name": "alpha_d"}


def test_a_stuck_fit_is_said():
    problem = pose(swing(duration_s=5), Scene(), "full_linear_drag")
    begin = {**problem.values, "alpha_d": 0.02, "theta0": 0.5, "phi": 1.2, "omega_g": 4.43}
    stuck = replace(descend(problem, begin), success=False)
    done, message = _verdict(problem, stuck, problem.reduce(begin)[0], [])
    assert not done
    assert message.key == "fit.unsettled"
    assert "start value" in message


@pytest.mark.parametrize(
    "effects",
    [
        {"moving_pivot": {"amplitude_m": 0.004, "f_hz": 1.3, "phase_rad": 0.4}},
        {"formula": {"torque": "0.02*cos(5*t)"}},
    ],
)
def test_what_a_scene_says_of_time_holds_for_a_record_that_starts_late(effects):
    begin = 37.3
    scene = Scene(
        pendulum=Pendulum(mass_kg=0.1, length_m=0.5), effects={"linear_drag": {"k_d_kg_per_s": 0.004}, **effects}
    )
    whole = simulate(scene, np.linspace(0, begin + 12, 6000), 1e-9)
    late = whole.t_s >= begin
    series = ThetaSeries(whole.t_s[late], whole.theta_rad[late], np.full(int(late.sum()), 1e-5))
    assert fit(series, scene, "scene").chi2 < 1e-2 * late.sum()  # noise-free: what is left is the solver's error


def test_an_equation_that_no_start_solves_is_a_result():
    """The torque is infinite wherever the bob can be."""
    scene = Scene(pendulum=Pendulum(0.1, 0.5), effects={"formula": {"torque": "1/(theta - theta)"}})
    result = fit(swing(omega_g=OMEGA), scene, "scene")
    assert not result.success
    assert result.message.key == "fit.unsolvable"

"""Error bars by several roads agree where they must; budgets add up; bands are those of refitted records."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from synthetic_swing import swing

from toolkit.errors import UsageError
from toolkit.fit import fit
from toolkit.fitting.budget import Input, budget, budgets
from toolkit.fitting.contour import contour
from toolkit.fitting.uncertainty import bands, bootstrap, profile, sample_posterior, small_angle_bias
from toolkit.scene import Pendulum, Scene
from toolkit.series import ThetaSeries

SCENE = Scene(pendulum=Pendulum(mass_kg=0.05, length_m=0.5))


@functools.cache
def fitted():
    series = swing(theta0=0.5, omega_g=math.sqrt(9.80665 / 0.5), beta=0.01, fps=30, duration_s=40)
    return fit(series, SCENE, "full_linear_quadratic_drag", free=("length",))


def test_bootstrap_agrees_for_white_noise():
    drawn = bootstrap(fitted(), count=40)
    for name in fitted().free:
        assert drawn.stderr(name) == pytest.approx(fitted().parameters[name].stderr, rel=0.4)


def test_bootstrap_sees_correlation():
    result = fit(swing(theta0=0.3, rho=0.9, alpha_d=0.05, duration_s=40, fps=30))
    drawn = bootstrap(result, count=40)
    assert drawn.stderr("omega_g") == pytest.approx(result.parameters["omega_g"].stderr, rel=0.5)


def test_profile_agrees_where_the_fit_is_linear():
    low, high = profile(fitted(), "c")
    c = fitted().parameters["c"]
    assert (high - low) / 2 == pytest.approx(c.stderr, rel=0.05)
    assert (high + low) / 2 == pytest.approx(c.value, abs=0.1 * c.stderr)


def test_profile_ends_at_the_bound():
    result = fit(swing(theta0=0.3, alpha_d=0.02, duration_s=10), model="full_linear_quadratic_drag")
    if result.parameters["beta"].value > 0.5 * result.parameters["beta"].stderr:
        pytest.skip("this seed is not near the bound")
    assert profile(result, "beta")[0] == 0.0


def test_mcmc_agrees():
    pytest.importorskip("emcee")
    drawn = sample_posterior(fitted(), steps=40)
    assert drawn.stderr("k_d") == pytest.approx(fitted().parameters["k_d"].stderr, rel=0.5)
    low, high = drawn.interval("k_d")
    assert low < fitted().parameters["k_d"].value < high


def test_bands_cover_the_spread_of_refits():
    omega = math.sqrt(9.80665 / 0.5)
    curves = []
    for seed in range(12):
        series = swing(theta0=0.5, omega_g=omega, beta=0.02, fps=20, duration_s=10, seed=seed)
        band = bands(fit(series, SCENE, "full_linear_quadratic_drag", free=("length",)))
        curves.append([band.omega_rad_per_s, band.tension_n, band.energy_j])
    spread = np.std(np.array(curves), axis=0)
    for measured, told in zip(spread, (band.sigma_omega_rad_per_s, band.sigma_tension_n, band.sigma_energy_j)):
        assert np.median(measured / told) == pytest.approx(1, abs=0.5)


def test_tension_and_energy_are_physics():
    result = fitted()
    band = bands(result)
    theta = result.theta_rad - result.parameters["theta_offset"].value
    length = result.parameters["length"].value
    assert np.allclose(band.tension_n, 0.05 * (9.80665 * np.cos(theta) + length * result.omega_rad_per_s**2))
    assert band.energy_j[0] > band.energy_j[-1] > 0


def test_bands_at_other_times_are_the_same_motion():
    result = fitted()
    at_points, t_s = bands(result), result.problem.series.t_s
    again = bands(result, t_s[::7])
    for name in ("theta_rad", "sigma_theta_rad", "tension", "sigma_energy", "energy_j", "sigma_tension_n"):
        assert np.allclose(getattr(again, name), getattr(at_points, name)[::7], rtol=1e-6, atol=1e-12), name
    assert np.allclose(at_points.tension_n, 0.05 * 9.80665 * at_points.tension)


def test_budget_adds_up_and_sensitivities_are_known():
    table = budget(fitted(), "k_d", {"mass": Input(0.001, "rectangular"), "time_scale": Input(1e-4), "g": Input(0.01)})
    k_d = fitted().parameters["k_d"]
    rows = {row.quantity: row for row in table.rows}
    assert rows["mass"].sensitivity == pytest.approx(k_d.value / 0.05, rel=1e-3)
    assert rows["mass"].u == pytest.approx(0.001 / math.sqrt(3))
    assert rows["time_scale"].sensitivity == pytest.approx(-k_d.value, rel=1e-3)
    assert abs(rows["g"].contribution) < 1e-3 * k_d.stderr
    assert table.u_statistical == pytest.approx(k_d.stderr, rel=1e-6)
    assert table.u == pytest.approx(math.sqrt(sum(row.contribution**2 for row in table.rows)), rel=1e-9)
    assert table.coverage_factor == pytest.approx(1.96, abs=0.01)
    assert table.expanded == pytest.approx(table.coverage_factor * table.u)


def test_welch_satterthwaite():
    table = budget(fitted(), "k_d", {"mass": Input(0.01, dof=4)})
    mass = next(row for row in table.rows if row.quantity == "mass")
    scatter = table.rows[0]
    expected = table.u**4 / (mass.contribution**4 / 4 + scatter.contribution**4 / scatter.dof)
    assert table.effective_dof == pytest.approx(expected)
    assert table.coverage_factor > 2.5


def test_prior_is_apart_from_the_scatter():
    series = swing(theta0=0.2)
    told = ThetaSeries(series.t_s, series.theta_rad, series.sigma_theta_rad, {"angle_scale_relative_u": 0.01})
    result = fit(told, model="small_angle_linear_drag")
    table = budget(result, "theta0")
    assert table.u == pytest.approx(result.parameters["theta0"].stderr, rel=1e-6)
    assert table.u_systematic == pytest.approx(0.002, rel=0.05)
    assert table.u_statistical < 0.2 * table.u_systematic


def test_misuse():
    with pytest.raises(UsageError, match="did you mean 'k_d'"):
        budget(fitted(), "k_dd")
    with pytest.raises(UsageError, match="unknown input"):
        budget(fitted(), "k_d", {"masss": Input(0.1)})
    with pytest.raises(UsageError, match="not a free parameter"):
        profile(fitted(), "f0")
    failed = fit(swing().between(0, 0.05), model="full_linear_quadratic_coulomb")
    with pytest.raises(UsageError, match="failed"):
        bootstrap(failed)


def test_papers_k_d_beside_the_better_models():
    from toolkit.fit import choose_model, fit_models

    series = swing(theta0=0.5, omega_g=math.sqrt(9.80665 / 0.5), alpha_d=0.02, beta=0.05)
    fits = fit_models(series, SCENE)
    bias = small_angle_bias(fits, choose_model(fits))
    assert bias["preferred"] > 2 * 0.05 * 0.02
    assert set(bias) == {"paper", "paper_u", "preferred", "preferred_u", "difference_sigma"}


def test_budgets_of_all_that_a_report_states():
    inputs = {"mass": Input(2e-4, "rectangular"), "angle_scale": Input(0.01)}
    drawn = budgets(fitted(), inputs=inputs)
    assert {"k_d", "c", "theta0", "phi", "length", "T0", "Q"} <= set(drawn)
    for name, one in drawn.items():
        assert one.u == pytest.approx(math.hypot(one.u_statistical, one.u_systematic))
        assert one == budget(fitted(), name, inputs)
    mass = {name: next(r for r in one.rows if r.quantity == "mass") for name, one in drawn.items()}
    assert mass["k_d"].sensitivity == pytest.approx(drawn["k_d"].estimate / 0.05, rel=1e-3)
    assert abs(mass["T0"].contribution) < 1e-9
    scale = next(r for r in drawn["theta0"].rows if r.quantity == "angle_scale")
    assert scale.sensitivity == pytest.approx(drawn["theta0"].estimate, rel=0.15)


def test_contour_is_the_profile_and_near_the_best_fit_the_ellipse():
    result = fitted()
    found = contour(result, "k_d", "c", reach=1.5, count=5)
    best = {name: p.value for name, p in result.parameters.items()}
    others = tuple(n for n in result.free if n not in ("k_d", "c"))
    block = result.covariance[np.ix_(*[[result.free.index(n) for n in ("k_d", "c")]] * 2)]
    least = result.problem.cost_at(best, ())
    assert found.delta_chi2[2, 2] == pytest.approx(0, abs=1e-6)
    for place in ((0, 2), (4, 2), (2, 0), (2, 4), (1, 3)):
        at = {"k_d": found.first[place], "c": found.second[place]}
        if not np.isfinite(found.delta_chi2[place]):
            assert min(at.values()) < 0
            continue
        again = (result.problem.cost_at({**best, **at}, others) - least) / result.noise["inflation"] ** 2
        assert found.delta_chi2[place] == pytest.approx(again, abs=0.02)
        away = np.array([at["k_d"] - best["k_d"], at["c"] - best["c"]])
        assert found.delta_chi2[place] == pytest.approx(away @ np.linalg.solve(block, away), rel=0.1)
    with pytest.raises(UsageError, match="two free"):
        contour(result, "k_d", "mass")

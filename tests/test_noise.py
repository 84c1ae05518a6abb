"""Noise: against statsmodels, and against what simulation says about the error bars."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toolkit.fitting import noise


def ar1(n: int, rho: float, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = np.empty(n)
    x[0] = rng.normal()
    for i in range(1, n):
        x[i] = rho * x[i - 1] + rng.normal() * math.sqrt(1 - rho**2)
    return x


def test_whiteness_agrees_with_statsmodels():
    sandbox = pytest.importorskip("statsmodels.stats.diagnostic")
    tools = pytest.importorskip("statsmodels.stats.stattools")
    x = ar1(500, 0.15)
    ours = noise.ljung_box(noise.autocorrelation(x, 20), x.size)
    theirs = sandbox.acorr_ljungbox(x, lags=[20], auto_lag=False)
    assert ours == pytest.approx(float(theirs["lb_pvalue"].iloc[0]), rel=0.15)
    measured = noise.measure_noise(x, 1.0, True, 1.0, 0.1, 0)
    assert measured.durbin_watson == pytest.approx(float(tools.durbin_watson(x)), rel=1e-9)


def test_runs_agree_with_statsmodels():
    runs = pytest.importorskip("statsmodels.sandbox.stats.runs")
    x = ar1(400, 0.3)
    assert noise.runs_z(x) == pytest.approx(runs.runstest_1samp(x, cutoff=0.0, correction=False)[0], rel=1e-2)


@pytest.mark.parametrize("rho", [0.5, 0.9, 0.98])
def test_spectrum_of_ar1_is_its_formula(rho):
    phase = 2 * math.pi * 0.705 / 60
    expected = (1 - rho**2) / abs(1 - rho * np.exp(-1j * phase)) ** 2
    assert noise.spectrum((rho,), phase) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("rho", "inflation"), [(0.5, 1.72), (0.9, 3.57), (0.98, 2.63)])
def test_inflation_at_the_pendulums_frequency(rho, inflation):
    """The worked numbers of physics.md 8.3: 60 fps, 0.705 Hz."""
    measured = noise.measure_noise(ar1(20000, rho), 1.0, True, 2 * math.pi * 0.705, 1 / 60, 4)
    assert not measured.white
    assert measured.inflation == pytest.approx(inflation, rel=0.1)


def test_white_noise_is_left_alone():
    flagged = 0
    for seed in range(60):
        x = np.random.default_rng(seed).normal(size=800)
        measured = noise.measure_noise(x, 1e-3, True, 4.4, 1 / 60, 5)
        flagged += not measured.white
        if measured.white:
            assert measured.scale_used == 1.0
            assert measured.inflation == 1.0
    assert flagged <= 1


def test_wrong_sigma_is_noticed():
    x = 3 * np.random.default_rng(0).normal(size=800)
    measured = noise.measure_noise(x, 1e-3, True, 4.4, 1 / 60, 5)
    assert measured.scale_used == pytest.approx(3, rel=0.1)
    assert measured.sigma_rad == pytest.approx(3e-3, rel=0.1)


def test_scatter_below_sigma_is_no_sign_that_what_returns_with_the_angle_is_small():
    """σ² is 0.36 of scatter and 0.64 of errors that a fitted motion follows: only σ stated too large in both may shrink."""
    x = 0.6 * np.random.default_rng(0).normal(size=800)
    used = [noise.measure_noise(x, 1e-3, True, 4.4, 1 / 60, 5, common=c).scale_used for c in (0.0, 0.4, 0.8, 1.0)]
    assert used == pytest.approx([0.6, math.hypot(0.6, 0.4), 1.0, 1.0], rel=0.05)
    assert noise.measure_noise(5 * x, 1e-3, True, 4.4, 1 / 60, 5, common=0.8).scale_used == pytest.approx(3, rel=0.05)


def test_spread_is_the_covariance_of_projections():
    n, rho = 300, 0.8
    t = np.arange(n)
    columns = np.stack([np.ones(n), np.cos(0.07 * t), t / n], axis=1)
    drawn = np.array([columns.T @ ar1(n, rho, seed) for seed in range(1500)])
    measured = noise.Noise(1.0, "series", 1, 1, rho, 0, 0, 0, False, (rho,), 1, n)
    expected = noise.spread(columns, measured)
    assert np.allclose(np.cov(drawn.T), expected, rtol=0.15, atol=0.05 * expected.max())


def test_what_a_fit_takes_out_of_slow_noise_is_put_back():
    """Short records of AR(1) noise of unknown strength from which a swing was fitted: pulls of its coefficients."""
    n, phase = 240, 3.2 / 30
    t = np.arange(n)
    wave = np.stack([np.sin(phase * t), np.cos(phase * t)], axis=1)
    columns = np.hstack([wave, wave * (t / n)[:, None], np.ones((n, 1))])
    inverse, project = np.linalg.inv(columns.T @ columns), np.linalg.pinv(columns)

    def spread_of_pulls(jacobian):
        pulls = []
        for seed in range(100):
            x = ar1(n, 0.95, seed)
            fitted = project @ x
            left = x - columns @ fitted
            scatter = math.sqrt(left @ left / (n - 5))
            measured = noise.measure_noise(left / scatter, scatter, False, 3.2, 1 / 30, 5, jacobian)
            covariance = inverse @ noise.spread(columns, measured) @ inverse * scatter**2
            pulls.append(fitted / np.sqrt(np.diag(covariance)))
        return np.std(pulls, axis=0)

    put_back, plain = spread_of_pulls(columns), spread_of_pulls(None)
    assert np.all(put_back < 0.95 * plain)
    assert np.all((put_back[:4] > 0.8) & (put_back[:4] < 1.3))

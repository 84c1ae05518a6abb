"""Cycle by cycle: periods and turning points lie on the laws that made them, within their error bars."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_swing import swing

from toolkit.fit import fit
from toolkit.fitting.cycles import amplitude_of, cycles, period_of, residual_autocorrelation, residual_spectrum


def test_periods_follow_the_exact_law():
    series = swing(theta0=1.0, alpha_d=0.01, beta=0.01, duration_s=60)
    found = cycles(series, fit(series, model="full_linear_quadratic_drag"))
    assert found.t_s.size > 75
    expected = period_of(found.amplitude_rad, 2 * np.pi / 4.43)
    pull = (found.period_s - expected) / found.sigma_period_s
    assert abs(pull.mean()) < 0.6
    assert 0.7 < pull.std() < 1.5


def test_turning_points_lie_on_the_envelope():
    series = swing(theta0=1.0, alpha_d=0.01, beta=0.01, duration_s=60)
    result = fit(series, model="full_linear_quadratic_drag")
    found = cycles(series, result)
    envelope = np.interp(found.turning_t_s, series.t_s, amplitude_of(result))
    pull = (np.abs(found.turning_theta_rad) - envelope) / found.sigma_turning_rad
    assert abs(pull.mean()) < 0.6
    assert pull.std() < 1.5
    assert np.all(np.diff(np.sign(found.turning_theta_rad)) != 0)


def test_gaps_leave_cycles_out():
    t = np.arange(0, 40, 1 / 60)
    t = t[(t < 10) | (t > 20)]
    found = cycles(swing(t_s=t))
    assert found.period_s.max() < 1.6
    assert not np.any((found.t_s > 10.8) & (found.t_s < 19.2))


def test_too_short_a_record_has_no_cycles():
    assert cycles(swing(duration_s=0.3)).t_s.size == 0


def test_period_law_at_known_amplitudes():
    assert period_of(np.array([1.0]), 1.0)[0] == pytest.approx(1.066334245580, abs=1e-11)
    assert period_of(np.array([0.1]), 1.0)[0] == pytest.approx(1.000625358308, abs=1e-11)


def test_spectrum_holds_the_power_and_the_line():
    series = swing(theta0=0.3)
    shaken = series.theta_rad + 2e-3 * np.sin(2 * np.pi * 7.0 * series.t_s)
    result = fit(type(series)(series.t_s, shaken, series.sigma_theta_rad))
    frequency, power = residual_spectrum(series, result)
    assert frequency[np.argmax(power)] == pytest.approx(7.0, abs=0.2)
    assert np.trapezoid(power, frequency) == pytest.approx(np.var(result.residuals_rad), rel=0.15)
    rho, bound = residual_autocorrelation(result)
    assert rho.size == 100
    assert np.mean(np.abs(rho) > bound) > 0.5

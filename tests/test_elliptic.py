"""The bare pendulum against mpmath's elliptic functions, published values and the separatrix."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolkit.errors import UsageError
from toolkit.motion.elliptic import pendulum_period, solve_pendulum
from toolkit.motion.exact_arithmetic import whole_multiple

TIMES = np.concatenate([np.linspace(0, 30, 25), [100.3]])


def truth(t, theta0, omega0, rate):
    """θ and θ̇ by mpmath's elliptic functions at 40 digits."""
    theta0, omega0, rate, t = (mp.mpf(float(x)) for x in (theta0, omega0, rate, t))
    s, u = mp.sin(theta0 / 2), omega0 / (2 * rate)
    m = s * s + u * u
    if m < 1:
        phase = rate * t + mp.ellipf(mp.atan2(s, u), m)
        phase = mp.fmod(phase, 4 * mp.ellipk(m))
        sn, cn, dn = (mp.ellipfun(n, phase, m=m) for n in ("sn", "cn", "dn"))
        return float(2 * mp.atan2(mp.sqrt(m) * sn, dn)), float(2 * mp.sqrt(m) * rate * cn)
    if m == 1:
        x = mp.asinh(mp.tan(theta0 / 2)) + mp.sign(omega0) * rate * t
        return float(2 * mp.atan(mp.sinh(x))), float(mp.sign(omega0) * 2 * rate / mp.cosh(x))
    k = mp.sqrt(m)
    phase = mp.sign(omega0) * k * rate * t + mp.ellipf(theta0 / 2, 1 / m)
    turns = mp.nint(phase / (2 * mp.ellipk(1 / m)))
    phase -= 2 * turns * mp.ellipk(1 / m)
    sn, cn, dn = (mp.ellipfun(n, phase, m=1 / m) for n in ("sn", "cn", "dn"))
    return float(2 * mp.atan2(sn, cn) + 2 * mp.pi * turns), float(mp.sign(omega0) * 2 * k * rate * dn)


CASES = [
    (1.0, 0.0, 1.0),
    (1e-8, 0.0, 2.0),
    (0.3, 0.4, 1.7),
    (0.3, -0.4, 1.0),
    (-2.0, -0.3, 1.0),
    (math.pi / 2, 0.0, 1.0),
    (-3.1, 0.0, 4.427),
    (3.1415926, 0.0, 1.0),
    (3.1415926, 1e-8, 4.4),
    (0.0, 2.6 * (1 - 1e-12), 1.3),  # the separatrix from inside,
    (0.0, 2.6, 1.3),  # on it,
    (0.0, 2.6 * (1 + 1e-12), 1.3),  # and from outside
    (0.0, -2.6 * (1 + 1e-12), 1.3),
    (0.7, 2.6 * math.cos(0.35) * (1 - 1e-13), 1.3),
    (0.7, 2.6 * math.cos(0.35) * (1 + 1e-13), 1.3),
    (1.0, 5.0, 1.0),
    (-2.0, 2.0, 1.0),
    (3.14159265, 1e-3, 1.0),
    (0.0, 100.0, 1.0),
]


@pytest.mark.parametrize("case", CASES)
def test_matches_mpmath(case):
    solved = solve_pendulum(TIMES, *case)
    with mp.workdps(40):
        exact = np.array([truth(t, *case) for t in TIMES])
    assert np.max(np.abs(solved.theta_rad - exact[:, 0])) <= 1e-12 * max(1e-8, np.max(np.abs(exact[:, 0])))
    assert np.max(np.abs(solved.omega_rad_per_s - exact[:, 1])) <= 1e-12 * np.max(np.abs(exact[:, 1]))


@pytest.mark.parametrize(
    ("amplitude", "ratio"),
    [
        (0.05, 1.000156272383), (0.1, 1.000625358308), (0.2, 1.002505744229), (0.3, 1.005654176110),
        (0.5, 1.015852531101), (math.pi / 6, 1.017408797596), (math.pi / 4, 1.039973343197), (1.0, 1.066334245580),
        (math.pi / 3, 1.073182007149), (1.5, 1.161968744387), (math.pi / 2, 1.180340599016),
        (2 * math.pi / 3, 1.372880500618), (2.5, 1.642982398446), (3.0, 2.571233949432),
    ],
)  # fmt: skip
def test_published_periods(amplitude, ratio):
    assert round(pendulum_period(amplitude, 2 * math.pi), 12) == ratio


@pytest.mark.parametrize(("loss", "amplitude"), [(1e-3, 0.12649637), (1e-2, 0.40016432), (0.1, 1.26932971)])
def test_published_amplitudes_of_a_given_slowing(loss, amplitude):
    assert 1 - 1 / pendulum_period(amplitude, 2 * math.pi) == pytest.approx(loss, rel=1e-7)


def test_published_angles():
    solved = solve_pendulum(np.array([5.0, 10.0, 15.0, 20.0]), 1.5, 0.0, 1.0)
    assert list(np.round(solved.theta_rad, 8)) == [-0.62474574, -1.05404916, 1.42097953, -0.10538332]


def test_third_harmonic():
    # h3/h1 of physics.md's table, from the solution itself by Fourier
    for amplitude, ratio in ((0.1, -5.211e-5), (0.5, -1.321e-3), (1.0, -5.528e-3), (1.5, -1.350e-2)):
        period = pendulum_period(amplitude, 1.0)
        theta = solve_pendulum(np.arange(512) * period / 512, amplitude, 0.0, 1.0).theta_rad
        spectrum = np.fft.rfft(theta).real
        assert float(f"{spectrum[3] / spectrum[1]:.3e}") == ratio


def test_1e5_periods():
    amplitude, rate = 1.0, 1.0
    t = 1e5 * pendulum_period(amplitude, rate) + np.array([0.0, 1.7, 3.3])
    with mp.workdps(40):
        exact = [truth(s, amplitude, 0.0, rate)[0] for s in t]
    assert np.max(np.abs(solve_pendulum(t, amplitude, 0.0, rate).theta_rad - exact)) < 1e-10


@settings(max_examples=80, deadline=None)
@given(st.floats(-3.14, 3.14), st.floats(-4, 4), st.floats(0.1, 10))
def test_energy_is_kept_and_the_mirror_image_is_a_motion(theta0, omega0, rate):
    t = np.linspace(0, 20, 101)
    solved = solve_pendulum(t, theta0, omega0, rate)
    energy = solved.omega_rad_per_s**2 / 2 + 2 * rate**2 * np.sin(solved.theta_rad / 2) ** 2
    start = omega0**2 / 2 + 2 * rate**2 * math.sin(theta0 / 2) ** 2
    assert np.all(np.abs(energy - start) <= 1e-12 * (start + rate**2))
    mirrored = solve_pendulum(t, -theta0, -omega0, rate)
    assert np.allclose(mirrored.theta_rad, -solved.theta_rad, rtol=1e-13, atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-4, 4), st.floats(-5, 5))
def test_motion_runs_backwards_too(theta0, omega0, t):
    there = solve_pendulum(np.array([t]), theta0, omega0, 1.0)
    back = solve_pendulum(np.array([-t]), there.theta_rad[0], there.omega_rad_per_s[0], 1.0)
    # near the separatrix rounding grows as e^|t|
    assert back.theta_rad[0] == pytest.approx(theta0, abs=1e-12 * math.exp(abs(t)))


def test_over_the_top_the_angle_grows():
    solved = solve_pendulum(np.linspace(0, 10, 1001), 0.0, 2.5, 1.0)
    assert solved.kind == "rotation"
    assert np.all(np.diff(solved.theta_rad) > 0)
    assert solved.theta_rad[-1] > 2 * math.pi
    assert solve_pendulum(np.array([solved.period_s]), 0.4, 2.5, 1.0).kind == "rotation"


def test_whole_turns_of_the_start_are_kept():
    t = np.linspace(0, 5, 11)
    shifted = solve_pendulum(t, 0.4 + 6 * math.pi, 0.1, 1.0).theta_rad
    assert np.allclose(shifted - 6 * math.pi, solve_pendulum(t, 0.4, 0.1, 1.0).theta_rad, atol=1e-14)


def test_rest_below_and_standing_above():
    assert solve_pendulum(np.array([1.0]), 0.0, 0.0, 1.0).kind == "rest"
    assert solve_pendulum(np.empty(0), 1.0, 0.0, 1.0).theta_rad.size == 0


@pytest.mark.parametrize("bad", [(math.nan, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, math.inf, 1.0)])
def test_misuse(bad):
    with pytest.raises(UsageError):
        solve_pendulum(np.array([1.0]), *bad)


@pytest.mark.parametrize(
    ("theta0", "omega0"), [(1.0, 0.3), (3.1, 0.0), (3.14159, 0.0), (0.1, 4.0), (0.1, -2.3), (0.2, 2.0000001)]
)
def test_compiled_samples_are_the_elliptic_functions(theta0, omega0):
    t = np.linspace(0, 40, 3001)
    plain, compiled = (solve_pendulum(t, theta0, omega0, 1.0, how) for how in (False, True))
    np.testing.assert_allclose(compiled.theta_rad, plain.theta_rad, rtol=0, atol=1e-13)
    np.testing.assert_allclose(compiled.omega_rad_per_s, plain.omega_rad_per_s, rtol=0, atol=1e-13)


@given(st.integers(-(2**53), 2**53) | st.integers(-(2**26), 2**26), st.floats(1e-3, 1e3))
def test_a_whole_multiple_loses_nothing(n, period):
    high, low = whole_multiple(np.array([float(n)]), period)
    assert Fraction(high[0]) + Fraction(low[0]) == n * Fraction(period)

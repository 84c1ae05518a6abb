"""The linear equation in all regimes, against a matrix exponential in 50-digit arithmetic."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from toolkit.errors import UsageError
from toolkit.motion.closed_form import PAPER_PARAMETERS, PARAMETERS, paper_model, solve_linear, steady_state

TIMES = (1e-9, 1e-4, 0.03, 0.7, 2.3, 5.0, 17.0, 60.0)
REGIMES = {  # α, ω_g, ω_f
    "the paper's": (0.32, 4.427, 0.942),
    "critical": (1.0, 1.0, 0.7),
    "just over": (1.0 + 1e-9, 1.0, 0.7),
    "just under": (1.0 - 1e-9, 1.0, 0.7),
    "one ulp under": (1.0, float(np.nextafter(1.0, 2.0)), 0.7),
    "over": (3.0, 1.0, 0.7),
    "over 1000 times": (1000.0, 1.0, 0.7),
    "resonance without damping": (0.0, 1.0, 1.0),
    "nearly resonance without damping": (0.0, 1.0, 1.0 + 1e-9),
    "resonance with little damping": (1e-8, 1.0, 1.0 - 1e-6),
    "drive at the damped frequency": (1e-3, 1.0, math.sqrt(1 - 1e-6)),
    "resonance with damping": (0.2, 1.0, 1.0),
    "no restoring force": (0.5, 0.0, 1.0),
    "free particle, steady push": (0.0, 0.0, 0.0),
    "overdamped, slow drive": (3.0, 1e-3, 1e-4),
    "fast drive": (0.1, 1.0, 1e3),
    "growing": (-0.1, 1.0, 0.7),
    "parameters times 1e6": (0.32e6, 4.427e6, 0.942e6),
    "parameters times 1e-6": (0.32e-6, 4.427e-6, 0.942e-6),
}
START, DRIVE = (0.6, -0.8), (0.7, 0.4, 0.3)  # θ(0), θ̇(0); a, ψ, constant


def truth(t, values):
    """(θ, θ̇) by exp(Mt) of the equation and its forces as one linear system."""
    theta0, omega0, alpha, omega_g, a, omega_f, psi, constant = values
    matrix = mp.matrix(
        [
            [0, 1, 0, 0, 0],
            [-(omega_g**2), -2 * alpha, 1, 0, 1],
            [0, 0, 0, -omega_f, 0],
            [0, 0, omega_f, 0, 0],
            [0, 0, 0, 0, 0],
        ]
    )
    state = mp.expm(matrix * t, method="taylor") * mp.matrix(
        [theta0, omega0, a * mp.cos(psi), a * mp.sin(psi), constant]
    )
    return state[0], state[1]


def inputs(regime):
    alpha, omega_g, omega_f = REGIMES[regime]
    unit = omega_g if regime.startswith("parameters") else 1.0
    a, psi, constant = DRIVE
    values = (START[0], START[1] * unit, alpha, omega_g, a * unit**2, omega_f, psi, constant * unit**2)
    return np.array(TIMES) / unit, values


@pytest.mark.parametrize("regime", REGIMES)
def test_matches_the_matrix_exponential_in_every_regime(regime):
    t, values = inputs(regime)
    solved = solve_linear(t, *values)
    with mp.workdps(50):
        exact = np.array([[float(x) for x in truth(mp.mpf(s), [mp.mpf(v) for v in values])] for s in t])
    scale = np.maximum.accumulate(np.abs(exact), axis=0)
    assert np.all(np.abs(solved.theta_rad - exact[:, 0]) <= 1e-13 * scale[:, 0])
    assert np.all(np.abs(solved.omega_rad_per_s - exact[:, 1]) <= 1e-13 * scale[:, 1])


@pytest.mark.parametrize(
    "regime",
    ["the paper's", "critical", "one ulp under", "over", "resonance without damping", "overdamped, slow drive"],
)
def test_derivatives_match_differences_in_50_digits(regime):
    t, values = inputs(regime)
    t = t[[1, 4, 6]]
    solved = solve_linear(t, *values, derivatives=PARAMETERS)
    step = mp.mpf(10) ** -15
    with mp.workdps(50):
        for k in range(len(PARAMETERS)):
            up, down = [mp.mpf(v) for v in values], [mp.mpf(v) for v in values]
            up[k] += step
            down[k] -= step
            pairs = [(truth(mp.mpf(s), up), truth(mp.mpf(s), down)) for s in t]
            exact = np.array([[float((u[i] - d[i]) / (2 * step)) for i in (0, 1)] for u, d in pairs])
            scale = np.maximum.accumulate(np.abs(exact), axis=0)
            assert np.all(np.abs(solved.d_theta[:, k] - exact[:, 0]) <= 1e-11 * scale[:, 0]), PARAMETERS[k]
            assert np.all(np.abs(solved.d_omega[:, k] - exact[:, 1]) <= 1e-11 * scale[:, 1]), PARAMETERS[k]


def test_keeps_its_phase_over_1e5_periods():
    omega_g, t = 1.3, np.array([1e5 * 2 * math.pi / 1.3, 1e6])
    solved = solve_linear(t, 0.5, 0.0, 0.0, omega_g)
    with mp.workdps(40):
        exact = [float(mp.mpf(0.5) * mp.cos(mp.mpf(1.3) * mp.mpf(s))) for s in t]
    assert np.allclose(solved.theta_rad, exact, rtol=0, atol=1e-15)


def test_exact_resonance_without_damping_grows_linearly():
    t = np.linspace(0, 1e4, 501)
    solved = solve_linear(t, 0.0, 0.0, 0.0, 2.0, 0.3, 2.0)
    assert np.allclose(solved.theta_rad, 0.3 * t * np.sin(2.0 * t) / 4.0, rtol=0, atol=1e-11 * 0.3 * 1e4 / 4)


def test_very_long_times_neither_overflow_nor_lose_the_steady_state():
    with np.errstate(over="raise", invalid="raise"):
        solved = solve_linear(np.array([1e4, 1e8]), 1.0, 0.0, 5.0, 1.0, 0.3, 0.7, derivatives=PARAMETERS)
    z = steady_state(5.0, 1.0, 0.3, 0.7)
    with mp.workdps(40):
        exact = [float(mp.re(mp.mpc(z) * mp.expj(mp.mpf(0.7) * s))) for s in (10**4, 10**8)]
    assert np.allclose(solved.theta_rad, exact, rtol=0, atol=1e-15)
    assert np.all(np.isfinite(solved.d_theta))


def test_steady_amplitude_below_resonance():
    # about f0/(m(g - ℓ ω_f²)): grows with ℓ
    z = [abs(steady_state(0.32, math.sqrt(9.8 / x), 0.15 / (0.25 * x), 0.3 * math.pi)) for x in (0.3, 0.5, 0.7)]
    assert z[0] < z[1] < z[2]
    assert z[1] == pytest.approx(0.15 / (0.25 * (9.8 - 0.5 * (0.3 * math.pi) ** 2)), rel=1e-3)


def test_critical_damping_is_crossed_continuously():
    t = np.linspace(0, 20, 201)
    for shift in (1e-6, 1e-9, 1e-12):
        sides = [paper_model(t, 0.8, 1.1, 2.0 * (1 + s * shift), 2.0, 0.3, 0.9).theta_rad for s in (-1, 1)]
        # the distance shrinks as √shift, because |ω_u| does
        assert np.max(np.abs(sides[0] - sides[1])) < 3 * math.sqrt(shift)


def test_paper_model_is_the_papers_formula():
    t, alpha, omega_g = np.linspace(0, 20, 501), 0.32, 4.427
    omega_u = math.sqrt(omega_g**2 - alpha**2)
    solved = paper_model(t, 0.8, 1.1, alpha, omega_g)
    assert np.allclose(solved.theta_rad, 0.8 * np.exp(-alpha * t) * np.sin(omega_u * t + 1.1), rtol=0, atol=1e-14)


def test_paper_model_beyond_critical_damping_is_its_hyperbolic_form():
    t, alpha, omega_g = np.linspace(0, 3, 101), 6.0, 4.4
    rate = math.sqrt(alpha**2 - omega_g**2)
    solved = paper_model(t, 0.8, 1.1, alpha, omega_g)
    expected = 0.8 * np.exp(-alpha * t) * (math.sin(1.1) * np.cosh(rate * t) + math.cos(1.1) * np.sinh(rate * t))
    assert np.allclose(solved.theta_rad, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("alpha", [0.32, 4.3, 6.0])
def test_paper_model_derivatives_match_differences(alpha):
    t = np.linspace(0, 10, 301)
    at = {"theta0_rad": 0.8, "phi_rad": 1.1, "alpha_d_per_s": alpha, "omega_g_rad_per_s": 4.4,
          "drive_rad_per_s2": 1.2, "omega_f_rad_per_s": 0.94, "phase_rad": 0.2}  # fmt: skip
    solved = paper_model(t, **at, derivatives=PAPER_PARAMETERS)
    for i, name in enumerate(PAPER_PARAMETERS):
        up, down = ({**at, name: at[name] + s * 1e-5} for s in (1, -1))
        slope = (paper_model(t, **up).theta_rad - paper_model(t, **down).theta_rad) / 2e-5
        assert np.allclose(solved.d_theta[:, i], slope, rtol=0, atol=1e-7 * np.max(np.abs(slope))), name


numbers = st.floats(-2, 2)


@settings(max_examples=60, deadline=None)
@given(numbers, numbers, st.floats(0, 3), st.floats(0.1, 3), numbers, st.floats(0, 3), st.floats(0.01, 20))
@example(0.0, 0.0, 2.2e-311, 1.0, 1.0, 1.0, 0.5)  # at resonance, with a damping that is hardly a number
def test_a_motion_may_be_stopped_and_taken_up_again(theta0, omega0, alpha, omega_g, a, omega_f, stop):
    whole = solve_linear(np.array([stop, stop + 3.0]), theta0, omega0, alpha, omega_g, a, omega_f)
    half = whole.theta_rad[0], whole.omega_rad_per_s[0]
    rest = solve_linear(np.array([3.0]), *half, alpha, omega_g, a, omega_f, omega_f * stop)
    size = 1 + np.max(np.abs([whole.theta_rad, whole.omega_rad_per_s])) * (1 + alpha)
    assert abs(rest.theta_rad[0] - whole.theta_rad[1]) < 1e-12 * size
    assert abs(rest.omega_rad_per_s[0] - whole.omega_rad_per_s[1]) < 1e-12 * size


def test_the_empty_and_the_still():
    assert solve_linear(np.empty(0), 0.1, 0.0, 0.1, 1.0).theta_rad.size == 0
    still = solve_linear(np.linspace(0, 9, 10), 0.0, 0.0, 0.1, 1.0, derivatives=("alpha_per_s",))
    assert not still.theta_rad.any()
    assert not still.d_theta.any()


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"t": [-1.0]}, "not negative"),
        ({"omega_g": -1.0}, "omega_g"),
        ({"alpha": math.nan}, "finite"),
        ({"names": ["mass"]}, "mass"),
    ],
)
def test_misuse_is_one_sentence(change, word):
    with pytest.raises(UsageError, match=word):
        solve_linear(
            np.array(change.get("t", [1.0])), 0.1, 0.0, change.get("alpha", 0.1), change.get("omega_g", 1.0),
            derivatives=change.get("names", ()),
        )  # fmt: skip


def test_no_steady_state_without_damping_at_resonance():
    with pytest.raises(UsageError, match="no steady state"):
        steady_state(0.0, 2.0, 0.3, 2.0)

"""Where pendulum codes break: turning points, sticking, chaos, stiffness, 1e5 periods, extreme scales, nothing to do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from independent import integrate
from scipy.optimize import brentq

from toolkit import Scene, simulate
from toolkit.motion import build_equation

UNIT = {"mass_kg": 1.0, "length_m": 1.0, "g_m_per_s2": 1.0}
T_DRIVE = 3 * np.pi  # of ω_D = 2/3


def turning_points(equation, p, theta0, count):
    """|θ| at the first turning points after a release at rest."""
    found, t, theta = [], 0.0, theta0

    def omega(x):
        return float(equation.solve(p, theta, 0.0, [x], 1e-13).omega_rad_per_s[0])

    for _ in range(count):
        t = brentq(omega, 1.5, 6.0, xtol=1e-14)
        theta = float(equation.solve(p, theta, 0.0, [t], 1e-13).theta_rad[0])
        found.append(abs(theta))
    return found


@pytest.mark.parametrize(
    ("beta", "start", "expected"),
    [
        (0.1, 1.5, [1.21895006, 1.03428590, 0.90126648, 0.80002257, 0.72000992, 0.65500084]),
        (0.01, 1.0, [0.98590037, 0.97222081, 0.95894158, 0.94604424, 0.93351153, 0.92132726]),
        (0.5, 1.0, [0.58347709, 0.41680469, 0.32508580, 0.26671769, 0.22622088, 0.19644673]),
    ],
)
def test_turning_points_of_quadratic_drag(beta, start, expected):
    """e^{2βa}(cos a − 2β sin a) = e^{−2βA}(cos A + 2β sin A), printed to eight digits."""
    p = {**UNIT, "quadratic_drag.c_kg_per_m": beta}
    np.testing.assert_allclose(turning_points(build_equation(["quadratic_drag"]), p, start, 6), expected, atol=6e-9)


def test_turning_points_of_dry_friction():
    """cos a − cos A = μ(A + a), μ = 0.01."""
    expected = [0.97633132, 0.95285614, 0.92956614, 0.90645343, 0.88351049, 0.86073015]
    p = {**UNIT, "pivot_friction.torque_n_m": 0.01}
    np.testing.assert_allclose(turning_points(build_equation(["pivot_friction"]), p, 1.0, 6), expected, atol=6e-9)


def test_linear_pendulum_with_dry_friction_loses_2_mu_a_half_cycle_and_stops():
    p = {**UNIT, "pivot_friction.torque_n_m": 0.03}
    equation = build_equation(["pivot_friction"], small_angle=True)
    t = np.pi * np.arange(1, 8)
    solved = equation.solve(p, 0.4, 0.0, t, 1e-12)
    expected = [
        0.34,
        0.28,
        0.22,
        0.16,
        0.10,
        0.04,
        0.02,
    ]  # 0.04 > μ swings on to +0.02 < μ, short of the bottom, and stays
    np.testing.assert_allclose(np.abs(solved.theta_rad), expected, atol=1e-11)
    later = equation.solve(p, 0.4, 0.0, np.append(t, [30.0, 1e6]), 1e-12)
    assert later.events[0].kind == "stick"
    assert later.events[0].t_s == pytest.approx(7 * np.pi, abs=1e-10)
    assert later.theta_rad[-1] == later.theta_rad[-2] == pytest.approx(0.02, abs=1e-11)
    assert later.omega_rad_per_s[-1] == 0


def test_stick_and_slip_under_a_drive():
    """At rest it holds until f₀ |cos| exceeds the friction, and slips at that very time."""
    p = {**UNIT, "pivot_friction.torque_n_m": 0.05, "cosine_drive.f0_n": 0.1, "cosine_drive.f_hz": 0.01}
    p["cosine_drive.phase_rad"] = -np.pi / 2  # the force starts from 0
    equation = build_equation(["pivot_friction", "cosine_drive"])
    t = np.linspace(0, 60, 121)
    solved = equation.solve(p, 0.0, 0.0, t, 1e-11)
    kinds = [(e.kind, e.t_s) for e in solved.events[:3]]
    assert kinds[0] == ("stick", 0.0)
    assert kinds[1][0] == "slip"
    assert kinds[1][1] == pytest.approx(math.asin(0.5) / (2 * np.pi * 0.01), abs=1e-11)
    held = t <= kinds[1][1]
    assert not solved.theta_rad[held].any()
    np.testing.assert_allclose(solved.theta_rad, integrate(p, 0.0, 0.0, t, rtol=1e-11), atol=2e-8)


def test_sensitivities_across_turning_points_sticking_and_slipping():
    """Against central differences of the independent integrator; δω jumps where the friction turns round."""
    names = ["linear_drag", "quadratic_drag", "pivot_friction", "cosine_drive"]
    p = {
        "mass_kg": 0.25, "length_m": 0.5, "g_m_per_s2": 9.80665, "linear_drag.k_d_kg_per_s": 0.05,
        "quadratic_drag.c_kg_per_m": 0.1, "pivot_friction.torque_n_m": 0.01, "cosine_drive.f0_n": 0.3,
        "cosine_drive.f_hz": 0.6, "cosine_drive.phase_rad": 0.2,
    }  # fmt: skip
    equation = build_equation(names)
    wanted = [*p, "theta0_rad", "omega0_rad_per_s"]
    t = np.linspace(0.1, 6, 13)
    solved = equation.solve(p, 1.0, 0.3, t, 1e-12, wanted)
    for column, name in enumerate(wanted):

        def at(step, name=name):
            q, start = dict(p), [1.0, 0.3]
            if name in q:
                q[name] += step
            else:
                start[name == "omega0_rad_per_s"] += step
            return equation.solve(q, *start, t, 1e-14).theta_rad

        h = 2e-4 * abs(p.get(name, 1.0))
        slope = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
        np.testing.assert_allclose(solved.d_theta[:, column], slope, atol=1e-8 * np.abs(slope).max())
    # and one derivative from motions that this package did not compute
    h = 1e-4
    far = [integrate({**p, "pivot_friction.torque_n_m": 0.01 + s}, 1.0, 0.3, t) for s in (h, -h)]
    column = wanted.index("pivot_friction.torque_n_m")
    scale = np.abs(solved.d_theta[:, column]).max()
    np.testing.assert_allclose(solved.d_theta[:, column], (far[0] - far[1]) / (2 * h), atol=1e-5 * scale)


@pytest.mark.parametrize("effect", ["sphere_drag", "string_drag", "moving_pivot", "quadratic_drag"])
def test_sensitivities_of_the_runge_kutta_route(effect):
    names = [effect, "moving_pivot"] if effect == "quadratic_drag" else [effect]
    p = {
        "mass_kg": 0.0027, "length_m": 0.5, "g_m_per_s2": 9.8, "bob_radius_m": 0.02, "fluid_density_kg_per_m3": 1.2,
        "fluid_viscosity_pa_s": 1.8e-5, "sphere_drag.factor": 1.0, "string_drag.diameter_m": 1e-3,
        "moving_pivot.amplitude_m": 0.02, "moving_pivot.f_hz": 1.1, "moving_pivot.phase_rad": 0.3,
        "moving_pivot.direction_rad": 0.4, "quadratic_drag.c_kg_per_m": 3e-3,
    }  # fmt: skip
    equation = build_equation(names)
    wanted = [*equation.parameters, "theta0_rad", "omega0_rad_per_s"]
    t = np.linspace(0.2, 3, 8)
    solved = equation.solve(p, 1.0, 0.0, t, 1e-12, wanted)
    for column, name in enumerate(wanted):

        def at(step, name=name):
            q, start = dict(p), [1.0, 0.0]
            if name in q:
                q[name] += step
            else:
                start[name == "omega0_rad_per_s"] += step
            return equation.solve(q, *start, t, 1e-13).theta_rad

        h = 1e-3 * abs(p.get(name, 1.0))
        slope = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
        np.testing.assert_allclose(solved.d_theta[:, column], slope, atol=3e-7 * max(np.abs(slope).max(), 1e-3))


# -- chaos (q = 2, ω_D = 2/3) -------------------------------------------------------------------------------------


def test_chaos_says_when_the_accuracy_cannot_be_had():
    table = {
        "pendulum": {"mass_kg": 1.0, "length_m": 1.0},
        "environment": {"g_m_per_s2": 1.0},
        "release": {"theta0_rad": 0.2},
        "effects": {"linear_drag": {"k_d_kg_per_s": 0.5}, "cosine_drive": {"f0_n": 1.5, "f_hz": 1 / T_DRIVE}},
    }
    motion = simulate(Scene.from_dict(table), [0.0, 400.0], 1e-9)
    assert motion.error_estimate_rad > 1e-9
    assert any("amplifies" in w for w in motion.warnings)


# -- stiffness, long times, scales ---------------------------------------------------------------------------------


def test_overdamped_a_thousand_times():
    """The slow motion obeys θ' = −(ω²/2γ) sin θ: tan(θ/2) decays as an exponential, to first order in (ω/2γ)²."""
    m, length, g = 0.25, 0.5, 9.8
    rate = math.sqrt(g / length)
    p = {"mass_kg": m, "length_m": length, "g_m_per_s2": g, "linear_drag.k_d_kg_per_s": 2 * m * 1000 * rate}
    t = np.linspace(0, 100, 41)
    equation = build_equation(["linear_drag"])
    solved = equation.solve(p, 1.0, 0.0, t, 1e-10)
    assert "Rodas" in solved.method
    slow = 2 * np.arctan(math.tan(0.5) * np.exp(-rate / 2000 * t))
    np.testing.assert_allclose(solved.theta_rad, slow, atol=3e-7)
    tight = equation.solve(p, 1.0, 0.0, t[:6], 1e-10, ["theta0_rad"])  # sensitivities take the explicit route
    assert "Taylor" in tight.method
    np.testing.assert_allclose(solved.theta_rad[:6], tight.theta_rad, atol=1e-10)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_stiff_accuracy_is_met(accuracy):
    p = {**UNIT, "linear_drag.k_d_kg_per_s": 300.0, "cosine_drive.f0_n": 30.0, "cosine_drive.f_hz": 0.05}
    p["cosine_drive.phase_rad"] = 0.0
    equation = build_equation(["linear_drag", "cosine_drive"])
    t = np.linspace(0, 60, 61)
    stiff = equation.solve(p, 0.5, 0.0, t, accuracy)
    assert accuracy < 1e-10 or "Rodas" in stiff.method  # beyond that, order 4 costs more than the explicit series
    truth = equation.solve(p, 0.5, 0.0, t, 1e-12, ["theta0_rad"]).theta_rad
    assert np.abs(stiff.theta_rad - truth).max() <= accuracy


def test_a_hundred_thousand_periods():
    """θ₀ = 1: after 1e5 exact periods the bob is back, by the exact route and by the series."""
    from mpmath import mp, mpf

    mp.dps = 30
    period = float(2 * mp.pi / mp.agm(1, mp.cos(mpf(1) / 2)))
    equation = build_equation()
    times = np.array([1e5 * period])
    exact = equation.solve(UNIT, 1.0, 0.0, times)
    series = equation.prepare(times, 1e-9).integrate((1.0, 1.0), 1.0, 0.0)
    assert "Taylor" in series.method
    for solved in (exact, series):
        phase = solved.omega_rad_per_s[0] / math.sin(1.0) * 2 * np.pi / period  # rad of 2π a period
        assert abs(phase) < 1e-9
    assert series.error_estimate_rad > abs(series.theta_rad[0] - 1.0)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_scaled_parameters(factor):
    """The same motion with mass, length or gravity a million times larger or smaller."""
    names = ["linear_drag", "quadratic_drag", "pivot_friction"]
    p = {"mass_kg": 0.25, "length_m": 0.5, "g_m_per_s2": 9.8, "linear_drag.k_d_kg_per_s": 0.02}
    p |= {"quadratic_drag.c_kg_per_m": 0.01, "pivot_friction.torque_n_m": 1e-3}
    t = np.linspace(0, 5, 11)
    equation = build_equation(names)
    here = equation.solve(p, 1.0, 0.0, t, 1e-11).theta_rad
    heavy = {n: v * factor if n not in ("length_m", "g_m_per_s2") else v for n, v in p.items()}
    np.testing.assert_allclose(equation.solve(heavy, 1.0, 0.0, t, 1e-11).theta_rad, here, atol=2e-11)
    long = {**p, "length_m": 0.5 * factor, "g_m_per_s2": 9.8 * factor, "quadratic_drag.c_kg_per_m": 0.01 / factor}
    long["pivot_friction.torque_n_m"] = 1e-3 * factor**2
    np.testing.assert_allclose(equation.solve(long, 1.0, 0.0, t, 1e-11).theta_rad, here, atol=2e-11)
    slow = {**p, "g_m_per_s2": 9.8 / factor**2, "linear_drag.k_d_kg_per_s": 0.02 / factor}
    slow["pivot_friction.torque_n_m"] = 1e-3 / factor**2
    np.testing.assert_allclose(equation.solve(slow, 1.0, 0.0, t * factor, 1e-11).theta_rad, here, atol=2e-11)


@pytest.mark.parametrize("names", [[], ["linear_drag"], ["quadratic_drag"], ["pivot_friction"], ["sphere_drag"]])
def test_no_time_no_angle(names):
    p = {**UNIT, "linear_drag.k_d_kg_per_s": 0.1, "quadratic_drag.c_kg_per_m": 0.1, "pivot_friction.torque_n_m": 0.1}
    p |= {"sphere_drag.factor": 1.0, "bob_radius_m": 0.02, "fluid_density_kg_per_m3": 1.2, "fluid_viscosity_pa_s": 2e-5}
    equation = build_equation(names)
    assert equation.solve(p, 1.0, 2.0, [0.0]).theta_rad[0] == pytest.approx(1.0, abs=1e-15)
    assert equation.solve(p, 1.0, 2.0, [0.0, 0.0]).omega_rad_per_s[1] == pytest.approx(2.0, abs=1e-15)
    assert equation.solve(p, 1.0, 2.0, []).theta_rad.size == 0
    still = equation.solve(p, 0.0, 0.0, np.linspace(0, 10, 5))
    assert not still.theta_rad.any()
    assert not still.omega_rad_per_s.any()


def test_drive_without_damping_from_rest_at_the_bottom():
    p = {**UNIT, "cosine_drive.f0_n": 0.1, "cosine_drive.f_hz": 0.13, "cosine_drive.phase_rad": -np.pi / 2}
    t = np.linspace(0, 60, 31)
    solved = build_equation(["cosine_drive"]).solve(p, 0.0, 0.0, t, 1e-10)
    np.testing.assert_allclose(solved.theta_rad, integrate(p, 0.0, 0.0, t), atol=1e-10)


def test_over_the_top_keeps_counting():
    p = {**UNIT, "linear_drag.k_d_kg_per_s": 0.05}
    t = np.linspace(0, 40, 41)
    solved = build_equation(["linear_drag"]).solve(p, 0.0, 4.0, t, 1e-11)
    assert solved.theta_rad.max() > 4 * np.pi
    np.testing.assert_allclose(solved.theta_rad, integrate(p, 0.0, 4.0, t), atol=1e-9)

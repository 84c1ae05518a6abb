"""The slack string against the closed formulas of physics (energy, parabola, geometry)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toolkit import Scene, simulate
from toolkit.effects.effect import Effect, Parameter, Term
from toolkit.motion import Equation, build_equation
from toolkit.motion.elliptic import solve_pendulum
from toolkit.motion.flight import Flight, free_flight
from toolkit.motion.slack import solve_with_slack

G, LENGTH = 9.80665, 0.5
RATE = math.sqrt(G / LENGTH)


PARAMETERS = {"mass_kg": 0.25, "length_m": LENGTH, "g_m_per_s2": G}


def swing(t, theta, omega):
    return solve_pendulum(t, theta, omega, RATE).theta_rad


def let_go(theta0, omega0, t=None, acceleration=None):
    t = np.linspace(0, 3, 301) if t is None else t
    equation = build_equation(["slack_string"])
    return t, solve_with_slack(equation, PARAMETERS, theta0, omega0, t, 1e-12, Flight(G, acceleration))


TABLE = [  # v²/gℓ at the bottom; slack at, flight in √(ℓ/g), taut at, share of kinetic energy lost
    (2.2, 93.8226, 1.030498, 78.5323, 0.031309),
    (3.0, 109.4712, 2.177324, 31.5863, 0.615743),
    (4.0, 131.8103, 2.434322, -35.4309, 0.895832),
    (4.8, 158.9605, 1.387350, -116.8816, 0.058771),
]


@pytest.mark.parametrize("through", ["parabola", "integrated"])
@pytest.mark.parametrize(("u", "slack", "flight", "taut", "lost"), TABLE)
def test_table_of_flights(u, slack, flight, taut, lost, through):
    pull = None if through == "parabola" else lambda t, x, v: np.array([0.0, -G])
    _, solved = let_go(0.0, math.sqrt(u * G * LENGTH) / LENGTH, np.linspace(0, 1.5, 31), pull)
    first, second = solved.events[:2]
    assert (first.kind, second.kind) == ("slack", "taut")
    assert round(math.degrees(first.theta_rad), 4) == slack
    assert round((second.t_s - first.t_s) * RATE, 6) == flight
    caught = math.degrees(math.remainder(second.theta_rad, 2 * math.pi))
    assert round(caught, 4) == taut
    assert round(1 - solved.kept_energy[0], 6) == lost


def test_where_the_equation_has_no_series_runge_kutta_watches_the_tension():
    """Air so thin that the table holds, by the drag law of a sphere, which only the Runge–Kutta route can take."""
    air = {"fluid_density_kg_per_m3": 1e-13, "fluid_viscosity_pa_s": 1e-13}
    equation = build_equation(["slack_string", "sphere_drag"])
    assert not equation.code.ANALYTIC
    u, _, flight, _, lost = TABLE[1]
    p = PARAMETERS | air | {"bob_radius_m": 0.02, "sphere_drag.factor": 1.0}
    solved = solve_with_slack(equation, p, 0.0, math.sqrt(u) * RATE, np.linspace(0, 1.5, 31), 1e-11, Flight(G))
    first, second = solved.events[:2]
    assert math.cos(first.theta_rad) == pytest.approx((2 - u) / 3, abs=1e-10)
    assert first.omega_rad_per_s == pytest.approx(RATE * math.sqrt((u - 2) / 3), rel=1e-10)
    assert round((second.t_s - first.t_s) * RATE, 6) == flight
    assert round(1 - solved.kept_energy[0], 6) == lost


@pytest.mark.parametrize("degrees", [100.0, 150.0])
def test_release_above_the_horizontal_falls_straight(degrees):
    angle = math.radians(degrees)
    t, solved = let_go(angle, 0.0, np.linspace(0, 1.5, 151))
    slack, taut = solved.events[:2]
    assert slack.t_s == 0.0
    assert taut.t_s * RATE == pytest.approx(2 * math.sqrt(-math.cos(angle)), rel=1e-12)
    assert taut.theta_rad == pytest.approx(math.pi - angle, rel=1e-12)
    assert solved.kept_energy[0] == pytest.approx(math.sin(angle) ** 2, rel=1e-12)
    aloft = solved.in_flight
    x = solved.radius_m * np.sin(solved.theta_rad)
    assert np.allclose(x[aloft & (t < taut.t_s)], LENGTH * math.sin(angle), atol=1e-12)


def test_150_degrees_swings_on_to_64():
    _, solved = let_go(math.radians(150.0), 0.0, np.linspace(0, 6, 6001))
    later = solved.theta_rad[~solved.in_flight][-3000:]
    assert round(math.degrees(np.max(np.abs(later))), 2) == 64.34
    assert len(solved.events) == 2


def test_100_degrees_goes_slack_again_and_again_ever_lower():
    _, solved = let_go(math.radians(100.0), 0.0, np.linspace(0, 20, 2001))
    slack = [abs(e.theta_rad) for e in solved.events if e.kind == "slack"]
    assert len(slack) > 5
    assert slack[0] == pytest.approx(math.radians(100.0))
    assert all(a > math.pi / 2 for a in slack)
    height = LENGTH - solved.radius_m * np.cos(solved.theta_rad)
    radial = np.nan_to_num(solved.radial_velocity_m_per_s)
    energy = 0.5 * (radial**2 + (solved.radius_m * solved.omega_rad_per_s) ** 2) + G * height
    assert np.all(np.diff(energy) < 1e-11)


@pytest.mark.parametrize("u", [1.9, 5.1])
def test_never_slack_below_2gl_nor_above_5gl(u):
    t, solved = let_go(0.0, math.sqrt(u * G * LENGTH) / LENGTH)
    assert solved.events == ()
    assert np.allclose(solved.theta_rad, swing(t, 0.0, math.sqrt(u * G * LENGTH) / LENGTH), atol=1e-12)


def test_a_dip_of_the_tension_between_samples_is_found():
    # just below 5gℓ the tension is negative only within a hair of the top
    _, solved = let_go(0.0, math.sqrt(5 * (1 - 1e-9)) * RATE, np.linspace(0, 1.0, 5))
    assert solved.events
    assert math.cos(solved.events[0].theta_rad) == pytest.approx((2 - 5 * (1 - 1e-9)) / 3, abs=1e-10)


def test_the_string_never_stretches_and_the_angle_is_continuous():
    t, solved = let_go(0.0, math.sqrt(4.0 * G * LENGTH) / LENGTH, np.linspace(0, 2, 4001))
    assert np.max(solved.radius_m) <= LENGTH * (1 + 1e-12)
    # in flight the angle turns as fast as the bob passes near the pivot, not faster
    fastest = np.max(np.abs(solved.omega_rad_per_s))
    assert np.max(np.abs(np.diff(solved.theta_rad))) <= 1.1 * fastest * (t[1] - t[0])


def test_drag_shortens_the_flight():
    def pull(t, x, v):
        return np.array([0.0, -G]) - 2.0 * v

    start = math.sqrt(3.0 * G * LENGTH) / LENGTH
    (_, bare), (_, dragged) = let_go(0.0, start), let_go(0.0, start, acceleration=pull)
    x = [s.radius_m[s.in_flight] * np.sin(s.theta_rad[s.in_flight]) for s in (bare, dragged)]
    assert x[1].min() > x[0].min()  # it does not come as far across
    # in still air with F = −γ m v the horizontal velocity decays as e^{−γt}
    slack = dragged.events[0]
    flight = dragged.in_flight
    tau = np.linspace(0, 3, 301)[flight] - slack.t_s
    v0 = LENGTH * math.sqrt(-G * math.cos(slack.theta_rad) / LENGTH) * math.cos(slack.theta_rad)
    first = tau < dragged.events[1].t_s - slack.t_s
    expected = LENGTH * math.sin(slack.theta_rad) + v0 * (1 - np.exp(-2.0 * tau[first])) / 2.0
    assert np.allclose(x[1][first], expected, atol=1e-11)


def thrown(m, length, start, drag=0.0):
    """(t) -> x, y of a body thrown with linear drag, from the state (θ, θ̇) of a taut string."""
    theta, omega = start
    x0, y0 = length * math.sin(theta), -length * math.cos(theta)
    vx, vy = length * omega * math.cos(theta), length * omega * math.sin(theta)
    rate = drag / m

    def path(t):
        fade = -np.expm1(-rate * t) / rate
        return x0 + vx * fade, y0 + (vy + G / rate) * fade - G / rate * t

    return path


@pytest.mark.parametrize("k", [0.02, 0.2])
def test_linear_drag_acts_in_flight_as_on_any_thrown_body(k):
    m, t = 0.25, np.linspace(0, 2, 2001)
    table = {
        "pendulum": {"mass_kg": m, "length_m": LENGTH},
        "release": {"theta0_rad": 0.0, "omega0_rad_per_s": math.sqrt(3.5 * G / LENGTH)},
        "environment": {"g_m_per_s2": G},
        "effects": {"slack_string": {}, "linear_drag": {"k_d_kg_per_s": k}},
    }
    motion = simulate(Scene.from_dict(table), t, 1e-10)
    slack, taut = motion.events[:2]
    omega = math.sqrt(-G * math.cos(slack.theta_rad) / LENGTH)  # T = 0 there
    path = thrown(m, LENGTH, (slack.theta_rad, omega), k)
    aloft = (t > slack.t_s) & (t < taut.t_s)
    assert aloft.sum() > 100
    x, y = path(t[aloft] - slack.t_s)
    r = motion.meta["radius_m"][aloft]
    np.testing.assert_allclose(r * np.sin(motion.theta_rad[aloft]), x, atol=1e-9)
    np.testing.assert_allclose(-r * np.cos(motion.theta_rad[aloft]), y, atol=1e-9)
    assert np.hypot(*path(taut.t_s - slack.t_s)) == pytest.approx(LENGTH, abs=1e-9)  # caught at the string's length
    assert np.all(np.diff(motion.energy_j) < 1e-9)


def test_a_drag_that_nobody_knew_of_acts_in_flight_too():
    """An effect as docs/add-an-effect.md makes one; its drag, a function of the speed, goes against the velocity."""
    cubic = Effect(
        name="cubic_drag", meaning="F = −e |v|² v", term=lambda s: Term(drag=s.e_s_per_m2 * s.speed**2),
        parameters=(Parameter("e_s_per_m2", "kg·s/m²", "coefficient", symbol="e"),), needs=("mass_kg",),
        valid="made up", reference="made up", dissipative=True,
    )  # fmt: skip
    p = {"mass_kg": 0.2, "length_m": LENGTH, "g_m_per_s2": G, "cubic_drag.e_s_per_m2": 0.03}
    flight = free_flight(Equation((cubic,)), p)
    velocity = np.array([1.2, -0.5])
    expected = np.array([0.0, -G]) - 0.03 * (1.2**2 + 0.5**2) * velocity / 0.2
    np.testing.assert_allclose(flight.acceleration(0.0, np.array([0.1, 0.2]), velocity), expected, rtol=1e-13)
    # and on the string the same drag: −e (ℓθ̇)³ ℓ of torque
    torque = Equation((cubic,)).terms_at(p, 0.0, 0.3, 2.0).torque
    assert torque == pytest.approx(-0.2 * G * LENGTH * math.sin(0.3) - 0.03 * LENGTH**4 * 8.0, rel=1e-13)

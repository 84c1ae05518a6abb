"""simulate: published numbers, the accuracy that was asked for, routes, tension and energy."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from independent import integrate

from toolkit import Scene, simulate
from toolkit.errors import UsageError
from toolkit.simulate import scene_equation, scene_parameters


def scene(effects=None, theta0=1.0, omega0=0.0, small=False, mass=0.25, length=0.5, g=9.80665, **more):
    return Scene.from_dict(
        {
            "pendulum": {"mass_kg": mass, "length_m": length, "bob_radius_m": 0.02},
            "release": {"theta0_rad": theta0, "omega0_rad_per_s": omega0},
            "environment": {"g_m_per_s2": g},
            "effects": effects or {},
            "approximations": {"small_angle": small},
            **more,
        }
    )


# Regression table (m = 0.25 kg, ℓ = 0.5 m, θ₀ = 1 at rest), computed elsewhere with DOP853 at rtol 1e-13
TABLE = [
    (
        {},
        [-0.538970597742, -0.445006935336, -0.345470560580, -0.777341380923, 0.191310911539],
        3.531503346314,
        3.66304813,
    ),
    (
        {"linear_drag": {"k_d_kg_per_s": 0.16}},
        [-0.399668430102, -0.288446526293, -0.182108242202, 0.037819334236, 0.001609584349],
        2.697434312951,
        3.167966116,
    ),
    (
        {"quadratic_drag": {"c_kg_per_m": 3.3e-4}},
        [-0.538218173057, -0.444849036564, -0.351046468681, -0.746368760063, 0.054667023963],
        3.528656710468,
        3.661482115,
    ),
    (
        {"linear_drag": {"k_d_kg_per_s": 6e-5}, "quadratic_drag": {"c_kg_per_m": 3.3e-4}},
        [-0.538145975988, -0.444827798484, -0.351597132012, -0.743234574468, 0.041333412607],
        3.528337697263,
        3.661291433,
    ),
]


@pytest.mark.parametrize(("effects", "theta", "omega1", "tension1"), TABLE)
def test_regression_table(effects, theta, omega1, tension1):
    motion = simulate(scene(effects), np.array([1.0, 2.0, 5.0, 10.0, 20.0]), 1e-12)
    np.testing.assert_allclose(motion.theta_rad, theta, atol=2e-12)
    assert motion.omega_rad_per_s[0] == pytest.approx(omega1, abs=2e-12)
    assert motion.tension_n[0] == pytest.approx(tension1, abs=5e-9)


COMBINATIONS = [
    ((), False),
    (("linear_drag",), False),
    (("quadratic_drag",), False),
    (("linear_drag", "quadratic_drag", "pivot_friction"), False),
    (("linear_drag", "cosine_drive"), False),
    (("cosine_drive", "pivot_friction"), False),
    (("sphere_drag",), False),
    (("linear_drag", "moving_pivot"), False),
    (("linear_drag", "cosine_drive"), True),
    (("quadratic_drag",), True),
]


def random_scene(rng: np.random.Generator, index: int) -> Scene:
    names, small = COMBINATIONS[index % len(COMBINATIONS)]
    mass, length, g = 10 ** rng.uniform(-2, 0), rng.uniform(0.2, 2), rng.uniform(9, 10)
    made = {
        "linear_drag": {"k_d_kg_per_s": mass * 10 ** rng.uniform(-3, 0.5)},
        "quadratic_drag": {"c_kg_per_m": mass * 10 ** rng.uniform(-3, 0)},
        "pivot_friction": {"torque_n_m": mass * g * length * 10 ** rng.uniform(-4, -1)},
        "cosine_drive": {
            "f0_n": mass * g * rng.uniform(0, 0.3),
            "f_hz": rng.uniform(0.1, 2),
            "phase_rad": rng.uniform(0, 6),
        },
        "moving_pivot": {"amplitude_m": length * rng.uniform(0, 0.05), "f_hz": rng.uniform(0.2, 3)},
        "sphere_drag": {"factor": rng.uniform(1, 50)},
    }
    theta0 = rng.uniform(-2.5, 2.5)
    omega0 = rng.uniform(-3, 3) if rng.random() < 0.5 else 0.0
    return scene({n: made[n] for n in names}, theta0, omega0, small, mass, length, g)


def test_accuracy_that_was_asked_for_is_met_on_200_random_scenes():
    seed = 20261122
    print("seed", seed)
    rng = np.random.default_rng(seed)
    missed, honest = [], 0
    for index in range(200):
        one = random_scene(rng, index)
        accuracy = 10 ** rng.uniform(-11, -3)
        t = np.sort(rng.uniform(0, 10 ** rng.uniform(0, 0.8), 12))
        p = scene_parameters(one, scene_equation(one))
        p = {n: v for n, v in p.items() if "." not in n or n.split(".")[0] in one.effects}
        truth = integrate(p, one.release.theta0_rad, one.release.omega0_rad_per_s, t, one.approximations.small_angle)
        motion = simulate(one, t, accuracy)
        error = float(np.abs(motion.theta_rad - truth).max())
        honest += error <= max(motion.error_estimate_rad, 2e-12)
        if error > accuracy + 2e-12:  # what SciPy itself leaves
            missed.append((index, accuracy, error, motion.method))
    assert not missed
    assert honest >= 190  # the error estimate covers the error


def test_routes():
    t = np.linspace(0, 2, 5)
    drag = {"linear_drag": {"k_d_kg_per_s": 0.16}}
    assert "closed form" in simulate(scene(drag, small=True), t).method
    assert "elliptic" in simulate(scene(), t).method
    assert "elliptic" in simulate(scene({"buoyancy": {}, "finite_bob": {}}), t).method
    assert "Taylor" in simulate(scene(drag), t).method
    assert "DOP853" in simulate(scene({"sphere_drag": {}}), t).method
    assert "Rodas" in simulate(scene({"linear_drag": {"k_d_kg_per_s": 2000.0}}), np.linspace(0, 60, 5)).method


def test_reduced_inertia_keeps_the_exact_route_exact():
    """Buoyancy, added mass and bob size change only the rate: the elliptic route against SciPy on the same equation."""
    effects = {"buoyancy": {}, "finite_bob": {}, "string_mass": {"string_mass_kg": 0.01}}
    one = scene(effects)
    t = np.linspace(0, 5, 11)
    motion = scene_equation(one).terms_at(scene_parameters(one, scene_equation(one)), 0.0, 0.5, 0.0)
    rate2 = -motion.torque / motion.inertia / np.sin(0.5)
    truth = integrate({"length_m": 1.0, "g_m_per_s2": rate2}, 1.0, 0.0, t)
    np.testing.assert_allclose(simulate(one, t).theta_rad, truth, atol=1e-11)


def test_tension_and_energy_balance():
    """Energy lost = ∫ k_d (ℓω)² dt, and T from the radial equation."""
    t = np.linspace(0, 5, 20001)
    motion = simulate(scene({"linear_drag": {"k_d_kg_per_s": 0.16}}), t, 1e-11)
    loss = 0.16 * (0.5 * motion.omega_rad_per_s) ** 2
    from scipy.integrate import simpson

    assert motion.energy_j[0] - motion.energy_j[-1] == pytest.approx(simpson(loss, x=t), rel=1e-10)
    expected = 0.25 * 9.80665 * np.cos(motion.theta_rad) + 0.25 * 0.5 * motion.omega_rad_per_s**2
    np.testing.assert_allclose(motion.tension_n, expected, rtol=1e-13)


def test_small_angle_tension_is_the_papers():
    motion = simulate(scene({"linear_drag": {"k_d_kg_per_s": 0.16}}, small=True), np.linspace(0, 3, 7))
    theta, omega = motion.theta_rad, motion.omega_rad_per_s
    np.testing.assert_allclose(
        motion.tension_n, 0.25 * 9.80665 * (1 - theta**2 / 2) + 0.25 * 0.5 * omega**2, rtol=1e-13
    )


def test_negative_tension_is_reported_and_a_string_goes_slack():
    t = np.linspace(0, 2, 401)
    fast = np.sqrt(3 * 9.80665 / 0.5)
    rod = simulate(scene({}, 0.0, fast), t)
    assert rod.tension_n.min() < 0
    assert any("slack" in w for w in rod.warnings)
    string = simulate(scene({"slack_string": {}}, 0.0, fast), t)
    assert [e.kind for e in string.events[:2]] == ["slack", "taut"]
    assert np.degrees(string.events[0].theta_rad) == pytest.approx(109.4712, abs=1e-4)
    assert np.degrees(string.events[1].theta_rad) == pytest.approx(31.5863, abs=1e-4)
    flight = string.events[1].t_s - string.events[0].t_s
    assert flight / np.sqrt(0.5 / 9.80665) == pytest.approx(2.177324, abs=1e-6)
    assert string.tension_n.min() > -1e-9
    in_air = simulate(scene({"slack_string": {}, "linear_drag": {"k_d_kg_per_s": 0.05}}, 0.0, fast), t)
    assert np.all(np.diff(in_air.energy_j) <= 1e-9)  # swinging, flying and caught: drag and the catch only take
    assert in_air.energy_j[0] - in_air.energy_j[-1] > 0.1


def test_without_mass_tension_is_nan_and_says_so():
    motion = simulate(Scene.from_dict({"pendulum": {"length_m": 0.5}, "release": {"theta0_rad": 0.3}}), [0.0, 1.0])
    assert np.isnan(motion.tension_n).all()
    assert any("mass" in w for w in motion.warnings)


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ({"pendulum": {"mass_kg": 0.1}}, "length_m"),
        ({"pendulum": {"length_m": 0.5}, "effects": {"linear_drag": {"k_d_kg_per_s": 0.1}}}, "mass_kg"),
        ({"pendulum": {"length_m": 0.5, "mass_kg": 1}, "effects": {"sphere_drag": {}}}, "bob_radius_m"),
    ],
)
def test_what_the_scene_lacks_is_named(table, word):
    with pytest.raises(UsageError, match=word):
        simulate(Scene.from_dict(table), [0.0, 1.0])


def test_times_that_do_not_increase_are_refused():
    with pytest.raises(UsageError, match="increasing"):
        simulate(scene(), [0.0, 2.0, 1.0])
    with pytest.raises(UsageError, match="increasing"):
        simulate(scene(), [0.0, np.nan, 1.0])


def test_linear_scene_imports_neither_numba_nor_sympy():
    code = (
        "import sys, numpy as np\n"
        "from toolkit import Scene, simulate\n"
        "table = {'pendulum': {'mass_kg': 0.25, 'length_m': 0.5}, 'approximations': {'small_angle': True},\n"
        "         'effects': {'linear_drag': {'k_d_kg_per_s': 0.16}, 'cosine_drive': {'f0_n': 0.15, 'f_hz': 0.15}}}\n"
        "motion = simulate(Scene.from_dict(table), np.linspace(0, 1, 5))\n"
        "assert motion.equation_latex\n"
        "print(sorted({'numba', 'sympy', 'scipy'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# -- properties -------------------------------------------------------------------------------------------------

angle = st.floats(-2.5, 2.5)
rate = st.floats(-6, 6)
DRAG = {
    "linear_drag": {"k_d_kg_per_s": 0.02},
    "quadratic_drag": {"c_kg_per_m": 0.01},
    "pivot_friction": {"torque_n_m": 1e-3},
}


@settings(max_examples=40, deadline=None)
@given(theta0=angle, omega0=rate)
def test_energy_never_rises_with_drag(theta0, omega0):
    motion = simulate(scene(DRAG, theta0, omega0), np.linspace(0, 6, 301), 1e-10)
    assert np.all(np.diff(motion.energy_j) <= 1e-9)


@settings(max_examples=40, deadline=None)
@given(theta0=angle, omega0=rate)
def test_mirror_image_moves_as_the_mirror_image(theta0, omega0):
    t = np.linspace(0, 4, 9)
    one, other = simulate(scene(DRAG, theta0, omega0), t), simulate(scene(DRAG, -theta0, -omega0), t)
    np.testing.assert_allclose(one.theta_rad, -other.theta_rad, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(theta0=angle, omega0=rate, shift=st.floats(0.1, 3))
def test_going_on_from_a_later_state_is_the_same_motion(theta0, omega0, shift):
    t = np.linspace(shift, shift + 3, 7)
    whole = simulate(scene(DRAG, theta0, omega0), np.concatenate([[shift], t]), 1e-11)
    later = simulate(scene(DRAG, whole.theta_rad[0], whole.omega_rad_per_s[0]), t - shift, 1e-11)
    np.testing.assert_allclose(later.theta_rad, whole.theta_rad[1:], atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(theta0=angle, phase=st.floats(0, 6), shift=st.floats(0.1, 3))
def test_a_drive_knows_the_time_of_day(theta0, phase, shift):
    """start_s: the drive's phase goes on; the same as a drive with a later phase."""
    one = scene({"cosine_drive": {"f0_n": 0.5, "f_hz": 0.7, "phase_rad": phase}, "linear_drag": {"k_d_kg_per_s": 0.02}})
    equation = scene_equation(one)
    p = scene_parameters(one, equation)
    t = np.linspace(0, 3, 7)
    late = equation.solve(p, theta0, 0.0, t + shift, start_s=shift)
    turned = {**p, "cosine_drive.phase_rad": phase + 2 * np.pi * 0.7 * shift}
    np.testing.assert_allclose(late.theta_rad, equation.solve(turned, theta0, 0.0, t).theta_rad, atol=1e-8)

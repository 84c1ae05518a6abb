"""Every effect that there is: documented, checked, dimensionally sound, and what it claims to be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toolkit.effects import check_parameters, effect_names, load_effect
from toolkit.errors import UsageError
from toolkit.motion import build_equation
from toolkit.motion.symbols import number_functions, symbols
from toolkit.registry import load_part

ALL = effect_names()
UNITS = {  # exponents of kg, m, s
    "kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "1": (0, 0, 0), "rad": (0, 0, 0), "Hz": (0, 0, -1),
    "N": (1, 1, -2), "J": (1, 2, -2), "W": (1, 2, -3), "Pa": (1, -1, -2),
}  # fmt: skip
SCENE_UNITS = {
    "mass_kg": "kg", "length_m": "m", "g_m_per_s2": "m/s^2", "bob_radius_m": "m", "fluid_density_kg_per_m3": "kg/m^3",
    "fluid_viscosity_pa_s": "Pa s",
}  # fmt: skip
FORMULA = "-a * theta**3 - b * abs(omega)**1.5 * sign(omega)"
VALUES = {
    "mass_kg": 0.25, "length_m": 0.5, "g_m_per_s2": 9.81, "bob_radius_m": 0.02, "fluid_density_kg_per_m3": 1.2,
    "fluid_viscosity_pa_s": 1.8e-5, "linear_drag.k_d_kg_per_s": 0.1, "quadratic_drag.c_kg_per_m": 0.01,
    "sphere_drag.factor": 1.5, "string_drag.diameter_m": 4e-4, "cosine_drive.f0_n": 0.2, "cosine_drive.f_hz": 0.4,
    "cosine_drive.phase_rad": 0.3, "pivot_friction.torque_n_m": 0.01, "added_mass.viscous_damping": 0.8,
    "string_mass.string_mass_kg": 0.01, "elastic_string.stiffness_n_per_m": 800.0, "moving_pivot.amplitude_m": 0.01,
    "moving_pivot.f_hz": 1.2, "moving_pivot.phase_rad": 0.4, "moving_pivot.direction_rad": 0.3, "formula.a": 0.02,
    "formula.b": 0.01,
}  # fmt: skip


def exponents(unit):
    """Of kg, m, s in a unit such as `N m`, `kg/s` or `m/s^2`: one `/`, all after which divides. Raises KeyError for an unknown one."""
    total = np.zeros(3)
    for sign, part in zip((1, -1), unit.split("/")):
        for factor in part.split():
            name, _, power = factor.partition("^")
            total += sign * int(power or 1) * np.array(UNITS[name])
    return total


def some_value(parameter):
    """A value that the parameter may have, for an effect of which nothing stands in VALUES: its default, else one in its range."""
    if parameter.default:
        return parameter.default
    low = -math.inf if parameter.minimum is None else parameter.minimum
    high = math.inf if parameter.maximum is None else parameter.maximum
    return (
        0.05
        if low < 0.05 < high
        else 0.5 * (low + high)
        if math.isfinite(low + high)
        else low + 1
        if low > 0.05
        else high - 1
    )


for _name in ALL:
    VALUES = {f"{_name}.{p.name}": some_value(p) for p in load_effect(_name).parameters} | VALUES


def one(name):
    return build_equation([name], formulas={"formula": FORMULA})


def in_other_units(name, unit_kg, unit_m, unit_s):
    """VALUES, measured in other units of mass, length and time."""
    effect = load_effect(name)
    units = dict(SCENE_UNITS) | {f"{name}.{p.name}": p.unit for p in effect.parameters}
    units |= {"formula.a": "N m", "formula.b": None}
    changed = {}
    for full, value in VALUES.items():
        unit = units.get(full)
        if full == "formula.b":  # N m s^1.5
            changed[full] = value * unit_kg * unit_m**2 * unit_s ** (-2 + 1.5)
        elif unit is not None:
            kg, m, s = exponents(unit)
            changed[full] = value * unit_kg**kg * unit_m**m * unit_s**s
    return changed


@pytest.mark.parametrize("name", ALL)
def test_documented(name):
    effect = load_effect(name)
    assert effect.name == name
    assert len(effect.meaning) > 15
    assert len(effect.valid) > 10
    assert len(effect.reference) > 5
    for p in effect.parameters:
        assert p.meaning
        assert exponents(p.unit).shape == (3,)
        assert p.name == p.name.lower()
        assert p.minimum is None or p.default is None or p.minimum <= p.default
    assert set(effect.needs) <= set(SCENE_UNITS)
    assert one(name).latex.count("{") == one(name).latex.count("}")


@pytest.mark.parametrize("name", ALL)
def test_dimensionally_consistent(name):
    """Torque, inertia, tension and energy in other units of mass, length and time are the same physical quantities."""
    equation = one(name)
    kg, m, s = 3.0, 0.7, 1.9  # a new unit is the old one divided by these
    here = equation.terms_at(VALUES, 0.7, 0.6, -1.3)
    there = equation.terms_at(in_other_units(name, kg, m, s), 0.7 * s, 0.6, -1.3 / s)
    assert there.torque == pytest.approx(here.torque * kg * m**2 / s**2, rel=1e-12)
    assert there.inertia == pytest.approx(here.inertia * kg * m**2, rel=1e-12)
    assert there.tension == pytest.approx(here.tension * kg * m / s**2, rel=1e-12)
    assert there.energy == pytest.approx(here.energy * kg * m**2 / s**2, rel=1e-12)


@pytest.mark.parametrize("name", [n for n in ALL if load_effect(n).dissipative])
def test_dissipative_never_gives_power(name):
    equation, bare = one(name), build_equation()
    for omega in np.linspace(-8, 8, 33):
        extra = equation.terms_at(VALUES, 0.3, 0.4, omega).torque - bare.terms_at(VALUES, 0.3, 0.4, omega).torque
        assert extra * omega <= 0


@pytest.mark.parametrize("name", [n for n in ALL if load_effect(n).linear])
def test_linear_is_linear(name):
    equation = build_equation([name], small_angle=True)
    assert equation.is_linear

    def torque(theta, omega):
        return equation.terms_at(VALUES, 0.7, theta, omega).torque

    zero = torque(0.0, 0.0)
    assert torque(0.3, 0.7) - zero == pytest.approx(3 * (torque(0.1, 0.2) - zero) + torque(0.0, 0.1) - zero, rel=1e-11)


@pytest.mark.parametrize("name", [n for n in ALL if load_effect(n).term.__code__.co_consts and n != "formula"])
def test_stored_energy_belongs_to_the_torque(name):
    """dE/dt along the equation is the power of drag, drive and friction alone (elastic_string: to first order)."""
    effect = load_effect(name)
    if effect.pivot is not None:
        pytest.skip("the frame is shaken: the energy seen from the pivot is not kept")
    equation = one(name)
    seen = symbols(number_functions(), {"t": 0.2, "theta": 0.5, "omega": 1.1}, VALUES, [effect], False)[name]
    term = effect.term(seen)
    if not isinstance(term.energy, int | float) or term.energy == 0:
        return

    def energy(theta, omega):
        return float(equation.terms_at(VALUES, 0.2, theta, omega).energy)

    h, theta, omega = 1e-5, 0.5, 1.1
    motion = equation.terms_at(VALUES, 0.2, theta, omega)
    rate = (energy(theta + h, omega) - energy(theta - h, omega)) / (2 * h) * omega
    rate += (energy(theta, omega + h) - energy(theta, omega - h)) / (2 * h) * motion.torque / motion.inertia
    second_order = (VALUES["mass_kg"] * VALUES["g_m_per_s2"]) ** 2 / 800.0 / 0.25 if name == "elastic_string" else 0
    assert rate == pytest.approx(0, abs=1e-8 + 0.01 * second_order)


@pytest.mark.parametrize("name", ALL)
def test_absent_effect_is_not_in_the_code(name):
    """The source of a bare pendulum names no effect, and stays the same whatever else the library holds."""
    source = build_equation().source
    assert name not in source
    assert all(p.name not in source for p in load_effect(name).parameters if len(p.name) > 3)


def test_sphere_drag_is_clift_and_gauvin():
    """C_D(200) of the `fluids` package's documentation, and the table of C_D at other Re."""
    effect = load_effect("sphere_drag")
    for re, expected, digits in (
        (200, 0.7905400398000133, 1e-12),
        (1, 27.65, 2e-4),
        (1e3, 0.464, 2e-3),
        (1e5, 0.468, 2e-3),
    ):
        rho, mu, r = 1.2, 1.8e-5, 0.02
        speed = re * mu / (2 * rho * r)
        values = {
            **VALUES,
            "fluid_density_kg_per_m3": rho,
            "fluid_viscosity_pa_s": mu,
            "bob_radius_m": r,
            "sphere_drag.factor": 1.0,
        }
        state = {"t": 0.0, "theta": 0.0, "omega": speed / VALUES["length_m"]}
        drag = effect.term(symbols(number_functions(), state, values, [effect], False)["sphere_drag"]).drag
        assert drag * speed / (0.5 * rho * math.pi * r**2 * speed**2) == pytest.approx(expected, rel=digits)


def test_string_drag_loses_what_the_ranking_says():
    """0.4 mm thread, ℓ = 0.5 m, air: equivalent k_d 2.5e-5, 4.4e-5, 9.3e-5 kg/s at A = 0.1, 0.3, 1.0 rad."""
    effect = load_effect("string_drag")
    values = {**VALUES, "g_m_per_s2": 9.80665, "fluid_density_kg_per_m3": 1.2041, "fluid_viscosity_pa_s": 1.825e-5}
    values["bob_radius_m"] = 0.0197
    phase = np.linspace(0, 2 * np.pi, 4001)[:-1]
    rate = math.sqrt(9.80665 / 0.5)
    for amplitude, expected in ((0.1, 2.5e-5), (0.3, 4.4e-5), (1.0, 9.3e-5)):
        omega = amplitude * rate * np.cos(phase)
        seen = symbols(number_functions(), {"t": 0.0, "theta": 0.0, "omega": omega}, values, [effect], False)
        power = -np.mean(effect.term(seen["string_drag"]).torque * omega)
        assert power / np.mean((0.5 * omega) ** 2) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("effects", "extra", "ppm"),
    [
        (["finite_bob"], {}, 320.0),
        (["buoyancy"], {"fluid_density_kg_per_m3": 1.2041}, 77.0),
        (["string_mass"], {"string_mass.string_mass_kg": 0.25e-3}, -1e3 / 12),
    ],
)
def test_period_corrections(effects, extra, ppm):
    """ΔT/T of the table of corrections, from the torque and inertia of the equation itself."""
    values = {**VALUES, "bob_radius_m": 0.02, "g_m_per_s2": 9.80665, **extra}
    if effects == ["buoyancy"]:
        values["bob_radius_m"] = 0.0197
    at = build_equation(effects).terms_at(values, 0.0, 1e-6, 0.0)
    period = math.sqrt(-at.inertia * 1e-6 / at.torque)
    assert (period / math.sqrt(0.5 / 9.80665) - 1) * 1e6 == pytest.approx(ppm, rel=0.01)


def test_added_mass_with_its_viscous_layer():
    """Steel ball r = 1.97 cm on 0.5 m: added mass 38 ppm + viscous 23 ppm; b = 5.8e-5 kg/s."""
    values = {**VALUES, "bob_radius_m": 0.0197, "g_m_per_s2": 9.80665, "fluid_density_kg_per_m3": 1.2041}
    values |= {"fluid_viscosity_pa_s": 1.825e-5, "added_mass.viscous_damping": 1.0}
    equation = build_equation(["added_mass"])
    inertia = equation.terms_at(values, 0.0, 1e-6, 0.0).inertia
    assert (math.sqrt(inertia / (0.25 * 0.25)) - 1) * 1e6 == pytest.approx(38 + 23, abs=1.0)
    damping = -equation.terms_at(values, 0.0, 0.0, 1.0).torque / 0.25
    assert damping == pytest.approx(5.8e-5, rel=0.01)


def test_elastic_string_lengthens_the_period_by_eleven_sixteenths_s_a_squared():
    values = {**VALUES, "g_m_per_s2": 9.80665}
    stiff = 0.25 * 9.80665 / (0.5 * 1e-3)  # s = mg/(kℓ) = 1e-3

    def period(effects, amplitude):
        """The time of the maximum after one swing there and back."""
        from scipy.optimize import brentq

        equation = build_equation(effects)
        full = {**values, "elastic_string.stiffness_n_per_m": stiff}

        def omega(t):
            return float(equation.solve(full, amplitude, 0.0, [t], 1e-13).omega_rad_per_s[0])

        return brentq(omega, 1.2, 1.6, xtol=1e-14)

    shift = period(["elastic_string"], 0.1) / period([], 0.1) - 1
    assert shift == pytest.approx(11 / 16 * 1e-3 * 0.01, rel=0.01)


@pytest.mark.parametrize(
    ("name", "table", "words"),
    [
        ("linear_drag", {"kd_kg_per_s": 0.1}, "did you mean 'k_d_kg_per_s'"),
        ("linear_drag", {}, "needs k_d_kg_per_s"),
        ("linear_drag", {"k_d_kg_per_s": -1}, "at least 0"),
        ("linear_drag", {"k_d_kg_per_s": "much"}, "finite number"),
        ("linear_drag", {"k_d_kg_per_s": float("nan")}, "finite number"),
        ("linear_drag", {"k_d_kg_per_s": True}, "finite number"),
        ("added_mass", {"viscous_damping": 2}, "at most 1"),
        ("buoyancy", {"density": 1}, "takes no keys"),
        ("linear_drag", 3, "table"),
        ("linear_dragg", {}, "did you mean 'linear_drag'"),
    ],
)
def test_wrong_tables_are_named_in_one_line(name, table, words):
    with pytest.raises(UsageError) as caught:
        check_parameters(name, table)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_defaults_are_filled_in():
    assert check_parameters("cosine_drive", {"f0_n": 0.1, "f_hz": 2})["phase_rad"] == 0.0


def test_checking_a_table_needs_no_sympy():
    import subprocess
    import sys

    code = (
        "import sys; from toolkit.effects import check_parameters as c, effect_names\n"
        "c('formula', {'torque': '-a*theta', 'a': 1.0})\n"
        "[c(n, {}) for n in ('buoyancy', 'finite_bob')]; assert len(effect_names()) >= 14\n"
        "print('sympy' in sys.modules or 'numba' in sys.modules or 'numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_a_part_is_found_by_its_file():
    import toolkit.effects

    assert load_part(toolkit.effects, "buoyancy", "EFFECT", frozenset({"effect"})).name == "buoyancy"

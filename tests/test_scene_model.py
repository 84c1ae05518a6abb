"""The model `scene`: what the scene names is fitted, and what it holds is held."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from synthetic_swing import swing

from toolkit.errors import UsageError
from toolkit.fit import fit, fit_models, has_full_sine
from toolkit.scene import Approximations, Pendulum, Scene
from toolkit.series import ThetaSeries

PENDULUM = Pendulum(mass_kg=0.05, length_m=0.5)
OMEGA = math.sqrt(9.80665 / 0.5)


def with_formula() -> ThetaSeries:
    """Linear drag and a torque −a θ³ besides, by SciPy."""

    def slope(_, y):
        cubic = 0.02 * y[0] ** 3 / (PENDULUM.mass_kg * PENDULUM.length_m**2)
        return y[1], -(OMEGA**2) * math.sin(y[0]) - 2 * 0.03 * y[1] - cubic

    t = np.arange(1201) / 60
    theta = solve_ivp(slope, (0, 21), [0.8, 0.0], "DOP853", t, rtol=1e-11, atol=1e-12).y[0]
    return ThetaSeries(t, theta + 1e-3 * np.random.default_rng(0).normal(size=t.size), np.full(t.size, 1e-3))


CUBIC = Scene(
    pendulum=PENDULUM,
    effects={"linear_drag": {"k_d_kg_per_s": 0.01}, "formula": {"torque": "-a*theta**3", "a": 0.02}},
)


def test_a_torque_of_the_scenes_own_joins_the_ladder():
    fits = fit_models(with_formula(), CUBIC, ("full_linear_drag", "scene"))
    own, plain = fits["scene"], fits["full_linear_drag"]
    assert own.success
    assert own.reduced_chi2 == pytest.approx(1, abs=0.15)
    assert plain.reduced_chi2 > 10
    k_d = own.parameters["k_d"]
    assert abs(k_d.value - 2 * 0.05 * 0.03) < 4 * k_d.stderr
    assert "scene" in fit_models(with_formula().between(0, 3), CUBIC)
    assert has_full_sine(own)


def test_only_what_is_named_is_fitted():
    series = swing(theta0=0.03, omega_g=OMEGA, alpha_d=0.0, beta=2.0, small_angle=True, noise_rad=1e-4, duration_s=30)
    scene = Scene(
        pendulum=PENDULUM,
        effects={"quadratic_drag": {"c_kg_per_m": 0.1}},
        approximations=Approximations(small_angle=True),
    )
    result = fit(series, scene, "scene")
    assert result.success
    assert not has_full_sine(result)
    assert "k_d" not in result.parameters
    assert abs(result.parameters["c"].value - 2.0 * 0.05 / 0.5) < 4 * result.parameters["c"].stderr
    assert "scene" not in fit_models(series.between(0, 3), scene)  # the ladder has it


def test_what_it_needs_is_said():
    with pytest.raises(UsageError, match="mass and length"):
        fit(swing(duration_s=3), Scene(effects={"formula": {"torque": "-a*theta", "a": 0.1}}), "scene")

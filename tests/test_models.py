"""Models: found by name, started as the conventions say, with derivatives that are right."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from synthetic_swing import swing

from toolkit.errors import UsageError
from toolkit.models import STANDARD, load_model, model_names
from toolkit.scene import Pendulum, Scene

VALUES = {
    "theta0": 1.3,
    "omega_g": 4.4,
    "alpha_d": 0.03,
    "beta": 0.05,
    "mu": 0.02,
    "drive": 1.0,
    "f": 0.5,
    "drive_phase": 0.3,
}


def test_every_model_is_found_and_documented():
    assert set(STANDARD) <= set(model_names())
    for name in model_names():
        model = load_model(name)
        assert model.name == name
        assert model.summary
        assert model.small_angle == name.startswith("small_angle")


def test_unknown_model_names_the_nearest():
    with pytest.raises(UsageError, match="did you mean 'full_linear_drag'"):
        load_model("full_linear_drg")


@pytest.mark.parametrize("name", [n for n in model_names() if not load_model(n).needs_scene])
@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("phi", [0.7, -2.0])
def test_derivatives_are_those_of_central_differences(name, driven, phi):
    model = load_model(name)
    if driven:
        model = replace(model, effects=(*model.effects, "cosine_drive"))
    if driven and name == "full_undamped":
        pytest.skip("covered by the others")
    t = np.linspace(0, 8, 150)
    values = {**VALUES, "phi": phi}
    names = (*model.coefficients, "theta0", "phi", "omega_g")
    motion = model.motion(values, t, names)
    for i, one in enumerate(names):
        h = 2e-5
        up, down = (model.motion({**values, one: values[one] + s * h}, t) for s in (1, -1))
        for difference, ours in (
            ((up.theta - down.theta) / (2 * h), motion.d_theta[:, i]),
            ((up.omega - down.omega) / (2 * h), motion.d_omega[:, i]),
        ):
            assert np.max(np.abs(difference - ours)) < 2e-5 * (1 + np.max(np.abs(ours))), one


@pytest.mark.parametrize(
    "name", ["full_linear_quadratic_drag", "full_quadratic_drag", "small_angle_linear_quadratic_drag"]
)
def test_motion_agrees_with_scipy(name):
    model = load_model(name)
    values = {"theta0": 1.1, "phi": -0.4, "omega_g": 5.0, "alpha_d": 0.05, "beta": 0.1}
    alpha = values["alpha_d"] if "alpha_d" in model.coefficients else 0.0
    truth = swing(1.1, -0.4, 5.0, alpha, 0.1, duration_s=10, noise_rad=0.0, offset=0.0, small_angle=model.small_angle)
    assert np.max(np.abs(model.motion(values, truth.t_s).theta - truth.theta_rad)) < 3e-9


def test_start_follows_the_conventions():
    motion = load_model("full_linear_drag").motion(
        {"theta0": 1.0, "phi": 0.6, "omega_g": 4.0, "alpha_d": 0.1}, np.array([0.0])
    )
    kappa = math.sin(0.5)
    assert math.sin(motion.theta[0] / 2) == pytest.approx(kappa * math.sin(0.6), abs=1e-12)
    assert motion.omega[0] == pytest.approx(2 * kappa * 4.0 * math.cos(0.6), abs=1e-12)


def test_sphere_drag_needs_mass_length_and_radius():
    with pytest.raises(UsageError, match="mass and length"):
        load_model("full_sphere_drag").within(Scene())
    with pytest.raises(UsageError, match="radius"):
        load_model("full_sphere_drag").within(Scene(pendulum=Pendulum(0.1, 0.5)))
    model = load_model("full_sphere_drag").within(Scene(pendulum=Pendulum(0.01, 0.5, 0.02)))
    motion = model.motion({"theta0": 1.0, "phi": 1.5, "omega_g": 4.4}, np.linspace(0, 20, 200))
    assert np.max(np.abs(motion.theta[150:])) < np.max(np.abs(motion.theta[:50]))

"""The pendulum does not swing in one plane: its bob draws a narrow ellipse, seen from above."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.distance_m = shoot.distance_m or values["distance_m"]
    amplitude, phase, omega = values["amplitude_rad"], values["phase_rad"], shoot.omega_g_rad_per_s

    def swing(t: np.ndarray, xyz: np.ndarray) -> np.ndarray:
        psi = (amplitude * np.sin(omega * t + phase))[..., None]
        return xyz * np.cos(psi) + shoot.length_m * np.sin(psi) * np.array([0.0, 0.0, 1.0])

    shoot.sway.append(swing)


EFFECT = CameraEffect(
    meaning="The string leaves the plane by amplitude_rad · sin(ω_g t + phase_rad); θ is the angle within the plane.",
    kind="geometry",
    parameters=(
        Parameter("amplitude_rad", "rad", "largest angle out of the plane", 0.05, 0.0, 1.0),
        Parameter("phase_rad", "rad", "0: crosses the plane at t = 0", 0.0, -7.0, 7.0),
        Parameter("distance_m", "m", "camera distance, where [camera.perspective] gives none", 2.0, 0.05, None),
    ),
    apply=apply,
    example={"amplitude_rad": 0.15},
)

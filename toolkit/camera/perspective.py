"""The camera stands near and not square to the plane of swing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.distance_m = values["distance_m"]
    shoot.yaw_rad, shoot.pitch_rad, shoot.roll_rad = values["yaw_rad"], values["pitch_rad"], values["roll_rad"]


EFFECT = CameraEffect(
    meaning="A pinhole camera that looks at the middle of the picture from distance_m, turned about that point.",
    kind="geometry",
    parameters=(
        Parameter("yaw_rad", "rad", "turn about the vertical: camera to the side", 0.0, -1.2, 1.2),
        Parameter("pitch_rad", "rad", "turn about the horizontal: camera above or below", 0.0, -1.2, 1.2),
        Parameter("roll_rad", "rad", "turn about the line of sight: the horizon is not level", 0.0, -3.2, 3.2),
        Parameter(
            "distance_m", "m", "from the camera to the plane of swing at the middle of the picture", 2.0, 0.05, None
        ),
    ),
    apply=apply,
    off={"yaw_rad": 0.0, "pitch_rad": 0.0, "roll_rad": 0.0, "distance_m": 1e6},
    example={"yaw_rad": 0.26, "pitch_rad": 0.1, "roll_rad": 0.05, "distance_m": 1.5},
)

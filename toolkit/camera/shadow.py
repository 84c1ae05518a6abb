"""The bob casts a soft shadow on the wall, which swings with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.paint import soft_disc
from toolkit.camera.shoot import Patch, Shoot, View


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    def cast(view: View) -> list[Patch]:
        x, y = view.x_px + values["right_px"], view.y_px + values["down_px"]
        return [soft_disc(x, y, view.radius_px, values["softness_px"], (0.0, 0.0, 0.0), values["strength"])]

    shoot.behind.append(cast)


EFFECT = CameraEffect(
    meaning="A dark soft disc behind the pendulum, a fixed offset from the bob.",
    kind="scenery",
    parameters=(
        Parameter("strength", "1", "fraction of light taken away", 0.3, 0.0, 1.0),
        Parameter("right_px", "px", "offset to the right", 18.0, None, None),
        Parameter("down_px", "px", "offset downwards", 10.0, None, None),
        Parameter("softness_px", "px", "sigma of its edge", 4.0, 0.3, 100.0),
    ),
    apply=apply,
    off={"strength": 0.0},
    example={"strength": 0.5},
)

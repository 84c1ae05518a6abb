"""The wall behind the pendulum: its colour and a gradient of the light on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter, colour
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.wall_rgb = values["colour_rgb"]
    slope = values["gradient"]

    def shade(image: np.ndarray) -> None:
        image *= 1 + slope * np.linspace(-1, 1, image.shape[1], dtype=np.float32)[None, :, None]

    if slope:
        shoot.backdrop.insert(0, shade)


EFFECT = CameraEffect(
    meaning="A wall of one colour, brighter to the right by the gradient.",
    kind="scenery",
    parameters=(
        colour("colour_rgb", "colour of the wall", (200.0, 200.0, 200.0)),
        Parameter("gradient", "1", "relative change from the middle to the right edge", 0.0, -1.0, 1.0),
    ),
    apply=apply,
    off={"gradient": 0.0},
    example={"colour_rgb": (150.0, 175.0, 190.0), "gradient": 0.15},
)

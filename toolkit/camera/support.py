"""What the string hangs from: a clamp at the pivot, on a rod that reaches in from the side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter, colour
from toolkit.camera.paint import lay, soft_box
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    size, rgb = values["size_px"], values["colour_rgb"]
    x, y = shoot.pivot_px

    def mount(image: np.ndarray) -> None:
        clamp = soft_box(x - size / 2, x + size / 2, y - size, y, 0.6, rgb)
        rod = soft_box(x, shoot.width_px + 9.0, y - 0.7 * size, y - 0.4 * size, 0.6, rgb)
        for patch in (clamp, rod):
            lay(image, patch, np.asarray(rgb))

    if size > 0:
        shoot.backdrop.append(mount)


EFFECT = CameraEffect(
    meaning="A still clamp above the pivot and a rod to the right, where they are in the picture.",
    kind="scenery",
    parameters=(
        Parameter("size_px", "px", "width and height of the clamp", 24.0, 0.0, 500.0),
        colour("colour_rgb", "its colour", (95.0, 98.0, 105.0)),
    ),
    apply=apply,
    off={"size_px": 0.0},
    example={"size_px": 30.0},
)

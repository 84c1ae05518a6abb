"""The picture is darker towards its corners."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    middle = shoot.middle_px

    def darken(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        r2 = ((x - middle[0]) ** 2 + (y - middle[1]) ** 2) / float(np.sum(middle**2))
        return 1 - values["corner_loss"] * r2

    shoot.falloff.append(darken)


EFFECT = CameraEffect(
    meaning="Light is multiplied by 1 − corner_loss · r², r being 1 at the corner.",
    kind="light",
    parameters=(Parameter("corner_loss", "1", "fraction of light lost in the corners", 0.3, 0.0, 1.0),),
    apply=apply,
    off={"corner_loss": 0.0},
    example={"corner_loss": 0.6},
)

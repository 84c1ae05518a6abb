"""The camera encodes light by a power law: blur, noise and vignetting act on light, the file holds its root."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.gamma = values["gamma"]


EFFECT = CameraEffect(
    meaning="Level = 255 (light/255)^(1/gamma). Colours in a scene are levels; blends are made in light.",
    kind="sensor",
    parameters=(Parameter("gamma", "1", "exponent of the display", 2.2, 0.2, 5.0),),
    apply=apply,
    off={"gamma": 1.0},
    example={"gamma": 2.2},
)

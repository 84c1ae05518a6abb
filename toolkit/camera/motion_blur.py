"""The shutter is open for a while: moving things are smeared, evenly over the exposure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.exposure_s = values["exposure_s"]


EFFECT = CameraEffect(
    meaning="The shutter stays open: the bob is drawn as the mean of its positions during the exposure.",
    kind="exposure",
    parameters=(Parameter("exposure_s", "s", "time for which every row is exposed", 0.004, 0.0, 1.0),),
    apply=apply,
    off={"exposure_s": 0.0},
    example={"exposure_s": 0.012},
)

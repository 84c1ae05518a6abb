"""Rows are read one after the other: lower rows see a later moment, a moving bob is sheared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.readout_s = values["readout_s"]


EFFECT = CameraEffect(
    meaning="Rows are exposed one after the other, the middle row at the frame's own time.",
    kind="exposure",
    parameters=(Parameter("readout_s", "s", "time from the first row to the last", 0.015, -0.1, 0.1),),
    apply=apply,
    off={"readout_s": 0.0},
    example={"readout_s": 0.016},
)

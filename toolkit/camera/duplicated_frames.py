"""Some frames are shown twice, in place of the next one (a recorder that could not keep up)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    repeat = rng.random(shoot.captured_s.size) < values["fraction"]
    repeat[0] = False
    last = np.maximum.accumulate(np.where(repeat, 0, np.arange(repeat.size)))
    shoot.captured_s = shoot.captured_s[last]


EFFECT = CameraEffect(
    meaning="A random fraction of the frames repeats the picture before it, under its own time stamp.",
    kind="clock",
    parameters=(Parameter("fraction", "1", "fraction of frames that are repeats", 0.05, 0.0, 0.9),),
    apply=apply,
    off={"fraction": 0.0},
    example={"fraction": 0.2},
)

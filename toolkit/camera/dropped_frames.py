"""The phone drops frames: the file has fewer of them, and says so in its time stamps or does not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    keep = rng.random(shoot.captured_s.size) >= values["fraction"]
    keep[0] = True
    shoot.captured_s = shoot.captured_s[keep]
    counted = np.arange(shoot.captured_s.size) / float(shoot.fps)
    shoot.stamped_s = counted if values["stamps"] == "counted" else shoot.stamped_s[keep]


EFFECT = CameraEffect(
    meaning="A random fraction of the frames is missing; stamps are true, or counted as if none were.",
    kind="clock",
    parameters=(
        Parameter("fraction", "1", "fraction of frames that are dropped", 0.03, 0.0, 0.9),
        Parameter("stamps", "", "time stamps of the others", "true", choices=("true", "counted")),
    ),
    apply=apply,
    off={"fraction": 0.0},
    example={"fraction": 0.2},
)

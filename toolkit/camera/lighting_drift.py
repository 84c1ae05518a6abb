"""The light changes during the clip: a lamp that warms up, a cloud, auto exposure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    relative, wave, period = values["relative"], values["wave"], values["period_s"]

    def drift(t: np.ndarray, exposure_s: float) -> np.ndarray:
        return 1 + relative * t / shoot.duration_s + wave * np.sin(2 * np.pi * t / period)

    shoot.gain.append(drift)


EFFECT = CameraEffect(
    meaning="Light is multiplied by 1 + relative · t/duration + wave · sin(2πt/period_s).",
    kind="light",
    parameters=(
        Parameter("relative", "1", "change from the first frame to the last", -0.2, -0.95, 5.0),
        Parameter("wave", "1", "amplitude of a slow wave", 0.0, 0.0, 0.9),
        Parameter("period_s", "s", "period of the wave", 3.0, 0.1, None),
    ),
    apply=apply,
    off={"relative": 0.0, "wave": 0.0},
    example={"relative": -0.4, "wave": 0.1},
)

"""The camera is held by hand: the whole picture wanders and turns a little."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    tones = 9
    f = rng.uniform(values["slowest_hz"], max(values["fastest_hz"], values["slowest_hz"]), (3, tones))
    phase = rng.uniform(0, 2 * np.pi, (3, tones))
    rms = np.array([values["rms_px"], values["rms_px"], values["roll_rms_rad"]])
    weight = 1 / f  # slow tones are large
    size = rms[:, None] * weight * np.sqrt(2 / np.sum(weight**2, axis=1, keepdims=True))

    def wander(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        turn = 2 * np.pi * f * np.asarray(t)[..., None, None] + phase
        dx, dy, roll = np.moveaxis(np.sum(size * np.sin(turn), axis=-1), -1, 0)
        return dx, dy, roll

    shoot.shake.append(wander)


EFFECT = CameraEffect(
    meaning="Shift and roll about the middle of the picture, a sum of slow random tones. Truth is in the shaken pixels.",
    kind="geometry",
    parameters=(
        Parameter("rms_px", "px", "rms of the shift along each axis", 2.0, 0.0, 100.0),
        Parameter("roll_rms_rad", "rad", "rms of the roll", 0.0, 0.0, 0.2),
        Parameter("slowest_hz", "Hz", "lowest tone", 0.4, 0.05, 30.0),
        Parameter("fastest_hz", "Hz", "highest tone", 5.0, 0.05, 30.0),
    ),
    apply=apply,
    off={"rms_px": 0.0, "roll_rms_rad": 0.0},
    example={"rms_px": 4.0, "roll_rms_rad": 0.004},
)

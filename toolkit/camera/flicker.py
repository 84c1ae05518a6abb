"""Lamps on the mains flicker at twice its frequency; with a rolling shutter this draws bands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    depth, f_hz = values["depth"], values["f_hz"]

    def pulse(t: np.ndarray, exposure_s: float) -> np.ndarray:
        return 1 + depth * np.sinc(f_hz * exposure_s) * np.sin(2 * np.pi * f_hz * t)

    shoot.gain.append(pulse)


EFFECT = CameraEffect(
    meaning="Light is multiplied by 1 + depth · sin(2π f_hz t), averaged over the exposure of each row.",
    kind="light",
    parameters=(
        Parameter("depth", "1", "amplitude relative to the mean", 0.1, 0.0, 1.0),
        Parameter("f_hz", "Hz", "twice the mains frequency", 100.0, 0.1, 1000.0),
    ),
    apply=apply,
    off={"depth": 0.0},
    example={"depth": 0.2},
)

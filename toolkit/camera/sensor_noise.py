"""Noise of the sensor: read noise and shot noise, independent for every pixel, colour and frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.read_sigma = values["read_sigma"]
    shoot.shot_sigma_at_white = values["shot_sigma_at_white"]


EFFECT = CameraEffect(
    meaning="Gaussian noise of variance read_sigma² + shot_sigma_at_white² · (light/255), before gamma.",
    kind="sensor",
    parameters=(
        Parameter("read_sigma", "level", "noise in the dark", 2.0, 0.0, 100.0),
        Parameter(
            "shot_sigma_at_white", "level", "noise that light 255 adds; shot noise grows with its root", 0.0, 0.0, 100.0
        ),
    ),
    apply=apply,
    off={"read_sigma": 0.0, "shot_sigma_at_white": 0.0},
    example={"read_sigma": 4.0, "shot_sigma_at_white": 8.0},
)

"""A real lens: points move along their radius from the middle of the picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    middle = shoot.middle_px
    corner = float(np.hypot(*middle))
    k1, k2 = values["k1"], values["k2"]

    def bend(points: np.ndarray) -> np.ndarray:
        offset = points - middle
        r2 = np.sum(offset**2, axis=-1, keepdims=True) / corner**2
        return middle + offset * (1 + k1 * r2 + k2 * r2**2)

    shoot.lens.append(bend)


EFFECT = CameraEffect(
    meaning="Radius r (1 at the corner) becomes r (1 + k1 r² + k2 r⁴): k1 < 0 barrel, k1 > 0 pincushion.",
    kind="geometry",
    parameters=(
        Parameter("k1", "1", "third-order distortion at the corner", -0.05, -0.4, 0.4),
        Parameter("k2", "1", "fifth-order distortion at the corner", 0.0, -0.4, 0.4),
    ),
    apply=apply,
    off={"k1": 0.0, "k2": 0.0},
    example={"k1": -0.12},
)

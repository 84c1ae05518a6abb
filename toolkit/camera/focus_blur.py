"""The lens is out of focus: everything is softer by a Gaussian."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    sigma = values["sigma_px"]
    shoot.edge_sigma_px = float(np.hypot(shoot.edge_sigma_px, sigma))
    if sigma > 0:
        shoot.blur_backdrop_px = sigma


EFFECT = CameraEffect(
    meaning="Edges and the wall are blurred by a Gaussian of sigma_px, on top of the lens's own 0.5 px.",
    kind="light",
    parameters=(Parameter("sigma_px", "px", "sigma of the blur", 1.5, 0.0, 20.0),),
    apply=apply,
    off={"sigma_px": 0.0},
    example={"sigma_px": 3.0},
)

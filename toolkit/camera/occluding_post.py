"""Something stands before the pendulum and hides the bob when it passes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter, colour
from toolkit.camera.paint import soft_box
from toolkit.camera.shoot import Patch, Shoot, View


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    half = values["width_px"] / 2

    def stand(view: View) -> list[Patch]:
        foot = view.place(np.array([values["x_px"], shoot.middle_px[1]]))
        return [soft_box(foot[0] - half, foot[0] + half, -9, shoot.height_px + 9, 0.6, values["colour_rgb"])]

    if half > 0:
        shoot.front.append(stand)


EFFECT = CameraEffect(
    meaning="An upright post over the whole height. Truth says how much of the bob is visible.",
    kind="scenery",
    parameters=(
        Parameter("x_px", "px", "its middle", 260.0, None, None),
        Parameter("width_px", "px", "its width", 40.0, 0.0, None),
        colour("colour_rgb", "its colour", (110.0, 95.0, 80.0)),
    ),
    apply=apply,
    off={"width_px": 0.0},
    example={"x_px": 250.0},
)

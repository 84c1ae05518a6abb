"""The string: its width on the picture and its colour. Without this it is 2 px wide and grey."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter, colour
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.string_width_px = values["width_px"]
    shoot.string_rgb = values["colour_rgb"]


EFFECT = CameraEffect(
    meaning="A straight string from the pivot to the bob; width 0 hides it.",
    kind="scenery",
    parameters=(
        Parameter("width_px", "px", "width; 0 for none, below 1 for a thread", 2.0, 0.0, 100.0),
        colour("colour_rgb", "its colour", (70.0, 70.0, 70.0)),
    ),
    apply=apply,
    off={},
    example={"width_px": 0.6, "colour_rgb": (120.0, 120.0, 120.0)},
)

"""Something else moves through the picture: a person walks by, a ball rolls past."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter, colour
from toolkit.camera.paint import soft_box, soft_disc
from toolkit.camera.shoot import Patch, Shoot, View


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    radius, speed = values["radius_px"], values["speed_px_per_s"]
    start = -2 * radius if speed >= 0 else shoot.width_px + 2 * radius

    def pass_by(view: View) -> list[Patch]:
        x = start + speed * (view.t_s - values["start_s"])
        if view.t_s < values["start_s"] or not -3 * radius <= x <= shoot.width_px + 3 * radius:
            return []
        x, y = view.place(np.array([x, values["y_px"]]))
        if values["shape"] == "disc":
            return [soft_disc(x, y, radius, 0.6, values["colour_rgb"])]
        return [soft_box(x - radius, x + radius, y - radius, shoot.height_px + 9, 0.6, values["colour_rgb"])]

    if radius > 0:
        (shoot.front if values["depth"] == "front" else shoot.behind).append(pass_by)


EFFECT = CameraEffect(
    meaning="A disc, or a tall figure, that crosses the picture once at even speed, behind or before the pendulum.",
    kind="scenery",
    parameters=(
        Parameter("shape", "", "what it is", "disc", choices=("disc", "figure")),
        Parameter("depth", "", "where it passes", "behind", choices=("behind", "front")),
        Parameter("start_s", "s", "when it enters", 1.0, 0.0, None),
        Parameter("speed_px_per_s", "px/s", "its speed, negative to the left", 250.0, None, None),
        Parameter("y_px", "px", "row of its middle (of a figure's top)", 240.0, None, None),
        Parameter("radius_px", "px", "radius or half width", 22.0, 0.0, None),
        colour("colour_rgb", "its colour", (60.0, 70.0, 60.0)),
    ),
    apply=apply,
    off={"radius_px": 0.0},
    example={"start_s": 0.0, "speed_px_per_s": 400.0},
)

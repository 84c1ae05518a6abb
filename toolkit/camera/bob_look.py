"""What the bob looks like: its colours, shading, a highlight, a pattern that turns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter, colour
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.bob_rgb = values["colour_rgb"]
    first, second = np.array(values["colour_rgb"]), np.array(values["second_rgb"])
    strength, spin = values["strength"], values["spin_rad_per_s"]

    def mix(share: np.ndarray) -> np.ndarray:
        return first + strength * np.clip(share, 0, 1)[..., None] * (second - first)

    def height(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.sqrt(np.maximum(1 - u * u - v * v, 0))

    def shaded(u: np.ndarray, v: np.ndarray, theta: float, t: float) -> np.ndarray:
        facing = np.maximum(-0.5 * u - 0.6 * v + 0.62 * height(u, v), 0)  # towards a lamp at the upper left
        return first * (1 - strength * (1 - facing))[..., None]

    def highlight(u: np.ndarray, v: np.ndarray, theta: float, t: float) -> np.ndarray:
        return mix(np.exp(-((u + 0.35) ** 2 + (v + 0.4) ** 2) / (2 * 0.16**2)))

    def rotating_pattern(u: np.ndarray, v: np.ndarray, theta: float, t: float) -> np.ndarray:
        along, up = np.cos(theta) * u - np.sin(theta) * v, np.sin(theta) * u + np.cos(theta) * v
        longitude = np.arctan2(along, height(along, up)) + spin * t
        return mix(0.5 + 0.5 * np.tanh(5 * np.sin(3 * longitude)))

    def two_coloured(u: np.ndarray, v: np.ndarray, theta: float, t: float) -> np.ndarray:
        turned = theta + spin * t
        return mix(0.5 + 0.5 * np.tanh(12 * (np.sin(turned) * u + np.cos(turned) * v)))

    looks = {
        "shaded": shaded,
        "highlight": highlight,
        "rotating_pattern": rotating_pattern,
        "two_coloured": two_coloured,
    }
    shoot.look = looks.get(values["look"])


EFFECT = CameraEffect(
    meaning="Colour and look: plain, shaded by a lamp, with a highlight, striped and turning about the string, or in halves.",
    kind="scenery",
    parameters=(
        Parameter(
            "look",
            "",
            "kind of look",
            "plain",
            choices=("plain", "shaded", "highlight", "rotating_pattern", "two_coloured"),
        ),
        colour("colour_rgb", "colour of the bob", (45.0, 45.0, 50.0)),
        colour("second_rgb", "second colour: of the highlight, the stripes or the lower half", (235.0, 235.0, 235.0)),
        Parameter("strength", "1", "how much of the look, 0 for plain", 0.7, 0.0, 1.0),
        Parameter("spin_rad_per_s", "rad/s", "turning of the pattern", 1.5, -200.0, 200.0),
    ),
    apply=apply,
    off={"look": "plain"},
    example={"look": "rotating_pattern", "colour_rgb": (40.0, 60.0, 160.0)},
)

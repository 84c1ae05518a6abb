"""Still things stand or hang behind the pendulum: boxes, sticks and round things, some like the bob."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    from toolkit.camera.paint import lay, soft_box, soft_disc

    def furnish(image: np.ndarray) -> None:
        height, width = image.shape[:2]
        for number in range(round(values["count"])):
            x, y, size = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.02, 0.12) * height
            long = size * rng.uniform(0.15, 3)
            rgb = np.asarray(shoot.wall_rgb) + values["contrast"] * rng.uniform(-1, 1, 3)
            if number % 3 == 0:
                patch = soft_disc(x, y, shoot.radius_m * shoot.px_per_m * rng.uniform(0.7, 1.5), 0.6, rgb)
            else:
                patch = soft_box(x - size / 2, x + size / 2, y - long / 2, y + long / 2, 0.6, rgb)
            lay(image, patch, np.clip(rgb, 0, 255))

    shoot.backdrop.append(furnish)


EFFECT = CameraEffect(
    meaning="`count` still boxes and discs on the wall, every third a disc about as large as the bob.",
    kind="scenery",
    parameters=(
        Parameter("count", "1", "number of things", 8.0, 0.0, 500.0),
        Parameter("contrast", "level", "largest difference of their colour from the wall's", 120.0, 0.0, 255.0),
    ),
    apply=apply,
    off={"count": 0.0},
    example={"count": 14.0},
)

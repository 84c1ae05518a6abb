"""The wall is not smooth: plaster, bricks or wallpaper, as random blotches of several sizes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    def roughen(image: np.ndarray) -> None:
        import cv2

        height, width = image.shape[:2]
        total = np.zeros((height, width), np.float32)
        for octave in range(4):
            size = values["scale_px"] / 2**octave
            coarse = rng.standard_normal((int(height / size) + 4, int(width / size) + 4)).astype(np.float32)
            large = cv2.resize(coarse, None, fx=size, fy=size, interpolation=cv2.INTER_CUBIC)
            total += large[:height, :width] * 0.7**octave
        image += (total / total.std() * values["rms"])[:, :, None]

    if values["rms"] > 0:
        shoot.backdrop.append(roughen)


EFFECT = CameraEffect(
    meaning="Still random blotches on the wall, of scale_px and three octaves below it.",
    kind="scenery",
    parameters=(
        Parameter("rms", "level", "rms of the blotches", 10.0, 0.0, 100.0),
        Parameter("scale_px", "px", "size of the largest blotches", 24.0, 8.0, 1000.0),
    ),
    apply=apply,
    off={"rms": 0.0},
    example={"rms": 16.0},
)

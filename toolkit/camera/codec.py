"""How the film is stored. Without this: H.264 of high quality, or lossless where the name asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    shoot.codec = dict(values)


EFFECT = CameraEffect(
    meaning="H.264, HEVC, MJPEG or lossless, at a bit rate or (bit rate 0) at a constant quality.",
    kind="file",
    parameters=(
        Parameter("name", "", "which codec", "h264", choices=("h264", "hevc", "mjpeg", "lossless")),
        Parameter("bit_rate_bit_per_s", "bit/s", "mean bit rate; 0 for constant quality", 0.0, 0.0, 1e9),
        Parameter("crf", "1", "constant quality of H.264 and HEVC: 0 best, 51 worst", 18.0, 0.0, 51.0),
        Parameter("effort", "", "how hard H.264 and HEVC try", "quick", choices=("quick", "thorough")),
        Parameter("keyframe_interval", "frame", "largest distance of key frames", 60.0, 1.0, 10000.0),
    ),
    apply=apply,
    example={"name": "h264", "bit_rate_bit_per_s": 800000.0},
)

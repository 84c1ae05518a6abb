"""A phone takes frames when it can: their distance in time varies, and the stamps say so."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolkit.camera.effect import CameraEffect, Parameter
from toolkit.camera.shoot import Shoot


def apply(shoot: Shoot, values: Mapping[str, Any], rng: np.random.Generator) -> None:
    limit = 0.45 / float(shoot.fps)
    first = np.searchsorted(shoot.captured_s, shoot.captured_s)  # a repeated picture keeps its first one's moment
    early = np.clip(values["jitter_s"] * rng.standard_normal(first.size), -limit, limit)
    wrong = np.clip(values["stamp_error_s"] * rng.standard_normal(first.size), -limit, limit)
    early[0] = wrong[0] = 0.0
    shoot.captured_s = shoot.captured_s + early[first]
    shoot.stamped_s = np.sort(shoot.stamped_s + early + wrong)


EFFECT = CameraEffect(
    meaning="Every frame is taken early or late at random; its stamp follows, but for an error of its own.",
    kind="clock",
    parameters=(
        Parameter("jitter_s", "s", "standard deviation of the capture from even times", 0.003, 0.0, 1.0),
        Parameter("stamp_error_s", "s", "standard deviation of the stamp from the capture", 0.0, 0.0, 1.0),
    ),
    apply=apply,
    off={"jitter_s": 0.0, "stamp_error_s": 0.0},
    example={"jitter_s": 0.006},
)

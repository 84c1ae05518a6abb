"""What a camera effect is. One effect is one module of this package with a module-level `EFFECT`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolkit.camera.shoot import Shoot

Value = float | str | tuple[float, ...]
KINDS = ("clock", "exposure", "geometry", "scenery", "light", "sensor", "file")


@dataclass(frozen=True)
class Parameter:
    """A named parameter of a camera effect; its default tells its kind: a number, a choice, or a tuple of numbers."""

    name: str
    unit: str
    meaning: str
    default: Value
    minimum: float | None = 0.0
    maximum: float | None = None
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class CameraEffect:
    """One thing that a camera (or what stands before it) does to the picture.

    kind : what it acts on, one of `KINDS`. Clock, exposure and geometry effects may move the truth, others cannot.
    apply : adds the effect to a `Shoot`, given all its parameters and a generator of its own (seeded by the
        scene's seed and the effect's name, so that one effect never changes another's chance).
    off : parameters with which it does nothing at all; None where it has no such setting.
    example : a setting strong enough to see, for tests and for the picture in the documentation.
    """

    meaning: str
    kind: str
    parameters: tuple[Parameter, ...]
    apply: Callable[[Shoot, Mapping[str, Any], np.random.Generator], None]
    off: Mapping[str, Value] | None = None
    example: Mapping[str, Value] = field(default_factory=dict)


def colour(name: str, meaning: str, default: tuple[float, float, float]) -> Parameter:
    """A parameter that is a colour: red, green and blue from 0 to 255."""
    return Parameter(name, "level", meaning, default, 0.0, 255.0)

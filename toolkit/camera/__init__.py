"""What a camera does to light, one file an effect. Only the effects that a scene names are applied.

An effect is a module here with an `EFFECT`; it is found, not listed. `check_parameters` reads names, units and ranges
only: it draws nothing and needs neither OpenCV nor PyAV.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from toolkit.errors import UsageError
from toolkit.registry import did_you_mean, load_part, part_names

if TYPE_CHECKING:
    from toolkit.camera.effect import CameraEffect, Parameter

_NOT_EFFECTS = frozenset({"effect", "film", "optics", "outline", "paint", "shoot"})


def effect_names() -> tuple[str, ...]:
    """The names of all camera effects that there are, sorted."""
    return part_names(sys.modules[__name__], _NOT_EFFECTS)


def load_effect(name: str) -> CameraEffect:
    """The effect of that name. Raises UsageError for a name that is none."""
    known = effect_names()
    if name not in known:
        raise UsageError(f"unknown camera effect {name!r}{did_you_mean(name, known)}")
    effect: CameraEffect = load_part(sys.modules[__name__], name, "EFFECT", _NOT_EFFECTS)
    return effect


def check_parameters(name: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """All parameters of effect `name`: those of `table`, checked, and the defaults of the others.

    Raises UsageError that names the effect, the key and the range.
    """
    effect = load_effect(name)
    known = {parameter.name: parameter for parameter in effect.parameters}
    for key in table:
        if key not in known:
            raise UsageError(f"unknown key {key!r} in [camera.{name}]{did_you_mean(key, tuple(known))}")
    return {key: _checked(table.get(key, p.default), p, f"{key} in [camera.{name}]") for key, p in known.items()}


def _checked(value: Any, parameter: Parameter, what: str) -> Any:
    if parameter.choices:
        if value not in parameter.choices:
            raise UsageError(f"{what} must be one of {', '.join(parameter.choices)}, got {value!r}")
        return value
    if isinstance(parameter.default, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(parameter.default):
            raise UsageError(f"{what} must be {len(parameter.default)} numbers, got {value!r}")
        return tuple(_number(v, parameter, what) for v in value)
    return _number(value, parameter, what)


def _number(value: Any, parameter: Parameter, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UsageError(f"{what} must be a finite number, got {value!r}")
    low, high = parameter.minimum, parameter.maximum
    if (low is not None and value < low) or (high is not None and value > high):
        span = (
            f"between {low:g} and {high:g}"
            if low is not None and high is not None
            else (f"at least {low:g}" if low is not None else f"at most {high:g}")
        )
        raise UsageError(f"{what} must be {span} {parameter.unit}, got {value!r}".replace(" 1,", ","))
    return float(value)

"""Physics, one file an effect. A scene names the effects that act; only those are imported."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from toolkit.effects.effect import Effect, Parameter
from toolkit.errors import UsageError
from toolkit.registry import did_you_mean, load_part, part_names

_NOT_EFFECTS = frozenset({"effect"})


def effect_names() -> tuple[str, ...]:
    """The names of all effects that there are, sorted."""
    return part_names(sys.modules[__name__], _NOT_EFFECTS)


def load_effect(name: str) -> Effect:
    """The effect of that name. Raises UsageError for an unknown one."""
    effect: Effect = load_part(sys.modules[__name__], name, "EFFECT", _NOT_EFFECTS)
    return effect


def check_parameters(name: str, table: Any) -> dict[str, Any]:
    """The parameters of an effect as a scene gives them, checked, with defaults filled in.

    Raises UsageError naming the key that is unknown, missing, not a number or out of range.
    """
    effect = load_effect(name)
    where = f"[effects.{name}]"
    if not isinstance(table, Mapping):
        raise UsageError(f"{where} must be a table of keys, got {table!r}")
    if name == "formula":
        from toolkit.effects.formula import check_formula

        return check_formula(table)
    known = [p.name for p in effect.parameters]
    for key in table:
        if key not in known:
            what = did_you_mean(str(key), known) if known else ": it takes no keys"
            raise UsageError(f"unknown key {key!r} in {where}{what}")
    values: dict[str, Any] = {}
    for parameter in effect.parameters:
        if parameter.name in table:
            values[parameter.name] = check_number(parameter, table[parameter.name], where)
        elif parameter.default is not None:
            values[parameter.name] = parameter.default
        else:
            raise UsageError(
                f"{where} needs {parameter.name}, {parameter.meaning} in {parameter.unit}; add a line for it"
            )
    return values


def check_number(parameter: Parameter, value: Any, where: str) -> float:
    """`value` as a float within the parameter's range. Raises UsageError."""
    what = f"{parameter.name} in {where}"
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
        raise UsageError(f"{what} must be a finite number, got {value!r}")
    if parameter.minimum is not None and value < parameter.minimum:
        raise UsageError(f"{what} must be at least {parameter.minimum:g} {parameter.unit}, got {value:g}")
    if parameter.maximum is not None and value > parameter.maximum:
        raise UsageError(f"{what} must be at most {parameter.maximum:g} {parameter.unit}, got {value:g}")
    return float(value)

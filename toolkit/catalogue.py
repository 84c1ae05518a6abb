"""What there is, in words: every effect, model, localiser and camera effect with its formula and units."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from toolkit.report.plain_math import plain_math


def describe_effects(written: Callable[[str], str] = plain_math) -> str:
    """Every effect with its equation of motion, parameters with units and ranges, validity and reference; `written` writes LaTeX."""
    from toolkit.effects import effect_names, load_effect
    from toolkit.motion import build_equation

    blocks = []
    for name in effect_names():
        effect = load_effect(name)
        formulas = {"formula": "-k*omega"} if name == "formula" else {}
        lines = [
            name,
            f"  {effect.meaning}",
            f"  equation    {written(build_equation((name,), formulas=formulas).latex)}",
        ]
        lines += [f"  {p.name} [{p.unit}]  {p.meaning}{_range(p)}" for p in effect.parameters]
        if effect.needs:
            lines.append(f"  needs       {', '.join(effect.needs)}")
        lines += [f"  valid       {effect.valid}", f"  reference   {effect.reference}"]
        blocks.append(lines)
    return _text(blocks)


def describe_camera_effects() -> str:
    """Every camera effect with its parameters, units and ranges."""
    from toolkit.camera import effect_names, load_effect

    blocks = []
    for name in effect_names():
        effect = load_effect(name)
        lines = [name, f"  {effect.meaning}"]
        lines += [f"  {p.name} [{p.unit}]  {p.meaning}{_range(p)}" for p in effect.parameters]
        blocks.append(lines)
    return _text(blocks)


def describe_models(written: Callable[[str], str] = plain_math) -> str:
    """Every model with its equation and what is fitted; those that a report fits by itself are marked; `written` writes LaTeX."""
    from toolkit.models import STANDARD, load_model, model_names

    blocks = []
    for name in model_names():
        model = load_model(name)
        mark = " (in every report)" if name in STANDARD else ""
        fitted = ", ".join((*model.coefficients, "theta0", "phi", "omega_g", "theta_offset"))
        blocks.append(
            [
                f"{name}{mark}",
                f"  {model.summary}",
                f"  equation    {written(model.latex)}",
                f"  fitted      {fitted}",
            ]
        )
    note = (
        "alpha_d = k_d/(2m) [1/s], beta = c l/m [1], mu = torque/(m l^2) [1/s2]; with mass and length known the\n"
        "report gives k_d [kg/s], c [kg/m] and torque [N m]. theta0, phi, theta_offset [rad], omega_g [rad/s]."
    )
    return f"{_text(blocks)}\n\n{note}"


def describe_trackers() -> str:
    """Every localiser of the bob in one sentence."""
    from toolkit.trackers import load_tracker, tracker_names

    return _text([name, f"  {load_tracker(name).summary}"] for name in tracker_names())


def _range(parameter: object) -> str:
    low, high = getattr(parameter, "minimum", None), getattr(parameter, "maximum", None)
    default = getattr(parameter, "default", None)
    limits = [f"≥ {low:g}"] if low is not None else []
    limits += [f"≤ {high:g}"] if high is not None else []
    limits += ["must be given" if default is None else f"default {default}"]
    return f" ({', '.join(limits)})"


def _text(blocks: Iterable[list[str]]) -> str:
    return "\n\n".join("\n".join(lines) for lines in blocks)

"""θ(t), θ̇(t) and the string's tension with the model and its band: the whole record, and its beginning enlarged."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import Curve, Material
from toolkit.report.style import BEST_MODEL, DATA, dots, draw, legend_above, panels

_PERIODS_ENLARGED = 4
_COLUMNS = 700


def motion(material: Material) -> Figure | None:
    """Three quantities, two columns: all of the record (its outline where it is long), and the first four swings."""
    if not material.usable or material.t.size < 8:
        return None
    words, t = material.words, material.t
    start = float(t[0])
    span = _PERIODS_ENLARGED * 2 * math.pi / material.omega_g
    span = min(span, float(t[-1]) - start) if math.isfinite(span) else float(t[-1]) - start
    near = material.curve(material.best, np.linspace(start, start + span, 400))
    whole = float(t[-1]) - start > 1.5 * span
    mass = material.analysis.scene.pendulum.mass_kg
    weight = mass * material.analysis.scene.environment.gravity_m_per_s2 if mass else 1.0
    points = t <= start + span
    seen: list[tuple[np.ndarray | None, str, Callable[[np.ndarray], np.ndarray]]] = [
        (np.degrees(material.theta), words("figure.theta_deg"), np.degrees),
        (material.measured_omega, words("figure.omega"), lambda x: x),
        (None, words("figure.tension_n" if mass else "figure.tension_mg"), lambda x: weight * x),
    ]
    best = material.best
    tension = np.cos(best.theta_rad - material.offset) + (best.omega_rad_per_s / material.omega_g) ** 2
    long = [np.degrees(material.theta), best.omega_rad_per_s, weight * tension]

    size = 2.2 if points.sum() > 200 else 4.0

    def paint(figure: Any) -> None:
        axes = panels(figure, 3, 2 if whole else 1, top=0.24, squeeze=False, sharex="col")
        for row, (measured, label, scale) in enumerate(seen):
            axis = axes[row, -1]
            if measured is not None:
                dots(axis, t[points], measured[points], DATA, size, 1.0, words("figure.measured"))
            middle, band = _of(near, row)
            axis.plot(near.t_s, scale(middle), color=BEST_MODEL, label=words("figure.model"))
            if band is not None:
                axis.fill_between(
                    near.t_s,
                    scale(middle - 2 * band),
                    scale(middle + 2 * band),
                    color=BEST_MODEL,
                    alpha=0.25,
                    linewidth=0,
                )
            if measured is not None and row == 0:
                legend_above(axis)
            if whole:
                _outline(axes[row, 0], t, long[row], DATA if row == 0 else BEST_MODEL)
            axes[row, 0].set_ylabel(label)
        for axis in axes[-1]:
            axis.set_xlabel(words("figure.time_s"))

    data = {
        "t_s": t,
        "theta_rad": material.theta,
        "theta_model_rad": best.theta_rad,
        "omega_model_rad_per_s": best.omega_rad_per_s,
    }
    data["tension_over_weight"] = tension
    return Figure(
        "motion",
        words("caption.motion" if whole else "caption.motion_short"),
        draw("motion", words.lang, 4.0, paint),
        data,
    )


def _of(curve: Curve, row: int) -> tuple[np.ndarray, np.ndarray | None]:
    return (
        (curve.theta_rad, curve.theta_u),
        (curve.omega_rad_per_s, curve.omega_u),
        (curve.tension, curve.tension_u),
    )[row]


def _outline(axis: Any, t: np.ndarray, y: np.ndarray, colour: str) -> None:
    """The curve where it is short; else the range that it covers in each column of the picture."""
    if t.size <= 2 * _COLUMNS:
        axis.plot(t, y, color=colour, linewidth=0.7)
        return
    column = np.minimum(((t - t[0]) / (t[-1] - t[0]) * _COLUMNS).astype(int), _COLUMNS - 1)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    high, low = np.maximum.reduceat(y, first), np.minimum.reduceat(y, first)
    axis.fill_between(t[first], low, high, color=colour, alpha=0.55, linewidth=0.3, step="mid")

"""Period against amplitude with the theory curve: the picture of the small-angle verdict."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolkit.fitting.cycles import period_of
from toolkit.report.document import Figure
from toolkit.report.material import Material, binned, value
from toolkit.report.style import BEST_MODEL, DATA, INK, PAPER_MODEL, dots, draw, legend_above, panels


def period(material: Material, width_in: float = 3.35, height_in: float = 2.85) -> Figure | None:
    """Measured period of each swing against its amplitude, the pendulum's own curve, and the small-angle line."""
    cycles = material.cycles
    small = value(material.full_sine, "T0")
    if cycles is None or small is None:
        return None
    words = material.words
    threshold = threshold_rad(material)
    amplitude = cycles.amplitude_rad / (1 + (value(material.full_sine, "angle_scale") or 0.0))  # as the fit corrects it
    widest = float(amplitude.max()) * 1.05
    grid = np.linspace(0, min(widest, 3.1), 200)
    theory = period_of(grid, small)

    def paint(figure: Any) -> None:
        axis = panels(figure, top=0.38)
        degrees = np.degrees(amplitude)
        many = degrees.size > 60
        if many:
            dots(axis, degrees, cycles.period_s, DATA, 2.2, 0.5, words("figure.one_swing"))
        else:
            bars = {"fmt": "o", "color": INK, "markersize": 3.2, "elinewidth": 0.8, "zorder": 4}
            axis.errorbar(degrees, cycles.period_s, cycles.sigma_period_s, label=words("figure.one_swing"), **bars)
        if many:
            at, mean, error = binned(degrees, cycles.period_s, 16)
            axis.errorbar(
                at, mean, error, fmt="s", color=INK, markersize=3, elinewidth=0.8, label=words("figure.mean_of_swings")
            )
        axis.plot(np.degrees(grid), theory, color=BEST_MODEL, label=words("figure.full_sine"))
        axis.axhline(small, color=PAPER_MODEL, linestyle="--", label=words("figure.small_angle"))
        if threshold is not None and threshold < widest:
            axis.axvspan(0, np.degrees(threshold), color=PAPER_MODEL, alpha=0.10, linewidth=0)
        low, high = np.percentile(cycles.period_s, [1, 99])
        low, high = min(low, small), max(high, float(theory[-1]))
        axis.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
        axis.set_xlim(0, np.degrees(widest))
        axis.set_xlabel(words("figure.amplitude_deg"))
        axis.set_ylabel(words("figure.period_s"))
        axis.ticklabel_format(axis="y", useOffset=False)
        legend_above(axis, 2)

    data = {"amplitude_rad": amplitude, "period_s": cycles.period_s}
    data["sigma_period_s"] = cycles.sigma_period_s
    return Figure("period", words("caption.period"), draw("period", words.lang, height_in, paint, width_in), data)


def threshold_rad(material: Material) -> float | None:
    """Up to which amplitude the small-angle formula serves, as the finding says."""
    for finding in material.analysis.findings:
        if finding.assumption == "small_angle":
            found = finding.where.get("amplitude_above_rad")
            return None if found is None else float(found)
    return None

"""How the amplitude falls, with the linear and the quadratic law of drag: the picture of the drag verdict."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import Cycles, Material, value
from toolkit.report.style import BEST_MODEL, DATA, PAPER_MODEL, draw

_LAWS = (("full_linear_drag", "linear", PAPER_MODEL, "-"), ("full_quadratic_drag", "quadratic", BEST_MODEL, "--"))


def decay(material: Material, width_in: float = 3.35, height_in: float = 2.5) -> Figure | None:
    """Amplitude of each swing against time on a logarithmic axis, and what each law leaves of it below."""
    cycles = material.cycles
    if cycles is None:
        return None
    words = material.words
    laws = {}
    for model, name, colour, dash in _LAWS:
        law = _envelope(material, model, cycles)
        if law is not None:
            laws[name] = (law, colour, dash)
    degrees = np.degrees(cycles.amplitude_rad)

    def paint(figure: Any) -> None:
        top, rest = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1)) if laws else (figure.subplots(), None)
        top.plot(cycles.t_s, degrees, "o", color=DATA, label=words("figure.measured"), rasterized=False)
        for name, (law, colour, dash) in laws.items():
            top.plot(cycles.t_s, np.degrees(law), dash, color=colour, label=words(f"figure.law_{name}"))
        top.set_ylabel(words("figure.amplitude_deg"))
        if degrees.max() > 1.6 * degrees.min():
            top.set_yscale("log")
            _plain_log(top)
        top.legend()
        if rest is None:
            top.set_xlabel(words("figure.time_s"))
            return
        for law, colour, dash in laws.values():
            rest.plot(cycles.t_s, 100 * (cycles.amplitude_rad / law - 1), dash, color=colour)
        rest.axhline(0, color=DATA, linewidth=0.6)
        rest.set_ylabel(words("figure.deviation_percent"))
        rest.set_xlabel(words("figure.time_s"))
        figure.align_ylabels()

    data = {"t_s": cycles.t_s, "amplitude_rad": cycles.amplitude_rad}
    data |= {f"{name}_rad": law for name, (law, _, _) in laws.items()}
    return Figure("decay", words("caption.decay"), draw("decay", words.lang, height_in, paint, width_in), data)


def _envelope(material: Material, model: str, cycles: Cycles) -> np.ndarray | None:
    """Amplitude of a fitted model at the cycles' times, from its energy: independent of where the samples lie."""
    result = material.analysis.fits.get(model)
    if result is None or not result.success or len(result.theta_rad) != material.t.size:
        return None
    omega_g = value(result, "omega_g") or (2 * math.pi / (value(result, "T0") or math.nan))
    if not np.isfinite(omega_g):
        return None
    scale = 1 + (value(result, "angle_scale") or 0.0)
    theta = (result.theta_rad - (value(result, "theta_offset") or 0.0)) / scale
    sine = np.sqrt(np.clip(np.sin(theta / 2) ** 2 + (result.omega_rad_per_s / (2 * omega_g)) ** 2, 0, 1))
    return scale * np.interp(cycles.t_s, material.t, 2 * np.arcsin(sine))


def _plain_log(axis: Any) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())

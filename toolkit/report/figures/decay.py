"""How the amplitude falls, with the linear and the quadratic law of drag: the picture of the drag verdict."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolkit.fitting.cycles import Cycles, amplitude_of
from toolkit.report.document import Figure
from toolkit.report.material import Material, value
from toolkit.report.style import BEST_MODEL, DATA, PAPER_MODEL, dots, draw, legend_above, panels

_LAWS = (("full_linear_drag", "linear", PAPER_MODEL, "-"), ("full_quadratic_drag", "quadratic", BEST_MODEL, "--"))


def decay(material: Material, width_in: float = 3.35, height_in: float = 2.85) -> Figure | None:
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
        top, rest = (
            panels(figure, 2, top=0.24, sharex=True, height_ratios=(2.2, 1))
            if laws
            else (panels(figure, top=0.24), None)
        )
        dots(top, cycles.t_s, degrees, DATA, 2.2 if degrees.size > 60 else 4.0, 1.0, words("figure.measured"))
        for name, (law, colour, dash) in laws.items():
            top.plot(cycles.t_s, np.degrees(law), dash, color=colour, label=words(f"figure.law_{name}"))
        top.set_ylabel(words("figure.amplitude_deg"))
        if degrees.max() > 1.6 * degrees.min():
            top.set_yscale("log")
            plain_log(top)
        low, high = np.log(degrees.min()), np.log(degrees.max())
        top.set_ylim(np.exp(low - 0.06 * (high - low)), np.exp(high + 0.08 * (high - low)))
        legend_above(top, 3)
        if rest is None:
            top.set_xlabel(words("figure.time_s"))
            return
        for law, colour, dash in laws.values():
            rest.plot(cycles.t_s, 100 * (cycles.amplitude_rad / law - 1), dash, color=colour)
        rest.axhline(0, color=DATA, linewidth=0.6)
        rest.set_ylabel(words("figure.deviation_percent"))
        rest.set_xlabel(words("figure.time_s"))

    data = {"t_s": cycles.t_s, "amplitude_rad": cycles.amplitude_rad}
    data |= {f"{name}_rad": law for name, (law, _, _) in laws.items()}
    return Figure("decay", words("caption.decay"), draw("decay", words.lang, height_in, paint, width_in), data)


def _envelope(material: Material, model: str, cycles: Cycles) -> np.ndarray | None:
    """Amplitude of a fitted model at the cycles' times, from its energy: independent of where the samples lie."""
    result = material.analysis.fits.get(model)
    if result is None or not result.success or len(result.theta_rad) != material.t.size:
        return None
    scale = 1 + (value(result, "angle_scale") or 0.0)  # as the camera sees it
    return scale * np.interp(cycles.t_s, material.t, amplitude_of(result))


def plain_log(axis: Any, subs: tuple[int, ...] = (1, 2, 5)) -> None:
    """Ticks at `subs` of each decade as plain numbers on a logarithmic y axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.yaxis.set_major_locator(LogLocator(subs=subs))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.yaxis.set_minor_locator(NullLocator())

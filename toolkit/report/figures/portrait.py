"""Phase portrait: θ̇ against θ, measured and modelled."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import Material, thinned
from toolkit.report.style import BEST_MODEL, DATA, MAX_POINTS, dots, draw, legend_above, panels

_SWINGS = 12


def portrait(material: Material) -> Figure | None:
    """The first swings: points by central differences of the measured angle; the model's spiral over them."""
    if not material.usable or material.t.size < 8:
        return None
    words = material.words
    best = material.best
    turns = np.flatnonzero(material.t <= material.t[0] + _SWINGS * 2 * np.pi / material.omega_g)
    shown = turns[thinned(turns.size, MAX_POINTS)]

    def paint(figure: Any) -> None:
        axis = panels(figure, top=0.4)
        dots(
            axis,
            np.degrees(material.theta[shown]),
            material.measured_omega[shown],
            DATA,
            1.6 if shown.size > 400 else 3.2,
            1.0,
            words("figure.measured"),
        )
        axis.plot(
            np.degrees(best.theta_rad[turns]),
            best.omega_rad_per_s[turns],
            color=BEST_MODEL,
            linewidth=0.7,
            label=words("figure.model"),
        )
        axis.set_xlabel(words("figure.theta_deg"))
        axis.set_ylabel(words("figure.omega"))
        legend_above(axis, 1)

    data = {
        "theta_rad": material.theta,
        "omega_measured_rad_per_s": material.measured_omega,
        "omega_model_rad_per_s": best.omega_rad_per_s,
    }
    return Figure("portrait", words("caption.portrait"), draw("portrait", words.lang, 2.4, paint, 2.35), data)

"""Phase portrait: θ̇ against θ, measured and modelled."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import Material, thinned
from toolkit.report.style import BEST_MODEL, DATA, MAX_POINTS, dots, draw, panels


def portrait(material: Material) -> Figure | None:
    """Points by central differences of the measured angle; the model's spiral over them."""
    if not material.usable or material.t.size < 8:
        return None
    words = material.words
    shown = thinned(material.t.size, MAX_POINTS)
    best = material.best

    def paint(figure: Any) -> None:
        axis = panels(figure)
        dots(
            axis,
            np.degrees(material.theta[shown]),
            material.measured_omega[shown],
            DATA,
            1.6 if shown.size > 400 else 3.2,
            1.0,
            words("figure.measured"),
        )
        turns = material.t <= material.t[0] + 12 * 2 * np.pi / material.omega_g
        axis.plot(
            np.degrees(best.theta_rad[turns]),
            best.omega_rad_per_s[turns],
            color=BEST_MODEL,
            linewidth=0.7,
            label=words("figure.model_first_swings"),
        )
        axis.set_xlabel(words("figure.theta_deg"))
        axis.set_ylabel(words("figure.omega"))
        axis.legend(loc="upper right")
        low, high = axis.get_ylim()
        axis.set_ylim(low, high + 0.18 * (high - low))

    data = {
        "theta_rad": material.theta,
        "omega_measured_rad_per_s": material.measured_omega,
        "omega_model_rad_per_s": best.omega_rad_per_s,
    }
    return Figure("portrait", words("caption.portrait"), draw("portrait", words.lang, 3.2, paint, 4.6), data)

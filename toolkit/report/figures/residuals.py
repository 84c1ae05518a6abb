"""Residuals of the preferred and of the paper's model against time, angle, velocity and phase."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import Material, binned, thinned
from toolkit.report.style import BEST_MODEL, DATA, MAX_POINTS, PAPER_MODEL, dots, draw, panels


def residuals(material: Material) -> Figure | None:
    """Four panels for the preferred model; where the paper's model is another, a row for it too, on its own scale."""
    if not material.usable or material.t.size < 8:
        return None
    words = material.words
    rows = [(material.best, BEST_MODEL, words("figure.preferred_model"))]
    paper = material.paper
    if paper is not None and paper is not material.best and len(paper.residuals_rad) == material.t.size:
        rows.append((paper, PAPER_MODEL, words("figure.paper_model")))
    shown = thinned(material.t.size, MAX_POINTS)
    against = [
        (material.t, words("figure.time_s")),
        (np.degrees(material.best.theta_rad), words("figure.theta_deg")),
        (material.best.omega_rad_per_s, words("figure.omega")),
        (np.degrees(material.phase), words("figure.phase_deg")),
    ]

    def paint(figure: Any) -> None:
        axes = panels(
            figure, len(rows), 4, left=0.68, gap=0.2, between=0.3, top=0.25, sharey="row", sharex="col", squeeze=False
        )
        for line, (result, colour, name) in zip(axes, rows):
            rest = 1e3 * result.residuals_rad
            for axis, (x, _) in zip(line, against):
                dots(axis, x[shown], rest[shown], DATA, 1.2 if shown.size > 400 else 2.8, 0.7)
                at, mean, error = binned(x, rest)
                if at.size:
                    axis.errorbar(at, mean, error, color=colour, linewidth=1.1, elinewidth=0.7)
            line[0].set_ylabel(words("figure.residual_mrad"))
            line[0].set_title(name, color=colour)
            limit = float(np.percentile(np.abs(rest), 99.5)) * 1.15 or 1.0
            line[0].set_ylim(-limit, limit)
        for axis, (_, label) in zip(axes[-1], against):
            axis.set_xlabel(label)
            axis.locator_params(axis="x", nbins=4)

    data = {"t_s": material.t, "residual_preferred_rad": material.best.residuals_rad}
    if len(rows) > 1 and paper is not None:
        data["residual_paper_rad"] = paper.residuals_rad
    data["phase_rad"] = material.phase
    return Figure(
        "residuals", words("caption.residuals"), draw("residuals", words.lang, 0.85 + 1.15 * len(rows), paint), data
    )

"""The source paper again: its twelve panels with both models, its claims weighed, its misprints shown.

Wanaek, A. and Hutem, A. (2023), on the angular displacement, angular velocity and tension of a pendulum under air
resistance and a cosine external force. The paper gives neither φ nor the time span; ours are stated on each figure.
"""

from __future__ import annotations

import csv
from pathlib import Path

from toolkit.progress import Progress, silent


def reproduce_paper(folder: str | Path, progress: Progress = silent) -> str:
    """Write the 12 panels and an overview (PNG and SVG) for φ = π/2 and φ = 0, claims.csv and misprints into `folder`.

    Returns the summary as text: a line a claim, and the misprints' errors. `folder` must exist.
    """
    from toolkit.paper.claims import weigh_claims
    from toolkit.paper.figures import draw_misprints, draw_overview, draw_panels
    from toolkit.paper.misprints import misprint_errors

    folder = Path(folder)
    progress("drawing panels", 0.0)
    draw_panels(folder, progress)
    progress("drawing overviews", 0.6)
    draw_overview(folder)
    progress("drawing misprints", 0.75)
    draw_misprints(folder)
    progress("weighing claims", 0.85)
    judgements = weigh_claims()
    with (folder / "claims.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["claim", "statement", "regime", "phi", "model", "verdict", "deciding_numbers"])
        writer.writerows([j.claim, j.statement, j.regime, j.phi, j.model, j.verdict, j.numbers] for j in judgements)
    lines = ["claim  regime     φ    small angle     full equation"]
    table = {(j.claim, j.regime, j.phi, j.model): j.verdict for j in judgements}
    for claim, regime, phi in dict.fromkeys((j.claim, j.regime, j.phi) for j in judgements):
        small, full = (table[claim, regime, phi, model] for model in ("small angle", "full equation"))
        lines.append(f"{claim:5}  {regime:9}  {phi:3}  {small:14}  {full}")
    theta_error, omega_error, between = misprint_errors()
    lines += [
        "",
        f"(18) as printed is wrong by up to {theta_error:.3f} rad, (19) by up to {omega_error:.3f} rad/s (0 … 20 s)",
        f"the small-angle model differs from the full equation by up to {between:.3f} rad at θ₀ = 1 (0 … 20 s)",
    ]
    progress("done", 1.0)
    return "\n".join(lines)

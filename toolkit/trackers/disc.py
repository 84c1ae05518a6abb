"""Disc fit with motion blur: least squares of a shaded disc with a soft edge, smeared along its motion, over the
background that the clip has shown, on a ring of pixels about the outline.

Model of a pixel: g·back·(1 − α) + (f0 + fx·dx/R + fy·dy/R)·α, with α the mean over the streak of the edge function
E((R − d)/h). E is the integral of the biweight kernel (compact, variance h²/7: no exponential to evaluate).
Gauss–Newton over (cx, cy, f0, fx, fy, g) and, when calibrating, (R, h); pixels far off the model do not count.
"""

from __future__ import annotations

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place

_H_PER_SIGMA = np.sqrt(7.0)
SECTORS = 24


def fit_disc(
    patch: Patch, look: Look, guess: Guess, *, calibrate: bool = False, turns: int = 7, soften: float = 1.0
) -> np.ndarray | None:
    """(cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall) in patch pixels, or None.

    `calibrate` lets radius and edge go free; `soften` widens the edge, and with it the range of capture.
    """
    out = np.zeros(13)
    start = np.array((guess.x_px - patch.x_px, guess.y_px - patch.y_px, look.radius_px, look.edge_px * soften))
    streak = np.array((guess.streak_x_px, guess.streak_y_px))
    half = min(0.9, 0.2 + 3.0 / look.radius_px)
    from toolkit.trackers._disc_kernel import fit

    good = fit(
        patch.image,
        patch.back,
        patch.seen,
        start,
        streak,
        guess.string_rad,
        half,
        look.noise,
        look.contrast if soften == 1.0 else 0.0,
        8 if calibrate else 7 if look.radius_free and soften == 1.0 else 6,
        turns,
        out,
    )
    return out if good and np.all(np.isfinite(out)) else None


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The bob's centre by the disc fit; radius and edge are those of `look`."""
    out = fit_disc(patch, look, guess)
    if out is None or out[4] <= 0 or out[5] <= 0:
        return NOWHERE
    x, y, sx, sy = out[0] + patch.x_px, out[1] + patch.y_px, float(np.sqrt(out[4])), float(np.sqrt(out[5]))
    return Place(x, y, sx, sy, out[7], out[8], out[9], out[10] * out[12])


LOCALISER = Localiser("disc", "least squares of a shaded disc with a soft edge and motion blur (default)", locate)

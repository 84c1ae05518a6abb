"""Disc fit with motion blur: least squares of a shaded disc with a soft edge, smeared along its motion, over the
background that the clip has shown, on a ring of pixels about the outline and, where the bob is evenly shaded, a quarter
of those within it (they tell the shade, which the outline alone confuses with the place).

Model of a pixel: g·back·(1 − α) + (f0 + fx·dx/R + fy·dy/R)·α, with α the mean over the streak of the edge function
E((R − d)/h). E is the integral of a compact kernel very near to the normal distribution's: no exponential to evaluate.
Gauss–Newton over (cx, cy, f0, fx, fy, g) and, when calibrating, (R, h); pixels far off the model do not count.
"""

from __future__ import annotations

from math import cos, isfinite, sin, sqrt

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place


def fit_disc(
    patch: Patch, look: Look, guess: Guess, *, calibrate: bool = False, turns: int = 7, soften: float = 1.0
) -> np.ndarray | None:
    """(cx, cy, R, s, var_x, var_y, cov_xy, misfit, visible, contrast, gain, pixels, wall, misfit well inside) in patch
    pixels, or None.

    `calibrate` lets radius and edge go free; `soften` widens the edge, and with it the range of capture.
    """
    from toolkit.trackers._disc_kernel import fit

    out = np.zeros(14)
    start = np.array((guess.x_px - patch.x_px, guess.y_px - patch.y_px, look.radius_px, look.edge_px * soften), float)
    streak = np.array((guess.streak_x_px, guess.streak_y_px), float)
    string = np.array((0.0, 0.0, 1.0))
    if guess.string_rad == guess.string_rad:
        string[:] = cos(guess.string_rad), sin(guess.string_rad), cos(min(0.9, 0.2 + 3.0 / look.radius_px)) ** 2
    plain = soften == 1.0
    free = 8 if calibrate else 7 if look.radius_free and plain else 6
    contrast = look.contrast if plain else 0.0
    good = fit(
        patch.image, patch.back, patch.seen, start, streak, string, look.noise, contrast, free, look.even, turns, out
    )
    return out if good and isfinite(out[:13].sum()) else None


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The bob's centre by the disc fit; radius and edge are those of `look`."""
    out = fit_disc(patch, look, guess)
    if out is None or out[4] <= 0 or out[5] <= 0:
        return NOWHERE
    cx, cy, _, _, xx, yy, _, misfit, visible, contrast, gain, _, wall, _ = out.tolist()
    return Place(cx + patch.x_px, cy + patch.y_px, sqrt(xx), sqrt(yy), misfit, visible, contrast, gain * wall)


LOCALISER = Localiser("disc", "least squares of a shaded disc with a soft edge and motion blur (default)", locate)

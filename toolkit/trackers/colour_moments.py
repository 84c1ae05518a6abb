"""Moments: the centroid of how much each pixel looks like the bob, between the wall's colour and the bob's own."""

from __future__ import annotations

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place, unexplained


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The centroid of (image − back)/contrast, clipped to 0 … 1, within a circle that follows it."""
    if not look.contrast:
        return NOWHERE
    share = np.clip((patch.image - patch.back) / look.contrast, 0, 1)
    share = np.where(share > 0.25, share, 0.0)
    rows, columns = np.mgrid[: share.shape[0], : share.shape[1]].astype(float)
    x, y = guess.x_px - patch.x_px, guess.y_px - patch.y_px
    reach = 1.15 * look.radius_px + 2 * look.edge_px + 0.5 * float(np.hypot(guess.streak_x_px, guess.streak_y_px))
    for _ in range(8):
        near = np.hypot(columns - x, rows - y) < reach
        weight = share * near
        total = float(weight.sum())
        if total < 0.3 * np.pi * look.radius_px**2:
            return NOWHERE
        before = x, y
        x, y = float((weight * columns).sum() / total), float((weight * rows).sum() / total)
        if abs(x - before[0]) + abs(y - before[1]) < 0.01:
            break
    noise = _noise(patch, near) / abs(look.contrast)
    edge = near & (weight > 0)
    sigma_x = noise * float(np.sqrt(((columns - x) ** 2 * edge).sum())) / total
    sigma_y = noise * float(np.sqrt(((rows - y) ** 2 * edge).sum())) / total
    visible = min(1.0, total / (np.pi * look.radius_px**2))
    contrast = float(np.median((patch.image - patch.back)[weight > 0.5])) if (weight > 0.5).any() else 0.0
    misfit = unexplained(patch, look, guess, x, y)
    return Place(x + patch.x_px, y + patch.y_px, sigma_x + 1e-4, sigma_y + 1e-4, misfit, visible, contrast)


def _noise(patch: Patch, near: np.ndarray) -> float:
    """Robust scatter of image − back outside the bob, in grey levels."""
    rest = (patch.image - patch.back)[~near]
    return 1.4826 * float(np.median(np.abs(rest - np.median(rest)))) + 0.3 if rest.size > 20 else 2.0


LOCALISER = Localiser("colour_moments", "centroid of the pixels weighted by how much they look like the bob", locate)

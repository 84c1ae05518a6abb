"""Background difference: the middle of the pixels that differ from the wall. A seed rather than a measurement."""

from __future__ import annotations

import numpy as np

from toolkit.trackers.colour_moments import _noise
from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place, unexplained


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The centroid of the largest patch of pixels that differ clearly from the background, the string cut off."""
    import cv2

    rows, columns = np.mgrid[: patch.image.shape[0], : patch.image.shape[1]]
    x, y = guess.x_px - patch.x_px, guess.y_px - patch.y_px
    far = np.hypot(columns - x, rows - y) > 1.3 * look.radius_px + 3
    noise = _noise(patch, ~far)
    limit = max(5 * noise, 0.4 * abs(look.contrast))
    mask = (np.abs(patch.image - patch.back) > limit).astype(np.uint8)
    size = max(3, int(0.5 * look.radius_px) | 1)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    count, labels, stats, middles = cv2.connectedComponentsWithStats(mask)
    stats, middles = np.asarray(stats).reshape(-1, 5), np.asarray(middles).reshape(-1, 2)
    if count < 2:
        return NOWHERE
    best = 1 + int(np.argmax(stats[1:, 4]))
    area = float(stats[best, 4])
    if area < 0.2 * np.pi * look.radius_px**2:
        return NOWHERE
    inside = labels == best
    contrast = float(np.median((patch.image - patch.back)[inside]))
    sigma = 0.4 / np.sqrt(look.radius_px) + 0.05  # pixels at the rim fall on either side by chance
    visible = min(1.0, area / (np.pi * look.radius_px**2))
    mx, my = (float(v) for v in middles[best])
    misfit = unexplained(patch, look, guess, mx, my)
    return Place(mx + patch.x_px, my + patch.y_px, sigma, sigma, misfit, visible, contrast)


LOCALISER = Localiser("background", "middle of the pixels that differ from the wall", locate)

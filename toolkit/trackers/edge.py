"""Edge fit: where the outline is crossed along rays from the centre, and the circle through these points.

It asks nothing of the inside of the bob, so a pattern or a highlight does not disturb it; motion blur does.
"""

from __future__ import annotations

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place

_RAYS = 72


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The centre of the circle through the outline; each crossing is the centroid of the brightness step on its ray."""
    cx, cy = guess.x_px - patch.x_px, guess.y_px - patch.y_px
    streak = float(np.hypot(guess.streak_x_px, guess.streak_y_px))
    narrow = min(0.5 * look.radius_px, 2 * look.edge_px + 1 + 0.5 * streak)
    width = min(0.7 * look.radius_px, narrow + look.edge_px + 2)
    angles = (np.arange(_RAYS) + 0.5) * 2 * np.pi / _RAYS
    if np.isfinite(guess.string_rad):
        half = min(0.9, 0.2 + 3.0 / look.radius_px)
        angles = angles[np.abs((angles - guess.string_rad + np.pi) % (2 * np.pi) - np.pi) > half]
    ux, uy = np.cos(angles), np.sin(angles)
    sign = -np.sign(look.contrast) or 1.0
    radius = look.radius_px
    for turn in range(6):
        r = np.arange(radius - width, radius + width + 0.125, 0.25)
        x, y = cx + ux[:, None] * r, cy + uy[:, None] * r
        inside = (x >= 0) & (y >= 0) & (x < patch.image.shape[1] - 1.001) & (y < patch.image.shape[0] - 1.001)
        profile = _sampled(patch.image, x, y)
        inside = inside.all(axis=1)
        if width == narrow:
            found, height = _half_way(profile, r, sign, look.edge_px)
        else:
            found, height = _steepest(profile, r, sign, 1.5 + 2 * look.edge_px + 0.3 * streak)
        good = inside & (height > (0.2 * abs(look.contrast) if look.contrast else 0.5 * np.median(height)))
        if good.sum() < 12:
            return NOWHERE
        keep = good.copy()
        design = np.column_stack([ux, uy, np.ones(ux.size)])
        for _ in range(3):
            a = np.linalg.lstsq(design[keep], found[keep], rcond=None)[0]
            rest = found - design @ a
            spread = 1.4826 * float(np.median(np.abs(rest[keep]))) + 0.02
            keep = good & (np.abs(rest) < 3.5 * spread)
            if keep.sum() < 10:
                return NOWHERE
        step = float(np.hypot(a[0], a[1]))
        cx, cy = cx + float(a[0]), cy + float(a[1])
        if width == narrow and step < 0.02:
            break
        if turn == 5 and step > 0.3:
            return NOWHERE
        if step < 0.5:
            width = narrow  # near by, what is drawn on the bob is kept out
    scatter = float(np.sqrt(np.sum(rest[keep] ** 2) / max(1, keep.sum() - 3)))
    covariance = np.linalg.inv(design[keep].T @ design[keep]) * scatter**2
    sigma = np.sqrt(np.diag(covariance))
    slope = float(np.median(height[keep])) / max(1.0, 2.5 * look.edge_px)
    contrast = -sign * float(np.median(height[keep]))
    return Place(
        cx + patch.x_px, cy + patch.y_px, max(float(sigma[0]), 1e-4), max(float(sigma[1]), 1e-4), scatter * slope,
        float(keep.mean()), contrast,
    )  # fmt: skip


def _sampled(image: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Bilinear values of the image at (x, y)."""
    ix = np.clip(x.astype(int), 0, image.shape[1] - 2)
    iy = np.clip(y.astype(int), 0, image.shape[0] - 2)
    fx, fy = x - ix, y - iy
    top = image[iy, ix] * (1 - fx) + image[iy, ix + 1] * fx
    bottom = image[iy + 1, ix] * (1 - fx) + image[iy + 1, ix + 1] * fx
    return top * (1 - fy) + bottom * fy


def _steepest(profile: np.ndarray, r: np.ndarray, sign: float, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Centroid of the brightness step about the steepest place of each ray, and the step's height."""
    rise = np.clip(sign * np.diff(profile, axis=1), 0, None)
    middle = 0.5 * (r[1:] + r[:-1])
    peak = np.argmax(_blurred(rise), axis=1)
    weight = rise * (np.abs(middle[None, :] - middle[peak][:, None]) <= reach)
    height = weight.sum(axis=1)
    return (weight * middle).sum(axis=1) / np.maximum(height, 1e-9), height


def _half_way(profile: np.ndarray, r: np.ndarray, sign: float, edge_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Where each ray leaves the bob: its level just inside the outline, against that just outside, by the area between."""
    few = 1 + int(edge_px / (r[1] - r[0]))
    within, beyond = profile[:, :few].mean(axis=1), profile[:, -few:].mean(axis=1)
    height = sign * (beyond - within)
    area = np.trapezoid(sign * (beyond[:, None] - profile), r, axis=1)
    return r[0] + area / np.where(height > 0, height, np.inf), height


def _blurred(rows: np.ndarray) -> np.ndarray:
    return rows + np.pad(rows, ((0, 0), (1, 0)))[:, :-1] + np.pad(rows, ((0, 0), (0, 1)))[:, 1:]


LOCALISER = Localiser("edge", "circle through the sub-pixel outline; for bobs with a pattern or a highlight", locate)

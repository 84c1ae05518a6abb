"""Outline fit: the circle where the picture departs from the background, whatever is drawn on the bob.

Along rays from the centre, the picture less the background is a level outside and unknown levels inside: the bob's
shells, thinnest at its rim, for on a ball a pattern is foreshortened there to less than a pixel. These levels are random
with a wide prior; integrated out (Gaussian marginal likelihood) they leave how likely each place of the outline is on each
ray. The centre is the likeliest over all rays; a ray that disagrees with the others counts little (Cauchy).
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place

_STEP = 0.5  # px between samples of a ray
_SHIFTS = np.linspace(-1.8, 1.8, 25)  # places of the outline on a ray that are tried, px
_DEPTHS = np.array([0.0, 0.4, 0.9, 1.6, 2.6, 4.0])  # where the shells begin, px within the outline
_FAR = 9.0  # what a ray may disagree by, in units of twice the log-likelihood, before it counts less
_WIDTHS = 4  # classes of blur along the ray
# standard deviations, the first three in units of the contrast:
_CHANGE = 0.3  # of a shell's level against the next one's
_OUTSIDE = 0.25  # of the level beyond the outline (a shadow)
_FLOOR = 0.03  # of what a codec and the edge's true shape leave
_RADIUS = 0.3  # px, of the radius about the look's


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The centre of the likeliest outline; the radius may differ a little from the look's."""
    fit = fit_outline(patch, look, guess)
    return NOWHERE if fit is None else fit[0]


def fit_outline(patch: Patch, look: Look, guess: Guess) -> tuple[Place, float] | None:
    """The place and the radius in px; None where too little of an outline is seen."""
    import cv2

    contrast = abs(look.contrast) or float(np.ptp(patch.image - patch.back))
    if not contrast > 0:
        return None
    centre = np.array([guess.x_px - patch.x_px, guess.y_px - patch.y_px], float)
    picture = np.ascontiguousarray(patch.image - patch.back, np.float32)
    quiet = 1.4826 * float(np.median(np.abs(picture - np.median(picture))))
    noise = float(np.clip(quiet / contrast, _FLOOR, 0.2))
    count = int(max(32, 2 * np.pi * look.radius_px / 0.9))
    angles = (np.arange(count) + 0.5) * 2 * np.pi / count
    if np.isfinite(guess.string_rad):
        half = min(0.9, 0.2 + 3.0 / look.radius_px)
        angles = angles[np.abs((angles - guess.string_rad + np.pi) % (2 * np.pi) - np.pi) > half]
    ux, uy = np.cos(angles), np.sin(angles)
    streak = np.abs(guess.streak_x_px * ux + guess.streak_y_px * uy)
    longest = float(np.round(np.hypot(guess.streak_x_px, guess.streak_y_px)))  # rounded, so that few kinds of ray occur
    classes = (
        np.minimum((streak / max(longest, 1e-9) * _WIDTHS).astype(int), _WIDTHS - 1)
        if longest > 0.5
        else 0 * angles.astype(int)
    )
    level = float(2.0 ** np.round(np.log2(noise)))
    change = _CHANGE if not look.even else 0.25 * _CHANGE
    wide = max(1.0, look.radius_px / 6)
    unit, step = wide, 0.0  # coarse at first: what is drawn is mistaken for the outline less, and the reach is far
    for turn in range(10):
        if turn > 1 or (turn and step < 0.5):
            unit = 1.0
        edge = float(round(max(look.edge_px / unit, 0.3), 2))
        r = _grid(edge, longest / unit)
        x = centre[0] + ux[:, None] * (look.radius_px + unit * r)
        y = centre[1] + uy[:, None] * (look.radius_px + unit * r)
        inside = ((x >= 0) & (y >= 0) & (x <= picture.shape[1] - 1) & (y <= picture.shape[0] - 1))[
            :, r < 2.5 * edge + 0.5
        ].all(axis=1)
        if inside.sum() < 12:
            return None
        profile = (
            cv2.remap(
                picture, x.astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
            )
            / contrast
        )
        cost = np.empty((angles.size, _SHIFTS.size))
        for k in range(_WIDTHS):
            rows = classes == k
            if rows.any():
                blur = float(round((k + 0.5) / _WIDTHS * longest / unit * 2) / 2) if longest > 0.5 else 0.0
                whitened = _likelihood(edge, float(longest / unit), blur, level, change)
                cost[rows] = _misfits(profile[rows], whitened, float(np.sign(look.contrast)))
        least = cost.min(axis=1)
        scale = max(1.0, float(np.median(least[inside])) / r.size)
        cost = (cost - least[:, None]) / scale
        found, variance, apart = _likeliest(cost, ux, uy, inside)
        step = unit * float(np.hypot(found[0], found[1]))
        centre += unit * np.clip(found[:2], -1.5, 1.5)
        if unit == 1 and step < 0.05:  # the costs were taken on rays from there
            break
    if step > 0.3:
        return None
    sigma = np.sqrt(variance)
    within = profile[:, (r < -0.5 - edge) & (r > -3.0 - edge)].mean(axis=1)
    beyond = profile[:, -3:].mean(axis=1)
    seen = inside & (apart < 2 * _FAR) & (np.abs(within - beyond) > max(0.12, 3 * noise))
    if seen.sum() < 10:
        return None
    place = Place(
        float(centre[0]) + patch.x_px, float(centre[1]) + patch.y_px, max(float(sigma[0]), 1e-4), max(float(sigma[1]), 1e-4),
        contrast * noise * float(np.sqrt(scale)), float(seen.mean()),
        float(np.median((within - beyond)[seen])) * contrast,
    )  # fmt: skip
    return place, look.radius_px + float(found[2])


@cache
def _kernel() -> Any:
    from toolkit.motion.compiled import kernel

    return kernel("likeliest", "toolkit.trackers._outline_kernel", "the outline fit")


def _likeliest(
    cost: np.ndarray, ux: np.ndarray, uy: np.ndarray, inside: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and radius (px off the present ones) of the least robust sum, their variances, and each ray's misfit there."""
    numbers = np.zeros(64)
    numbers[:4] = _SHIFTS[0], _SHIFTS[1] - _SHIFTS[0], _FAR, _RADIUS
    result, apart = np.empty(6), np.empty(ux.size)
    arrays = (np.ascontiguousarray(cost), ux, uy, inside.astype(float), numbers, result, apart)
    places = np.array([*(a.ctypes.data for a in arrays), *cost.shape, 0], np.int64)
    _kernel()(places[-1:].ctypes.data, None, places.ctypes.data)
    return result[:3], result[3:], apart


def _grid(edge: float, longest: float) -> np.ndarray:
    """Where rays are sampled, px beyond the outline."""
    reach = 2.2 * edge + 0.5 * longest
    return np.arange(-_DEPTHS[-1] - min(reach, 3.0), reach + 2.6, _STEP)


def _misfits(profile: np.ndarray, whitened: tuple[np.ndarray, np.ndarray, np.ndarray], sign: float) -> np.ndarray:
    """Minus twice the log-likelihood of each place of the outline, (rays, places), up to a constant."""
    whiten, mean, volume = whitened
    places, size, _ = whiten.shape
    # laid out anew: a transposed view takes OpenBLAS a hundred times as long
    white = whiten.reshape(places * size, size) @ np.ascontiguousarray(profile.T)
    white -= np.float32(sign) * mean.reshape(-1, 1)
    white *= white
    return np.asarray(white.reshape(places, size, -1).sum(axis=1).T + volume, float)


@lru_cache(maxsize=64)
def _likelihood(
    edge: float, longest: float, blur: float, noise: float, change: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each place of the outline: what makes its profiles white noise, the mean so treated, and the volume's logarithm.
    All in units of the contrast."""
    from scipy.special import erf

    r = _grid(edge, longest)
    ends = np.linspace(-0.5, 0.5, 1 + 2 * int(np.ceil(blur))) * blur

    def covered(rim: float) -> np.ndarray:
        return np.mean([0.5 + 0.5 * erf((rim + e - r) / (edge * np.sqrt(2))) for e in ends], axis=0)

    walk = np.tril(np.ones((_DEPTHS.size, _DEPTHS.size)))  # each shell's level is the one's beyond it, changed
    levels = walk @ np.diag([0.5, *([change] * (_DEPTHS.size - 1))]) ** 2 @ walk.T
    whiten, mean, volume = [], [], []
    for shift in _SHIFTS:
        rims = np.array([covered(shift - d) for d in _DEPTHS])
        shells = rims - np.vstack([rims[1:], np.zeros(r.size)])
        beyond = 1 - rims[0]
        spread = shells.T @ levels @ shells + _OUTSIDE**2 * np.outer(beyond, beyond)
        spread += noise**2 * (0.5 ** (np.abs(r[:, None] - r) / 0.5))
        lower = np.linalg.cholesky(spread)
        inverse = np.linalg.inv(lower)
        whiten.append(inverse)
        mean.append(inverse @ rims[0])
        volume.append(2 * np.log(np.diag(lower)).sum())
    plain = [np.where(np.abs(a) < 1e-9, 0, a).astype(np.float32) for a in (whiten, mean)]  # denormal numbers are slow
    return plain[0], plain[1], np.array(volume)


LOCALISER = Localiser("edge", "likeliest outline before the background; for bobs with a pattern or a highlight", locate)

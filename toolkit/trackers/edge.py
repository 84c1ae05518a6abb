"""Outline fit: the circle where the picture departs from the background, whatever is drawn on the bob.

Along rays from the centre, the picture less the background is about zero outside and the bob's level inside. What is drawn
on a ball is foreshortened at its rim to less than a pixel: a shell there may have another of the levels that are seen on
the bob, to an unknown depth, and moves the apparent edge. Each ray is compared with every such shell at every place of the
outline, what levels there are beside being random and integrated out (Gaussian marginal likelihood); the shell that suits
a ray and its neighbours best says how likely the place is. The centre is the likeliest over all rays; a ray that disagrees
with the others counts little (Cauchy).
"""

from __future__ import annotations

from functools import cache, lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place

_STEP = 0.5  # px between samples of a ray
_SHIFTS = np.linspace(-1.2, 1.2, 17)  # places of the outline on a ray that are tried, px
_SHARP = np.array([-0.15, 0.15, 0.45, 0.8, 1.2])  # px: how deep a shell is tried that is as sharp as a pixel,
_SHELLS = np.array([*_SHARP, *np.arange(0.2, 3.3, 0.3)])  # and one as blurred as the outline
_DEEP = 3.0  # px within the outline: what lies deeper hardly counts
_WALK = np.array([0.4, 0.9, 1.6, 2.6])  # depths at which the level within may change a little, px
_LEVELS = np.array([0.03, 0.3, 0.7, 0.97])  # quantiles of what is seen on the bob: levels that the shell may have
_SHELLED = 0.3  # how likely there is a shell at all
_CHANCES = -2 * np.log(np.array([1 - _SHELLED, *np.full(_SHELLS.size, _SHELLED / _SHELLS.size)])).astype(np.float32)
_ALIKE = 3  # neighbouring rays that see the same shell
_TIED = 7.0  # rays that err alike, where the shell is not quite as any that is tried
_FAR = 9.0  # what a ray may disagree by, in units of twice the log-likelihood, before it counts less
_STRAY = 100.0  # the same, before it counts less for which shell its neighbours see
_SEEN_THROUGH = 1  # px of blur along a ray, beyond which no shell is told from the rest
_BLURS = np.array([0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48])  # px along a ray
_BETWEEN = 0.5 * (_BLURS[1:] + _BLURS[:-1])
_NEAR = 2  # pixels of every other one, beyond which a codec hardly joins their noise
_SETTLED = 0.3  # px: after a smaller step the rays, taken from before it, would hardly differ
_POOR = 0.9  # px: after a larger first step the guess was poor
# standard deviations, all but the last two in units of the contrast:
_WITHIN = 0.5  # of the level within the shell
_SHELL = 0.06  # of the shell's level about one of those seen
_CHANGE, _CHANGE_BLURRED = 0.05, 0.3  # of the level from one depth to the next, with shells and without
_OUTSIDE = 0.1  # of the level beyond the outline (a shadow)
_FLOOR = 0.03  # of what a codec and the edge's true shape leave
_SOFT = 0.5  # px, of the shell's inner edge
_RADIUS = 0.3  # px, of the radius about the look's


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """The centre of the likeliest outline; the radius may differ a little from the look's."""
    fit = fit_outline(patch, look, guess)
    return NOWHERE if fit is None else fit.place


class Outline(NamedTuple):
    """Where the outline was found, and its radius (px) with that one's variance."""

    place: Place
    radius_px: float
    variance_px2: float


def fit_outline(patch: Patch, look: Look, guess: Guess, spread_px: float = _RADIUS) -> Outline | None:
    """The likeliest outline of a radius within about `spread_px` of the look's; None where too little of one is seen."""
    contrast = look.contrast or float(np.ptp(patch.image - patch.back))
    if not abs(contrast) > 0:
        return None
    rays = _rays(patch, look._replace(contrast=contrast), guess)
    rows, columns = patch.image.shape
    centre = np.array([guess.x_px - patch.x_px, guess.y_px - patch.y_px], float)
    wide = max(1.0, look.radius_px / 6)
    unit = 1.0
    for turn in range(6):
        edge = float(round(max(look.edge_px / unit, 0.3), 1))
        blurs = _BLURS[np.searchsorted(_BETWEEN, rays.streak / unit)]
        r = _grid(_reach(edge, int(blurs.max())))
        x, y = rays.along(centre, look.radius_px + unit * r)
        last = int(np.searchsorted(r, 2.5 * edge + 0.5)) - 1  # the picture is convex: with it, it has those before
        inside = (x[:, last] >= 0) & (x[:, last] <= columns - 1) & (y[:, last] >= 0) & (y[:, last] <= rows - 1)
        if inside.sum() < 12:
            return None
        profile = rays.seen(x, y)
        levels = _seen_on(rays.picture, centre, look.radius_px - 2.5 * unit)
        cost, least = _weigh(profile, r, edge, blurs, rays.noise, levels, inside)
        scale = max(1.0, float(np.median(least[inside])) / r.size)
        cost /= scale
        found, variance, apart = _likeliest(cost, rays.ux, rays.uy, inside, spread_px)
        step = unit * float(np.hypot(found[0], found[1]))
        centre += unit * np.clip(found[:2], -1.5, 1.5)
        if unit == 1 and step < _SETTLED:
            break
        # a coarse turn, if the guess was poor: its reach is far, and it takes less of what is drawn for the outline
        unit = wide if turn == 0 and step > _POOR else 1.0
    else:
        return None
    sigma = np.sqrt(_TIED * variance)
    deep = (r < -0.5 - edge) & (r > -3.0 - edge)
    if not deep.any():
        return None  # so soft an edge that the rays begin within it: they do not tell the bob from what is beyond
    within = profile[:, deep].mean(axis=1)
    beyond = profile[:, -3:].mean(axis=1)
    seen = inside & (apart < 2 * _FAR) & (np.abs(within - beyond) > max(0.12, 3 * rays.noise))
    if seen.sum() < 10:
        return None
    place = Place(
        float(centre[0]) + patch.x_px, float(centre[1]) + patch.y_px, max(float(sigma[0]), 1e-4), max(float(sigma[1]), 1e-4),
        abs(contrast) * rays.noise * float(np.sqrt(scale)), float(seen.mean()),
        float(np.median((within - beyond)[seen])) * contrast,
    )  # fmt: skip
    return Outline(place, look.radius_px + float(found[2]), float(variance[2]))


def unlikely(patch: Patch, look: Look, guess: Guess, reach_px: float, shells: bool = True) -> float:
    """Minus twice the log-likelihood of an ordinary ray, the bob having this look and streak and its outline being about where it is
    guessed: of two looks the one with less is the likelier, if the rays reach as far (px beyond the outline) for both. Streaks are
    compared without `shells`, which are not told through long ones."""
    rays = _rays(patch, look, guess)
    rows, columns = patch.image.shape
    centre = np.array([guess.x_px - patch.x_px, guess.y_px - patch.y_px], float)
    edge = float(round(max(look.edge_px, 0.3), 1))
    blurs = _BLURS[np.searchsorted(_BETWEEN, rays.streak)]
    r = _grid(reach_px)
    x, y = rays.along(centre, look.radius_px + r)
    inside = (x.min(axis=1) >= 0) & (x.max(axis=1) <= columns - 1) & (y.min(axis=1) >= 0) & (y.max(axis=1) <= rows - 1)
    if inside.sum() < 12:
        return np.nan
    levels = _seen_on(rays.picture, centre, look.radius_px - 2.5)
    _, least = _weigh(rays.seen(x, y), r, edge, blurs, rays.noise, levels, inside, reach_px, shells)
    lowest = np.array([_model(edge, int(blur), rays.noise, reach_px, shells).lowest for blur in blurs])
    return float(np.median((least + lowest)[inside]))


class _Rays(NamedTuple):
    """Rays from the bob's centre, (n,): their directions' cosines and sines, and how far (px) the exposure blurs each; before the
    picture less the background, in units of the contrast, and its noise."""

    picture: np.ndarray
    noise: float
    ux: np.ndarray
    uy: np.ndarray
    streak: np.ndarray

    def along(self, centre: np.ndarray, far_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x and y, (n, k) float32, of the points so far (k,) from the centre."""
        far = far_px.astype(np.float32)
        x, y = (np.float32(c) + u.astype(np.float32)[:, None] * far for c, u in zip(centre, (self.ux, self.uy)))
        return x, y

    def seen(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The picture at these points, as many."""
        import cv2

        return np.asarray(cv2.remap(self.picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE))


def _rays(patch: Patch, look: Look, guess: Guess) -> _Rays:
    """A ray a pixel of the outline, but for those on which the string is expected."""
    picture = np.ascontiguousarray((patch.image - patch.back) / look.contrast, np.float32)
    some = picture[::2, ::2]
    # by pixels near each other: what passes behind the bob, and its pattern, have other levels, but no more noise
    quiet = 1.4826 / np.sqrt(2) * float(np.median(np.abs(some[:, _NEAR:] - some[:, :-_NEAR])))
    noise = float(2.0 ** np.round(np.log2(np.clip(quiet, _FLOOR, 0.2))))
    count = int(max(32, 2 * np.pi * look.radius_px / 0.9))
    angles = (np.arange(count) + 0.5) * 2 * np.pi / count
    if np.isfinite(guess.string_rad):
        half, turn = min(0.9, 0.2 + 3.0 / look.radius_px), np.pi if guess.faces else 2 * np.pi
        angles = angles[np.abs((angles - guess.string_rad + turn / 2) % turn - turn / 2) > half]
    ux, uy = np.cos(angles), np.sin(angles)
    return _Rays(picture, noise, ux, uy, np.abs(guess.streak_x_px * ux + guess.streak_y_px * uy))


def _seen_on(picture: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """The levels seen on the bob, in units of its contrast."""
    rows, columns = np.ogrid[: picture.shape[0], : picture.shape[1]]
    on = picture[np.hypot(columns - centre[0], rows - centre[1]) < max(radius, 2.0)]
    if on.size <= 8:
        return np.ones(_LEVELS.size, np.float32)
    ranks = np.rint(_LEVELS * (on.size - 1)).astype(int)
    return np.partition(on, ranks)[ranks]


def _reach(edge: float, blur: int) -> float:
    """How far beyond the outline (px) it is to be seen."""
    return 2.2 * edge + 0.5 * blur


def _grid(reach: float) -> np.ndarray:
    """Where rays are sampled, px beyond the outline, which is to be seen so far."""
    return np.arange(np.floor((-_DEEP - min(reach, 3.0)) / _STEP), np.ceil((reach + 2.0) / _STEP) + 1) * _STEP


class _Model(NamedTuple):
    """For each place of the outline and each shell (none first), (m, …): what makes profiles white noise, what a level of 1
    within the shell and of 1 in it become by that, and the volume's logarithm, above the `lowest`."""

    whiten: np.ndarray
    within: np.ndarray
    shell: np.ndarray
    volume: np.ndarray
    lowest: float  # of it, which is left out
    addresses: tuple[int, ...]  # of these
    first_px: float  # the first sample, beyond the outline


@lru_cache(maxsize=256)
def _model(edge: float, blur: int, noise: float, reach: float, shells: bool) -> _Model:
    from scipy.special import ndtr

    from toolkit.motion.compiled import address

    r = _grid(reach)
    ends = np.linspace(-0.5, 0.5, 1 + 2 * blur) * blur
    depths, change = (_SHELLS, _CHANGE) if shells and blur <= _SEEN_THROUGH else (_SHELLS[:0], _CHANGE_BLURRED)

    def covered(rims: np.ndarray, sigma: float) -> np.ndarray:
        return np.asarray(ndtr((rims[..., None, None] + ends - r[:, None]) / sigma).mean(axis=-1))

    shift, depth = np.repeat(_SHIFTS, 1 + depths.size), np.tile([-np.inf, *depths], _SHIFTS.size)
    # where shells are told, a ray without one is a step by one of the levels, from anywhere; else it is the disc's
    sharp = np.tile([not depths.size, *(np.arange(depths.size) < _SHARP.size)], _SHIFTS.size)[:, None]
    disc = covered(shift, edge)
    core = np.where(sharp, disc * covered(shift - depth, _SOFT), covered(shift - depth, edge))
    within, shell = core, disc - core
    changes = [change * core * covered(shift - d, edge) for d in _WALK]
    random = np.stack([_WITHIN * within, _SHELL * shell, _OUTSIDE * (1 - disc), *changes], axis=-1)
    spread = random @ random.transpose(0, 2, 1) + noise**2 * 0.5 ** (np.abs(r[:, None] - r) / 0.5)
    spread[:, r < -_DEEP, r < -_DEEP] += 1.0
    lower = np.linalg.cholesky(spread)
    whiten = np.linalg.inv(lower)
    volume = 2 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
    parts = (whiten, (whiten @ within[..., None])[..., 0], (whiten @ shell[..., None])[..., 0], volume - volume.min())
    a, b, c, d = (np.where(np.abs(p) < 1e-9, 0, p).astype(np.float32) for p in parts)  # denormal numbers are slow
    return _Model(a, b, c, d, float(volume.min()), tuple(address(p) for p in (a, b, c, d)), float(r[0]))


def _weigh(
    profile: np.ndarray,
    r: np.ndarray,
    edge: float,
    blurs: np.ndarray,
    noise: float,
    levels: np.ndarray,
    inside: np.ndarray,
    reach: float | None = None,
    shells: bool = True,
) -> tuple[np.ndarray, np.ndarray]:
    """Minus twice the log-likelihood of each place of the outline, (rays, places), by the shell that suits the ray and its
    neighbours best; and each ray's least misfit. A ray is looked at as far as it is blurred, or all as far as `reach`."""
    from toolkit.motion.compiled import address, call

    rays, kinds = len(profile), _SHIFTS.size * (1 + _SHELLS.size)
    order = np.argsort(blurs, kind="stable")
    blurs = blurs[order]
    ends = np.flatnonzero(np.diff(blurs, prepend=-1, append=-1))
    runs = []
    for begin, end in pairwise(ends.tolist()):
        blur = int(blurs[begin])
        model = _model(edge, blur, noise, _reach(edge, blur) if reach is None else reach, shells)
        size = model.within.shape[1]
        first, kinds_here = round((model.first_px - r[0]) / _STEP), len(model.volume) // _SHIFTS.size
        runs.append((begin, end, first, size, kinds_here, *model.addresses))
    arrays = (
        np.ascontiguousarray(profile.T[:, order]),
        np.array(runs, np.int64),
        np.array([*levels, levels.mean(), _STRAY], np.float32),
        _CHANCES,
        inside[order].astype(np.float32),
        order,
        np.empty(levels.size * kinds * rays + 4 * rays + _ALIKE, np.float32),
        np.empty((rays, _SHIFTS.size)),
        np.empty(rays, np.float32),
    )
    counts = (rays, len(runs), levels.size, _SHIFTS.size, 1 + _SHELLS.size, _ALIKE)
    call(_kernel("weigh_places", "_rim_kernel"), *(address(a) for a in arrays), *counts)
    return arrays[7], arrays[8][np.argsort(order)]


@cache
def _kernel(name: str, module: str) -> Any:
    from toolkit.motion.compiled import kernel

    return kernel(name, f"toolkit.trackers.{module}", "the outline fit")


def _likeliest(
    cost: np.ndarray, ux: np.ndarray, uy: np.ndarray, inside: np.ndarray, spread_px: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and radius (px off the present ones) of the least robust sum, their variances, and each ray's misfit there."""
    from toolkit.motion.compiled import address, call

    numbers = np.zeros(64)
    numbers[:4] = _SHIFTS[0], _SHIFTS[1] - _SHIFTS[0], _FAR, spread_px
    result, apart = np.empty(6), np.empty(ux.size)
    arrays = (np.ascontiguousarray(cost), ux, uy, inside.astype(float), numbers, result, apart)
    call(_kernel("likeliest", "_outline_kernel"), *(address(a) for a in arrays), *cost.shape)
    return result[:3], result[3:], apart


LOCALISER = Localiser(
    "edge", "likeliest outline before the background; for bobs with a pattern or a highlight", locate, circle=True
)

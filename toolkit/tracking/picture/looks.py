"""How the bob looks: size and edge from fits where it is slow, the exposure from the streak where it is fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch

_SURE, _GROWN_PX = 6.0, 0.4  # standard deviations, and over the whole swing: so much the bob grows where it nears
_FEW = 3  # sightings: fewer tell no size on one side of the swing
_BESIDE = 0.4  # of the radius: so far from where the bob was seen it is not
_CLEAR = 2.0  # times the least misfit squared that any has
_STREAKED = 0.9  # of the misfit, at most, is left where a streak is taken into account that is there
_MANY = 4000  # pixels of a patch: a part of more tells its light as well
# what `fit_disc` gives
_RADIUS, _EDGE, _MISFIT, _VISIBLE, _CONTRAST, _WITHIN = 2, 3, 7, 8, 9, 13


@dataclass(frozen=True)
class Sightings:
    """The bob where it was found: centre x_px, y_px and velocity vx, vy (px/s), all (n,), and `show`, which gives the guess
    and the patch (or None) of sighting k for a bob of these looks, centred there, that draws so long a streak (s)."""

    x_px: np.ndarray
    y_px: np.ndarray
    vx: np.ndarray
    vy: np.ndarray
    show: Callable[[int, Look, tuple[float, float], float], tuple[Guess, Patch | None]]

    def fit(self, k: int, look: Look, streak_s: float, **how: float) -> np.ndarray | None:
        """The disc fitted to sighting k, its centre in pixels of the picture; None where there is none."""
        return self._fit(k, look, (float(self.x_px[k]), float(self.y_px[k])), streak_s, how)

    def fit_from_far(
        self, k: int, look: Look, streak_s: float, about: tuple[float, float] | None = None
    ) -> np.ndarray | None:
        """`fit` (from `about` that place, if it is given); and where this sees no outline, once more from where a soft edge, which
        reaches farther, finds it; but not from beside the bob: a long streak is as faint as the wall's texture."""
        out = self._fit(k, look, about or (float(self.x_px[k]), float(self.y_px[k])), streak_s, {"turns": 12})
        if out is not None and out[_VISIBLE] > 0.5:
            return out
        soft = self.fit(k, look._replace(noise=np.inf), streak_s, turns=12, soften=2.5)
        if soft is None or np.hypot(soft[0] - self.x_px[k], soft[1] - self.y_px[k]) > _BESIDE * look.radius_px:
            return None
        return self._fit(k, look, (soft[0], soft[1]), streak_s, {"turns": 12})

    def _fit(
        self, k: int, look: Look, centre: tuple[float, float], streak_s: float, how: dict[str, float]
    ) -> np.ndarray | None:
        guess, patch = self.show(k, look, centre, streak_s)
        out = None if patch is None else fit_disc(patch, look, guess, **how)  # type: ignore[arg-type]
        if patch is not None and out is not None:
            out[:2] += patch.x_px, patch.y_px
        return out

    def noise(self, k: int, look: Look) -> float:
        """The wall's own noise about sighting k, grey levels; NaN where nothing is seen."""
        patch = self.show(k, look, (float(self.x_px[k]), float(self.y_px[k])), 0.0)[1]
        return (
            np.nan if patch is None else 1.4826 * float(np.median(np.abs(patch.image - light_on(patch) * patch.back)))
        )


class Looks(NamedTuple):
    """The looks learned, the exposure (s), and how the radius grows along x (slope, intercept) if it does."""

    look: Look
    exposure_s: float = 0.0
    growth: tuple[float, float] | None = None


class Clearest(NamedTuple):
    """Of one sighting's fits that which left least (misfit squared): how little, and its centre, px."""

    cost: float
    centre: tuple[float, float]


def learn_looks(
    seen: Sightings, look: Look, radius: float | None, interval_s: float, shape: tuple[int, ...]
) -> Looks | None:
    """The looks of the bob seen, from about `look`; its `radius` if that is known. None where hardly a fit succeeds."""
    speed = np.hypot(seen.vx, seen.vy)
    sides = _sides(seen, np.argsort(speed), look.radius_px, shape)
    slow = _slow(speed, sides)
    fast = np.argsort(-speed)[:10]
    walls = [w for w in (seen.noise(k, look) for k in slow[::2]) if np.isfinite(w)]
    drawn = 0.05 * abs(look.contrast) + 1.5 * float(np.median(walls or [0.0]))  # more misfit than noise leaves
    found_px, learned = look.radius_px, Looks(look)
    clearest: dict[int, Clearest] = {}
    patterned: Look | None = None

    def fitted(look: Look, sightings: np.ndarray) -> dict[int, np.ndarray]:
        near = ((int(k), grown(look, learned.growth, float(seen.x_px[k]))) for k in sightings)
        fits = ((k, seen.fit(k, its, learned.exposure_s, calibrate=True, turns=8)) for k, its in near)
        return {k: f for k, f in fits if f is not None and (radius or _whole(f, found_px, shape))}

    def sized(look: Look) -> dict[int, np.ndarray]:
        fits = fitted(look, slow)
        usual = _usual_contrast(fits)
        alike = _of_contrast(usual, fits)
        for side in sides:  # where something passes behind the bob as it turns, the next slowest tell
            if sum(k in alike for k in side.tolist()) < _FEW:
                fits |= _of_contrast(usual, fitted(look, side[~np.isin(side, slow)][:8]))
        return fits

    for turn in range(2):  # the streak widens the edge, the edge shortens the streak
        fits = sized(look)
        if look.even and (len(fits) < 3 or np.median([f[_WITHIN] for f in fits.values()]) > drawn):
            uneven = look._replace(even=False)  # a pattern or a highlight: the outline alone counts
            outlined = sized(uneven)
            if len(fits) >= 3 or len(outlined) >= 3:
                look, fits = uneven, outlined
        if len(fits) < 3 and turn == 0:
            return None
        if len(fits) >= 3:
            look, growth = _size(look, fits, seen, radius)
            learned = Looks(look, learned.exposure_s, growth)
        if not look.even and look.noise > drawn:
            # a pattern up to the outline tells no size and no streak; but a bob that is nowhere slow draws one, which is none
            if patterned is None and turn == 0 and np.median(speed[slow]) * interval_s > 1.0:
                patterned = look
            elif patterned is None or look.noise > _STREAKED * patterned.noise:
                return Looks((patterned or look)._replace(radius_free=False))
        if speed.max() * interval_s < 1.0:
            break
        exposure_s = _exposure(seen, learned, fast, interval_s, learned.exposure_s if turn else None, clearest)
        if exposure_s is None:
            return learned if patterned is None else Looks(patterned._replace(radius_free=False))
        learned = learned._replace(exposure_s=exposure_s)
    return learned


def grown(look: Look, growth: tuple[float, float] | None, x_px: float) -> Look:
    """The bob's looks at a place: nearer to the camera it is larger."""
    if growth is None or not look.radius_free:
        return look
    size = growth[0] * x_px + growth[1]
    return look._replace(radius_px=min(max(size, 0.75 * look.radius_px), 1.3 * look.radius_px))


def _sides(seen: Sightings, order: np.ndarray, radius_px: float, shape: tuple[int, ...]) -> list[np.ndarray]:
    """Of these sightings those on the left and those on the right, whole in the picture."""
    rim = np.min([seen.x_px, seen.y_px, shape[1] - 1 - seen.x_px, shape[0] - 1 - seen.y_px], axis=0)
    whole, left = rim >= radius_px + 2, seen.x_px < np.median(seen.x_px)
    return [order[whole[order] & side[order]] for side in (left, ~left)]


def _slow(speed: np.ndarray, sides: list[np.ndarray]) -> np.ndarray:
    """Up to 16 sightings on which the bob is slow; where hardly one of them is whole on the left, or on the right, as many from
    either of these `sides`, for the bob may be larger there."""
    slow = np.argsort(speed)[: max(8, speed.size // 4)]
    slow = slow[:: max(1, slow.size // 16)][:16]
    if min(np.isin(side, slow).sum() for side in sides) >= 4:
        return slow
    return np.concatenate([side[:8] for side in sides]) if min(map(len, sides)) >= 4 else slow


def _usual_contrast(fits: dict[int, np.ndarray]) -> float:
    return float(sorted(f[_CONTRAST] for f in fits.values())[len(fits) // 2]) if fits else np.nan


def _of_contrast(usual: float, fits: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
    """Those of about this contrast: the others ran away, or something else stands behind the bob."""
    return {k: f for k, f in fits.items() if 0.5 < f[_CONTRAST] / usual < 2.0}


def _whole(fit: np.ndarray, found_px: float, shape: tuple[int, ...]) -> bool:
    """Can a size be learned here? Not half out of the picture, nor where a shadow was taken for a part of the bob."""
    size = float(fit[_RADIUS])
    rim = min(fit[0], fit[1], shape[1] - 1 - fit[0], shape[0] - 1 - fit[1])
    return bool(rim >= size + 2 and 0.8 < size / found_px < 1.25)


def _size(
    look: Look, fits: dict[int, np.ndarray], seen: Sightings, radius: float | None
) -> tuple[Look, tuple[float, float] | None]:
    """The looks that most fits agree on; and the line along which the radius grows, where the bob is larger on one side."""
    x_px = seen.x_px
    fits = _of_contrast(_usual_contrast(fits), fits)
    table = np.array(list(fits.values()))
    middle = np.median(table, axis=0)
    size, edge, contrast, noise = (float(middle[n]) for n in (_RADIUS, _EDGE, _CONTRAST, _MISFIT))
    look = look._replace(radius_px=radius or size, edge_px=max(0.35, edge), contrast=contrast, noise=noise)
    sizes, where = table[:, _RADIUS], x_px[list(fits)]
    left = where < float(np.median(x_px))
    if radius or not _FEW <= left.sum() <= left.size - _FEW:
        return look._replace(radius_free=False), None
    spread = np.hypot(sizes[left].std() / np.sqrt(left.sum()), sizes[~left].std() / np.sqrt((~left).sum()))
    if abs(sizes[left].mean() - sizes[~left].mean()) <= max(0.05, 4 * spread):
        return look._replace(radius_free=_nears(sizes, where, seen.vx[list(fits)], float(np.ptp(seen.vx)))), None
    slope, intercept = np.polyfit(where, sizes, 1)
    return look._replace(radius_free=True), (float(slope), float(intercept))


def _nears(sizes: np.ndarray, x_px: np.ndarray, vx: np.ndarray, range_vx: float) -> bool:
    """Is the bob larger on its way to one side than on its way back? So it is where it swings in an ellipse: then it is nearest, and
    farthest, where it is fastest. All (n,), of sightings on which it is slow."""
    design = np.column_stack([np.ones_like(vx), x_px - x_px.mean(), vx])
    values, rest, rank, _ = np.linalg.lstsq(design, sizes, rcond=None)
    if rank < 3 or sizes.size < 8:
        return False
    sigma = float(np.sqrt(rest[0] / (sizes.size - 3) * np.linalg.inv(design.T @ design)[2, 2]))
    return bool(abs(values[2]) > _SURE * sigma and abs(values[2]) * range_vx > _GROWN_PX)


def _exposure(
    seen: Sightings,
    learned: Looks,
    fast: np.ndarray,
    interval_s: float,
    about_s: float | None,
    clearest: dict[int, Clearest],
) -> float | None:
    """The exposure whose streak fits the fastest sightings best, looked for from `about_s` on where that is known; None where
    hardly one is fitted.

    A fit that sees no outline says nothing: a long faint streak fits an empty wall well. Each starts where the sighting's `clearest`
    fit was, which becomes known here: a bob that draws a long streak was hardly found in its middle, and a fit that then fails with
    one exposure, but not with another, would say what it should not.
    """
    trials = np.linspace(0, 1, 11)
    cost = np.full((trials.size, fast.size), np.nan)
    looks = [grown(learned.look, learned.growth, x) for x in seen.x_px[fast].tolist()]
    tried: set[int] = set()
    # so close that one lies a little below the right one: too long a streak fits about as badly whatever its length
    wanted = {0, 2, 4, 6} if about_s is None else {round(10 * about_s / interval_s)}
    while wanted - tried:  # until what is best has no untried neighbour
        for j in sorted(wanted - tried):
            for n, k in enumerate(fast.tolist()):
                best_yet = clearest.get(k)
                fit = seen.fit_from_far(k, looks[n], trials[j] * interval_s, best_yet and best_yet.centre)
                if fit is not None and fit[_VISIBLE] > 0.5 and _shows(fit, looks[n]):
                    cost[j, n] = fit[_MISFIT] ** 2
                    if best_yet is None or cost[j, n] < best_yet.cost:
                        clearest[k] = Clearest(cost[j, n], (float(fit[0]), float(fit[1])))
        tried |= wanted
        total = _total(cost, 1)
        if total is None:
            return None
        best = int(np.argmin(total))
        wanted = {best - 1, best, best + 1} & set(range(trials.size))
    total = _total(cost, min(3, len(tried)))
    if total is None:
        return None
    j = int(np.argmin(total))
    part = trials[j]
    if 0 < j < trials.size - 1 and np.isfinite(total[j - 1 : j + 2]).all():
        a, b, c = total[j - 1 : j + 2]
        part += 0.1 * 0.5 * (a - c) / max(a - 2 * b + c, 1e-12)
    return float(max(0.0, part) * interval_s)


def _shows(fit: np.ndarray, look: Look) -> bool:
    """Is it as dark, or bright, as a bob of one shade is when it is slow? Of a bob that is not where the fit is, a streak shows nothing."""
    return not look.even or bool(0.5 < fit[_CONTRAST] / look.contrast < 2.0)


def _total(cost: np.ndarray, least: int) -> np.ndarray | None:
    """(trials,) the sum of the clearest sightings' costs (trials, n), NaN where nothing was fitted, of those that were fitted
    in so many trials at least, or very clearly in one; infinite for what was not tried; None where there are fewer than three."""
    fitted = np.isfinite(cost)
    best = np.min(np.where(fitted, cost, np.inf), axis=0)
    once = (fitted.sum(axis=0) == 1) & (best < _CLEAR * best.min())
    used = once | (fitted.sum(axis=0) >= least)
    if used.sum() < 3:
        return None
    some = cost[:, used]
    # what is clear with one exposure and not seen with any other is as unlike those as anything that was fitted
    known = np.where(np.isfinite(some), some, np.where(once[used], np.nanmax(some), np.nanmax(some, axis=0)))
    clear = np.argsort(known.min(axis=0))[:6]  # not those on which something hides a part of it
    return np.where(fitted.any(axis=1), known[:, clear].sum(axis=1), np.inf)


def light_on(patch: Patch) -> float:
    """How bright the light is against that of the background."""
    every = 1 + patch.image.size // _MANY
    image, back, seen = (p.ravel()[::every] for p in (patch.image, patch.back, patch.seen))
    known = seen > 0
    if np.count_nonzero(known) < 20:
        return 1.0
    return float(np.clip(np.median(image[known] / np.maximum(back[known], 1.0)), 0.3, 3.0))

"""The bob's shadow on the wall behind it: a soft disc that swings along at a fixed offset and takes the same share of light
from whatever is there. Taken for a part of the bob it would draw its centre by pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.geometry.least_squares import least_squares
from toolkit.tracking.picture.plane import rim_level

_PIXELS = 3000  # so many are compared with the model
_CLEAR = 8.0  # grey levels: what the model leaves counts less where it is more
_ALIKE = 1.1  # so much worse a model may be, and as likely
_OWN = 6.0  # grey levels: what is explained less well may be the bob
_SHADOWY_PX = 1.2  # a sharper edge is no shadow's
_MOVES, _STRIDE_PX = 4, 2.0  # so often each patch is moved, by so much at most
# of the values of `_model`
_STEPS = np.array([1e-3, 1e-3, 1e-3, 1e-3, 1e-2, 1e-3, 1e-3, 1e-5, 1e-3, 1e-3, 1e-5, 1e-3, 1e-3])
# where a shadow is looked for: how far away, how large the bob and it may be (in radii of what was taken for the bob), and how much of
# the way to it what was taken for the bob lies
_ABOUT_BOB = ((0.5, 1.0, 0.2), (1.3, 1.0, 0.2))
_TAKEN_FOR_ONE = (0.6, 0.6, 0.5)
# what the bob alone leaves is compared between parts of the picture: rings about it, of so many radii, in eight directions each
_RINGS = (0.5, 0.8, 0.95, 1.05, 1.25, 1.6, 2.2)
_DISTURBED = 3.0  # times what is left of most patches: of one with more something else is on it
_UNEXPLAINED = 8.0  # times the scatter within such parts: more between them, and there is something beside the bob

# of each: its place relative to the guess (two), the picture in the background's light, the background, and its patch's number
_Pixels = tuple[np.ndarray, ...]


class Shadow(NamedTuple):
    """Its centre less the bob's, its radius, the standard deviation of its edge (px), and the share of light it takes."""

    right_px: float
    down_px: float
    radius_px: float
    soft_px: float
    strength: float

    def light(self, right: np.ndarray, down: np.ndarray) -> np.ndarray:
        """How much of the light is left at places relative to the bob's centre, px."""
        d = np.hypot(right - self.right_px, down - self.down_px)
        return 1 - self.strength * _covered(d, self.radius_px, self.soft_px)

    def cast(self, patch: Patch, guess: Guess) -> Patch:
        """The patch with a background on which the shadow of a bob at the guess lies, smeared along its streak."""
        rows, columns = patch.back.shape
        down = np.arange(rows)[:, None] + (patch.y_px - guess.y_px)
        right = np.arange(columns)[None, :] + (patch.x_px - guess.x_px)
        streak = float(np.hypot(guess.streak_x_px, guess.streak_y_px))
        parts = np.arange(0.5, int(streak / self.soft_px) + 1) / (int(streak / self.soft_px) + 1) - 0.5
        left = sum(self.light(right - p * guess.streak_x_px, down - p * guess.streak_y_px) for p in parts)
        return patch._replace(back=(patch.back * (left / parts.size)).astype(np.float32))

    def circle(self, x_px: float, y_px: float, radius_px: float) -> tuple[float, float, float]:
        """The circle that holds one of this radius about the bob, and the shadow."""
        far = float(np.hypot(self.right_px, self.down_px))
        beyond = self.radius_px + 2 * self.soft_px
        if far + beyond <= radius_px:
            return x_px, y_px, radius_px
        whole = 0.5 * (far + beyond + radius_px)
        part = (whole - radius_px) / max(far, 1e-9)
        return x_px + part * self.right_px, y_px + part * self.down_px, whole


class Shaded(NamedTuple):
    """A shadow, and what the bob is without it: its centre less where it was taken to be, its radius and edge, px, and its
    contrast, grey levels."""

    shadow: Shadow
    x_px: float
    y_px: float
    radius_px: float
    edge_px: float
    contrast: float

    @property
    def taken_for_bob(self) -> bool:
        """Was the bob, which is clear of it, taken to be where its shadow is?"""
        to_bob = np.hypot(self.x_px, self.y_px)
        to_shadow = np.hypot(self.x_px + self.shadow.right_px, self.y_px + self.shadow.down_px)
        return bool(to_shadow < 0.3 * self.radius_px and to_bob > self.radius_px)


def find_shadow(seen: list[tuple[Patch, Guess]], look: Look) -> Shaded | None:
    """The shadow beside the bob, by what is fitted to patches on which the bob is slow (each with the guess at its centre).
    None where the bob alone explains them nearly as well."""
    pixels = _pixels(seen, look)
    if pixels[0].size < 200:
        return None
    alone, rest = _fit_alone(pixels, look)
    undisturbed = _undisturbed(rest, pixels[-1])
    if not np.all(undisturbed):
        pixels = tuple(each[undisturbed] for each in pixels)
        alone, rest = _fit_alone(pixels, look)
    u, v, image, back, which = pixels
    if look.even and _unexplained(u, v, rest, look.radius_px) < _UNEXPLAINED:
        return None
    found = _beside_even(u, v, image, back, which, look, alone)
    return found or (_beside_patterned(u, v, image, back, look) if look.even else None)


def find_shadow_near(seen: list[tuple[Patch, Guess]], look: Look, about: Shaded) -> Shaded | None:
    """The shadow found before from places that it had drawn aside, and the bob; from patches at better places."""
    u, v, image, back, _ = _pixels(seen, look)
    shadow = about.shadow
    bob = about.radius_px, about.edge_px, np.median(back) + about.contrast
    start = np.array(
        [0, 0, *bob, 0, 0, 1.0, shadow.right_px, shadow.down_px, shadow.strength, shadow.radius_px, shadow.soft_px]
    )
    values, _ = _fit(u, v, image, back, start, range(start.size), 15)
    return _read(values, look, back)


def _fit(
    u: np.ndarray, v: np.ndarray, image: np.ndarray, back: np.ndarray, start: np.ndarray, free: range, turns: int
) -> tuple[np.ndarray, float]:
    """The model's values from about `start` on, and what they leave of a pixel (squared, tamed)."""

    def rest(values: np.ndarray) -> np.ndarray:
        return _CLEAR * np.arcsinh((image - _model(values, u, v, back)) / _CLEAR)

    least = least_squares(rest, start, _STEPS, free, turns=turns)
    return (start, np.inf) if least is None else (least.values, least.chi2 / least.rest.size)


def _fit_alone(pixels: _Pixels, look: Look) -> tuple[tuple[np.ndarray, float], np.ndarray]:
    """`_fit` of the bob without a shadow, and what it leaves of each pixel, grey levels."""
    u, v, image, back, _ = pixels
    alone = _fit(u, v, image, back, _alone(image, back, look), range(8), 12)
    return alone, image - _model(alone[0], u, v, back)


def _undisturbed(rest: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Which pixels are of a patch like most: of one on which something passes, the model leaves far more (`rest`, grey levels), and a
    shadow would not show in the mean."""
    tame = np.clip(rest, -3 * _CLEAR, 3 * _CLEAR)
    left = np.bincount(which, tame**2) / np.maximum(np.bincount(which), 1)
    return left[which] <= _DISTURBED * np.median(left[np.unique(which)])


def _fit_in_place(
    u: np.ndarray, v: np.ndarray, image: np.ndarray, back: np.ndarray, which: np.ndarray, start: np.ndarray, free: int
) -> tuple[np.ndarray, float]:
    """`_fit` to patches each of which is moved to where the model explains it best: the shadow draws each guess another way, for
    the string hides another part of both. `which` is each pixel's patch."""
    values, left = start, np.inf
    for _ in range(_MOVES):
        off = image - _model(values, u, v, back)
        weight = 1 / (1 + (off / _CLEAR) ** 2)
        moved = (
            _model(values, u + a, v + b, back) - _model(values, u - a, v - b, back) for a, b in ((0.5, 0), (0, 0.5))
        )
        by_x, by_y = moved
        xx, xy, yy, x, y = (
            np.bincount(which, weight * one * other)
            for one, other in ((by_x, by_x), (by_x, by_y), (by_y, by_y), (by_x, off), (by_y, off))
        )
        far = np.stack([yy * x - xy * y, xx * y - xy * x]) / np.maximum(xx * yy - xy * xy, 1e-9)
        far = np.clip(far, -_STRIDE_PX, _STRIDE_PX)
        right, down = far - far.mean(axis=1, keepdims=True)
        u, v = u + right[which], v + down[which]
        values, left = _fit(u, v, image, back, values, range(free), 5)
    return values, left


def _beside_even(
    u: np.ndarray,
    v: np.ndarray,
    image: np.ndarray,
    back: np.ndarray,
    which: np.ndarray,
    look: Look,
    alone: tuple[np.ndarray, float],
) -> Shaded | None:
    """By a disc and a soft darker disc behind it; `alone` is the fit of the disc without one."""
    size, (bare, without) = look.radius_px, alone

    def fit(start: np.ndarray, free: range, every: int, turns: int) -> tuple[np.ndarray, float]:
        return _fit(u[::every], v[::every], image[::every], back[::every], start, free, turns)

    starts = []
    for far, large, drawn in _ABOUT_BOB if look.even else (*_ABOUT_BOB, _TAKEN_FOR_ONE):
        for angle in np.arange(8) * np.pi / 4:
            start = _alone(image, back, look)
            right, down = far * size * np.cos(angle), far * size * np.sin(angle)
            start[:3] = -drawn * right, -drawn * down, large * size
            start[8:12] = right, down, 0.3, large * size
            starts.append(fit(start, range(13), 4, 4))
    start = _alone(image, back, look)
    start[8:11] = *_rest_beside(u, v, image, back, size), 0.3
    starts += [fit(s, range(13), 4, 4) for s in (start, _exchanged(start))]
    starts.sort(key=lambda s: s[1])
    tries = [min((fit(start, range(13), 1, 15) for start, _ in starts[:2]), key=lambda s: s[1])]
    values, with_it = tries[0]
    if abs(values[12]) < abs(values[3]):  # the bob has the sharper edge: they may have been taken for each other
        other = fit(_exchanged(values), range(13), 1, 15)
        tries.insert(0 if other[1] < _ALIKE * with_it else 1, other)
    less = 0.75 if look.even else 0.7

    def told(tries: list[tuple[np.ndarray, float]], without: float) -> Shaded | None:
        read = (_read(values, look, back) for values, with_it in tries if with_it <= less * without)
        return next((shaded for shaded in read if shaded is not None), None)

    found = told(tries, without)
    if found is not None:
        return found
    pixels = u, v, image, back, which
    return told([_fit_in_place(*pixels, values, 13) for values, _ in tries], _fit_in_place(*pixels, bare, 8)[1])


def _read(values: np.ndarray, look: Look, back: np.ndarray) -> Shaded | None:
    """The shadow that these values of the model mean; None where they mean none that could be."""
    cx, cy, radius, edge, shade, _, _, gain, right, down, strength, shadow_px, soft = (float(a) for a in values)
    shadow = Shadow(right, down, shadow_px, abs(soft), strength)
    far = float(np.hypot(right, down))
    least = 0.15 if look.even else 0.5  # a pattern may look a little like a shadow behind most of the bob
    both = 0.5 * (radius + far + shadow_px)  # the circle about them, if they were taken for one
    plausible = (
        0.03 < strength < 0.95
        and np.hypot(shadow_px, 2 * soft) > 0.6 * radius  # so soft a shadow as this may be of any size
        and shadow_px < 1.6 * radius
        and 1 / 1.3 < look.radius_px / radius < max(1 / 0.6, both / radius)
        and shadow.soft_px > max(0.3 if look.even else _SHADOWY_PX, 0.6 * abs(edge))
        and radius + 1 < far + shadow_px < 6 * radius
        and far > least * radius
    )
    wall = gain * float(np.median(back))
    contrast = shade - wall
    # two discs of one shade and one edge are one bob that the lens draws out
    drawn_out = abs(contrast + strength * wall) < 0.15 * abs(contrast) and abs(soft) < 1.5 * abs(edge)
    if drawn_out or not plausible:
        return None
    return Shaded(shadow, cx, cy, radius, max(0.35, abs(edge)), contrast)


def _beside_patterned(u: np.ndarray, v: np.ndarray, image: np.ndarray, back: np.ndarray, look: Look) -> Shaded | None:
    """The shadow was taken for the bob, which is beside it and may look like anything: by a soft darker disc, and another in
    which nothing is explained, so small as may be."""
    size = look.radius_px
    start = np.array([*_rest_beside(u, v, image, back, size), size, 1.0, 0, 0, 0.3, size, max(look.edge_px, 1.0)])
    steps = np.array([1e-3, 1e-3, 1e-3, 1e-5, 1e-3, 1e-3, 1e-5, 1e-3, 1e-3])

    def parts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        cx, cy, radius, gain, sx, sy, strength, shadow_px, soft = values
        bob = _covered(np.hypot(u - cx, v - cy), radius, 0.7)
        wall = gain * back * (1 - strength * _covered(np.hypot(u - sx, v - sy), shadow_px, soft))
        return bob, _CLEAR * np.arcsinh((image - wall) / _CLEAR)

    def rest(values: np.ndarray) -> np.ndarray:
        bob, off = parts(values)
        return np.concatenate([(1 - bob) * off, _OWN * np.sqrt(bob)])

    least = least_squares(rest, start, steps, range(9), turns=15)
    if least is None:
        return None
    cx, cy, radius, gain, sx, sy, strength, shadow_px, soft = (float(a) for a in least.values)
    bob, off = parts(least.values)
    beyond, within = off[bob < 0.5], off[bob > 0.5]
    found = (
        within.size > 50
        and np.sqrt(np.mean(beyond**2)) < min(0.5 * _OWN, 0.25 * np.sqrt(np.mean(within**2)))
        and np.hypot(sx, sy) < 0.3 * size
        and abs(soft) > _SHADOWY_PX
        and 0.05 < strength < 0.95
        and 0.6 < shadow_px / radius < 1.6
        and np.hypot(cx - sx, cy - sy) > shadow_px  # nearer, it may be a bob that the lens draws out
    )
    if not found:
        return None
    away = (image - gain * back)[bob > 0.5]
    contrast = float(np.mean(away[np.abs(away) >= np.median(np.abs(away))]))
    return Shaded(Shadow(sx - cx, sy - cy, shadow_px, abs(soft), strength), cx, cy, radius, 0.7, contrast)


def _pixels(seen: list[tuple[Patch, Guess]], look: Look) -> _Pixels:
    """Some pixels of the patches but for the string: places relative to the guess, picture in the background's light, background,
    and which patch each is of."""
    bare = []
    for patch, guess in seen:
        rows, columns = np.ogrid[: patch.image.shape[0], : patch.image.shape[1]]
        u, v = columns + patch.x_px - guess.x_px, rows + patch.y_px - guess.y_px
        held = np.isfinite(guess.string_rad)
        ux, uy = (float(f(guess.string_rad)) if held else 0.0 for f in (np.cos, np.sin))
        along, across = u * ux + v * uy, np.abs(u * uy - v * ux)
        bare.append(np.argwhere((along < 0.5 * look.radius_px) | (across > 5 + 0.1 * look.radius_px)))
    every = max(1, sum(len(places) for places in bare) // _PIXELS)
    taken, passed = [np.empty((5, 0))], 0
    for k, ((patch, guess), places) in enumerate(zip(seen, bare)):
        rows, columns = places[-passed % every :: every].T
        passed += len(places)
        u, v = columns + patch.x_px - guess.x_px, rows + patch.y_px - guess.y_px
        evened = patch.image * (rim_level(patch.back) / max(rim_level(patch.image), 1.0))
        taken.append(np.array([u, v, evened[rows, columns], patch.back[rows, columns], np.full(u.size, k)]))
    u, v, image, back, which = np.concatenate(taken, axis=1)
    return u, v, image, back, which.astype(int)


def _alone(image: np.ndarray, back: np.ndarray, look: Look) -> np.ndarray:
    """A start of the model: the bob as it was taken to be, and no shadow."""
    shade, size = np.median(back) + (look.contrast or np.median(image) - np.median(back)), look.radius_px
    return np.array([0, 0, size, look.edge_px, shade, 0, 0, 1.0, 0, size, 0, size, 3.0])


def _rest_beside(u: np.ndarray, v: np.ndarray, image: np.ndarray, back: np.ndarray, size: float) -> tuple[float, float]:
    """The middle of what differs from the background and is not the bob."""
    differs = np.maximum(np.abs(image - back) - _CLEAR, 1e-6) * (np.hypot(u, v) > 1.2 * size)
    return float(np.average(u, weights=differs)), float(np.average(v, weights=differs))


def _unexplained(u: np.ndarray, v: np.ndarray, rest: np.ndarray, radius_px: float) -> float:
    """How much more what is left, (n,) grey levels, varies between the parts of the picture than within them; about 1 where it is
    noise (the ratio of an analysis of variance)."""
    part = 8 * np.digitize(np.hypot(u, v) / radius_px, _RINGS) + np.floor(np.arctan2(v, u) * 4 / np.pi).astype(int) % 8
    most = 4 * np.std(rest)
    tame = np.clip(rest, -most, most)
    count, whole, square = (np.bincount(part, weight) for weight in (np.ones_like(rest), tame, tame**2))
    some = count > 8
    between = whole[some] ** 2 / count[some]
    within = np.sum(square[some] - between) / np.sum(count[some] - 1)
    return float(np.mean(between) / max(within, 1e-9))


def _model(values: np.ndarray, u: np.ndarray, v: np.ndarray, back: np.ndarray) -> np.ndarray:
    cx, cy, radius, edge, shade, shade_x, shade_y, gain, right, down, strength, size, soft = values
    x, y = u - cx, v - cy
    bob = _covered(np.hypot(x, y), radius, edge)
    wall = gain * back
    if strength:
        wall = wall * (1 - strength * _covered(np.hypot(x - right, y - down), size, soft))
    return wall * (1 - bob) + (shade + shade_x * x + shade_y * y) * bob


def _exchanged(values: np.ndarray) -> np.ndarray:
    """The model with the bob where its shadow was, and the other way round."""
    cx, cy, radius, edge, shade, _, _, gain, right, down, strength, size, soft = values
    return np.array([cx + right, cy + down, size, soft, shade, 0, 0, gain, -right, -down, strength, radius, edge])


def _covered(distance: np.ndarray, radius: float, edge: float) -> np.ndarray:
    """How much of a disc with a Gaussian edge covers a place; the normal distribution by Page's formula (Applied Statistics 26
    (1977) 75), right to 1.4e-4."""
    at = (radius - distance) / np.hypot(edge, 0.2)
    covered: np.ndarray = 0.5 + 0.5 * np.tanh(0.7988 * at * (1 + 0.04417 * at * at))
    return covered

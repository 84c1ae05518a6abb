"""How much a series scatters, and the factor that makes error bars agree with it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from toolkit.tracking.clip.band import beyond_band

_FITS = 2.5  # a motion fits where places stray from it by less than so many times their scatter from frame to frame
_CLOCK = 3.0  # by how much a localiser may be worse along the motion than across it
_ALONG, _ACROSS = 8, 2  # so many values a fitted motion has taken from the residuals along it and across it,
_CAMERA = 3  # and the six effects of the camera that bend it so many more of each
_LEFT = 0.85  # but of their mean square it has left so much
_CARRIED = 1.06  # times what changes from frame to frame: a codec carries its errors on into the next pictures
_CODEC_PX = 0.05  # so far a codec may err for long
_COUNT = 3  # frames that tell as much of what changes from frame to frame as one would of the whole
# by how much factors are ordinarily larger along the motion than across it (natural logarithm), and its standard deviation
_MORE, _ALIKE = 0.12, 0.13
_TURNS = 30
_LEAST, _USUAL, _MOST = 0.2, 4.0, 10.0  # what a fit's own σ is multiplied by; beyond the last the quick is not its own


class Factors(NamedTuple):
    """What the fits' own σ are to be multiplied by, what moves all places of a frame alike (px), beyond what is known, and whether
    all that strays from the motion, but for the clock, are the localiser's errors."""

    x: float
    y: float
    shake_px: float
    wholly: bool = False


def true_sigma(
    t_s: np.ndarray,
    residuals: Iterable[np.ndarray],
    sigmas: Iterable[np.ndarray],
    velocity: Iterable[np.ndarray],
    shake_px: np.ndarray,
    time_sigma_s: float,
    unsteady_px: float = np.inf,
    rough: bool = False,
    slow_px: float = 0.0,
    full: bool = False,
) -> Factors:
    """Make the fit's σ agree with the residuals about a motion, all (n,) for x and y over the measured frames at t_s, less
    what the shake and the clock are known to add. `unsteady_px` is the most that the camera can have moved, `slow_px` the most
    that the localiser can err for long on a bob of such looks.

    Where the motion fits, or strays no farther than `slow_px` or than a codec errs for long before a camera that is known to have
    stood still, its residuals are the localiser's errors, slow ones too (a
    codec's, a shadow's, a pattern's). Where it does not, what changes from frame to frame is the localiser's; the rest is a
    camera's shake as far as it is across the motion, where no pendulum moves and no clock errs. About a `rough` motion, or
    where a shake was taken away, only what changes from frame to frame tells of the localiser. `full` if the motion was seen with every
    camera effect free.
    """
    (rx, ry), (sx, sy), (vx, vy) = residuals, sigmas, velocity
    speed = np.hypot(vx, vy) + 1e-9
    ux, uy = vx / speed, vy / speed
    v = max(vx, vy, key=np.std)
    step_rad = float(np.std(np.diff(v)) / np.std(v))  # of the swing's period, from one frame to the next
    across = rx * uy - ry * ux, np.hypot(sx * uy, sy * ux)
    strays_px = float(np.sqrt(np.mean(rx**2 + ry**2)))
    still = unsteady_px < 0.5 * strays_px
    slow = strays_px < np.sqrt(2) * max(slow_px, _CODEC_PX if still else 0.0)
    clock = vx * time_sigma_s, vy * time_sigma_s, np.zeros_like(speed)
    found, fits, wholly = [], [], []
    all_s = np.array([sx, sy, across[1]])
    # a few pictures may be of another time
    all_r = np.array([tamed(r / s) * s for r, s in zip((rx, ry, across[0]), all_s)])
    ways = float(np.mean(ux**2)), float(np.mean(uy**2)), 0.0
    for r, s, late, scatter, way in zip(all_r, all_s, clock, quick_scatter(t_s, all_r, all_s), ways):
        known = float(np.mean((np.hypot(late, shake_px) / s) ** 2))
        quick = _less(float(scatter) ** 2, known)
        taken = _ACROSS + (_ALONG - _ACROSS) * way + (_CAMERA if full else 0)
        whole = _less(float(np.mean((r / s) ** 2)) / _left(r / s, step_rad, taken), known)
        fits.append(whole <= _FITS**2 * quick)
        wholly.append(bool(fits[-1] or (slow and np.isfinite(whole))) and not (rough or np.any(shake_px)))
        if wholly[-1]:
            found.append(float(np.fmax(quick, whole)))
        else:
            found.append(_CARRIED**2 * quick if quick < _MOST**2 else np.nan)
    count, beside_clock = r.size / _COUNT, bool(time_sigma_s and wholly[2])
    if not (rough or beside_clock or (wholly[0] and wholly[1])):
        count, quick_squares = _beyond(t_s, np.array([rx, ry]), all_s[:2], np.array([vx, vy]), time_sigma_s, shake_px)
        found[:2] = [f if all_of_it else q for f, q, all_of_it in zip(found, quick_squares, wholly)]
    own = found[2] if np.isfinite(found[2]) else _USUAL**2
    # the rest is the clock's
    x, y = (f if f <= _CLOCK**2 * own or (slow and all_of_it) else own for f, all_of_it in zip(found[:2], wholly))
    more = _MORE * (ways[0] - ways[1])
    if beside_clock:
        x, y = _beside_clock(all_r[:2], all_s[:2], np.array(clock[:2]), own, more)
    elif not (wholly[0] or wholly[1]):
        x, y = _alike(x, y, count, more)
    left = 0.0
    if not (rough or fits[2] or still):
        r, s = across
        left = float(np.sqrt(max(np.mean(r**2) - own * np.mean(s**2) - np.mean(shake_px**2), 0.0)))
    return Factors(
        max(float(np.sqrt(x)), _LEAST), max(float(np.sqrt(y)), _LEAST), left, beside_clock or (wholly[0] and wholly[1])
    )


def quick_sigma(
    t_s: np.ndarray, r: np.ndarray, s: np.ndarray, velocity: np.ndarray, time_sigma_s: float
) -> tuple[float, float]:
    """The factors of both axes as far as what changes from frame to frame tells them, for residuals r of the localiser's σ s, all (2, n),
    beside whatever is slow, and a clock. Beside that one they are told along the bob's `velocity`, where the clock errs most, and
    across it, where only a shake makes it err."""
    share = np.mean(velocity**2, axis=1) / np.mean(np.sum(velocity**2, axis=0))
    if not time_sigma_s:
        count, (x, y) = _beyond(t_s, r, s, velocity, 0.0)
        x, y = _both(x, y, count, _MORE * float(share[0] - share[1]))
    else:
        way = velocity / (np.hypot(*velocity) + 1e-9)
        way *= np.where(way[np.argmax(share)] < 0, -1, 1)  # to one side, whether the bob goes there or comes
        turns = np.array([way, [-way[1], way[0]]])
        turned, own, moved = (
            np.sum(turns * r, axis=1),
            np.sqrt(np.sum((turns * s) ** 2, axis=1)),
            np.sum(turns * velocity, axis=1),
        )
        count, (along, across) = _beyond(t_s, turned, own, moved, time_sigma_s)
        along, across = _both(along, across, count, _MORE)
        x, y = share * along + share[::-1] * across
    return max(float(np.sqrt(x)), _LEAST), max(float(np.sqrt(y)), _LEAST)


def late_px(t_s: np.ndarray, velocity: np.ndarray, slow: np.ndarray, time_sigma_s: float) -> np.ndarray:
    """How far (standard deviation) a clock moves the bob in the picture, beside what is slow in its residuals, all (2, n): a shake
    moves it too."""
    return np.asarray(time_sigma_s * (velocity + np.gradient(slow, axis=1) / np.maximum(np.gradient(t_s), 1e-3)))


def _both(one: float, other: float, count: float, more: float) -> tuple[float, float]:
    """The squares of two factors, of which the first is ordinarily `more` (logarithm) than the other: each told by so many
    values, or (NaN) not at all."""
    if np.isfinite(one) and np.isfinite(other):
        return _alike(one, other, count, more)
    if np.isfinite(one):
        return one, float(one * np.exp(-2 * more))
    return (float(other * np.exp(2 * more)), other) if np.isfinite(other) else (_USUAL**2, _USUAL**2)


def _beyond(
    t_s: np.ndarray,
    r: np.ndarray,
    s: np.ndarray,
    velocity: np.ndarray,
    time_sigma_s: float,
    known: np.ndarray | float = 0.0,
) -> tuple[float, list[float]]:
    """How many independent values tell of what is quicker than whatever is slow in residuals r of the localiser's σ s beside a clock and
    errors `known`, all (2, n), and the squares of the factors that make it the localiser's; NaN where that cannot be told."""
    unit = np.sqrt(s[0] * s[1])
    beyond = beyond_band(t_s, r, unit)
    squares = np.sum(beyond.rest**2, axis=1)
    late = late_px(t_s, velocity, r - unit * beyond.rest, time_sigma_s) if time_sigma_s else np.zeros_like(r)
    told = np.array([_less(a, b) for a, b in zip(squares, beyond.holds((late**2 + known**2) / unit**2))])
    told *= _CARRIED**2 / beyond.holds((s / unit) ** 2)
    return float(beyond.left), [f if f < _MOST**2 else np.nan for f in told.tolist()]


def _less(square: float, known: float) -> float:
    """The square without what is known of it; NaN where that is nearly all, so that nothing can be told of the rest."""
    return square - known if square - known > 0.3 * square else np.nan


def _alike(x: float, y: float, count: float, more: float) -> tuple[float, float]:
    """Squares of the factors of both axes that rest on so many independent values each, drawn together as far as they are
    that uncertain, but for what is ordinarily `more` in x; not where they clearly differ."""
    apart, spread = 0.5 * np.log(y / x) + more, np.sqrt(1 / count + _ALIKE**2)
    if abs(apart) > 3 * spread:
        return x, y
    drawn = float(np.exp(apart / (count * spread**2)))
    return x * drawn, y / drawn


def _beside_clock(r: np.ndarray, s: np.ndarray, late: np.ndarray, start: float, more: float) -> tuple[float, float]:
    """Squares of the factors of both axes beside a clock that moves the bob by `late` px (standard deviation) along its way:
    the likeliest for residuals r of the localiser's σ s, all (2, n), ordinarily alike but for `more` in x; by scoring from `start` on."""
    log = np.full(2, 0.5 * np.log(start))
    differ = np.array([[1.0, -1.0], [-1.0, 1.0]]) / _ALIKE**2
    for _ in range(_TURNS):
        own = np.exp(2 * log)[:, None] * s**2
        (xx, yy), xy = own + late**2, late[0] * late[1]
        inverse = np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy)
        pulls = np.sum(inverse * r, axis=1)
        score = np.sum(own * (pulls**2 - inverse[[0, 1], [0, 1]]), axis=1) - differ @ (log - [more, 0.0])
        information = 2 * np.einsum("in,jn,ijn->ij", own, own, inverse**2) + differ
        step = np.linalg.solve(information, score)
        log = log + np.clip(step, -0.5, 0.5)
        if np.abs(step).max() < 1e-3:
            break
    return float(np.exp(2 * log[0])), float(np.exp(2 * log[1]))


def _left(r: np.ndarray, step_rad: float, values: float) -> float:
    """What share of its mean square a fitted motion has left of a series (n,) of which a frame is `step_rad` of a period: it
    took so many of the values that are independent of their neighbours, of what changes within a period."""
    half = min(int(np.pi / max(step_rad, 1e-3)), r.size - 1)
    slow = np.convolve(np.pad(r, half, "reflect"), np.full(2 * half + 1, 1 / (2 * half + 1)), "valid")
    within, length = r - slow, 1.0
    for k in range(1, half):
        alike = float(within[k:] @ within[:-k]) / max(float(within @ within), 1e-300)
        if alike <= 0:
            break
        length += 2 * alike
    taken = values / r.size
    alike = length * float(within @ within) / max(float(r @ r), 1e-300)
    return max(1 - taken * alike, min(_LEFT, 1 - taken), 1 / r.size)


def tamed(r: np.ndarray) -> np.ndarray:
    """The series with its strays drawn in to five of its robust standard deviation."""
    most = 5 * 1.4826 * float(np.median(np.abs(r - np.median(r))))
    return np.clip(r, np.median(r) - most, np.median(r) + most)


def quick_scatter(t_s: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Standard deviation of what changes from one to the next in series (…, n) at times t_s (n,), over their own σ (…, n), about
    polynomials through neighbours (by divided differences): of the lowest degree above which no more of it goes away."""
    found = []
    for degree in (2, 4, 6, 8):
        if t_s.size < 4 * degree:
            break
        ends = [slice(k, t_s.size - degree + k) for k in range(degree + 1)]
        top = bottom = np.zeros(1)
        for k in ends:
            apart = np.prod([t_s[k] - t_s[j] for j in ends if j != k], axis=0)
            top, bottom = top + r[..., k] / apart, bottom + (s[..., k] / apart) ** 2
        differences = top / np.sqrt(bottom)
        found.append(np.sqrt(np.mean(differences**2, axis=-1)))
    if not found:
        return np.asarray(np.sqrt(np.mean((r / s) ** 2, axis=-1)))
    tried = np.array(found)
    first = np.argmax(tried < 1.2 * tried.min(axis=0), axis=0)
    return np.asarray(np.take_along_axis(tried, first[None], axis=0)[0])

"""Frames that a camera lost again and again while it counted on: first from one step of the bob to the next, before any
motion is known, then from the motion that these times show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.recount_seen import count_as_seen
from toolkit.tracking.geometry.least_squares import least_squares
from toolkit.tracking.geometry.swing import CALM, NAMES, Swing, fit_swing, small_steps, start_swing

_ABOUT = 4  # steps on either side that tell how far the bob moves in one frame there
_FAST = 0.4  # of the greatest speed: slower, a step two frames long may be one of a bob that gathers speed
_OFF = 0.25  # of a frame: so near a whole number a step is that many frames long
_LEAST = 3  # places; fewer are found with the motion's help
_MOST = 4  # frames lost in one place
_NEAR = 6  # frames: so much more or less than was lost so far is tried
_SWEEPS = 60  # more, in a long film, would take too long
_ROUNDS = 8
_RIGHT, _EARLY = 0.95, 0.12  # if all were counted right, such a share of the places is less than so many frames off
_LOSS, _ASTRAY = 12.0, 30.0  # in χ²: what a loss must explain, and the most that a single place can
_FIT_PX = 0.5  # a place's σ where lost frames are still to be counted: more than its own


def recounted(places: Places) -> tuple[Places, np.ndarray] | None:
    """The places at times with the frames put back that were lost where the bob is fast, as its steps tell: some are two
    frames long, and all about them are one; and in which sweep of the swing each is, (n,), −1 where the bob is slow. None
    where the steps do not tell so.
    """
    usual = float(np.median(np.diff(places.t_s)))
    if np.ptp(np.diff(places.t_s)) > 0.1 * usual:
        return None  # stamps with gaps of their own were not counted
    seen = np.flatnonzero(places.good)
    frames = np.diff(places.t_s[seen]) / usual
    steps = np.diff([places.x_px[seen], places.y_px[seen]], axis=1) / frames
    whole = np.ones(frames.size)
    for _ in range(_ROUNDS):  # steps that are known to be long do not tell of those about them
        padded = np.pad(steps / whole, ((0, 0), (_ABOUT, _ABOUT)), mode="edge")
        about = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * _ABOUT + 1, axis=1), axis=2)
        speed = np.hypot(*about)
        long = np.sum(steps * about, axis=0) / np.maximum(speed, 1e-9) ** 2
        across = np.abs(steps[0] * about[1] - steps[1] * about[0]) / np.maximum(speed, 1e-9) ** 2
        nearest = np.maximum(np.round(long), 1)
        fast = speed > _FAST * np.percentile(speed, 98)
        told = fast & (np.diff(seen) == 1) & (across < _OFF * nearest)
        lost = told & (nearest > 1) & (nearest <= 1 + _MOST) & (np.abs(long - nearest) < _OFF * np.sqrt(nearest))
        before, whole = whole, np.where(lost, nearest, 1.0)
        if np.array_equal(before, whole):
            break
    one = told & (np.abs(long - 1) < _OFF)
    again = told & (long < 0.5)  # a picture shown again is followed by a long step, which makes up for it
    lost[1:] &= ~again[:-1]
    odd = told & ~one & ~lost & ~again
    if lost.sum() < _LEAST or odd.sum() > lost.sum() or one.sum() < 2 * lost.sum():
        return None
    t_s = places.t_s.copy()
    for k in np.flatnonzero(lost):
        t_s[seen[k + 1] :] += (whole[k] - 1) * usual
    forth = about[0] > 0
    sure = one | lost
    sweep = np.full(t_s.size, -1)
    sweep[seen[1:]] = np.where(fast & ~again, np.cumsum(fast & (_anew(fast, forth) | ~sure)) - 1, -1)
    return replace(places, t_s=t_s), sweep


def _anew(fast: np.ndarray, forth: np.ndarray) -> np.ndarray:
    """Where a fast stretch goes another way than the last one did."""
    chosen = np.flatnonzero(fast)
    anew = np.zeros(fast.size, bool)
    anew[chosen] = np.diff(forth[chosen], prepend=not forth[chosen[0]])
    return anew


def swing_of_sweeps(start: np.ndarray, places: Places, sweep: np.ndarray) -> tuple[Swing, np.ndarray] | None:
    """The motion from a start (9,) at the first place, and by how much later than its time (s) each sweep is: what was lost
    between two sweeps is not known yet, and fitted too. How fast the bob is tells its frequency all the same."""
    used = np.flatnonzero(sweep >= 0)
    t, x, y, part = places.t_s[used], places.x_px[used], places.y_px[used], sweep[used]
    t0 = float(places.t_s[places.good][0])
    usual = float(np.median(np.diff(places.t_s)))

    def rest(values: np.ndarray) -> np.ndarray:
        delays = np.concatenate([[0.0], np.cumsum(values[9:])])
        motion = Swing(values[:9], np.zeros((9, 9)), t0, 0.0)
        mx, my = motion.position(t + delays[part])
        pulls = [(values[i] - CALM[name][0]) / CALM[name][1] for name, i in (("gamma", 5), ("beta", 6))]
        return np.concatenate([(mx - x) / _FIT_PX, (my - y) / _FIT_PX, pulls, values[9:] / (3 * usual)])

    values = np.concatenate([start, np.zeros(part.max())])
    steps = np.concatenate([small_steps(start), np.full(part.max(), 1e-5)])
    least = least_squares(rest, values, steps, range(values.size), turns=40)
    if least is None:
        return None
    rms = float(np.sqrt(np.mean((_FIT_PX * least.rest[: 2 * t.size]) ** 2)))
    return Swing(least.values[:9], np.zeros((9, 9)), t0, rms), np.concatenate([[0.0], np.cumsum(least.values[9:])])


def count_lost(
    places: Places, start: np.ndarray, size_px: tuple[int, int] | None = None, rows_along_x: bool = False
) -> tuple[Places, Swing] | None:
    """The places at times with all frames put back that were lost, and the motion at these times, from a start (9,) at the
    first place (from the places alone where it is not finite). None where the steps of the bob do not tell of lost frames, or
    not well enough to count them all.

    In turns: the motion of the sweeps, and of all ways in which frames can be lost the one that agrees with it best. Where
    that comes to no end, and the picture's size is given, about the motion as the camera saw it.
    """
    told = recounted(places)
    if told is None or told[1].max() > _SWEEPS:
        return None
    now, sweep = told
    begun = start if np.isfinite(start).all() else start_swing(*(c[now.good] for c in (now.t_s, now.x_px, now.y_px)))
    if begun is None:
        return None
    start = np.where([name in CALM for name in NAMES], 0.0, begun)  # damping seen over a second or so is none
    stamps, usual = places.t_s, float(np.median(np.diff(places.t_s)))
    tried: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(_ROUNDS):
        fitted = swing_of_sweeps(start, now, sweep)
        if fitted is None:
            return None
        motion, delays = fitted
        last = np.maximum.accumulate(np.where(sweep >= 0, np.arange(sweep.size), 0))
        lost = np.round((now.t_s - stamps + delays[np.maximum(sweep[last], 0)]) / usual).astype(int)
        lost = _lost_before(motion, stamps, places, np.maximum.accumulate(np.maximum(lost, 0)))
        before, now, start = now, replace(places, t_s=stamps + lost * usual), motion.values
        tried.append((lost, start))
        if np.array_equal(before.t_s, now.t_s):
            break
    some = places.some()
    x, y, sigma = places.x_px[some], places.y_px[some], np.full(some.size, 0.1)
    best: tuple[Places, Swing] | None = None
    for _ in range(_ROUNDS):
        swing = fit_swing(now.t_s[some], x, y, sigma, start)
        if swing is None or (best is not None and swing.rms_px >= best[1].rms_px):
            break
        best = now, swing
        lost = _lost_before(swing, stamps, places, np.round((now.t_s - stamps) / usual).astype(int))
        now, start = replace(places, t_s=stamps + lost * usual), swing.values
    if best is None or _counted_right(*best, sweep >= 0):
        return best
    if size_px is None:
        return None
    for lost, values in tried[:1] + tried[-1:]:  # turns that went astray began well, or ended well
        counted = count_as_seen(places, lost, values, size_px, rows_along_x)
        if counted is not None:
            now = replace(places, t_s=stamps + counted * usual)
            swing = fit_swing(now.t_s[some], x, y, sigma, best[1].values)
            return None if swing is None else (now, swing)
    return None


def _counted_right(places: Places, swing: Swing, fast: np.ndarray) -> bool:
    """Is the bob hardly early or late where it is fast? A count that is wrong somewhere lets it be so by up to half a frame."""
    (mx, my), (vx, vy) = swing.position(places.t_s), swing.velocity(places.t_s)
    ahead = ((places.x_px - mx) * vx + (places.y_px - my) * vy) / np.maximum(vx**2 + vy**2, 1e-9)
    return bool(np.quantile(np.abs(ahead[fast]), _RIGHT) < _EARLY * float(np.median(np.diff(places.t_s))))


def _lost_before(swing: Swing, stamps: np.ndarray, places: Places, about: np.ndarray) -> np.ndarray:
    """How many frames were lost before each, (n,) int never falling and near `about`: of least χ² by dynamic programming.
    A place far from the motion (a picture shown again) is no loss."""
    n, usual = stamps.size, float(np.median(np.diff(stamps)))
    most = about[-1] + _NEAR
    mx, my = swing.position(stamps[0] + usual * np.arange(n + most))
    lost = np.arange(most + 1)
    at = np.minimum(np.arange(n)[:, None] + lost, n + most - 1)
    far = np.hypot(places.x_px[:, None] - mx[at], places.y_px[:, None] - my[at])
    apart = np.abs(lost - about[:, None]) > _NEAR
    good = places.good[:, None]
    usual_px = 1.4826 * float(np.median(np.where(apart, np.inf, far).min(axis=1)[places.good])) + 0.05
    cost = np.where(good, np.minimum((far / usual_px) ** 2, _ASTRAY), 0.0) + np.where(apart, 1e9, 0.0)
    return _cheapest(cost)


def _cheapest(cost: np.ndarray) -> np.ndarray:
    """(n,) columns of a cost (n, m), never falling, of least sum; each rise costs `_LOSS`."""
    n, m = cost.shape
    total, came = cost[0], np.empty((n, m), int)
    columns = np.arange(m)
    for k in range(1, n):
        least = np.minimum.accumulate(total)
        first = np.maximum.accumulate(np.where(total <= least, columns, 0))
        risen = np.concatenate([[np.inf], least[:-1] + _LOSS])
        came[k] = np.where(total <= risen, columns, np.concatenate([[0], first[:-1]]))
        total = cost[k] + np.minimum(total, risen)
    path = np.empty(n, int)
    path[-1] = int(np.argmin(total))
    for k in range(n - 1, 0, -1):
        path[k - 1] = came[k, path[k]]
    return path

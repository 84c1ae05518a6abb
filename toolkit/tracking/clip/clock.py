"""What the motion tells about the clock: repeated pictures, pictures at another time than their stamp's, lost frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.recount import count_lost
from toolkit.tracking.clip.whole_swing import whole_swing
from toolkit.tracking.geometry.swing import Swing, fit_swing
from toolkit.video import Video

_LEFT_OUT = 0.12  # so many frames at another time than their stamp, left out, leave a clock that is sound else
_STRAY = 8.0  # of its neighbours' robust standard deviation: so far a single frame is not measured right
_LEAST_PX = 0.1  # and no less than this
_ROUNDS = 6  # of looking for lost frames
_PLACED = 0.01  # of the swing's extent: how far places may still stray where lost frames are placed


def even_times(t: np.ndarray, video: Video, log: list[str]) -> np.ndarray:
    """Time stamps that a file keeps only to the millisecond (Matroska, WebM), put back on their even grid.

    Only where every stamp agrees with one constant frame rate to within its rounding; else as they are.
    """
    tick = video.tick_s
    if tick < 2e-4 or t.size < 10:
        return t
    steps = np.diff(t)
    if not np.any(steps > 0):
        return t
    rate = 1 / float(np.median(steps[steps > 0]))
    claimed = video.fps_header
    if claimed and abs(claimed / rate - 1) < rate * tick:
        rate = claimed
    for _ in range(2):  # frames may be missing: each stamp's place on the grid is counted, then the grid is fitted
        n = np.round((t - t[0]) * rate)
        if np.any(np.diff(n) < 1):
            return t
        fitted = float(np.polyfit(n, t, 1)[0])
        if claimed and abs(claimed * fitted - 1) * n[-1] < 0.6 * claimed * tick + 0.02 * claimed * tick * n[-1]:
            fitted = 1 / claimed
        rate = 1 / fitted
    grid = n / rate
    off = t - grid
    if np.ptp(off) > 1.05 * tick:
        return t
    log.append(
        said(
            "track.even_times",
            "The file keeps times to {tick_ms:.3g} ms only; all agree with {rate_hz:.6g} frames per second, which was used.",
            tick_ms=1e3 * tick,
            rate_hz=float(rate),
        )
    )
    return grid + 0.5 * (off.max() + off.min())


def out_of_time(places: Places, swing: Swing, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
    """Frames (n,) bool whose picture does not belong to their time stamp: repeats of the one before, and leaps along the motion,
    which has the bob at x_px, y_px (n,)."""
    t, good = places.t_s, places.good
    rx, ry = places.x_px - x_px, places.y_px - y_px
    vx, vy = swing.velocity(t)
    speed = np.hypot(vx, vy) + 1e-9
    along = (rx * vx + ry * vy) / speed
    across = (ry * vx - rx * vy) / speed
    near = _running_median(along, good)
    noise = 1.4826 * float(np.median(np.abs((along - near)[good]))) + 1e-3
    step = float(np.median(np.diff(t))) * speed
    off = along - near
    again = np.abs(off + step) < 4 * noise + 0.2 * step  # where the bob was one frame before
    leap = good & (step > 6 * noise) & (again | (step > 0.3 * float(step.max())))
    leap &= (np.abs(off) > np.maximum(8 * noise, 0.5 * step)) & (np.abs(across) < 4 * noise + 0.5 * step)
    return leap | (places.repeated & (step > 4 * noise) & good)


def late_told(places: Places, late: np.ndarray, log: list[str], warnings: list[str]) -> None:
    """Sentences on the frames (n,) bool that were left out as out of time, if any."""
    t, repeats, leap = places.t_s, late & places.repeated, late & ~places.repeated
    if repeats.any():
        log.append(
            said(
                "track.repeats",
                "{frames} frame(s) repeat the picture before them, first at t = {t_s:.3f} s; they were not measured",
                frames=int(repeats.sum()),
                t_s=float(t[np.flatnonzero(repeats)[0]]),
            )
        )
    if leap.any():  # a few are left out and done with; many mean a clock that cannot be trusted
        (log if leap.mean() < _LEFT_OUT else warnings).append(
            said(
                "track.leaps",
                "{frames} frame(s) show the bob at another time than their stamp says (a camera that drops or repeats frames), "
                "first at t = {t_s:.3f} s; they were left out",
                frames=int(leap.sum()),
                t_s=float(t[np.flatnonzero(leap)[0]]),
            )
        )


def timed_swing(
    followed: Swing,
    places: Places,
    path: Path,
    warnings: list[str],
    size_px: tuple[int, int] | None = None,
    rows_along_x: bool = False,
) -> tuple[Places, Swing]:
    """The motion over the whole clip from the one followed, and the places at times with the frames put back that a camera
    lost without a gap in its stamps. Raises JobError where no pendulum's motion goes through the places."""
    counted = count_lost(places, followed.values_at(places.t_s[places.good][0]), size_px, rows_along_x)
    if counted is not None and counted[1].rms_px <= _PLACED * places.extent_px:
        warnings.append(_lost_told(places.t_s, counted[0].t_s))
        return counted
    return place_lost_frames(places, whole_swing(followed, places, path), warnings)


def place_lost_frames(places: Places, swing: Swing, warnings: list[str]) -> tuple[Places, Swing]:
    """The places at times with the frames put back that the motion shows to be lost, and the motion fitted to them."""
    now, motion = _placed(places, swing)
    if now is places or motion.rms_px > _PLACED * places.extent_px:
        return places, swing  # nothing is lost, or too much is amiss to know what was lost where
    warnings.append(_lost_told(places.t_s, now.t_s))
    return now, motion


def _placed(places: Places, swing: Swing) -> tuple[Places, Swing]:
    """The same with frames put back where the motion leaps, as long as it fits the better for it.

    A lost frame shows as a leap of the motion by one frame's time, for good; nothing else does that. A leap backwards is
    believed where a picture repeats the one before, else it is left to `slips_told`.
    """
    step = float(np.median(np.diff(places.t_s)))
    some = places.some()
    x, y = places.x_px[some], places.y_px[some]
    now, motion = places, swing
    for _ in range(_ROUNDS):
        lost = [
            (k, f)
            for k, f in _for_good(clock_slips(now, motion, *motion.position(now.t_s)))
            if f > 0 or (f > -1.3 and places.repeated[max(0, k - 1) : k + 1].any())
        ]
        if not lost:
            break
        moved = now.t_s.copy()
        for k, frames in lost:
            moved[k:] += frames * step
        better = fit_swing(moved[some], x, y, np.full(some.size, 0.1), motion.values)
        if better is None or better.rms_px > motion.rms_px:
            break
        now, motion = replace(now, t_s=moved), better
    return now, motion


def _lost_told(stamps: np.ndarray, t_s: np.ndarray) -> str:
    """A sentence on the frames that were put back: the times (n,) as stamped and as they are."""
    where = np.flatnonzero(np.abs(np.diff(t_s - stamps)) > 1e-6) + 1
    return said(
        "track.lost_frames",
        "the camera lost or repeated frames at {frames} place(s) that the time stamps do not tell of (t = {places} s): the "
        "motion leaps there by whole frames; times after them were moved by as much, {share:+.2%} over the clip",
        frames=int(where.size),
        places=", ".join(f"{stamps[k]:.2f}" for k in where[:8]),
        share=float((t_s[-1] - stamps[-1]) / (stamps[-1] - stamps[0])),
    )


def lone_strays(
    places: Places, x_px: np.ndarray, y_px: np.ndarray, sure: np.ndarray | None = None
) -> np.ndarray | None:
    """Frames (n,) bool on which the bob was found far from where the motion (n,) and the frames about it (those that are
    `sure`, (n,) bool, if it is known which) have it: a picture shown again, a post or a passer-by taken for it. None where they
    are so many that something else is amiss."""
    sure = places.good if sure is None else sure
    rest = np.array([places.x_px - x_px, places.y_px - y_px])
    apart = rest - [_running_median(r, sure) for r in rest]
    usual = 1.4826 * np.median(np.abs(apart[:, sure]), axis=1, keepdims=True) + _LEAST_PX / _STRAY
    stray = places.good & (np.hypot(*apart / usual) > _STRAY)
    if stray.sum() >= _LEFT_OUT * stray.size:
        return None
    stray[stray] = ~_lead_on(rest / usual, places.good & ~stray, np.flatnonzero(stray))
    return stray


def strays_told(places: Places, stray: np.ndarray) -> list[str]:
    """A sentence on the frames (n,) bool that were left out as strays, if any."""
    if not stray.any():
        return []
    return [
        said(
            "track.lone_strays",
            "{frames} frame(s) show the bob far from where the motion and the frames about them have it, first at t = {t_s:.3f} s; "
            "they were left out",
            frames=int(stray.sum()),
            t_s=float(places.t_s[np.flatnonzero(stray)[0]]),
        )
    ]


def slips_told(places: Places, swing: Swing, x_px: np.ndarray, y_px: np.ndarray) -> list[str]:
    """A sentence where the bob still leaps by whole frames from where its motion has it in the picture (n,): what tilt or
    lens explain is no slip."""
    slips = _for_good(clock_slips(places, swing, x_px, y_px))
    if not slips:
        return []
    return [
        said(
            "track.clock_slips",
            "the clock of the file slips by whole frames at {places} place(s) (a camera that lost or repeated frames and did "
            "not say so); the error bars allow for it",
            places=len(slips),
        )
    ]


def clock_slips(places: Places, swing: Swing, x_px: np.ndarray, y_px: np.ndarray) -> list[tuple[int, float]]:
    """The frames from which on the bob is early (+) or late (−) for good from where its motion has it (n,), and by how many
    frames.

    Each place is judged by lines through the seven measured frames before and after it, where the bob is fast.
    """
    vx, vy = swing.velocity(places.t_s)
    speed = np.hypot(vx, vy) + 1e-9
    step = float(np.median(np.diff(places.t_s)))
    ahead = ((places.x_px - x_px) * vx + (places.y_px - y_px) * vy) / speed**2 / step  # in frames
    slips: list[tuple[int, float]] = []
    chosen = np.flatnonzero(places.good & (speed > 0.25 * speed.max()))
    n = 7
    if chosen.size < 4 * n:
        return slips
    leap, off, bent = np.zeros(chosen.size), np.full(chosen.size, np.inf), np.zeros(chosen.size)
    for i in range(n, chosen.size - n):
        a, b = chosen[i - n : i], chosen[i : i + n]
        if b[-1] - a[0] > 3 * n or abs(ahead[b[0]] - ahead[a[-1]]) < 0.5:
            continue
        middle = 0.5 * (a[-1] + b[0])
        before, after = (np.polyfit(p - middle, ahead[p], 1) for p in (a, b))
        rest = np.concatenate([ahead[p] - np.polyval(f, p - middle) for p, f in ((a, before), (b, after))])
        leap[i], off[i] = after[1] - before[1], np.sqrt(np.mean(rest**2))
        both = chosen[i - n : i + n]
        smooth = np.polyfit(both - middle, ahead[both], 3)
        bent[i] = np.sqrt(np.mean((ahead[both] - np.polyval(smooth, both - middle)) ** 2))
    # a leap of about a whole frame, far above the scatter, that no bend of the motion explains
    sharp = (off < 0.06) & (bent > 2.5 * off) & (np.abs(leap - np.round(leap)) < 0.25)
    while True:
        i = int(np.argmax(np.where(sharp, np.abs(leap), 0)))
        if not sharp[i] or round(float(leap[i])) == 0:
            return sorted(slips)
        near = np.arange(max(0, i - n), min(i + n, sharp.size))
        exact = int(near[np.argmin(np.where(sharp[near], off[near], np.inf))])
        size, whole = float(leap[exact]), round(float(leap[exact]))
        # cameras that lose a frame may be late with the next: what is no whole number is taken as it is
        slips.append((int(chosen[exact]), whole if abs(size - whole) < 0.03 + 3 * off[exact] else size))
        sharp[near] = False


def _for_good(slips: list[tuple[int, float]]) -> list[tuple[int, float]]:
    """Without leaps by part of a frame that a later one takes back: a camera loses whole frames, and for good."""
    parts = [(k, f) for k, f in slips if f != round(f)]
    undone = {p for i, a in enumerate(parts) for b in parts[i + 1 :] if abs(a[1] + b[1]) < 0.1 for p in (a, b)}
    return [p for p in slips if p not in undone]


def _running_median(values: np.ndarray, good: np.ndarray, half: int = 7) -> np.ndarray:
    """Median of the good values within ±half places."""
    padded = np.pad(np.where(good, values, np.nan), half, constant_values=np.nan)
    windows = np.sort(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)  # what is none comes last
    count, row = np.sum(~np.isnan(windows), axis=1), np.arange(values.size)
    return np.where(count > 0, 0.5 * (windows[row, (count - 1) // 2] + windows[row, count // 2]), 0.0)


def _lead_on(values: np.ndarray, steady: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Do the three steady frames before a chosen one, or those behind it, lead to it in a line? (chosen,) bool; `values` are
    (2, n) in units of their scatter. Then it is theirs, at the brink of a leap."""
    led = np.zeros(chosen.size, bool)
    some = np.flatnonzero(steady)
    for n, k in enumerate(chosen):
        for side in (some[some < k][-3:], some[some > k][:3]):
            if side.size == 3 and np.abs(side - k).max() <= 7:
                at = np.polyfit(side - k, values[:, side].T, 1)[1]
                led[n] |= np.hypot(*(values[:, k] - at)) < _STRAY
    return led

"""What the motion tells about the clock: repeated pictures, pictures at another time than their stamp's, lost frames."""

from __future__ import annotations

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.follow import Record
from toolkit.tracking.swing import Swing
from toolkit.video import Video


def even_times(t: np.ndarray, video: Video, log: list[str]) -> np.ndarray:
    """Time stamps that a file keeps only to the millisecond (Matroska, WebM), put back on their even grid.

    Only where every stamp agrees with one constant frame rate to within its rounding; else as they are.
    """
    tick = video.tick_s
    if tick < 2e-4 or t.size < 10:
        return t
    n = np.arange(t.size)
    rate = (t.size - 1) / (t[-1] - t[0]) if t[-1] > t[0] else 0.0
    claimed = video.fps_header
    if claimed and abs(claimed / max(rate, 1e-9) - 1) * t.size < 0.5 * (rate * tick) + 0.02 * rate * tick * t.size:
        rate = claimed
    if rate <= 0:
        return t
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


def out_of_time(
    r: Record,
    t: np.ndarray,
    rx: np.ndarray,
    ry: np.ndarray,
    swing: Swing,
    good: np.ndarray,
    log: list[str],
    warnings: list[str],
) -> np.ndarray:
    """Frames whose picture does not belong to their time stamp: repeats of the one before, and leaps along the motion."""
    vx, vy = swing.velocity(t)
    speed = np.hypot(vx, vy) + 1e-9
    along = (rx * vx + ry * vy) / speed
    across = (ry * vx - rx * vy) / speed
    near = _running_median(along, good)
    noise = 1.4826 * float(np.median(np.abs((along - near)[good]))) + 1e-3
    step = float(np.median(np.diff(t))) * speed
    leap = good & (step > max(6 * noise, 0.3 * float(step.max())))
    leap &= (np.abs(along - near) > np.maximum(8 * noise, 0.5 * step)) & (np.abs(across) < 4 * noise + 0.5 * step)
    repeats = np.array(r.repeated) & (step > 4 * noise) & good
    if repeats.any():
        log.append(
            said(
                "track.repeats",
                "{frames} frame(s) repeat the picture before them, first at t = {t_s:.3f} s; they were not measured",
                frames=int(repeats.sum()),
                t_s=float(t[np.flatnonzero(repeats)[0]]),
            )
        )
    leap &= ~repeats
    if leap.any():
        warnings.append(
            said(
                "track.leaps",
                "{frames} frame(s) show the bob at another time than their stamp says (a camera that drops or repeats frames), "
                "first at t = {t_s:.3f} s; they were left out",
                frames=int(leap.sum()),
                t_s=float(t[np.flatnonzero(leap)[0]]),
            )
        )
    return leap | repeats


def clock_slips(t: np.ndarray, rx: np.ndarray, ry: np.ndarray, swing: Swing, good: np.ndarray) -> np.ndarray:
    """The frames from which on the motion is early or late by whole frames for good.

    Each place is judged by lines through the seven measured frames before and after it, where the bob is fast.
    """
    vx, vy = swing.velocity(t)
    speed = np.hypot(vx, vy) + 1e-9
    step = float(np.median(np.diff(t)))
    ahead = (rx * vx + ry * vy) / speed**2 / step  # in frames
    slips: list[int] = []
    chosen = np.flatnonzero(good & (speed > 0.25 * speed.max()))
    n = 7
    if chosen.size < 4 * n:
        return np.array(slips, int)
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
    # a leap of a whole frame, far above the scatter, that no bend of the motion explains
    sharp = (off < 0.06) & (bent > 2.5 * off) & (np.abs(leap - np.round(leap)) < 0.03 + 3 * off)
    while True:
        i = int(np.argmax(np.where(sharp, np.abs(leap), 0)))
        if not sharp[i] or round(float(leap[i])) == 0:
            break
        slips.append(int(chosen[i]))
        sharp[max(0, i - n) : i + n] = False
    return np.array(sorted(slips), int)


def _running_median(values: np.ndarray, good: np.ndarray, half: int = 7) -> np.ndarray:
    """Median of the good values within ±half places."""
    padded = np.pad(np.where(good, values, np.nan), half, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    filled = np.where(np.all(np.isnan(windows), axis=1)[:, None], 0.0, windows)
    return np.nanmedian(filled, axis=1)

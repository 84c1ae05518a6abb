"""From a video to the bob's position on every frame, with an error bar, and no click in ordinary clips."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.output import whole_file
from toolkit.progress import Progress, silent
from toolkit.sentence import said
from toolkit.trackers import load_tracker
from toolkit.tracking.acquire import REMEDY, find_bob
from toolkit.tracking.follow import Follower, Record
from toolkit.tracking.stillness import CameraShift
from toolkit.tracking.swing import Swing, fit_swing
from toolkit.video import Frame, Video, clock_warnings, open_video

OK, PREDICTED, LOST = "ok", "predicted", "lost"
_MOST = 3.0  # by how much a fit's own σ may be too small (noise that a codec has smeared)


@dataclass(frozen=True)
class Track:
    """Where the bob was. All arrays have one entry a decoded frame.

    frame : (n,) int, decoded frames from 0.    t_s : (n,) true time stamps in s, first frame used at 0.
    x_px, y_px : (n,) bob centre in that frame's own pixels (first pixel's centre is (0, 0), y down); NaN if lost.
    sigma_x_px, sigma_y_px : (n,) standard uncertainties; NaN if lost.
    status : (n,) str, `ok` (measured), `predicted` (hidden: from the motion) or `lost`.
    radius_px : the bob's radius.    pivot_px : (x, y) of the pivot, may lie outside the picture.
    pivot_sigma_px : its standard uncertainties.    localiser : the tracker that measured most frames.
    meta : source, width_px, height_px, fps, time_source, log (sentences), warnings (sentences) and what else
        the stages after may use (string direction on each frame, exposure_s, velocities …).
    """

    frame: np.ndarray
    t_s: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray
    sigma_x_px: np.ndarray
    sigma_y_px: np.ndarray
    status: np.ndarray
    radius_px: float
    pivot_px: tuple[float, float]
    pivot_sigma_px: tuple[float, float]
    localiser: str
    meta: Mapping[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> np.ndarray:
        """(n,) bool: the frames on which the bob was measured."""
        return self.status == OK


def track(
    video_path: str | Path,
    *,
    pivot: tuple[float, float] | None = None,
    bob: tuple[float, float] | None = None,
    radius: float | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    fps_factor: float = 1.0,
    localiser: str | None = None,
    progress: Progress = silent,
) -> Track:
    """Follow the bob of the pendulum in a video file or a folder of pictures.

    pivot, bob (on the first frame used) and radius are in px and only help where the search would fail.
    start_s, stop_s cut the clip (in the file's time); fps_factor is true frame rate / the file's (slow motion: > 1).
    localiser names the tracker to use; by default the one whose model fits the clip best.

    Raises JobError where the video cannot be read, or where nothing in it moves like a pendulum.
    """
    if not (np.isfinite(fps_factor) and fps_factor > 0):
        raise UsageError(f"fps_factor must be a positive number, got {fps_factor}")
    if radius is not None and not radius > 0:
        raise UsageError(f"radius must be positive, got {radius}")
    if localiser is not None:
        load_tracker(localiser)
    video = open_video(video_path)
    progress("searching", 0.0)
    follower, frames = _begin(video, pivot, bob, radius, localiser, start_s, stop_s)
    expected = _expected_frames(video, start_s, stop_s)
    for count, frame in enumerate(frames):
        follower.follow(frame)
        if count % 64 == 0:
            progress("tracking", min(1.0, count / expected))
    progress("tracking", 1.0)
    return _finish(video, follower, pivot, fps_factor)


def write_track_csv(track: Track, path: str | Path) -> None:
    """Write track.csv: frame,t_s,x_px,y_px,sigma_x_px,sigma_y_px,status and where measured the string's direction."""
    with whole_file(path) as scratch, scratch.open("w", encoding="utf-8", newline="\n") as file:
        file.write("frame,t_s,x_px,y_px,sigma_x_px,sigma_y_px,status\n")
        columns = zip(track.frame, track.t_s, track.x_px, track.y_px, track.sigma_x_px, track.sigma_y_px, track.status)
        for frame, t, x, y, sx, sy, status in columns:
            numbers = ",".join(
                "" if not np.isfinite(v) else f"{v:.6g}" if v in (sx, sy) else f"{v:.5f}" for v in (x, y, sx, sy)
            )
            file.write(f"{frame},{t:.9g},{numbers},{status}\n")


# --- the pieces ---------------------------------------------------------------------------------------------------


def _begin(
    video: Video,
    pivot: tuple[float, float] | None,
    bob: tuple[float, float] | None,
    radius: float | None,
    localiser: str | None,
    start_s: float | None,
    stop_s: float | None,
) -> tuple[Follower, Iterator[Frame]]:
    """A follower that knows the bob, and all frames to be followed.

    Ordinarily the search looks at the first frames, kept in memory, and the file is decoded once. Where these do not
    show it (a slow swing, slow motion), every third or ninth frame over a longer time is searched, and the file decoded again.
    """
    first: JobError | None = None
    for every in (1, 3, 9):
        used = _between(iter(video), start_s, stop_s)
        batch = _read_ahead(used, every)
        if every == 1:
            _require_frames(batch, video)
        elif len(batch) < 12:
            break
        try:
            rough = find_bob(batch, bob, radius, str(video.path))
        except JobError as error:
            first = first or error
            continue
        follower = Follower(batch, rough, pivot, radius, localiser)
        if every == 1:
            follower.first = batch
            return follower, chain(batch, used)
        follower.interval_s /= every
        follower.exposure_s = min(follower.exposure_s, follower.interval_s)
        return follower, _between(iter(video), start_s, stop_s)
    raise first  # type: ignore[misc]


def _between(frames: Iterator[Frame], start_s: float | None, stop_s: float | None) -> Iterator[Frame]:
    for frame in frames:
        if stop_s is not None and frame.t_s > stop_s:
            return
        if start_s is None or frame.t_s >= start_s:
            yield frame


def _expected_frames(video: Video, start_s: float | None, stop_s: float | None) -> int:
    try:
        length = float(video.metadata.get("duration_s", "nan"))
    except ValueError:
        length = float("nan")
    stop = min(x for x in (stop_s, length, 1e9) if x is not None and x == x)
    return max(1, int((stop - (start_s or 0.0)) * (video.fps_header or 30.0))) if stop < 1e9 else 1000


def _read_ahead(frames: Iterator[Frame], every: int = 1, most_s: float = 1.6, most_bytes: float = 2.2e8) -> list[Frame]:
    """The first frames (or every n-th of them), kept in memory for the search."""
    batch: list[Frame] = []
    size = 0.0
    for count, frame in enumerate(frames):
        if count % every:
            continue
        batch.append(frame)
        size += 1.5 * frame.luma.size
        if len(batch) >= 24 and (size > most_bytes or frame.t_s - batch[0].t_s > most_s * every):
            break
    return batch


def _require_frames(batch: list[Frame], video: Video) -> None:
    if not batch:
        raise JobError(f"no frame of {video.path} lies in the time asked for; change --start and --stop")
    if len(batch) == 1:
        raise JobError(f"{video.path} holds a single frame; a pendulum needs a video of at least half a period")
    if len(batch) < 8:
        raise JobError(f"{video.path} holds only {len(batch)} frames; film at least half a period")


def _finish(video: Video, follower: Follower, pivot: tuple[float, float] | None, fps_factor: float) -> Track:
    """Judge the whole motion, bridge the gaps, make σ true."""
    r = follower.record
    log: list[str] = []
    warnings: list[str] = []
    t = _even_times(np.array(r.t_s), video, log)
    evened = bool(log)
    t = t - t[0]
    x, y, sx, sy = (np.array([getattr(p, n) for p in r.place]) for n in ("x_px", "y_px", "sigma_x_px", "sigma_y_px"))
    good = np.array(r.ok)
    if good.sum() < max(8, 0.3 * good.size):
        raise JobError(f"the bob was seen on only {good.sum()} of {good.size} frames of {video.path}; {REMEDY}")
    start = follower.swing
    start = Swing(start.values, start.covariance, start.t0_s - r.t_s[0], start.rms_px)
    shift = _Shift(follower, good, log)
    x, y = x + shift.raw_x - shift.x, y + shift.raw_y - shift.y
    swing = _whole_swing(start, t, x, y, good, video.path)
    _require_pendulum(swing, t, x, y, good, video.path)
    mx, my = swing.position(t)
    slips = _clock_slips(t, x - mx, y - my, swing, good)
    if slips.size:
        warnings.append(
            said(
                "track.clock_slips",
                "the clock of the file slips by whole frames at {places} place(s), first at t = {t_s:.3f} s (a camera that lost "
                "or repeated frames and did not say so); the error bars allow for it",
                places=int(slips.size),
                t_s=float(t[slips[0]]),
            )
        )
    good = good & ~_out_of_time(r, t, x - mx, y - my, swing, good, warnings)
    for a in (x, y, sx, sy):
        a[~good] = np.nan
    time_sigma = video.tick_s / np.sqrt(12) if video.tick_s > 2e-4 and not evened else 0.0
    vx, vy = (np.hypot(v * time_sigma, shift.sigma) for v in swing.velocity(t))
    scale = _true_sigma(x - mx, sx, good, vx), _true_sigma(y - my, sy, good, vy)
    sigma = shift.sigma
    if follower.shaking and max(scale) > _MOST:  # more than the picture explains: the camera's shift is known no better
        left = [np.sqrt(max(f**2 - _MOST**2, 0.0)) * np.median(s[good]) for f, s in zip(scale, (sx, sy))]
        sigma = np.hypot(sigma, float(np.hypot(*left)) / np.sqrt(2))
        scale = min(scale[0], _MOST), min(scale[1], _MOST)
    sx, sy = sx * scale[0], sy * scale[1]
    warnings += _poor_motion(
        swing, t, good, float(np.median(np.hypot(np.hypot(sx, sy)[good] / np.sqrt(2), sigma[good])))
    )
    status = np.where(good, OK, LOST).astype("U9")
    bridged = _bridged(good, t, swing.period_s)
    spread = float(np.hypot(np.nanstd((x - mx)[good]), np.nanstd((y - my)[good])))
    x[bridged], y[bridged] = mx[bridged], my[bridged]
    sx[bridged] = sy[bridged] = max(spread, 0.02)
    status[bridged] = PREDICTED
    steps = np.diff(t)
    fps = float(1 / np.median(steps[steps > 0])) * fps_factor if np.any(steps > 0) else float("nan")
    look = follower.look
    log += [
        said(
            "track.followed",
            "The bob was followed by its {sight} with the {localiser} localiser (radius {radius_px:.2f} px, edge "
            "{edge_px:.2f} px, exposure {exposure_ms:.1f} ms): {measured} of {frames} frames measured, {bridged} bridged by "
            "the fitted motion.",
            sight=said(f"track.by_{follower.sight.name}", follower.sight.name),
            localiser=follower.localiser.name,
            radius_px=float(look.radius_px),
            edge_px=float(look.edge_px),
            exposure_ms=1e3 * follower.exposure_s / fps_factor,
            measured=int(good.sum()),
            frames=int(good.size),
            bridged=int(bridged.sum()),
        ),
        said(
            "track.error_bars",
            "The error bars of the fit were multiplied by {x:.2f} (x) and {y:.2f} (y), the scatter seen about a smooth motion.",
            x=float(scale[0]),
            y=float(scale[1]),
        ),
    ]
    strings = np.full((t.size, 5), np.nan)
    for k, line in r.string.items():
        strings[k] = line
    return Track(
        frame=np.array(r.index),
        t_s=t / fps_factor,
        x_px=x + shift.x,
        y_px=y + shift.y,
        sigma_x_px=sx,
        sigma_y_px=sy,
        status=status,
        radius_px=float(look.radius_px),
        pivot_px=pivot or swing.pivot_px,
        pivot_sigma_px=(1.0, 1.0)
        if pivot
        else (float(np.sqrt(swing.covariance[0, 0])), float(np.sqrt(swing.covariance[1, 1]))),
        localiser=follower.localiser.name,
        meta={
            "source": str(video.path),
            "width_px": video.width_px,
            "height_px": video.height_px,
            "fps": fps,
            "fps_factor": fps_factor,
            "time_source": video.time_source,
            "sight": follower.sight.name,
            "exposure_s": follower.exposure_s / fps_factor,
            "edge_px": float(look.edge_px),
            "contrast": float(look.contrast),
            "visible": np.array([p.visible for p in r.place]),
            "misfit": np.array([p.misfit for p in r.place]),
            "residual_rms_px": swing.rms_px,
            "swing": _at_first_measured(swing, t, good, fps_factor),
            "pivot_given": pivot is not None,
            "shift_x_px": shift.x,
            "shift_y_px": shift.y,
            "shift_sigma_px": sigma,
            "time_sigma_s": time_sigma / fps_factor,
            "string_x_px": strings[:, 0],
            "string_y_px": strings[:, 1],
            "string_angle_rad": strings[:, 2],
            "string_angle_sigma_rad": strings[:, 3],
            "string_sigma_px": strings[:, 4],
            "log": log,
            "warnings": [*video.warnings, *clock_warnings(t, video), *warnings],
        },
    )


class _Shift:
    """How far the camera's shake moved the bob's place on each frame, smoothed as far as its own noise asks for.

    raw_x, raw_y (n,) were taken away while following (0 where the camera seemed to stand still), x, y (n,) are to be.
    """

    def __init__(self, follower: Follower, good: np.ndarray, log: list[str]) -> None:
        r = follower.record
        n = len(r.index)
        self.raw_x, self.raw_y, self.sigma = np.zeros(n), np.zeros(n), np.zeros(n)
        self.x, self.y = self.raw_x, self.raw_y
        known: dict[int, CameraShift] = {**follower.checks, **{k: s for k, s in enumerate(r.shift) if s is not None}}
        if not follower.shaking or not known:
            return
        at = np.array(sorted(known))
        rows = np.array([known[k][:3] for k in at])
        shifts = np.column_stack([np.interp(np.arange(n), at, column) for column in rows.T])
        first = next(k for k in range(n) if r.shift[k] is not None)
        smooth = shifts.copy()
        smooth[first:], noise = _smoothed(shifts[first:])
        one = next(iter(known.values()))
        self.x, self.y = np.zeros(n), np.zeros(n)
        for k, p in enumerate(r.place):
            where = (p.x_px, p.y_px) if good[k] else (one.centre_x_px, one.centre_y_px)
            self.x[k], self.y[k] = one._replace(x_px=smooth[k, 0], y_px=smooth[k, 1], roll_rad=smooth[k, 2]).at(*where)
            if k >= first:
                self.raw_x[k], self.raw_y[k] = r.shift[k].at(*where)  # type: ignore[union-attr]
        self.sigma = np.full(n, noise)
        extent = np.ptp(shifts, axis=0)
        log.append(
            said(
                "track.shake",
                "The camera moved by up to {across_px:.1f} px across and {down_px:.1f} px down; this was measured on the still "
                "background (to {noise_px:.3f} px a frame) and taken away.",
                across_px=float(extent[0]),
                down_px=float(extent[1]),
                noise_px=float(noise),
            )
        )


def _smoothed(values: np.ndarray) -> tuple[np.ndarray, float]:
    """Columns of `values` (n, k) by local parabolas over the longest window that adds no misfit; and what noise is left."""
    n = len(values)
    if n < 12:
        return values, 0.0
    third = values[3:] - 3 * values[2:-1] + 3 * values[1:-2] - values[:-3]
    noise = float(1.4826 * np.median(np.abs(third)) / np.sqrt(20))
    best, left = values, noise
    for width in (5, 9, 15, 25, 41):
        if width > n // 2:
            break
        half = width // 2
        at = np.arange(-half, half + 1)
        kernel = np.linalg.pinv(np.vander(at, 3, increasing=True))[0]
        padded = np.pad(values, ((half, half), (0, 0)), mode="reflect", reflect_type="odd")
        smooth = np.column_stack([np.convolve(c, kernel[::-1], "valid") for c in padded.T])
        rest = values - smooth
        own = noise * np.sqrt(1 - kernel[half])
        if np.sqrt(np.mean(rest**2)) > 1.25 * own + 1e-4:
            break
        best, left = smooth, noise * float(np.sqrt(kernel[half]))
    return best, left


def _whole_swing(start: Swing, t: np.ndarray, x: np.ndarray, y: np.ndarray, good: np.ndarray, path: Path) -> Swing:
    """The motion over the whole clip, fitted in growing pieces, so that no swing is lost count of."""
    chosen = np.flatnonzero(good)
    theta, rate = start.angle(t[chosen[:1]])
    values = start.values.copy()
    values[7:] = theta[0], rate[0]
    swing: Swing | None = None
    stop = t[chosen[0]] + max(0.75 * start.period_s, 0.3)
    while True:
        part = chosen[t[chosen] <= stop]
        if part.size >= 12:
            p = part[:: max(1, part.size // 1500)]
            swing = fit_swing(t[p], x[p], y[p], np.full(p.size, 0.1), values)
            if swing is None:
                break
            values = swing.values
        if stop >= t[-1]:
            break
        stop = t[chosen[0]] + 2 * (stop - t[chosen[0]])
    if swing is None:
        raise JobError(f"what moves in {path} does not swing like a pendulum; if there is one, {REMEDY}")
    return swing


def _out_of_time(
    r: Record, t: np.ndarray, rx: np.ndarray, ry: np.ndarray, swing: Swing, good: np.ndarray, warnings: list[str]
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
        warnings.append(
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


def _clock_slips(t: np.ndarray, rx: np.ndarray, ry: np.ndarray, swing: Swing, good: np.ndarray) -> np.ndarray:
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


def _require_pendulum(swing: Swing, t: np.ndarray, x: np.ndarray, y: np.ndarray, good: np.ndarray, path: Path) -> None:
    span = float(t[good][-1] - t[good][0])
    if span < 0.5 * swing.period_s:
        raise JobError(
            f"{path} shows {span:.2f} s, less than half a period ({0.5 * swing.period_s:.2f} s); film at least one period"
        )
    extent = float(np.hypot(np.ptp(x[good]), np.ptp(y[good])))
    amplitude = swing.amplitude_rad(t[good])
    reasons = []
    if swing.rms_px > max(0.04 * extent, 0.3):
        reasons.append(f"it strays {swing.rms_px:.1f} px from a swing of {extent:.0f} px")
    if good.mean() < 0.6 and swing.rms_px > 0.015 * extent:
        reasons.append(f"it was seen on {good.mean():.0%} of the frames, straying {swing.rms_px:.1f} px")
    if not 0 < amplitude < np.pi:
        reasons.append("it does not turn back")
    growth, growth_sigma = _growth(swing, t[good])
    if growth - 3 * growth_sigma > 0.5:
        reasons.append(f"its swing grows by {np.expm1(growth):.0%}")
    if swing.values[4] <= 0:
        reasons.append("nothing pulls it back")
    if reasons:
        raise JobError(f"what moves in {path} is no pendulum ({reasons[0]}); if there is one, {REMEDY}")


def _growth(swing: Swing, t: np.ndarray) -> tuple[float, float]:
    """How much the amplitude grew from the first to the last time (natural logarithm), and its standard uncertainty."""
    ends = np.array([t[0], t[-1]])

    def grown(values: np.ndarray) -> float:
        theta, rate = Swing(values, swing.covariance, swing.t0_s, swing.rms_px).angle(ends)
        energy = 0.5 * rate**2 + values[4] * (1 - np.cos(theta))
        return 0.5 * float(np.log(max(energy[1], 1e-12) / max(energy[0], 1e-12)))

    now = grown(swing.values)
    sigma = np.sqrt(np.diag(swing.covariance))
    slope = np.zeros(sigma.size)
    for i in range(4, 9):
        moved = swing.values.copy()
        moved[i] += 0.1 * sigma[i]
        slope[i] = (grown(moved) - now) / (0.1 * sigma[i]) if sigma[i] > 0 else 0.0
    return now, float(np.sqrt(max(slope @ swing.covariance @ slope, 0.0)))


def _poor_motion(swing: Swing, t: np.ndarray, good: np.ndarray, sigma_px: float) -> list[str]:
    """Sentences on a motion that was accepted, but is not quite that of a pendulum; `sigma_px` is a place's error bar."""
    poor: list[str] = []
    growth, sigma = _growth(swing, t[good])
    if growth > 0.02 + 4 * sigma:
        poor.append(
            said(
                "track.grows",
                "the swing grows by {share:.1%}: it is driven, or swings towards the camera by turns; a free decay does not "
                "describe it",
                share=float(np.expm1(growth)),
            )
        )
    if swing.rms_px > max(0.15, 3 * sigma_px) or swing.rms_px > 0.5:
        poor.append(
            said(
                "track.strays",
                "the bob's places stray {rms_px:.2f} px (rms) from a plane pendulum's swing on a circle: the camera was tilted "
                "or shook, its lens distorts, the bob swung out of the plane, was driven, or was not followed well",
                rms_px=float(swing.rms_px),
            )
        )
    if good.mean() < 0.7:
        share = float(good.mean())
        poor.append(said("track.few", "the bob was measured on only {share:.0%} of the frames", share=share))
    return poor


def _true_sigma(r: np.ndarray, s: np.ndarray, good: np.ndarray, others: np.ndarray) -> float:
    """The factor that makes the fit's σ `s` agree with the scatter of the residuals `r` from frame to frame, less that of
    `others` (the shake, the clock). What bends slowly is no error of a frame but of the motion assumed, and is taken out."""
    square = _scatter(r[good] / s[good]) ** 2
    known = float(np.mean((others[good] / s[good]) ** 2))
    return float(np.sqrt(max(square - known, 0.5 * square, 0.25)))


def _scatter(r: np.ndarray, width: int = 15) -> float:
    """Standard deviation of a series (n,) about parabolas through `width` neighbours."""
    if r.size < 2 * width:
        return float(np.sqrt(np.mean(r**2)))
    half = width // 2
    kernel = np.linalg.pinv(np.vander(np.arange(-half, half + 1), 3, increasing=True))[0]
    rest = r[half:-half] - np.convolve(r, kernel[::-1], "valid")
    return float(np.sqrt(np.mean(rest**2) / (1 - kernel[half])))


def _even_times(t: np.ndarray, video: Video, log: list[str]) -> np.ndarray:
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


def _at_first_measured(swing: Swing, t: np.ndarray, good: np.ndarray, fps_factor: float) -> list[float]:
    """The fitted motion's values (the order of `toolkit.tracking.swing.NAMES`) with the state at the first measured frame."""
    theta, rate = swing.angle(t[good][:1])
    values = swing.values.copy()
    values[7:] = theta[0], rate[0] * fps_factor
    values[4] *= fps_factor**2
    values[5] *= fps_factor
    return [float(v) for v in values]


def _bridged(good: np.ndarray, t: np.ndarray, period_s: float) -> np.ndarray:
    """Frames between two measured ones that are less than a period apart."""
    seen = np.flatnonzero(good)
    bridged = np.zeros(good.size, bool)
    for a, b in pairwise(seen):
        if b - a > 1 and t[b] - t[a] < period_s:
            bridged[a + 1 : b] = True
    return bridged

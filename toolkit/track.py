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
from toolkit.tracking.clock import clock_slips, even_times, out_of_time, place_lost_frames
from toolkit.tracking.follow import Follower
from toolkit.tracking.scatter import Factors, true_sigma
from toolkit.tracking.shake import Shake
from toolkit.tracking.string_line import seen_half
from toolkit.tracking.swing import Swing, fit_swing, start_swing
from toolkit.tracking.verdict import poor_motion, require_pendulum
from toolkit.tracking.view import View
from toolkit.tracking.view_fit import Lines, fit_view
from toolkit.video import Frame, Video, clock_warnings, open_video

OK, PREDICTED, LOST = "ok", "predicted", "lost"


_CALM = {"gamma": (0.0, 0.1), "beta": (0.0, 0.5)}  # damping of a pendulum of which little is known yet
_POOR_PICTURE = 0.12  # of the contrast
_HARMLESS = frozenset({"video.missing_frames", "video.varying_rate"})


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

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import track_html

        return track_html(self)


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
    t = even_times(np.array(r.t_s), video, log)
    evened = bool(log)
    t = t - t[0]
    x, y, sx, sy = (np.array([getattr(p, n) for p in r.place]) for n in ("x_px", "y_px", "sigma_x_px", "sigma_y_px"))
    good = np.array(r.ok)
    if good.sum() < max(8, 0.3 * good.size):
        raise JobError(f"the bob was seen on only {good.sum()} of {good.size} frames of {video.path}; {REMEDY}")
    start = follower.swing
    start = Swing(start.values, start.covariance, start.t0_s - r.t_s[0], start.rms_px)
    shift = Shake(follower, good, log)
    x, y = x + shift.raw_x - shift.x, y + shift.raw_y - shift.y
    swing = _whole_swing(start, t, x, y, good, video.path)
    require_pendulum(swing, t, x, y, good, video.path)
    stamps = t
    t, swing = place_lost_frames(t, x, y, swing, good, np.array(r.repeated), warnings)
    mx, my = swing.position(t)
    good = good & ~out_of_time(r, t, x - mx, y - my, swing, good, log, warnings)
    for a in (x, y, sx, sy):
        a[~good] = np.nan
    time_sigma = video.tick_s / np.sqrt(12) if video.tick_s > 2e-4 and not evened else 0.0
    strings = np.full((t.size, 6), np.nan)
    for k, line in r.string.items():
        strings[k, :5] = line
    strings[:, 5] = seen_half(np.hypot(strings[:, 0] - x, strings[:, 1] - y), follower.look.radius_px)
    straight = good & np.isfinite(strings[:, 5])
    lines = Lines(*[*strings[straight].T, t[straight] / fps_factor]) if straight.sum() >= 8 else None
    misfit = float(np.median([p.misfit for p, g in zip(r.place, good) if g])) / max(abs(follower.look.contrast), 1.0)
    view: View | None = None

    def _scatter(rx: np.ndarray, ry: np.ndarray, rough: bool = False) -> Factors:
        v = swing.velocity(t[good])
        known = shift.sigma[good], time_sigma
        found = true_sigma((rx[good], ry[good]), (sx[good], sy[good]), v, *known, rough)
        if not follower.shaking:
            return found
        # the picture's own places hold the shake, but not the error with which it was measured
        shaken = (rx + shift.x)[good], (ry + shift.y)[good]
        own = true_sigma(shaken, (sx[good], sy[good]), v, 0 * shift.sigma[good], time_sigma)
        return Factors(min(found.x, own.x), min(found.y, own.y), found.shake_px)

    vx, vy = (np.hypot(v * time_sigma, shift.sigma) for v in swing.velocity(t))
    scale = _scatter(x - mx, y - my, rough=True)
    for _ in range(2):  # error bars and the view of the camera each need the other
        found = fit_view(
            t[good] / fps_factor,
            x[good],
            y[good],
            np.sqrt((sx * scale.x) ** 2 + vx**2 + scale.shake_px**2)[good],
            np.sqrt((sy * scale.y) ** 2 + vy**2 + scale.shake_px**2)[good],
            np.array(_at_first_measured(swing, t, good, fps_factor)),
            (video.width_px, video.height_px),
            lines,
            None if pivot is None else (*pivot, 1.0),
            rows_along_x=video.rotation_deg % 180 != 0,
            off_px=max(0.02, misfit * follower.look.radius_px / 3),
        )
        if found is None:
            break
        view = found
        mx, my = view.position(t / fps_factor, mx, my)
        before, scale = scale, _scatter(x - mx, y - my)
        if not view.shown or min(scale.x / before.x, scale.y / before.y) > 0.6:
            break
    if view is not None and not clock_slips(t, x - mx, y - my, swing, good):  # what tilt or lens explain is no slip
        warnings = [w for w in warnings if getattr(w, "key", "") != "track.clock_slips"]
    sigma = np.hypot(shift.sigma, scale.shake_px)
    sx, sy = sx * scale.x, sy * scale.y
    rms_px = float(np.sqrt(0.5 * np.mean((x - mx)[good] ** 2 + (y - my)[good] ** 2)))
    late = time_sigma * np.hypot(*swing.velocity(t))
    typical = float(np.sqrt(np.mean((0.5 * (sx**2 + sy**2 + late**2) + shift.sigma**2)[good])))
    motion = swing if view is None else view.swing(fps_factor)
    warnings += poor_motion(motion, t, good, rms_px, typical)
    if misfit > _POOR_PICTURE or not follower.look.even:
        warnings.append(
            said(
                "track.poor_picture",
                "the bob does not look like an even disc (a pattern, a highlight or a shadow: {share:.0%} of its contrast is not "
                "explained); its centre may be off by about {off_px:.1f} px, much of it the same on all frames",
                share=misfit,
                off_px=misfit * follower.look.radius_px / 3,
            )
        )
    for odd in clock_warnings(stamps, video):  # what the stamps account for affects no result
        (log if getattr(odd, "key", "") in _HARMLESS else warnings).append(odd)
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
            x=scale.x,
            y=scale.y,
        ),
    ]
    return Track(
        frame=np.array(r.index),
        t_s=t / fps_factor,
        x_px=x + shift.x,
        y_px=y + shift.y,
        sigma_x_px=sx,
        sigma_y_px=sy,
        status=status,
        radius_px=float(look.radius_px),
        pivot_px=pivot or (swing if view is None else view).pivot_px,
        pivot_sigma_px=(1.0, 1.0) if pivot else (swing if view is None else view).pivot_sigma_px,
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
            "residual_rms_px": rms_px,
            "view": view,
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
            "string_half_px": strings[:, 5],
            "log": log,
            "warnings": [*video.warnings, *warnings],
        },
    )


def _whole_swing(start: Swing, t: np.ndarray, x: np.ndarray, y: np.ndarray, good: np.ndarray, path: Path) -> Swing:
    """The motion over the whole clip, from the motion followed; where that does not lead there, from the places alone."""
    chosen = np.flatnonzero(good)
    theta, rate = start.angle(t[chosen[:1]])
    values = start.values.copy()
    values[7:] = theta[0], rate[0]
    swing = _grown_swing(values, t, x, y, chosen)
    if swing is None or swing.rms_px > 0.02 * np.hypot(np.ptp(x[chosen]), np.ptp(y[chosen])):
        first = chosen[t[chosen] < t[chosen[0]] + 1.5 * start.period_s]
        other = start_swing(t[first], x[first], y[first]) if first.size >= 12 else None
        anew = None if other is None else _grown_swing(other, t, x, y, chosen)
        if anew is not None and (swing is None or anew.rms_px < swing.rms_px):
            swing = anew
    if swing is None:
        raise JobError(f"what moves in {path} does not swing like a pendulum; if there is one, {REMEDY}")
    return swing


def _grown_swing(values: np.ndarray, t: np.ndarray, x: np.ndarray, y: np.ndarray, chosen: np.ndarray) -> Swing | None:
    """The motion through the `chosen` frames, fitted in growing pieces, so that no swing is lost count of."""
    swing: Swing | None = None
    period = 2 * np.pi / np.sqrt(max(values[4], 1e-9))
    stop = t[chosen[0]] + max(0.75 * period, 0.3)
    while True:
        part = chosen[t[chosen] <= stop]
        if part.size >= 12:
            p = part[:: max(1, part.size // 1500)]
            calm = _CALM if stop < t[-1] else None
            swing = fit_swing(t[p], x[p], y[p], np.full(p.size, 0.5), values, prior=calm)
            if swing is None and calm is None:
                swing = fit_swing(t[p], x[p], y[p], np.full(p.size, 0.5), values, prior=_CALM)
            if swing is None:
                return None
            values = swing.values
        if stop >= t[-1]:
            return swing
        stop = t[chosen[0]] + 2 * (stop - t[chosen[0]])


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

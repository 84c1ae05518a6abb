"""From a video to the bob's position on every frame, with an error bar, and no click in ordinary clips."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import chain, islice, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.output import whole_file
from toolkit.progress import Progress, silent
from toolkit.sentence import said
from toolkit.trackers import load_tracker
from toolkit.tracking.begin.acquire import REMEDY, find_bob, find_clear_bob
from toolkit.tracking.begin.rival import rival_told
from toolkit.tracking.clip.bars import ErrorBars
from toolkit.tracking.clip.clock import (
    even_times,
    late_told,
    lone_strays,
    out_of_time,
    slips_told,
    strays_told,
    timed_swing,
)
from toolkit.tracking.clip.hands import held_still, not_swinging_yet
from toolkit.tracking.clip.held import held_swing
from toolkit.tracking.clip.joint import Camera, fit_jointly
from toolkit.tracking.clip.outline import pulled_by_string
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.shake import Shake
from toolkit.tracking.clip.soundness import SOUND, apart_told, faults, go_side_by_side
from toolkit.tracking.clip.verdict import poor_motion, poor_picture, require_pendulum
from toolkit.tracking.follow import Follower, Record
from toolkit.tracking.geometry.swing import Swing
from toolkit.tracking.geometry.view_fit import Lines
from toolkit.tracking.picture.string_line import seen_half
from toolkit.video import Frame, Video, clock_warnings, open_video

OK, PREDICTED, LOST = "ok", "predicted", "lost"

_BYTES_KEPT = 2.2e8  # of the frames that are searched
# of luma: what is decoded while the bob is searched for; each new frame costs memory, which takes time too
_BYTES_ASIDE = 2e7

_BRIEF_S, _THOROUGH_S = 0.8, (1.6, 2.4)  # of the film: what is searched
_BRIEF_FRAMES = 45  # fewer teach too little of the bob's looks
_CLEARLY = 0.2  # of the frames: a track with so many more of them is better though it is not sound
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
    video = open_video(video_path, filtered=False)
    if bob is not None and not (0 <= bob[0] < video.width_px and 0 <= bob[1] < video.height_px):
        wide, high = video.width_px, video.height_px
        raise UsageError(f"bob ({bob[0]:g}, {bob[1]:g}) lies outside the picture of {wide}×{high} px")
    if radius is not None and 2 * radius >= min(video.width_px, video.height_px):
        raise UsageError(
            f"a bob of radius {radius:g} px cannot swing in a picture of {video.width_px}×{video.height_px} px"
        )
    asked = Asked(pivot, bob, radius, localiser, start_s, stop_s)
    refusal: JobError | None = None
    found: list[Track] = []
    for look in _looks(video):
        if found and look.every > 1:
            break
        try:
            follower = _follow(video, asked, look, progress)
            if follower is None:
                continue
            follower = _from_release(follower, video, asked, progress)
            found.append(_finish(video, follower, pivot, fps_factor))
        except JobError as error:
            refusal = refusal or (None if look.brief else error)
            continue
        if _faults(found[-1]) < SOUND:
            break
    if found:
        return _soundest(found)
    raise refusal  # type: ignore[misc]


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


class Look(NamedTuple):
    """How the bob is searched: on every n-th of the frames of so much time; `brief`, it must be clear there."""

    every: int
    most_s: float
    brief: bool = False


def _looks(video: Video) -> list[Look]:
    """The searches, one after the other, until what comes of one is sound: a brief one does for most clips; the longer the look, the
    more it tells of what stands before and behind the bob; and a slow swing, slow motion, a hand that holds the bob need a long
    time."""
    fps = video.fps_header or 30.0
    most_s = _BYTES_KEPT / (1.5 * video.width_px * video.height_px * fps)
    brief = [Look(1, _BRIEF_S, brief=True)] if fps * _BRIEF_S >= _BRIEF_FRAMES else []
    thorough = [Look(1, span_s) for span_s in sorted({min(span_s, most_s) for span_s in _THOROUGH_S})]
    return [*brief, *thorough, *(Look(every, every * _THOROUGH_S[0]) for every in (3, 9))]


class Asked(NamedTuple):
    """What the caller of `track` said of the clip; None where nothing."""

    pivot: tuple[float, float] | None = None
    bob: tuple[float, float] | None = None
    radius: float | None = None
    localiser: str | None = None
    start_s: float | None = None
    stop_s: float | None = None


def _follow(video: Video, asked: Asked, look: Look, progress: Progress) -> Follower | None:
    """What has followed the bob through all frames; None where the look shows too few frames, or no clear bob to a brief one."""
    progress("searching", 0.0)
    begun = _begin(video, asked, look)
    if begun is None:
        return None
    follower, frames = begun
    expected = _expected_frames(video, asked.start_s, asked.stop_s)
    for count, frame in enumerate(_some_at_once(frames)):
        follower.follow(frame)
        if count % 64 == 0:
            progress("tracking", min(1.0, count / expected))
    progress("tracking", 1.0)
    return follower


def _faults(track: Track) -> float:
    return faults(track.ok, track.meta["warnings"])


def _soundest(tracks: list[Track]) -> Track:
    """The best of some tracks of a clip, but no shadow's; it warns where another has the bob elsewhere."""
    bobs = [track for track in tracks if not any(_is_shadow_of(track, other) for other in tracks)]
    best, *later = bobs or tracks
    for track in later:  # a longer look is no better in itself
        if _faults(track) < max(SOUND, _faults(best) - _CLEARLY):
            best = track
    told: list[str] = []
    for other in tracks:
        told = told or apart_told(*_on_common_frames(best, other))
    return replace(best, meta={**best.meta, "warnings": [*best.meta["warnings"], *told]})


def _is_shadow_of(one: Track, other: Track) -> bool:
    """Is the one of something that goes along beside the other, fainter and softer?"""
    fainter = abs(one.meta["contrast"]) < abs(other.meta["contrast"]) and one.meta["edge_px"] > other.meta["edge_px"]
    return fainter and go_side_by_side(*_on_common_frames(one, other), max(one.radius_px, other.radius_px))


def _on_common_frames(one: Track, other: Track) -> tuple[np.ndarray, np.ndarray]:
    """Both tracks' places, (2, n) px, on the frames that both measured."""
    both = one.ok & other.ok
    return np.array([one.x_px, one.y_px])[:, both], np.array([other.x_px, other.y_px])[:, both]


def _from_release(follower: Follower, video: Video, asked: Asked, progress: Progress) -> Follower:
    """Where a hand holds or hides the bob at first, what has followed it anew from its release on: else the hand is in what was
    learned of the bob, and of what stands still. The follower itself where none does, or the bob is not found there."""
    record = follower.record
    times = np.array(record.t_s)
    late = not_swinging_yet(Places.of(record, times - times[0]))
    if not late:
        return follower
    bob = None if asked.bob is None else record.place[late][:2]
    try:
        again = _follow(video, asked._replace(bob=bob, start_s=record.t_s[late]), Look(1, _THOROUGH_S[0]), progress)
    except JobError:
        return follower
    if again is None:
        return follower
    again.record.precede(record, late)
    again.late = late
    return again


def _begin(video: Video, asked: Asked, look: Look) -> tuple[Follower, Iterator[Frame]] | None:
    """A follower that knows the bob, and all frames to be followed; None where the look shows too few frames, or no clear bob to a
    brief one.

    Ordinarily the search looks at the first frames, kept in memory, and the file is decoded once. With every third or ninth frame
    over a longer time the file is decoded again.
    """
    used = _between(iter(video), asked.start_s, asked.stop_s)
    batch = _read_ahead(used, look)
    if look.every == 1:
        _require_frames(batch, video)
    elif len(batch) < 12:
        return None
    more = int(_BYTES_ASIDE / batch[0].luma.size) if look.every == 1 else 0
    with ThreadPoolExecutor(1) as aside:  # other processors decode on while this one searches
        later = aside.submit(list, islice(used, more))
        rough = (
            find_clear_bob(batch, asked.bob, asked.radius)
            if look.brief
            else find_bob(batch, asked.bob, asked.radius, str(video.path))
        )
        if rough is None:
            return None
        follower = Follower(batch, rough, asked.pivot, asked.radius, asked.localiser)
    if look.every == 1:
        follower.first = batch
        return follower, chain(batch, later.result(), used)
    follower.interval_s /= look.every
    follower.exposure_s = min(follower.exposure_s, follower.interval_s)
    return follower, _between(iter(video), asked.start_s, asked.stop_s)


def _some_at_once(frames: Iterator[Frame], count: int = 16) -> Iterator[Frame]:
    """The same frames, some decoded before the first of them is followed: both jobs go quicker where they do not drive each
    other out of the processor's caches on every frame."""
    held: deque[Frame] = deque()
    while True:
        held.extend(islice(frames, count))
        if not held:
            return
        while held:
            yield held.popleft()


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


def _read_ahead(frames: Iterator[Frame], look: Look) -> list[Frame]:
    """The first frames (or every n-th of them), kept in memory for the search."""
    batch: list[Frame] = []
    size = 0.0
    for count, frame in enumerate(frames):
        if count % look.every:
            continue
        batch.append(frame)
        size += 1.5 * frame.luma.size
        if len(batch) >= 24 and (size > _BYTES_KEPT or frame.t_s - batch[0].t_s > look.most_s):
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
    record, look = follower.record, follower.look
    size_px = video.width_px, video.height_px
    log: list[str] = []
    warnings: list[str] = []
    t = even_times(np.array(record.t_s), video, log)
    time_sigma = video.tick_s / np.sqrt(12) if video.tick_s > 2e-4 and not log else 0.0
    places = Places.of(record, t - t[0])
    _require_seen(places.good[follower.late :], video)
    shake = Shake(follower, places.good)
    if follower.unsteady:
        shake.look_at_string(places, _strings(record, places, shake, look.radius_px, fps_factor))
    places = replace(places, x_px=places.x_px + shake.raw_x - shake.x, y_px=places.y_px + shake.raw_y - shake.y)
    stamps = places.t_s
    if follower.late:
        log.append(
            said(
                "track.released",
                "the bob is held or hidden until t = {t_s:.2f} s: it was looked for from there on",
                t_s=float(stamps[follower.late]),
            )
        )
    places = held_still(places, log)

    followed = replace(follower.swing, t0_s=follower.swing.t0_s - record.t_s[0])
    turned = video.rotation_deg % 180 != 0
    places, swing = timed_swing(followed, places, video.path, warnings, size_px, turned)
    if shake.taken:
        places, swing = shake.checked(places, swing)
    swing = held_swing(swing, places, _strings(record, places, shake, look.radius_px, fps_factor).seen(), size_px)
    misfit = float(np.median([p.misfit for p, g in zip(record.place, places.good) if g])) / max(abs(look.contrast), 1.0)
    require_pendulum(swing, places, size_px, video.path, misfit)
    x_off, y_off = pulled_by_string(record.pull, swing, places)
    places = replace(places, x_px=places.x_px - x_off, y_px=places.y_px - y_off)
    found, none = places, np.zeros(places.t_s.size, bool)
    untimely, stray = _out_of_step(found, swing, swing.position(places.t_s), none)
    places = found.without(untimely | stray)

    good = places.good
    off_px = misfit * look.radius_px / 3
    strings = _strings(record, places, shake, look.radius_px, fps_factor)
    shaded, exposure_s = follower.shadow is not None, follower.exposure_s
    camera = Camera(size_px, pivot, turned, max(0.02, off_px), fps_factor, look.even, shaded, exposure_s)
    lines = strings.seen()
    joint = fit_jointly(places, swing, shake, time_sigma, lines, camera)
    # with tilt, lens and shutter taken out some are no strays, and others hid in these
    untimely, stray = _out_of_step(found, swing, (joint.x_px, joint.y_px), stray, good)
    left = found.without(untimely | stray)
    if not np.array_equal(left.good, good):
        places, good = left, left.good
        joint = fit_jointly(places, swing, shake, time_sigma, lines, camera)
    log += shake.told(joint.bars.shake_px)
    late_told(places, untimely, log, warnings)
    log += strays_told(places, stray)

    rx, ry = ((p - m)[good] for p, m in ((places.x_px, joint.x_px), (places.y_px, joint.y_px)))
    rms_px = float(np.sqrt(0.5 * np.mean(rx**2 + ry**2)))
    sx, sy = joint.bars.sigma_x_px, joint.bars.sigma_y_px
    late = time_sigma * np.hypot(*swing.velocity(places.t_s))
    borne = joint.bars.shake_px if shake.by_string else 0.0  # it strays so far, and the angles' σ allows for it
    typical = float(np.sqrt(np.mean((0.5 * (sx**2 + sy**2 + late**2) + shake.sigma**2 + borne**2)[good])))
    motion = swing if joint.view is None else joint.view.swing(fps_factor)
    if not joint.bars.shake_px:  # a shaking camera leaps too
        warnings += slips_told(places, swing, joint.x_px, joint.y_px)
    followed_at, seen = places.t_s[follower.late :], good[follower.late :]
    warnings += poor_motion(motion, followed_at, seen, rms_px, typical, look.radius_px, shake.by_string)
    warnings += poor_picture(misfit, look.even, off_px, rms_px)
    warnings += rival_told(follower.rival_px)
    for odd in clock_warnings(stamps, video):  # what the stamps account for affects no result
        (log if getattr(odd, "key", "") in _HARMLESS else warnings).append(odd)

    bridged = _bridged(good, places.t_s, swing.period_s)
    x, y = (np.where(bridged, m, p) for m, p in ((joint.x_px, places.x_px), (joint.y_px, places.y_px)))
    spread = max(float(np.hypot(np.std(rx), np.std(ry))), 0.02)
    steps = np.diff(places.t_s)
    mean_x, mean_y = swing.over_exposure(places.t_s, exposure_s)
    if follower.choice:
        log.append(follower.choice)
    log += _how_followed(follower, good, bridged, joint.bars, fps_factor)
    return Track(
        frame=np.array(record.index),
        t_s=places.t_s / fps_factor,
        x_px=x + shake.x,
        y_px=y + shake.y,
        sigma_x_px=np.where(bridged, spread, sx),
        sigma_y_px=np.where(bridged, spread, sy),
        status=np.where(good, OK, np.where(bridged, PREDICTED, LOST)),
        radius_px=float(look.radius_px),
        pivot_px=pivot or (joint.view or swing).pivot_px,
        pivot_sigma_px=(1.0, 1.0) if pivot else (joint.view or swing).pivot_sigma_px,
        localiser=follower.localiser.name,
        meta={
            "source": str(video.path),
            "width_px": video.width_px,
            "height_px": video.height_px,
            "fps": float(1 / np.median(steps[steps > 0])) * fps_factor if np.any(steps > 0) else float("nan"),
            "fps_factor": fps_factor,
            "time_source": video.time_source,
            "sight": follower.sight.name,
            "exposure_s": follower.exposure_s / fps_factor,
            "edge_px": float(look.edge_px),
            "contrast": float(look.contrast),
            "visible": np.array([p.visible for p in record.place]),
            "misfit": np.array([p.misfit for p in record.place]),
            "residual_rms_px": rms_px,
            "view": joint.view,
            "swing": swing.values_at(places.t_s[good][0], fps_factor).tolist(),
            "pivot_given": pivot is not None,
            "mean_x_px": mean_x,
            "mean_y_px": mean_y,
            "shift_x_px": shake.x,
            "shift_y_px": shake.y,
            "shift_sigma_px": np.hypot(shake.sigma, joint.bars.shake_px),
            "time_sigma_s": time_sigma / fps_factor,
            "string_x_px": strings.x_px,
            "string_y_px": strings.y_px,
            "string_angle_rad": strings.angle_rad,
            "string_angle_sigma_rad": strings.sigma_rad,
            "string_sigma_px": strings.sigma_px,
            "string_half_px": strings.half_px,
            "log": log,
            "warnings": [*video.warnings, *warnings],
        },
    )


def _how_followed(
    follower: Follower, good: np.ndarray, bridged: np.ndarray, bars: ErrorBars, fps_factor: float
) -> list[str]:
    """Sentences on how the bob was followed and what became of its error bars."""
    look = follower.look
    return [
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
            x=bars.x,
            y=bars.y,
        ),
    ]


def _out_of_step(
    found: Places, swing: Swing, drawn: tuple[np.ndarray, np.ndarray], stray: np.ndarray, sure: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Frames (n,) bool whose picture is of another time, and the strays, about the motion as drawn (`stray` where they are too many
    to tell); `sure`, (n,) bool, were kept before."""
    untimely = out_of_time(found, swing, *drawn)
    again = lone_strays(found.without(untimely), *drawn, sure=None if sure is None else sure & ~untimely)
    return untimely, stray if again is None else again


def _require_seen(good: np.ndarray, video: Video) -> None:
    seen, of = int(good.sum()), good.size
    if seen < max(8, 0.3 * of):
        raise JobError(f"the bob was seen on only {seen} of {of} frames of {video.path}; {REMEDY}")


def _strings(record: Record, places: Places, shake: Shake, radius_px: float, fps_factor: float) -> Lines:
    """The string's line on each frame, NaN where none was seen, in the pixels of a still camera."""
    lines = np.full((places.t_s.size, 5), np.nan)
    for k, line in record.string.items():
        lines[k] = line
    x, y, angle, angle_sigma, sigma = lines.T
    x, y = x + shake.raw_x - shake.x, y + shake.raw_y - shake.y
    half = seen_half(np.hypot(x - places.x_px, y - places.y_px), radius_px)
    return Lines(x, y, angle, angle_sigma, sigma, half, places.t_s / fps_factor)


def _bridged(good: np.ndarray, t: np.ndarray, period_s: float) -> np.ndarray:
    """Frames between two measured ones that are less than a period apart."""
    seen = np.flatnonzero(good)
    bridged = np.zeros(good.size, bool)
    for a, b in pairwise(seen):
        if b - a > 1 and t[b] - t[a] < period_s:
            bridged[a + 1 : b] = True
    return bridged

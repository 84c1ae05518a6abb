"""The whole motion judged: gaps bridged, σ made true, and said in words what was amiss."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.tracking.begin.acquire import REMEDY
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
from toolkit.tracking.clip.hands import held_still
from toolkit.tracking.clip.held import held_swing
from toolkit.tracking.clip.joint import Camera, Joint, fit_jointly
from toolkit.tracking.clip.outline import pulled_by_string
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.shake import Shake
from toolkit.tracking.clip.verdict import poor_motion, poor_picture, require_pendulum
from toolkit.tracking.follow import Follower
from toolkit.tracking.geometry.swing import Swing
from toolkit.tracking.geometry.view_fit import Lines
from toolkit.tracking.picture.string_line import seen_half
from toolkit.tracking.result import LOST, OK, PREDICTED, Track
from toolkit.video import Video, clock_warnings

_HARMLESS = frozenset({"video.missing_frames", "video.varying_rate"})


@dataclass(frozen=True)
class _Clip:
    """What is the same all through: the video, what followed the bob in it, the pivot if given, true frame rate over the file's,
    how finely the file rounds its times (standard deviation, s), and the sentences to come."""

    video: Video
    follower: Follower
    pivot_px: tuple[float, float] | None
    fps_factor: float
    time_sigma_s: float
    log: list[str]
    warnings: list[str]

    @property
    def size_px(self) -> tuple[int, int]:
        return self.video.width_px, self.video.height_px

    @property
    def turned(self) -> bool:
        """Does the camera read its rows along the picture's x axis?"""
        return self.video.rotation_deg % 180 != 0

    def strings(self, places: Places, shake: Shake) -> Lines:
        """The string's line on each frame, NaN where none was seen, in the pixels of a still camera."""
        lines = np.full((places.t_s.size, 5), np.nan)
        for k, line in self.follower.record.string.items():
            lines[k] = line
        x, y, angle, angle_sigma, sigma = lines.T
        x, y = x + shake.raw_x - shake.x, y + shake.raw_y - shake.y
        half = seen_half(np.hypot(x - places.x_px, y - places.y_px), self.follower.look.radius_px)
        return Lines(x, y, angle, angle_sigma, sigma, half, places.t_s / self.fps_factor)


def finish(video: Video, follower: Follower, pivot: tuple[float, float] | None, fps_factor: float) -> Track:
    """The track of the bob that was followed. Raises JobError where it was seen too seldom, or is no pendulum's."""
    log: list[str] = []
    t = even_times(np.array(follower.record.t_s), video, log)
    time_sigma_s = video.tick_s / np.sqrt(12) if video.tick_s > 2e-4 and not log else 0.0
    clip = _Clip(video, follower, pivot, fps_factor, time_sigma_s, log, [])
    places, shake = _in_still_camera(clip, Places.of(follower.record, t - t[0]))
    stamps = places.t_s
    places, swing, misfit = _as_pendulum(clip, held_still(places, log), shake)
    places, joint = _as_seen(clip, places, swing, shake, misfit)
    rms_px = _judge(clip, places, stamps, swing, joint, shake, misfit)
    return _track(clip, places, swing, joint, shake, rms_px)


def _in_still_camera(clip: _Clip, places: Places) -> tuple[Places, Shake]:
    """The places in the pixels of a still camera, and how far it shook."""
    follower = clip.follower
    _require_seen(places.good[follower.late :], clip.video)
    shake = Shake(follower, places.good)
    if follower.unsteady:
        shake.look_at_string(places, clip.strings(places, shake))
    if follower.late:
        clip.log.append(
            said(
                "track.released",
                "the bob is held or hidden until t = {t_s:.2f} s: it was looked for from there on",
                t_s=float(places.t_s[follower.late]),
            )
        )
    return replace(places, x_px=places.x_px + shake.raw_x - shake.x, y_px=places.y_px + shake.raw_y - shake.y), shake


def _as_pendulum(clip: _Clip, places: Places, shake: Shake) -> tuple[Places, Swing, float]:
    """The places, at true times and of the bob's centre, the pendulum's motion through them, and the share of the bob's contrast that
    its looks leave unexplained."""
    follower, record = clip.follower, clip.follower.record
    followed = replace(follower.swing, t0_s=follower.swing.t0_s - record.t_s[0])
    path = clip.video.path
    places, swing = timed_swing(followed, places, path, clip.warnings, clip.size_px, clip.turned)
    if shake.taken:
        places, swing = shake.checked(places, swing)
    swing = held_swing(swing, places, clip.strings(places, shake).seen(), clip.size_px)
    left = float(np.median([p.misfit for p, g in zip(record.place, places.good) if g]))
    misfit = left / max(abs(follower.look.contrast), 1.0)
    require_pendulum(swing, places, clip.size_px, path, misfit)
    x_off, y_off = pulled_by_string(record.pull, swing, places)
    return replace(places, x_px=places.x_px - x_off, y_px=places.y_px - y_off), swing, misfit


def _as_seen(clip: _Clip, found: Places, swing: Swing, shake: Shake, misfit: float) -> tuple[Places, Joint]:
    """The places without those out of step with the motion as the camera saw it, and this, with the error bars."""
    follower, none = clip.follower, np.zeros(found.t_s.size, bool)
    untimely, stray = _out_of_step(found, swing, swing.position(found.t_s), none)
    places = found.without(untimely | stray)
    lines = clip.strings(places, shake).seen()
    camera = Camera(
        clip.size_px,
        clip.pivot_px,
        clip.turned,
        max(0.02, _off_px(clip, misfit)),
        clip.fps_factor,
        follower.look.even,
        follower.shadow is not None,
        follower.exposure_s,
    )
    joint = fit_jointly(places, swing, shake, clip.time_sigma_s, lines, camera)
    # with tilt, lens and shutter taken out some are no strays, and others hid in these
    untimely, stray = _out_of_step(found, swing, (joint.x_px, joint.y_px), stray, places.good)
    left = found.without(untimely | stray)
    if not np.array_equal(left.good, places.good):
        places = left
        joint = fit_jointly(places, swing, shake, clip.time_sigma_s, lines, camera)
    clip.log.extend(shake.told(joint.bars.shake_px))
    late_told(places, untimely, clip.log, clip.warnings)
    clip.log.extend(strays_told(places, stray))
    return places, joint


def _judge(
    clip: _Clip, places: Places, stamps: np.ndarray, swing: Swing, joint: Joint, shake: Shake, misfit: float
) -> float:
    """How far (rms, px) the places stray from the motion as seen; what is poor about them is said."""
    follower, good = clip.follower, places.good
    rx, ry = _strays(places, joint)
    rms_px = float(np.sqrt(0.5 * np.mean(rx**2 + ry**2)))
    sx, sy = joint.bars.sigma_x_px, joint.bars.sigma_y_px
    late = clip.time_sigma_s * np.hypot(*swing.velocity(places.t_s))
    borne = joint.bars.shake_px if shake.by_string else 0.0  # it strays so far, and the angles' σ allows for it
    typical = float(np.sqrt(np.mean((0.5 * (sx**2 + sy**2 + late**2) + shake.sigma**2 + borne**2)[good])))
    motion = swing if joint.view is None else joint.view.swing(clip.fps_factor)
    warnings, seen = clip.warnings, slice(follower.late, None)
    if not joint.bars.shake_px:  # a shaking camera leaps too
        warnings += slips_told(places, swing, joint.x_px, joint.y_px)
    radius_px = follower.look.radius_px
    warnings += poor_motion(motion, places.t_s[seen], good[seen], rms_px, typical, radius_px, shake.by_string)
    warnings += poor_picture(misfit, follower.look.even, _off_px(clip, misfit), rms_px)
    warnings += rival_told(follower.rival_px)
    for odd in clock_warnings(stamps, clip.video):  # what the stamps account for affects no result
        (clip.log if getattr(odd, "key", "") in _HARMLESS else warnings).append(odd)
    return rms_px


def _track(clip: _Clip, places: Places, swing: Swing, joint: Joint, shake: Shake, rms_px: float) -> Track:
    """What is known of the bob, in the frames' own pixels and true time."""
    video, follower, record, fps_factor = clip.video, clip.follower, clip.follower.record, clip.fps_factor
    look, good, strings, log = follower.look, places.good, clip.strings(places, shake), clip.log
    bridged = _bridged(good, places.t_s, swing.period_s)
    x, y = (np.where(bridged, m, p) for m, p in ((joint.x_px, places.x_px), (joint.y_px, places.y_px)))
    rx, ry = _strays(places, joint)
    spread = max(float(np.hypot(np.std(rx), np.std(ry))), 0.02)
    steps = np.diff(places.t_s)
    mean_x, mean_y = swing.over_exposure(places.t_s, follower.exposure_s)
    if follower.choice:
        log.append(follower.choice)
    log += _how_followed(follower, good, bridged, joint.bars, fps_factor)
    return Track(
        frame=np.array(record.index),
        t_s=places.t_s / fps_factor,
        x_px=x + shake.x,
        y_px=y + shake.y,
        sigma_x_px=np.where(bridged, spread, joint.bars.sigma_x_px),
        sigma_y_px=np.where(bridged, spread, joint.bars.sigma_y_px),
        status=np.where(good, OK, np.where(bridged, PREDICTED, LOST)),
        radius_px=float(look.radius_px),
        pivot_px=clip.pivot_px or (joint.view or swing).pivot_px,
        pivot_sigma_px=(1.0, 1.0) if clip.pivot_px else (joint.view or swing).pivot_sigma_px,
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
            "pivot_given": clip.pivot_px is not None,
            "mean_x_px": mean_x,
            "mean_y_px": mean_y,
            "shift_x_px": shake.x,
            "shift_y_px": shake.y,
            "shift_sigma_px": np.hypot(shake.sigma, joint.bars.shake_px),
            "time_sigma_s": clip.time_sigma_s / fps_factor,
            "string_x_px": strings.x_px,
            "string_y_px": strings.y_px,
            "string_angle_rad": strings.angle_rad,
            "string_angle_sigma_rad": strings.sigma_rad,
            "string_sigma_px": strings.sigma_px,
            "string_half_px": strings.half_px,
            "log": log,
            "warnings": [*video.warnings, *clip.warnings],
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


def _off_px(clip: _Clip, misfit: float) -> float:
    """How far the places may be off the bob's centre for what its looks leave unexplained."""
    return misfit * clip.follower.look.radius_px / 3


def _strays(places: Places, joint: Joint) -> tuple[np.ndarray, np.ndarray]:
    """By how much (px) the measured places lie beside the motion as seen."""
    return (places.x_px - joint.x_px)[places.good], (places.y_px - joint.y_px)[places.good]


def _bridged(good: np.ndarray, t: np.ndarray, period_s: float) -> np.ndarray:
    """Frames between two measured ones that are less than a period apart."""
    seen = np.flatnonzero(good)
    bridged = np.zeros(good.size, bool)
    for a, b in pairwise(seen):
        if b - a > 1 and t[b] - t[a] < period_s:
            bridged[a + 1 : b] = True
    return bridged

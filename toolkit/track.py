"""From a video to the bob's position on every frame, with an error bar, and no click in ordinary clips."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.progress import Progress, silent
from toolkit.trackers import load_tracker
from toolkit.tracking.finish import finish
from toolkit.tracking.opening import Asked, follow_bob, openings
from toolkit.tracking.result import LOST, OK, PREDICTED, Track, write_track_csv
from toolkit.tracking.soundness import HOPELESS, SOUND, faults, soundest
from toolkit.video import open_video

__all__ = ["LOST", "OK", "PREDICTED", "Track", "track", "write_track_csv"]


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
    for opening in openings(video):
        if opening.every > 1 and any(faults(track) < HOPELESS for track in found):
            break
        try:
            follower = follow_bob(video, asked, opening, progress)
            if follower is not None:
                found.append(finish(video, follower, pivot, fps_factor))
        except JobError as error:
            refusal = refusal or (None if opening.brief else error)
        else:
            if follower is not None and faults(found[-1]) < SOUND:
                break
    if found:
        return soundest(found)
    raise refusal  # type: ignore[misc]

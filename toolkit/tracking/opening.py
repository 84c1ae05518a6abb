"""The opening of a clip, in which the bob is looked for; from there on it is followed through the whole clip."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, islice
from typing import NamedTuple

import numpy as np

from toolkit.errors import JobError
from toolkit.progress import Progress
from toolkit.tracking.begin.acquire import find_bob, find_clear_bob
from toolkit.tracking.clip.hands import not_swinging_yet
from toolkit.tracking.clip.places import Places
from toolkit.tracking.follow import Follower
from toolkit.video import Frame, Video

_BYTES_KEPT = 2.2e8  # of the frames that are searched
# of luma: what is decoded while the bob is searched for; each new frame costs memory, which takes time too
_BYTES_ASIDE = 2e7
_BRIEF_S, _THOROUGH_S = 0.8, (1.6, 2.4)  # of the film: what is searched
_BRIEF_FRAMES = 45  # fewer teach too little of the bob's looks


class Opening(NamedTuple):
    """What is searched for the bob: every n-th of the frames of so much time; it must be clear there if that is `brief`."""

    every: int
    most_s: float
    brief: bool = False


def openings(video: Video) -> list[Opening]:
    """What is searched, one after the other, until the track is sound: a brief opening does for most clips; a longer one tells more
    of what stands before and behind the bob; and a slow swing, slow motion, a hand that holds the bob need a long one."""
    fps = video.fps_header or 30.0
    most_s = _BYTES_KEPT / (1.5 * video.width_px * video.height_px * fps)
    brief = [Opening(1, _BRIEF_S, brief=True)] if fps * _BRIEF_S >= _BRIEF_FRAMES else []
    thorough = [Opening(1, span_s) for span_s in sorted({min(span_s, most_s) for span_s in _THOROUGH_S})]
    return [*brief, *thorough, *(Opening(every, every * _THOROUGH_S[0]) for every in (3, 9))]


class Asked(NamedTuple):
    """What the caller of `track` said of the clip; None where nothing."""

    pivot: tuple[float, float] | None = None
    bob: tuple[float, float] | None = None
    radius: float | None = None
    localiser: str | None = None
    start_s: float | None = None
    stop_s: float | None = None


def follow_bob(video: Video, asked: Asked, opening: Opening, progress: Progress) -> Follower | None:
    """What has followed the bob through all frames; None where the opening holds too few, or a brief one no clear bob.

    Raises JobError where nothing in it moves like a pendulum.
    """
    follower = _follow(video, asked, opening, progress)
    return None if follower is None else _from_release(follower, video, asked, progress)


def _follow(video: Video, asked: Asked, opening: Opening, progress: Progress) -> Follower | None:
    progress("searching", 0.0)
    begun = begin(video, asked, opening)
    if begun is None:
        return None
    follower, frames = begun
    expected = _expected_frames(video, asked.start_s, asked.stop_s)
    for count, frame in enumerate(frames):
        follower.follow(frame)
        if count % 64 == 0:
            progress("tracking", min(1.0, count / expected))
    progress("tracking", 1.0)
    return follower


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
        anew = asked._replace(bob=bob, start_s=record.t_s[late])
        again = _follow(video, anew, Opening(1, _THOROUGH_S[0]), progress)
    except JobError:
        return follower
    if again is None:
        return follower
    again.record.precede(record, late)
    again.late = late
    return again


def begin(video: Video, asked: Asked, opening: Opening) -> tuple[Follower, Iterator[Frame]] | None:
    """A follower that knows the bob, and all frames to be followed; None where the opening holds too few, or a brief one no clear
    bob.

    Ordinarily the search looks at the first frames, kept in memory, and the file is decoded once. With every third or ninth frame
    over a longer time the file is decoded again.
    """
    used = _between(iter(video), asked.start_s, asked.stop_s)
    batch = read_ahead(used, opening)
    if opening.every == 1:
        _require_frames(batch, video)
    elif len(batch) < 12:
        return None
    more = int(_BYTES_ASIDE / batch[0].luma.size) if opening.every == 1 else 0
    with ThreadPoolExecutor(1) as aside:  # other processors decode on while this one searches
        later = aside.submit(list, islice(used, more))
        rough = (
            find_clear_bob(batch, asked.bob, asked.radius)
            if opening.brief
            else find_bob(batch, asked.bob, asked.radius, str(video.path))
        )
        if rough is None:
            return None
        follower = Follower(batch, rough, asked.pivot, asked.radius, asked.localiser)
    if opening.every == 1:
        follower.first = batch
        return follower, chain(batch, later.result(), used)
    follower.interval_s /= opening.every
    follower.exposure_s = min(follower.exposure_s, follower.interval_s)
    return follower, _between(iter(video), asked.start_s, asked.stop_s)


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


def read_ahead(frames: Iterator[Frame], opening: Opening) -> list[Frame]:
    """The first frames (or every n-th of them), kept in memory for the search."""
    batch: list[Frame] = []
    size = 0.0
    for count, frame in enumerate(frames):
        if count % opening.every:
            continue
        batch.append(frame)
        size += 1.5 * frame.luma.size
        if len(batch) >= 24 and (size > _BYTES_KEPT or frame.t_s - batch[0].t_s > opening.most_s):
            break
    return batch


def _require_frames(batch: list[Frame], video: Video) -> None:
    if not batch:
        raise JobError(f"no frame of {video.path} lies in the time asked for; change --start and --stop")
    if len(batch) == 1:
        raise JobError(f"{video.path} holds a single frame; a pendulum needs a video of at least half a period")
    if len(batch) < 8:
        raise JobError(f"{video.path} holds only {len(batch)} frames; film at least half a period")

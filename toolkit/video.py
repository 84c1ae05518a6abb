"""Any video as a stream of frames with their true time stamps.

PyAV decodes (its luma plane is handed on without a copy), OpenCV is the fallback where PyAV is missing or cannot
open the file, and a folder of numbered pictures is a video too. The header's frame count and rate are never used
for timing; what is odd about the clock is said in `clock_warnings`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.sentence import said

_PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")
# 8-bit formats whose plane 0 is the luma itself
_LUMA_FIRST = re.compile(r"^(yuvj?4\d\dp|yuva4\d\dp|nv12|nv21|nv16|gray|gray8)$")
_DEEP_LUMA = re.compile(r"^(?:yuva?4\d\dp|gray)(9|10|12|14|16)le$")

# the decoder's own limit. One thread to a processor: with one more, ffmpeg's own choice, they wait for a processor as well as
# for each other, and frames decoded far ahead drive each other out of the processor's caches
_MOST_THREADS = 16


class Frame:
    """One decoded frame, turned upright.

    index : counts decoded frames from 0.    t_s : its time stamp, the first decoded frame's being 0.
    luma : (height, width) uint8, often a view into the decoder's memory: read it, do not write it.
    kind : how the codec coded it, by ffmpeg's numbers (1 I, 2 P, 3 B …), 0 where that is not known.
    """

    __slots__ = ("_colour", "index", "kind", "luma", "t_s")

    def __init__(self, index: int, t_s: float, luma: np.ndarray, colour: Callable[[str], Any], kind: int = 0) -> None:
        self.index, self.t_s, self.luma, self._colour, self.kind = index, t_s, luma, colour, kind

    @property
    def bgr(self) -> np.ndarray:
        """(height, width, 3) uint8 in OpenCV's order, converted when asked for."""
        return self._colour("bgr")

    @property
    def chroma(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The two colour-difference planes (uint8, often half the size), or None for a grey picture."""
        return self._colour("chroma")


@dataclass(frozen=True)
class Video:
    """A video that can be iterated any number of times; each time decodes the file anew.

    fps_header is what the file claims (None where it does not); `time_source` says where time stamps come from:
    `pts` (the file's own), `opencv`, `frame rate` (none in the file: index/fps) or `pictures`; `tick_s` is the step to
    which the file rounds them.
    """

    path: Path
    width_px: int
    height_px: int
    fps_header: float | None
    codec: str
    time_source: str
    rotation_deg: int = 0
    full_range: bool = False
    tick_s: float = 0.0
    metadata: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    _frames: Callable[[], Iterator[Frame]] = field(default=lambda: iter(()), repr=False, compare=False)

    def __iter__(self) -> Iterator[Frame]:
        return self._frames()


def open_video(path: str | Path, fps: float | None = None, filtered: bool = True) -> Video:
    """Open a video file (whatever PyAV or OpenCV decode) or a folder of pictures (`fps`, or 30 if not given).

    Not `filtered`, B pictures are left as they are before the codec's loop filter, which smooths the rims of blocks: that is
    quicker, a bob is found on them as well, and no I or P picture is drawn from them.

    Raises JobError where there is nothing to decode: missing, empty, not a video, broken, no picture in it.
    """
    path = Path(path)
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise UsageError(f"fps must be a positive number, got {fps}")
    if not path.exists():
        raise JobError(f"video {path} does not exist; check the name")
    if path.is_dir():
        return _open_pictures(path, fps)
    if path.stat().st_size == 0:
        raise JobError(f"video {path} is empty (0 bytes); copy it from the phone again")
    try:
        import av
    except ImportError:
        return _open_opencv(path)
    try:
        return _open_pyav(path, filtered)
    except JobError:
        raise
    except (av.error.FFmpegError, OSError, ValueError, IndexError, EOFError) as error:  # the fallback decides
        try:
            return _open_opencv(path)
        except JobError:
            raise JobError(f"{path} cannot be read as a video ({_one_line(error)}); {_REMEDY}") from error


_REMEDY = "record it again or convert it to mp4 (H.264)"


def _one_line(error: BaseException) -> str:
    text = str(getattr(error, "strerror", "") or error).strip().splitlines()
    return text[0] if text else type(error).__name__


# --- PyAV ---------------------------------------------------------------------------------------------------------


def _open_pyav(path: Path, filtered: bool) -> Video:
    import av

    with av.open(str(path)) as container:
        if not container.streams.video:
            raise JobError(f"{path} holds no video stream; give a video file")
        stream = container.streams.video[0]
        metadata = {str(k): str(v) for k, v in {**container.metadata, **stream.metadata}.items()}
        fps = float(stream.average_rate) if stream.average_rate else None
        first = next(iter(container.decode(stream)), None)  # a header alone proves nothing
        if first is None:
            raise JobError(f"{path} holds no frame that can be decoded; {_REMEDY}")
        rotation = _rotation(first, metadata)
        size = (first.width, first.height) if rotation % 180 == 0 else (first.height, first.width)
        stamped = first.pts is not None
        full = int(getattr(first, "color_range", 0) or 0) == 2 or first.format.name.startswith("yuvj")
        codec = stream.codec_context.name
        tick = float(stream.time_base) if stream.time_base else 0.0
        seconds = float(stream.duration * stream.time_base) if stream.duration and stream.time_base else None
        if seconds is None and container.duration:
            seconds = container.duration / 1e6
        if seconds:
            metadata["duration_s"] = f"{seconds:.6g}"
    warnings = (
        []
        if stamped
        else [said("video.no_stamps", "the file has no time stamps; frame number / frame rate is used instead")]
    )
    return Video(
        path=path,
        width_px=size[0],
        height_px=size[1],
        fps_header=fps,
        codec=codec,
        time_source="pts" if stamped else "frame rate",
        rotation_deg=rotation,
        full_range=full,
        tick_s=tick,
        metadata=metadata,
        warnings=tuple(warnings),
        _frames=lambda: _decode_pyav(path, rotation, fps, filtered),
    )


def _rotation(frame: Any, metadata: Mapping[str, str]) -> int:
    """Degrees, counter-clockwise, by which the picture is to be turned to stand upright."""
    turn = getattr(frame, "rotation", None)
    if turn is None:
        try:
            turn = -int(float(metadata.get("rotate", "0")))
        except ValueError:
            turn = 0
    return round(turn / 90) * 90 % 360


def _decode_pyav(path: Path, rotation: int, fps: float | None, filtered: bool) -> Iterator[Frame]:
    import av

    turns = rotation // 90
    first: float | None = None
    index = 0
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        stream.codec_context.thread_count = min(os.cpu_count() or 1, _MOST_THREADS)
        if not filtered:
            stream.codec_context.options = {**stream.codec_context.options, "skip_loop_filter": "bidir"}
        base = float(stream.time_base) if stream.time_base else 0.0
        frames = iter(container.decode(stream))
        while True:
            try:
                picture = next(frames, None)
            except av.error.FFmpegError as error:
                if index < 2:
                    raise JobError(
                        f"{path} breaks off after {index} frame(s) ({_one_line(error)}); {_REMEDY}"
                    ) from error
                return  # the frames before the damage are good; the loss shows in the number of frames
            if picture is None:
                return
            stamp = index / (fps or 30.0) if picture.pts is None else picture.pts * base
            if first is None:
                first = stamp
            luma = _luma(picture)
            upright = np.rot90(luma, turns) if turns else luma
            yield Frame(index, stamp - first, upright, _colour_of(picture, turns), int(picture.pict_type))
            index += 1


def _luma(picture: Any) -> np.ndarray:
    name = picture.format.name
    if _LUMA_FIRST.match(name):
        plane = picture.planes[0]
        rows = np.frombuffer(plane, np.uint8)[: plane.height * plane.line_size].reshape(plane.height, plane.line_size)
        return rows[:, : plane.width]
    deep = _DEEP_LUMA.match(name)
    if deep:
        plane = picture.planes[0]
        wide = np.frombuffer(plane, np.uint16).reshape(plane.height, plane.line_size // 2)[:, : plane.width]
        bits = int(deep.group(1))
        return np.minimum((wide.astype(np.uint32) + (1 << (bits - 9))) >> (bits - 8), 255).astype(np.uint8)
    return np.ascontiguousarray(picture.to_ndarray(format="gray"))


def _colour_of(picture: Any, turns: int) -> Callable[[str], Any]:
    def colour(kind: str) -> Any:
        if kind == "bgr":
            return np.ascontiguousarray(np.rot90(picture.to_ndarray(format="bgr24"), turns))
        name = picture.format.name
        if name.startswith("gray"):
            return None
        source = picture if re.match(r"^yuvj?4\d\dp$", name) else picture.reformat(format="yuv444p")
        planes = []
        for plane in (source.planes[1], source.planes[2]):
            rows = np.frombuffer(plane, np.uint8)[: plane.height * plane.line_size]
            planes.append(np.rot90(rows.reshape(plane.height, plane.line_size)[:, : plane.width], turns))
        return planes[0], planes[1]

    return colour


# --- OpenCV and pictures ------------------------------------------------------------------------------------------


def _opencv_capture(path: Path) -> Any:
    """OpenCV's reader, told to keep its decoder's own complaints off the screen: ours is one line."""
    import os

    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    import cv2

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    return cv2.VideoCapture(str(path))


def _open_opencv(path: Path) -> Video:
    import cv2

    capture = _opencv_capture(path)
    good, picture = capture.read()
    fps = capture.get(cv2.CAP_PROP_FPS)
    capture.release()
    if not good:
        raise JobError(f"{path} cannot be read as a video; {_REMEDY}")
    return Video(
        path=path,
        width_px=picture.shape[1],
        height_px=picture.shape[0],
        fps_header=fps if fps > 0 else None,
        codec="opencv",
        time_source="opencv",
        full_range=True,
        _frames=lambda: _decode_opencv(path),
    )


def _decode_opencv(path: Path) -> Iterator[Frame]:
    import cv2

    capture = _opencv_capture(path)
    try:
        first, index = None, 0
        while True:
            good, picture = capture.read()
            if not good:
                return
            stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
            first = stamp if first is None else first
            yield _from_bgr(index, stamp - first, picture)
            index += 1
    finally:
        capture.release()


def _open_pictures(folder: Path, fps: float | None) -> Video:
    import cv2

    names = sorted((p for p in folder.iterdir() if p.suffix.lower() in _PICTURES), key=_natural)
    if not names:
        raise JobError(f"{folder} is a folder without pictures; give a video file or a folder of numbered pictures")
    picture = cv2.imread(str(names[0]))
    if picture is None:
        raise JobError(f"{names[0]} cannot be read as a picture; save the frames as PNG")
    rate = fps or 30.0
    assumed = said("video.pictures", "pictures carry no time stamps: 30 frames per second is assumed")
    return Video(
        path=folder,
        width_px=picture.shape[1],
        height_px=picture.shape[0],
        fps_header=rate,
        codec="pictures",
        time_source="pictures",
        full_range=True,
        warnings=() if fps else (assumed,),
        _frames=lambda: _read_pictures(names, rate, picture.shape),
    )


def _natural(path: Path) -> list[tuple[int, int | str]]:
    return [(0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", path.name) if part]


def _read_pictures(names: list[Path], rate: float, shape: tuple[int, ...]) -> Iterator[Frame]:
    import cv2

    for index, name in enumerate(names):
        picture = cv2.imread(str(name))
        if picture is None or picture.shape != shape:
            raise JobError(f"{name} is not a picture of {shape[1]}×{shape[0]} px like the first; leave it out")
        yield _from_bgr(index, index / rate, picture)


def _from_bgr(index: int, t_s: float, picture: np.ndarray) -> Frame:
    import cv2

    def colour(kind: str) -> Any:
        if kind == "bgr":
            return picture
        planes = cv2.cvtColor(picture, cv2.COLOR_BGR2YCrCb)
        return np.ascontiguousarray(planes[:, :, 2]), np.ascontiguousarray(planes[:, :, 1])

    return Frame(index, t_s, cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), colour)


# --- the clock ----------------------------------------------------------------------------------------------------


def clock_warnings(t_s: np.ndarray, video: Video) -> list[str]:
    """What is odd about the time stamps `t_s` (n,) of all decoded frames: sentences, none for a sound clock."""
    odd: list[str] = []
    if t_s.size < 3:
        return odd
    steps = np.diff(t_s)
    if np.all(steps == 0):
        equal = "all time stamps are equal: the clock of this file is broken; convert it with its frame rate set"
        return [said("video.equal_stamps", equal)]
    backwards = int(np.sum(steps <= 0))
    if backwards:
        odd.append(
            said(
                "video.backwards",
                "{count} time stamps do not increase: the clock of this file is suspicious",
                count=backwards,
            )
        )
    forward = steps[steps > 0]
    typical = float(np.median(forward))
    jumps = np.flatnonzero(steps > 1.5 * typical)
    if jumps.size > 0.2 * steps.size:
        odd.append(
            said(
                "video.varying_rate",
                "the frame rate varies (steps of {shortest_ms:.1f} to {longest_ms:.1f} ms); the true time stamps are used",
                shortest_ms=1e3 * float(forward.min()),
                longest_ms=1e3 * float(forward.max()),
            )
        )
    elif jumps.size:
        missing = int(np.round(steps[jumps] / typical - 1).sum())
        odd.append(
            said(
                "video.missing_frames",
                "{missing} frame(s) are missing at {places} place(s), first at t = {t_s:.3f} s; the time stamps account for them",
                missing=missing,
                places=int(jumps.size),
                t_s=float(t_s[jumps[0]]),
            )
        )
    fps = 1 / typical
    mean = (t_s.size - 1) / (t_s[-1] - t_s[0])
    claimed = video.fps_header
    # a header may count one frame more or less over the same time
    if (
        claimed
        and video.time_source == "pts"
        and not jumps.size
        and abs(claimed / mean - 1) > max(1e-3, 1.1 / t_s.size)
    ):
        odd.append(
            said(
                "video.header_rate",
                "the header claims {claimed_hz:.4f} frames per second, the time stamps give {mean_hz:.4f}: times follow the "
                "stamps; if the header were right, all times would differ by {share:+.2%}",
                claimed_hz=float(claimed),
                mean_hz=float(mean),
                share=float(mean / claimed - 1),
            )
        )
    capture = _capture_fps(video.metadata)
    if capture and capture > 1.2 * fps:
        odd.append(
            said(
                "video.slow_motion",
                "slow motion: recorded at {capture_hz:g} frames per second and stored at {fps:.4g}; "
                "give --fps-factor {factor:.4g} to restore true time",
                capture_hz=capture,
                fps=fps,
                factor=capture / fps,
            )
        )
    return odd


def _capture_fps(metadata: Mapping[str, str]) -> float | None:
    try:
        return float(metadata["com.android.capture.fps"])
    except (KeyError, ValueError):
        return None

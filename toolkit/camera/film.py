"""Film: frames in, a video file (or a folder of pictures) out."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import numpy as np

from toolkit.errors import JobError, UsageError

_ENCODERS = {"h264": "libx264", "hevc": "libx265", "mjpeg": "mjpeg"}
_PRESETS = {
    ("h264", "least"): "ultrafast",
    ("h264", "quick"): "superfast",
    ("h264", "thorough"): "medium",
    ("hevc", "quick"): "ultrafast",
    ("hevc", "thorough"): "fast",
}
_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi")
_CLOCK = 90_000  # ticks a second of films whose frames are not evenly spaced


class Film:
    """Writes frames (h, w, 3) uint8, red green blue, in the order of their time stamps. A context manager.

    path : .mp4, .mov, .mkv, .avi, or a name without a suffix for a folder of PNG files.
    fps : the frame rate, exact.    even : stamps are whole multiples of 1/fps.
    codec : the parameters of [camera.codec]; lossless is FFV1 in .mkv and .avi, H.264 at qp 0 in .mp4 and .mov,
    both with full colour. Raises UsageError for a suffix or a size that the codec cannot hold.
    """

    def __init__(
        self, path: Path, width_px: int, height_px: int, fps: Fraction, codec: dict[str, Any], even: bool = True
    ) -> None:
        self.path, self._written = Path(path), 0
        self._container: Any = None
        if not self.path.suffix:
            self.path.mkdir(parents=True)
            return
        import av

        suffix = self.path.suffix.lower()
        if suffix not in _SUFFIXES:
            raise UsageError(f"cannot write a video as {suffix}; use {', '.join(_SUFFIXES)} or a folder's name")
        if suffix == ".avi" and codec.get("name") == "hevc":
            raise UsageError(".avi cannot hold HEVC; use .mp4, .mov or .mkv")
        name, options, pixels = _encoder(codec, suffix)
        if pixels == "yuv420p" and (width_px % 2 or height_px % 2):
            raise UsageError(
                f"{codec.get('name', 'h264')} needs an even width and height, got {width_px} x {height_px}; "
                'use even numbers or [camera.codec] name = "lossless"'
            )
        if suffix == ".avi" and not even:
            raise UsageError(".avi holds evenly spaced frames only; use .mp4, .mov or .mkv for a variable frame rate")
        self._tick = 1 / fps if even else Fraction(1, _CLOCK)
        try:
            self._container = av.open(str(self.path), "w")
            stream: Any = self._container.add_stream(name, rate=fps, options=options)
            stream.width, stream.height, stream.pix_fmt = width_px, height_px, pixels
            stream.time_base = stream.codec_context.time_base = self._tick
            stream.codec_context.thread_count = 2  # the file must not depend on the number of cores
            if codec.get("bit_rate_bit_per_s"):
                stream.bit_rate = round(codec["bit_rate_bit_per_s"])
            if name == "libx265":
                stream.codec_context.codec_tag = (
                    "hvc1" if suffix in (".mp4", ".mov") else stream.codec_context.codec_tag
                )
        except av.FFmpegError as error:
            raise JobError(f"cannot write {self.path.name} with {name}: {error}; try another codec") from error
        self._stream = stream

    def write(self, frame: np.ndarray, stamp_s: float) -> None:
        """Append one frame that is shown at stamp_s."""
        if self._container is None:
            import cv2

            cv2.imwrite(str(self.path / f"{self._written:06d}.png"), frame[:, :, ::-1])
        else:
            import av

            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), "rgb24")
            picture.pts, picture.time_base = round(stamp_s / self._tick), self._tick
            self._container.mux(self._stream.encode(picture))
        self._written += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *rest: object) -> None:
        if self._container is None:
            return
        if kind is None:
            self._container.mux(self._stream.encode())
        self._container.close()


def _encoder(codec: dict[str, Any], suffix: str) -> tuple[str, dict[str, str], str]:
    name = codec.get("name", "h264")
    interval = str(round(codec.get("keyframe_interval", 60)))
    rated, crf = bool(codec.get("bit_rate_bit_per_s")), str(codec.get("crf", 18))
    if name == "lossless" and suffix in (".mp4", ".mov"):
        return "libx264", {"qp": "0", "preset": "ultrafast", "g": interval}, "yuv444p"
    if name == "lossless":
        return "ffv1", {"coder": "0", "context": "0"}, "yuv444p"
    if name == "mjpeg":
        return "mjpeg", {} if rated else {"qmin": "2", "qmax": "3"}, "yuvj420p"
    options = {"g": interval, "preset": _PRESETS[name, codec.get("effort", "quick")]}
    if name == "h264":
        options["x264-params"] = "mbtree=0"  # with it, small pictures are not encoded the same way twice
    if name == "hevc":
        options["x265-params"] = "log-level=none:pools=2:frame-threads=1"
    if suffix == ".avi":
        options["bf"] = "0"  # AVI has no stamps to put reordered frames right
    if not rated:
        options["crf"] = crf
    return _ENCODERS[name], options, "yuv420p"

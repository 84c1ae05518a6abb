"""Clips as phones and programs write them: lying on their side with a display matrix, deep, cut off, damaged."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from toolkit.track import track

av = pytest.importorskip("av")
pytest.importorskip("cv2")

from test_track import FPS, LENGTH, PIVOT, angles, draw  # noqa: E402

TIMES = np.arange(90) / FPS


@pytest.fixture(scope="module")
def swing():
    """Upright frames (90, 240, 320) uint8, and the bob's true places."""
    theta = angles(TIMES)
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    rng = np.random.default_rng(4)
    return np.array([draw(a, b, rng) for a, b in zip(x, y)]), x, y


def write(path: Path, frames: np.ndarray) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=round(FPS))
        stream.height, stream.width = frames.shape[1:]
        stream.pix_fmt, stream.options = "yuv420p", {"crf": "10", "preset": "veryfast"}
        for picture in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="gray")))
        container.mux(stream.encode())
    return path


def lay(path: Path, degrees: int) -> None:
    """Make the file say that its pictures are to be turned by so much, clockwise: the matrix in its track header (ISO
    14496-12, 8.3.2)."""
    content = bytearray(path.read_bytes())
    head = content.find(b"tkhd") + 4
    matrix = head + (40 if content[head] == 0 else 52)
    c, s = round(np.cos(np.radians(degrees))) << 16, round(np.sin(np.radians(degrees))) << 16
    assert struct.unpack_from(">9i", content, matrix) == (1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30)
    struct.pack_into(">9i", content, matrix, c, s, 0, -s, c, 0, 0, 0, 1 << 30)
    path.write_bytes(content)


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_a_picture_that_lies_on_its_side_is_tracked_upright(swing, tmp_path, degrees: int):
    frames, x, y = swing
    path = write(tmp_path / "lies.mp4", np.rot90(frames, degrees // 90, axes=(1, 2)))
    lay(path, degrees)
    found = track(path)
    assert (found.meta["width_px"], found.meta["height_px"]) == (320, 240)
    assert found.ok.all()
    errors = np.concatenate([found.x_px - x, found.y_px - y])
    assert np.sqrt(np.mean(errors**2)) < 0.05

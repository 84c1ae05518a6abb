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


@pytest.mark.parametrize("released", [1.2, 2.8])
def test_a_hand_in_the_picture_holds_the_bob_and_lets_go(tmp_path, released):
    """For most of what the search looks at, or all of it, its fingers over the bob; then it goes away to the right."""
    rng = np.random.default_rng(5)
    t = np.arange(int((released + 6.1) * FPS)) / FPS
    held = t < released
    theta = np.interp(t - released, t, angles(t)) + held * np.convolve(
        rng.normal(0, 0.003, t.size), np.ones(9) / 3, "same"
    )
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    away = np.where(held, 0.0, 300 * (t - released))
    rows, columns = np.mgrid[0:240, 0:320]
    frames = []
    for a, b, far, hold in zip(x, y, away, held):
        frame = draw(a, b, rng)
        hx, hy = (a, b) if hold else (x[0] + far, y[0] + 0.5 * far)
        arm = (columns > hx + 14) & (np.abs(rows - hy - 0.4 * (columns - hx)) < 18)
        fingers = (np.abs(np.abs(rows - hy) - 8) < 4) & (columns > hx - 5) & (columns < hx + 25)
        frame[arm | fingers] = np.clip(150 + rng.normal(0, 1.5, int((arm | fingers).sum())), 0, 255)
        frames.append(frame)
    found = track(write(tmp_path / "hand.mp4", np.array(frames)))
    swings = t > released + 0.1
    assert found.frame.size == t.size
    assert found.ok[swings].mean() > 0.97
    assert not found.ok[t < released - 0.1].any()
    assert np.sqrt(np.mean(np.square([found.x_px - x, found.y_px - y])[:, found.ok])) < 0.05
    assert "track.released" in [getattr(line, "key", "") for line in found.meta["log"]]
    assert not found.meta["warnings"]

"""Frames, their times, and what is wrong with files."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from toolkit.errors import JobError
from toolkit.video import clock_warnings, open_video

av = pytest.importorskip("av")


def write(path, count=20, size=(64, 48), codec="libx264", pixels="yuv420p", stamps=None, base=600, options=None):
    """A clip whose frame i has the level 40 + 5 i, at stamps[i]/base seconds."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=Fraction(30))
        stream.width, stream.height, stream.pix_fmt = *size, pixels
        stream.options = options or ({"crf": "4"} if "x26" in codec else {})
        stream.time_base = stream.codec_context.time_base = Fraction(1, base)
        for i in range(count):
            picture = np.full((size[1], size[0], 3), 40 + 5 * i, np.uint8)
            picture[:, : size[0] // 4] = 250  # the left is bright: which way up it is can be seen
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(format=pixels)
            frame.pts, frame.time_base = (stamps[i] if stamps else i * base // 30), Fraction(1, base)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def test_without_the_loop_filter_no_picture_changes_from_which_others_are_drawn(tmp_path):
    rng = np.random.default_rng(2)
    wall = rng.uniform(60, 190, (12, 16)).repeat(16, axis=0).repeat(16, axis=1)
    with av.open(str(tmp_path / "v.mkv"), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(30))
        stream.width, stream.height, stream.pix_fmt, stream.options = 256, 192, "yuv420p", {"crf": "34", "bf": "3"}
        for i in range(40):
            grey = np.clip(np.roll(wall, 3 * i, axis=1) + rng.normal(0, 3, wall.shape), 0, 255).astype(np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(grey, format="gray").reformat(format="yuv420p")))
        container.mux(stream.encode())
    whole, bare = (list(open_video(tmp_path / "v.mkv", filtered=filtered)) for filtered in (True, False))
    assert [f.t_s for f in whole] == [f.t_s for f in bare]
    changed = np.array([np.any(a.luma != b.luma) for a, b in zip(whole, bare)])
    between = np.array([frame.kind == 3 for frame in whole])  # B pictures
    assert changed[between].mean() > 0.5
    assert not changed[~between].any()


@pytest.mark.parametrize(
    ("suffix", "codec", "pixels"),
    [
        ("mp4", "libx264", "yuv420p"),
        ("mov", "libx264", "yuv420p"),
        ("mkv", "libx264", "yuv420p"),
        ("avi", "mjpeg", "yuvj420p"),
        ("mp4", "libx264", "yuv420p10le"),
        ("mkv", "ffv1", "yuv444p"),
        ("mp4", "libx265", "yuv420p"),
        ("webm", "libvpx", "yuv420p"),
    ],
)
def test_containers_and_codecs(tmp_path, suffix, codec, pixels):
    try:
        path = write(tmp_path / f"a.{suffix}", codec=codec, pixels=pixels)
    except (av.error.FFmpegError, ValueError) as error:
        pytest.skip(f"this PyAV cannot write {codec}: {error}")
    video = open_video(path)
    frames = [(f.index, f.t_s, float(f.luma[:, 40:].mean()), f.luma.dtype, f.bgr[10, 40]) for f in video]
    assert (video.width_px, video.height_px) == (64, 48)
    assert [f[0] for f in frames] == list(range(20))
    assert np.allclose([f[1] for f in frames], np.arange(20) / 30, atol=6e-4)
    levels = np.array([f[2] for f in frames])
    assert np.all(np.diff(levels) > 2)  # grows by 5 in RGB, by 4.3 in limited range
    assert all(f[3] == np.uint8 for f in frames)
    assert np.allclose([f[4].mean() for f in frames], 40 + 5 * np.arange(20), atol=4)


def test_variable_stamps_are_kept(tmp_path):
    stamps = [0, 20, 40, 75, 95, 100, 160, 180, 200, 230]
    video = open_video(write(tmp_path / "v.mp4", 10, stamps=stamps))
    t = np.array([f.t_s for f in video])
    assert np.allclose(t, np.array(stamps) / 600, atol=1e-6)
    assert any("frame rate varies" in w for w in clock_warnings(t, video))


def test_pictures(tmp_path):
    import cv2

    for i in (1, 2, 10):
        cv2.imwrite(str(tmp_path / f"p{i}.png"), np.full((10, 12, 3), i * 10, np.uint8))
    (tmp_path / "notes.txt").write_text("not a picture")
    frames = list(open_video(tmp_path, fps=50))
    assert [int(f.luma[0, 0]) for f in frames] == [10, 20, 100]
    assert frames[2].t_s == pytest.approx(0.04)


def test_clocks(tmp_path):
    video = open_video(write(tmp_path / "c.mp4", 6))
    even = np.arange(50) / 30
    assert clock_warnings(even, video) == []
    assert "equal" in clock_warnings(np.zeros(9), video)[0]
    back = even.copy()
    back[10] = back[8]
    assert any("do not increase" in w for w in clock_warnings(back, video))
    lost = np.delete(even, [20, 21])
    assert any("2 frame(s) are missing" in w for w in clock_warnings(lost, video))


def test_slow_motion_is_seen_in_the_metadata(tmp_path):
    import dataclasses

    video = open_video(write(tmp_path / "s.mp4", 6))
    slow = dataclasses.replace(video, metadata={"com.android.capture.fps": "240.0"})
    assert "--fps-factor 8" in clock_warnings(np.arange(30) / 30, slow)[0]


def broken(tmp_path, kind):
    path = tmp_path / "x.mp4"
    if kind == "missing":
        return path
    if kind == "folder":
        return tmp_path
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "text":
        path.write_text("t_s,theta\n0,1\n" * 50)
    else:
        write(path, 40)
        path.write_bytes(path.read_bytes()[:400])
    return path


@pytest.mark.parametrize("kind", ["missing", "folder", "empty", "text", "truncated"])
def test_what_is_no_video(tmp_path, kind):
    with pytest.raises(JobError) as caught:
        list(open_video(broken(tmp_path, kind)))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) > 30

"""The overlay: drawn where the track says, on any size, with any pivot."""

from __future__ import annotations

from dataclasses import replace

import av
import numpy as np
import pytest

from toolkit import JobError, UsageError, render
from toolkit.overlay import write_overlay
from toolkit.scene import Scene
from toolkit.track import Track


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A rendered clip and a track made of its truth."""

    def film(width: int, height: int, pivot: list[float]):
        table = {
            "pendulum": {"length_m": 0.5, "bob_radius_m": 0.05, "mass_kg": 0.1},
            "release": {"theta0_rad": 0.4},
            "camera": {
                "width_px": width, "height_px": height, "fps": 25, "duration_s": 0.8, "px_per_m": 200,
                "pivot_px": pivot, "codec": {"name": "lossless"},
            },
        }  # fmt: skip
        path = tmp_path_factory.mktemp("film") / "film.mkv"
        truth = render(Scene.from_dict(table), path)
        n = truth.frame.size
        status = np.array(["ok"] * n, dtype="<U9")
        status[8:11] = "predicted"
        sigma = np.full(n, 0.02)
        return path, Track(
            truth.frame,
            truth.stamp_s,
            truth.x_px,
            truth.y_px,
            sigma,
            sigma,
            status,
            10.0,
            tuple(pivot),
            (0.1, 0.1),
            "disc",
        )

    return film


def decode(path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        assert container.streams.video[0].codec_context.pix_fmt == "yuv420p"
        assert container.streams.video[0].codec_context.name == "h264"
        return [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]


@pytest.mark.parametrize(("width", "height", "pivot"), [(160, 140, [80.0, 20.0]), (161, 99, [70.0, -35.0])])
def test_marks_stand_where_the_track_says(tmp_path, filmed, width, height, pivot):
    path, track = filmed(width, height, pivot)
    out = write_overlay(path, track, tmp_path / "overlay.mp4")
    frames = decode(out)
    assert len(frames) == track.frame.size
    assert frames[0].shape == ((height + 1) // 2 * 2, (width + 1) // 2 * 2, 3)
    for row in (0, 9, 15):
        # the ring's colour, red minus blue: ok is greenish, predicted yellow
        angle = np.linspace(0, 2 * np.pi, 60)
        x = np.round(track.x_px[row] + track.radius_px * np.sin(angle)).astype(int)
        y = np.round(track.y_px[row] + track.radius_px * np.cos(angle)).astype(int)
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height - 20)
        ring = np.median(frames[row][y[inside], x[inside]].astype(int), axis=0)
        assert ring[1] > ring[2] + 25  # green over blue in both
        assert (ring[0] > 150) == (track.status[row] == "predicted")


def test_the_caption_does_not_lie_on_the_bob(tmp_path, filmed):
    """Where the bob swings through the picture's last rows the caption is at the top: the bob is as bright as in the film."""
    path, track = filmed(160, 140, [80.0, 20.0])
    with av.open(str(path)) as film:
        source = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    row = int(np.argmax(track.y_px))
    assert track.y_px[row] + track.radius_px > 140 - 20
    angle = np.linspace(0, 2 * np.pi, 60)
    x, y = (
        (track.x_px[row] + 5 * np.sin(angle)).round().astype(int),
        (track.y_px[row] + 5 * np.cos(angle)).round().astype(int),
    )
    drawn = decode(write_overlay(path, track, tmp_path / "overlay.mp4"))[row]
    assert np.median(drawn[y, x]) == pytest.approx(np.median(source[row][y, x]), abs=12)
    assert drawn[2:18].mean() < 0.6 * source[row][2:18].mean()  # the caption's band


def test_lost_frames_and_the_model(tmp_path, filmed):
    path, track = filmed(160, 140, [80.0, 20.0])
    x, y, status = track.x_px.copy(), track.y_px.copy(), track.status.copy()
    x[4:7] = y[4:7] = np.nan
    status[4:7] = "lost"
    track = replace(track, x_px=x, y_px=y, status=status)
    theta = np.arctan2(x - 80.0, y - 20.0) + 0.3  # its zero is elsewhere: that must not matter
    for model in (theta, theta[status == "ok"]):
        frames = decode(write_overlay(path, track, tmp_path / "overlay.mp4", model))
        row = 12  # the arm of the cross beside the bob is purple
        mark = frames[row][round(y[row]), round(x[row] + track.radius_px + 3)].astype(int)
        assert mark[0] > mark[1] + 30
    with pytest.raises(UsageError, match="one value a frame"):
        write_overlay(path, track, tmp_path / "overlay.mp4", theta[:3])


def test_another_video_is_refused_and_nothing_is_left(tmp_path, filmed):
    path, track = filmed(160, 140, [80.0, 20.0])
    with pytest.raises(JobError, match="none of the frames"):
        write_overlay(path, replace(track, frame=track.frame + 1000), tmp_path / "out" / "overlay.mp4")
    assert not (tmp_path / "out").exists()
    with pytest.raises(UsageError, match=r"\.mp4"):
        write_overlay(path, track, tmp_path / "overlay")

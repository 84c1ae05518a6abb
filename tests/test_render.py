"""Films on disk: what is decoded is what was drawn, with the stamps and the truth that belong to it."""

from __future__ import annotations

from fractions import Fraction

import av
import cv2
import numpy as np
import pandas as pd
import pytest

from toolkit import JobError, UsageError, render
from toolkit.render import exact_frame_rate, stage, truth_path
from toolkit.scene import Scene


def scene(fps: float = 30, width: int = 160, height: int = 120, **effects) -> Scene:
    return Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.05, "length_m": 0.5, "bob_radius_m": 0.03},
            "release": {"theta0_rad": 0.5},
            "camera": {
                "width_px": width,
                "height_px": height,
                "fps": fps,
                "duration_s": 0.5,
                "px_per_m": 180,
                "pivot_px": [80.0, 10.0],
                **effects,
            },
        }
    )


def decode(path) -> tuple[list[np.ndarray], np.ndarray]:
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
    stamps = np.array([float(f.pts * f.time_base) for f in frames])
    return [f.to_ndarray(format="rgb24") for f in frames], stamps - stamps[0]


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv", ".avi"])
@pytest.mark.parametrize("codec", ["h264", "hevc", "mjpeg", "lossless"])
def test_every_codec_in_every_container(tmp_path, suffix, codec):
    film = tmp_path / f"film{suffix}"
    if (codec, suffix) == ("hevc", ".avi"):
        with pytest.raises(UsageError, match=r"\.mkv"):
            render(scene(codec={"name": codec}), film)
        return
    truth = render(scene(codec={"name": codec}), film)
    frames, stamps = decode(film)
    assert len(frames) == truth.frame.size == 15
    np.testing.assert_allclose(stamps, np.arange(15) / 30, atol=6e-4)
    drawn = list(stage(scene()).frames())
    worst = {"lossless": 3, "h264": 40, "hevc": 40, "mjpeg": 40}[codec]  # 8-bit luma and chroma cost ±2 levels
    for shown, made in zip(frames, drawn):
        assert np.abs(shown.astype(int) - made).max() <= worst
        assert np.abs(shown.astype(int) - made).mean() < 1.5
    assert {p.name for p in tmp_path.iterdir()} == {"film.truth.csv", film.name}


def test_a_folder_of_pictures_is_exact(tmp_path):
    truth = render(scene(), tmp_path / "stills")
    pictures = sorted((tmp_path / "stills").iterdir())
    assert len(pictures) == truth.frame.size
    for path, made in zip(pictures, stage(scene()).frames()):
        np.testing.assert_array_equal(cv2.imread(str(path))[:, :, ::-1], made)
    assert (tmp_path / "stills.truth.csv").is_file()


def test_the_truth_beside_the_video(tmp_path):
    truth = render(scene(motion_blur={}), tmp_path / "film.mp4")
    assert truth_path(tmp_path / "film.mp4") == tmp_path / "film.truth.csv"
    table = pd.read_csv(tmp_path / "film.truth.csv")
    assert list(table.columns) == ["frame", "t_s", "theta_rad", "x_px", "y_px"]
    for name in table.columns:
        np.testing.assert_array_equal(table[name], getattr(truth, name))  # to the last bit
    np.testing.assert_allclose(np.arctan2(table.x_px - 80, table.y_px - 10), table.theta_rad, atol=1e-4)


def test_the_same_scene_gives_the_same_file(tmp_path):
    busy = scene(sensor_noise={}, hand_shake={}, texture={}, dropped_frames={})
    for name in ("a.mp4", "b.mp4"):
        render(busy, tmp_path / name)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    assert (tmp_path / "a.truth.csv").read_text() == (tmp_path / "b.truth.csv").read_text()


@pytest.mark.parametrize(
    ("fps", "exact"),
    [
        (29.97, Fraction(30000, 1001)),
        (59.94, Fraction(60000, 1001)),
        (23.976, Fraction(24000, 1001)),
        (60, Fraction(60)),
        (12.5, Fraction(25, 2)),
        (239.76, Fraction(240000, 1001)),
    ],
)
def test_frame_rates_are_exact(fps, exact):
    assert exact_frame_rate(fps) == exact


def test_broadcast_rate_and_its_stamps(tmp_path):
    truth = render(scene(fps=29.97), tmp_path / "film.mp4")
    with av.open(str(tmp_path / "film.mp4")) as container:
        assert container.streams.video[0].average_rate == Fraction(30000, 1001)
        stamps = [f.pts * f.time_base for f in container.decode(video=0)]
    assert stamps == [Fraction(1001 * i, 30000) for i in range(len(stamps))]
    np.testing.assert_allclose(truth.t_s, [float(s) for s in stamps], atol=1e-12)


@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
def test_variable_frame_rate_keeps_its_stamps(tmp_path, suffix):
    film = tmp_path / f"film{suffix}"
    truth = render(scene(variable_frame_rate={"jitter_s": 0.006}, dropped_frames={"fraction": 0.2}), film)
    _, stamps = decode(film)
    assert stamps.size == truth.frame.size
    np.testing.assert_allclose(stamps, truth.stamp_s, atol=6e-4)  # mkv counts milliseconds
    assert np.diff(stamps).std() > 0.003


def test_a_bit_rate_is_kept(tmp_path):
    noisy = {"sensor_noise": {"read_sigma": 8.0}, "width": 320, "height": 240}
    sizes = []
    for rate in (200_000, 1_600_000):
        render(scene(codec={"name": "h264", "bit_rate_bit_per_s": rate}, **noisy), tmp_path / "film.mp4")
        sizes.append((tmp_path / "film.mp4").stat().st_size)
    assert sizes[1] > 2.5 * sizes[0]


@pytest.mark.parametrize(
    ("made", "name", "says"),
    [
        (scene(), "film.xyz", "folder's name"),
        (scene(width=161), "film.mp4", "even"),
        (scene(variable_frame_rate={}), "film.avi", "evenly spaced"),
        (Scene(), "film.mp4", r"\[camera\]"),
        (scene().with_(pendulum=Scene().pendulum), "film.mp4", "length_m and bob_radius_m"),
    ],
)
def test_what_cannot_be_rendered_is_refused_and_leaves_nothing(tmp_path, made, name, says):
    with pytest.raises((UsageError, JobError), match=says):
        render(made, tmp_path / "new" / name)
    assert not (tmp_path / "new").exists()


def test_odd_sizes_without_subsampling(tmp_path):
    render(scene(width=161, height=119, codec={"name": "lossless"}), tmp_path / "film.mkv")
    frames, _ = decode(tmp_path / "film.mkv")
    assert frames[0].shape == (119, 161, 3)


def test_an_interrupted_film_leaves_nothing(tmp_path):
    def stop(stage: str, fraction: float) -> None:
        if fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render(scene(), tmp_path / "out" / "film.mp4", progress=stop)
    assert not (tmp_path / "out").exists()

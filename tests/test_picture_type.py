"""Error bars of pictures that a codec coded in different ways, against scatter made up here and a film whose truth is known."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from toolkit.tracking.clip.bars import Bars
from toolkit.tracking.clip.picture_type import factors_of_types
from toolkit.tracking.clip.places import Places

N = 480
T = np.arange(N) / 60
KIND = np.array([1 if k % 60 == 0 else 2 if k % 3 == 0 else 3 for k in range(N)])
TRUE = np.array([np.nan, 0.4, 0.8, 1.2])[KIND]
MOTION = np.array([200 * np.sin(5 * T), 20 * np.cos(10 * T)])
VELOCITY = np.array([1000 * np.cos(5 * T), -200 * np.sin(10 * T)])


class NoShake:
    """A camera that stood still, as far as could be seen."""

    taken = by_string = False
    x = y = sigma = np.zeros(N)


class Taken(NoShake):
    """One that shook, by 3 px, which was measured to 0.1 px and taken away."""

    taken = True
    x, y = 2 * np.sqrt(2) * np.sin(np.outer([9.0, 13.0], T)) + np.sin(np.outer([29.0, 25.0], T))
    sigma = np.full(N, 0.1)


def bars(error, kind=KIND, shake=NoShake, time_sigma_s=0.0):
    """Of places with these errors (2, n) whose localiser states 0.02 px."""
    one, yes = np.full(N, 0.02), np.ones(N, bool)
    places = Places(T, *(MOTION + error), one, one, yes, ~yes, kind)
    return Bars(places, shake(), VELOCITY, time_sigma_s, 0.01, 0.1).about(*MOTION)


def stds(found, error, kind=KIND):
    """Of error/σ, by type, both axes together."""
    ratio = error / np.array([found.sigma_x_px, found.sigma_y_px])
    return [float(np.sqrt(np.mean(ratio[:, kind == k] ** 2))) for k in (1, 2, 3)]


@pytest.mark.parametrize("beside", ["nothing", "clock", "shake"])
def test_each_type_of_picture_has_its_own_error_bars(beside):
    found = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        error = 0.03 * TRUE * rng.normal(size=(2, N))
        if beside == "nothing":
            told = bars(error)
        elif beside == "clock":  # stamps in whole milliseconds
            told = bars(error + VELOCITY * rng.uniform(-5e-4, 5e-4, N), time_sigma_s=1e-3 / np.sqrt(12))
        else:  # taken away with an error of its own, which is not the localiser's
            shake = 0.1 * rng.normal(size=(2, N))
            told = bars(
                error + shake, shake=type("Wrong", (Taken,), {"x": Taken.x - shake[0], "y": Taken.y - shake[1]})
            )
        found.append(stds(told, error))
    carried = 1.06 if beside == "shake" else 1.0  # a codec's errors are taken to be carried on, and these are not
    first, *others = carried * np.mean(found, axis=0)
    assert others == pytest.approx([1.0, 1.0], rel=0.1)
    assert (
        first == pytest.approx(1.0, rel=0.15) if beside != "shake" else 0.6 < first < 1.1
    )  # hardly told among its neighbours


def test_pictures_of_one_type_or_of_none_known_are_left_as_they_are():
    error = 0.03 * np.random.default_rng(0).normal(size=(2, N))
    plain = bars(error, kind=None)
    for kind in (np.ones(N, int), np.zeros(N, int)):
        found = bars(error, kind=kind)
        assert np.array_equal(found.sigma_x_px, plain.sigma_x_px)
        assert np.array_equal(found.sigma_y_px, plain.sigma_y_px)


def test_types_of_which_there_are_few_pictures_are_drawn_towards_what_is_usual():
    rng = np.random.default_rng(1)
    kind = np.full(200, 2)
    kind[:2] = 1
    own = (kind[:, None] == [1, 2]).astype(float)
    ratios = []
    for _ in range(300):
        squares = rng.normal(size=200) ** 2
        found = factors_of_types(kind, squares, own, np.zeros(200), 200)
        ratios.append(found[0] / found[-1])
    alone = np.std([np.log(np.sqrt(np.mean(rng.normal(size=2) ** 2))) for _ in range(300)])
    assert np.std(np.log(ratios)) < 0.7 * alone
    assert 1 / 1.4 < np.exp(np.mean(np.log(ratios))) < 1.0


def filmed(path, **camera):
    """The truth of a film of a pendulum, rendered into `path`."""
    pytest.importorskip("av")
    from toolkit import Scene, render

    size = {"width_px": 640, "height_px": 360, "fps": 60, "px_per_m": 500, "pivot_px": [320.3, 20.4], "seed": 5}
    scene = {
        "pendulum": {"mass_kg": 0.1, "length_m": 0.55, "bob_radius_m": 0.03},
        "release": {"theta0_rad": 0.4},
        "camera": {**size, **camera},
    }
    return render(Scene.from_dict(scene), path)


def test_error_bars_hold_for_the_types_of_a_film(tmp_path):
    film = tmp_path / "film.mkv"
    codec = {"name": "h264", "bit_rate_bit_per_s": 3e6, "keyframe_interval": 30}
    truth = filmed(film, duration_s=5.0, sensor_noise={"read_sigma": 2.0}, codec=codec)
    from toolkit import track
    from toolkit.video import open_video

    found = track(film)
    kind = np.array([frame.kind for frame in open_video(film)])
    ratio = np.array([(found.x_px - truth.x_px) / found.sigma_x_px, (found.y_px - truth.y_px) / found.sigma_y_px])
    ratio -= ratio[:, found.ok].mean(axis=1, keepdims=True)
    assert found.ok.all()
    for one in (1, 2, 3):
        assert np.sum(kind == one) >= 8
        assert np.sqrt(np.mean(ratio[:, kind == one] ** 2)) == pytest.approx(1.0, abs=0.3)


def test_without_the_loop_filter_the_bob_is_found_as_well(tmp_path, monkeypatch):
    """Coarsely coded, so that the filter has much to smooth."""
    film = tmp_path / "film.mkv"
    codec = {"name": "h264", "bit_rate_bit_per_s": 4e5}
    truth = filmed(film, duration_s=4.0, texture={"rms": 4.0, "scale_px": 8.0}, codec=codec)
    from toolkit import track
    from toolkit.video import open_video

    bare = track(film)
    monkeypatch.setattr(sys.modules[track.__module__], "open_video", lambda path, filtered: open_video(path))
    whole = track(film)
    both = bare.ok & whole.ok
    assert both.mean() > 0.95
    assert np.any(bare.x_px != whole.x_px)
    off_bare, off_whole = (np.hypot(f.x_px - truth.x_px, f.y_px - truth.y_px)[both] for f in (bare, whole))
    assert np.sqrt(np.mean(off_bare**2)) < 1.05 * np.sqrt(np.mean(off_whole**2))

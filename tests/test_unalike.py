"""Error bars of frames on which the bob is found better or worse, against scatter made up here and films whose truth is known."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from toolkit.tracking.clip.bars import Bars
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.unalike import relative_sigma, traits

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


def bars(error, kind=KIND, shake=NoShake, time_sigma_s=0.0, misfit=None, own=0.02, even=True):
    """Of places with these errors (2, n) whose localiser states 0.02 px, or its `own`."""
    one, yes = np.full(N, own), np.ones(N, bool)
    places = Places(T, *(MOTION + error), one, one, yes, ~yes, kind, misfit)
    return Bars(places, shake(), VELOCITY, time_sigma_s, 0.01, 0.1, even).about(*MOTION)


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


def alike_in(ratio, parts):
    """The mean square of error/σ (2, n), pooled over seeds, on each part of the frames over that on all: the roots."""
    square = np.mean(np.square(ratio), axis=(0, 1))
    return [float(np.sqrt(square[part].mean() / square.mean())) for part in parts]


def ratios(truth, seeds=8, **given):
    """error/σ (seeds, 2, n) of errors of this true σ (n,)."""
    found = []
    for seed in range(seeds):
        error = truth * np.random.default_rng(seed).normal(size=(2, N))
        told = bars(error, **given)
        found.append(error / [told.sigma_x_px, told.sigma_y_px])
    return np.array(found)


@pytest.mark.parametrize("beside", ["nothing", "shake"])
def test_a_codecs_coarse_pictures_have_larger_error_bars_though_less_of_them_is_unexplained(beside):
    rng = np.random.default_rng(3)
    misfit = 2.0 * np.exp(rng.uniform(-0.2, 0.2, N))
    stated = 0.01 * misfit  # a fit's σ goes with what it leaves unexplained
    truth = 0.03 * TRUE * (2.0 / misfit)
    shake = NoShake if beside == "nothing" else Taken
    ratio = ratios(truth, misfit=misfit, own=stated, shake=shake)
    halves = misfit < np.median(misfit), misfit >= np.median(misfit)
    assert alike_in(ratio, halves) == pytest.approx([1.0, 1.0], abs=0.07)
    plain = ratios(truth, own=stated, shake=shake)
    assert alike_in(plain, halves)[0] > 1.12


def test_a_codec_that_codes_each_picture_by_itself_leaves_the_misfit_its_word():
    misfit = 2.0 * np.exp(np.random.default_rng(3).uniform(-0.2, 0.2, N))
    ratio = ratios(0.015 * misfit, misfit=misfit, own=0.01 * misfit, kind=np.ones(N, int))
    assert alike_in(ratio, [misfit < 1.9, misfit > 2.1]) == pytest.approx([1.0, 1.0], abs=0.07)


@pytest.mark.parametrize("where", ["fast", "aside"])
def test_error_bars_are_larger_where_the_bob_is_found_worse(where):
    fast, right = np.hypot(*VELOCITY) > 700, MOTION[0] > 0
    part = fast if where == "fast" else right
    truth = np.where(part, 0.04, 0.03)
    ratio = ratios(truth, kind=None)
    assert alike_in(ratio, [part, ~part]) == pytest.approx([1.0, 1.0], abs=0.06)
    stated = 0.03 * np.random.default_rng(0).normal(size=(2, N))
    even = bars(stated, kind=None)
    assert np.ptp(even.sigma_x_px) < 0.2 * np.mean(even.sigma_x_px)  # and hardly, where it is not


def test_the_error_bars_of_an_outline_are_as_unlike_as_its_errors_are():
    """And no more, though its likelihood was steep on one frame and flat on another."""
    steep = np.exp(0.7 * np.random.default_rng(5).normal(size=N))
    ratio = ratios(np.full(N, 0.2), own=0.02 * steep, kind=None, even=False)
    thirds = np.split(np.argsort(steep), 3)
    assert alike_in(ratio, thirds) == pytest.approx([1.0, 1.0, 1.0], abs=0.25)
    true = ratios(0.1 * steep, own=0.02 * steep, kind=None, even=False)
    assert alike_in(true, thirds) == pytest.approx([1.0, 1.0, 1.0], abs=0.1)


def test_a_clock_beside_a_shake_is_not_the_localisers():
    """Stamps in whole milliseconds: they err along the motion, and across it as fast as the hand moves."""
    found = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        error, late = 0.03 * rng.normal(size=(2, N)), rng.uniform(-5e-4, 5e-4, N)
        seen, taken = (np.array([0 * T, 2 * np.sin(2 * np.pi * 4 * t)]) for t in (T + late, T))
        hand = type("Hand", (Taken,), {"x": taken[0], "y": taken[1]})
        told = bars(error + VELOCITY * late + seen - taken, None, hand, time_sigma_s=1e-3 / np.sqrt(12))
        found.append((told.x / 1.5, told.y / 1.5))
    # a codec's errors are taken to be carried on, and to be larger along the motion
    assert np.mean(found, axis=0) == pytest.approx([1.06 * np.exp(0.12), 1.06], abs=0.06)
    assert np.std(found, axis=0).max() < 0.1


def test_types_of_which_there_are_few_pictures_are_drawn_towards_what_is_usual():
    rng = np.random.default_rng(1)
    kind = np.full(200, 2)
    kind[:2] = 1
    t = np.arange(200) / 60
    told_by = traits(kind, None, None, np.array([np.sin(5 * t), 0 * t]), np.array([np.cos(5 * t), 0 * t]))
    apart = []
    for _ in range(300):
        squares = rng.normal(size=200) ** 2
        found = relative_sigma(told_by, squares, lambda v: v, np.zeros(200), 200)
        apart.append(np.log(found[0] / found[-1]))
    alone = np.std([np.log(np.sqrt(np.mean(rng.normal(size=2) ** 2))) for _ in range(300)])
    assert np.std(apart) < 0.7 * alone
    assert 1 / 1.9 < np.exp(np.mean(apart)) < 1.0


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

"""`cost tracking` and the random scenes of its benchmark: the bound is the bound, peers follow, nothing is silently wrong."""

from __future__ import annotations

import csv
import importlib.util
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from toolkit import camera, render
from toolkit.cost import tracking as cost
from toolkit.render import stage
from toolkit.scene import Scene
from toolkit.trackers import tracker_names

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def benchmark_scenes():
    """benchmarks/tracking.py as a module."""
    spec = importlib.util.spec_from_file_location("tracking_benchmark", ROOT / "benchmarks" / "tracking.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def scene(**effects) -> Scene:
    return Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.1, "length_m": 0.5, "bob_radius_m": 0.03},
            "release": {"theta0_rad": 0.35},
            "camera": {
                "width_px": 320, "height_px": 240, "fps": 30, "duration_s": 2.4, "px_per_m": 380, "pivot_px": [160.3, 20.4],
                "sensor_noise": {"read_sigma": 3.0}, **effects,
            },
        }
    )  # fmt: skip


def test_the_bound_is_the_formula_for_a_still_disc():
    """σ_x = (σ/C) √(2 s/(√π R)), with σ and C those of an 8-bit luma."""
    studio = stage(scene())
    noise = math.sqrt((3.0**2) * (0.299**2 + 0.587**2 + 0.114**2) * (219 / 255) ** 2 + 1 / 12)
    contrast = (200 - (0.299 * 45 + 0.587 * 45 + 0.114 * 50)) * 219 / 255
    formula = noise / contrast * math.sqrt(2 * studio.sigma_px / (math.sqrt(math.pi) * 11.4))
    np.testing.assert_allclose(cost.cramer_rao_px(studio), formula, rtol=0.02)
    blurred = cost.cramer_rao_px(stage(scene(motion_blur={"exposure_s": 0.015})))
    assert blurred[0] > 1.2 * formula > blurred[1]  # blur is along x, and lengthens the edges that tell y


def test_the_bound_binds_a_maximum_likelihood_fit():
    """Noisy frames fitted with the renderer's own noiseless frame, shifted: the scatter is the bound's."""
    studio = stage(scene(string={"width_px": 0}))
    clean = studio.expose(0) @ cost.LUMA
    slope = np.gradient(clean)[1]
    centre = clean - clean.mean()
    errors = []
    for number in range(40):
        noisy = studio.develop(studio.expose(0), number).astype(float) @ cost.LUMA
        errors.append(np.sum((noisy - noisy.mean() - centre) * slope) / np.sum(slope**2))
    bound = cost.cramer_rao_px(studio)[0]
    # np.gradient is not the best slope of a sharp edge, so the scatter lies somewhat above
    assert 0.75 * bound < np.std(errors) < 1.6 * bound


def test_cost_tracking_compares_ours_and_peers(tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "clips", lambda quick: (cost.Clip("small", scene()),))
    monkeypatch.setattr(cost, "_LONGEST_S", 0.5)
    told: list[float] = []
    text = cost.measure(tmp_path, quick=True, progress=lambda stage, fraction: told.append(fraction))
    assert told == sorted(told)
    assert told[-1] == 1
    assert {p.name for p in tmp_path.iterdir()} == {"tracking.csv", "tracking.txt", "tracking.png", "tracking.svg"}
    rows = list(csv.DictReader((tmp_path / "tracking.csv").open(encoding="utf-8")))
    methods = {row["method"]: row for row in rows}
    assert {f"{name} localiser" for name in tracker_names()} <= methods.keys()
    assert {"disc whole run", "OpenCV template", "OpenCV Hough", "OpenCV mean-shift"} <= methods.keys()
    bound = float(methods["disc localiser"]["bound_px"])
    for row in rows:
        error = math.hypot(float(row["rms_x_px"]), float(row["rms_y_px"])) / math.sqrt(2)
        assert error > 0.8 * bound  # no one beats it
        assert float(row["us_per_frame"]) > 0
        assert row["method"] in text
    ours = float(methods["disc localiser"]["spread_px"])
    for peer in ("OpenCV Hough", "OpenCV mean-shift"):
        assert float(methods[peer]["spread_px"]) > 2 * ours


def test_random_scenes_cover_every_effect_and_repeat(benchmark_scenes):
    count = len(camera.effect_names())
    used = [benchmark_scenes.random_scene(number)[1] for number in range(count)]
    assert set().union(*used) == set(camera.effect_names())
    assert benchmark_scenes.random_scene(3)[0].to_dict() == benchmark_scenes.random_scene(3)[0].to_dict()


def test_a_wrong_track_without_a_warning_counts_as_silent(benchmark_scenes):
    outcome = benchmark_scenes.Outcome
    right = outcome("0 x", ok_fraction=1, rms_x_px=0.02, rms_y_px=0.02, zero_sigmas=1, scale_sigmas=1, rest_sigmas=1)
    assert right.locked
    assert not right.wrong
    for change in ({"rms_y_px": 1.2}, {"scale_sigmas": 6}, {"rest_sigmas": 5.5}, {"zero_sigmas": 7}):
        wrong = outcome(**{**right.__dict__, **change})
        assert wrong.silent_failure
        assert not outcome(**{**wrong.__dict__, "warnings": "camera tilt"}).silent_failure
    assert not outcome("0 x", refused="no pendulum").silent_failure


# one scene a kind of trouble: motion blur and noise, occlusion, texture and lost frames, streaks of half the bob's way
@pytest.mark.slow
@pytest.mark.parametrize("number", [42, 13, 46, 190])
def test_random_scenes_lock_and_nothing_is_silently_wrong(benchmark_scenes, tmp_path, number):
    outcome = film_and_measure(benchmark_scenes, tmp_path, number)
    assert not outcome.silent_failure, benchmark_scenes.describe(outcome)
    assert outcome.locked, benchmark_scenes.describe(outcome)


@pytest.mark.slow
@pytest.mark.parametrize("number", [42, 13, 46])
def test_half_hidden_frames_are_not_ok(benchmark_scenes, tmp_path, number):
    assert film_and_measure(benchmark_scenes, tmp_path, number).hidden_ok == 0


def film_and_measure(benchmark_scenes, tmp_path, number):
    made, used = benchmark_scenes.random_scene(number)
    film = tmp_path / "film.mkv"
    render(made, film)
    return benchmark_scenes.measure(made, film, f"{number} {'+'.join(used)}")

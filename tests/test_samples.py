"""The shipped samples are what their README says, and their scenes still make them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from toolkit import Scene, open_video, read_series, simulate
from toolkit.render import stage

SAMPLES = Path(__file__).resolve().parents[1] / "data" / "samples"
CLIPS = ["pendulum", "classroom"]


@pytest.mark.parametrize("name", CLIPS)
def test_truth_beside_a_clip_is_its_scenes(name):
    truth = stage(Scene.from_toml(SAMPLES / f"{name}.toml")).truth
    table = pd.read_csv(SAMPLES / f"{name}.truth.csv")
    for column in ("t_s", "theta_rad"):
        np.testing.assert_allclose(table[column], getattr(truth, column), atol=1e-9)
    for column in ("x_px", "y_px"):
        np.testing.assert_allclose(table[column], getattr(truth, column), atol=1e-5)


@pytest.mark.parametrize("name", CLIPS)
def test_a_clip_shows_its_scene(name):
    """Decoded luma against the light of the scene, on every 50th frame."""
    studio = stage(Scene.from_toml(SAMPLES / f"{name}.toml"))
    frames = list(open_video(SAMPLES / f"{name}.mp4"))
    assert len(frames) == studio.truth.frame.size
    np.testing.assert_allclose([f.t_s for f in frames], studio.truth.stamp_s, atol=1e-6)
    for frame in frames[::50]:
        grey = studio.expose(frame.index) @ np.array([0.299, 0.587, 0.114]) * (219 / 255) + 16
        difference = frame.luma - grey
        assert abs(difference.mean()) < 1
        assert difference.std() < 3


@pytest.mark.parametrize("name", [*CLIPS, "steel_bob"])
def test_the_readme_gives_the_scenes_parameters(name):
    scene = Scene.from_toml(SAMPLES / f"{name}.toml")
    lines = (SAMPLES / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    column = next(row for row in rows if row[0] == "parameter").index(f"`{name}`")

    def given(start: str) -> float:
        return float(next(row for row in rows if row[0].startswith(start))[column].split()[0])

    mass, length = scene.pendulum.mass_kg, scene.pendulum.length_m
    k_d, c = scene.effects["linear_drag"]["k_d_kg_per_s"], scene.effects["quadratic_drag"]["c_kg_per_m"]
    assert given("θ₀") == pytest.approx(scene.release.theta0_rad, rel=1e-5)
    assert given("m") == mass
    assert given("ℓ") == length
    assert given("g") == pytest.approx(scene.environment.gravity_m_per_s2, rel=1e-6)
    assert given("linear drag") == k_d
    assert given("α_d") == pytest.approx(k_d / (2 * mass), rel=1e-6)
    assert given("quadratic drag") == c
    assert given("β") == pytest.approx(c * length / mass, rel=5e-3)


def test_the_series_is_its_simulation_with_its_noise():
    series = read_series(SAMPLES / "steel_bob.csv")
    motion = simulate(Scene.from_toml(SAMPLES / "steel_bob.toml"), series.t_s)
    noise = (series.theta_rad - motion.theta_rad) / series.sigma_theta_rad
    assert abs(noise.mean()) < 4 / np.sqrt(noise.size)
    assert noise.std() == pytest.approx(1, abs=4 / np.sqrt(2 * noise.size))
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4 / np.sqrt(noise.size)


def test_samples_stay_small():
    assert sum(path.stat().st_size for path in SAMPLES.iterdir() if path.is_file()) < 4_000_000


def test_the_measured_series_is_within_a_hundredth_of_a_degree_of_the_truth():
    series = read_series(SAMPLES / "pendulum.theta.csv")
    truth = pd.read_csv(SAMPLES / "pendulum.truth.csv")
    error = series.theta_rad - np.interp(series.t_s, truth.t_s, truth.theta_rad)
    assert len(series) > 0.98 * len(truth)
    assert np.degrees(np.sqrt(np.mean(error**2))) < 0.01
    assert 0.8 < np.std(error / series.sigma_theta_rad) < 1.3

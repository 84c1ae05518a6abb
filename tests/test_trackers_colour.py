"""Bobs that differ from the wall in colour only, or in brightness only and little, through a codec that halves the colour planes."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit import Scene, render, track
from toolkit.render import stage

pytest.importorskip("av")

WALL, LUMA = (150.0, 150.0, 150.0), (0.299, 0.587, 0.114)


# rms error allowed, px: half-size colour planes tell places half as well, low contrast by its ratio to the noise
@pytest.mark.parametrize(
    ("bob", "sight", "allowed", "seed"),
    [
        ((60.0, 185.0, 204.0), "colour", 0.1, 3),
        ((60.0, 185.0, 204.0), "colour", 0.1, 4),
        ((60.0, 185.0, 204.0), "colour", 0.1, 5),
        ((138.0, 138.0, 138.0), "brightness", 0.15, 3),
    ],
    ids=[*(f"cyan, as bright as the wall, {seed}" for seed in (3, 4, 5)), "grey, hardly darker than the wall"],
)
def test_whatever_tells_the_bob_from_the_wall_is_used(tmp_path, bob, sight, allowed, seed):
    brighter = float(np.dot(LUMA, bob) - np.dot(LUMA, WALL))
    assert (abs(brighter) < 0.5) == (sight == "colour")
    scene = Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.1, "length_m": 0.5, "bob_radius_m": 0.025},
            "release": {"theta0_rad": 0.35},
            "camera": {
                "width_px": 640, "height_px": 480, "fps": 30, "duration_s": 3.0, "px_per_m": 700, "pivot_px": [320.3, 40.4],
                "seed": seed, "sensor_noise": {"read_sigma": 2.0}, "wall": {"colour_rgb": list(WALL)},
                "bob_look": {"colour_rgb": list(bob)}, "codec": {"name": "h264", "bit_rate_bit_per_s": 3e6},
            },
        }
    )  # fmt: skip
    film = tmp_path / "film.mp4"
    render(scene, film)
    truth, found = stage(scene).truth, track(film)
    assert found.meta["sight"] == sight
    assert found.ok.mean() > 0.98
    for at, true, sigma in ((found.x_px, truth.x_px, found.sigma_x_px), (found.y_px, truth.y_px, found.sigma_y_px)):
        error = (at - true[found.frame])[found.ok]
        assert np.sqrt(np.mean(error**2)) < allowed
        assert 0.6 < np.std(error / sigma[found.ok]) < 1.6

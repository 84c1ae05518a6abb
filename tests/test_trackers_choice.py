"""Which localiser the pipeline takes, and that it says so."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit import Scene, render, track
from toolkit.render import stage

pytest.importorskip("av")

# rms error allowed, px
LOOKS = {
    "plain": ({"look": "plain"}, "disc", 0.03),
    "rotating_pattern": (
        {"look": "rotating_pattern", "second_rgb": [235, 235, 235], "strength": 0.5, "spin_rad_per_s": 1.5},
        "edge",
        0.2,
    ),
    "two_coloured": (  # a slope of brightness nearly tells the halves: the bob wavers less than with the outline fit
        {
            "look": "two_coloured",
            "colour_rgb": [90, 80, 70],
            "second_rgb": [235, 235, 235],
            "strength": 0.5,
            "spin_rad_per_s": 2.0,
        },
        "disc",
        0.04,
    ),
}


@pytest.mark.parametrize("name", LOOKS)
def test_the_localiser_that_explains_the_bob_is_taken_and_named(tmp_path, name):
    look, expected, allowed = LOOKS[name]
    scene = Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.1, "length_m": 0.4, "bob_radius_m": 0.05 if name == "two_coloured" else 0.04},
            "release": {"theta0_rad": 0.4},
            "camera": {
                "width_px": 320, "height_px": 240, "fps": 30, "duration_s": 2.5, "px_per_m": 400, "pivot_px": [160.3, 30.4],
                "seed": 5, "sensor_noise": {"read_sigma": 2.0}, "bob_look": {"colour_rgb": [50, 60, 70], **look},
                "codec": {"name": "lossless"}, "wall": {"colour_rgb": [190, 190, 190]} if name == "two_coloured" else {},
            },
        }
    )  # fmt: skip
    film = tmp_path / "film.mkv"
    render(scene, film)
    truth, found = stage(scene).truth, track(film)
    assert found.localiser == expected
    choices = [s for s in found.meta["log"] if getattr(s, "key", "") == "track.choice"]
    assert len(choices) == (name != "plain")
    for choice in choices:
        names = [part.split()[0] for part in choice.split(": ")[1].split(", ")]
        assert names == ["edge", "disc"]  # the least misfit first; a pattern pulls the middle of what is like the bob
    for at, true, sigma in ((found.x_px, truth.x_px, found.sigma_x_px), (found.y_px, truth.y_px, found.sigma_y_px)):
        error = (at - true[found.frame])[found.ok]
        assert np.sqrt(np.mean(error**2)) < allowed
        assert np.std(error / sigma[found.ok]) < 2.0

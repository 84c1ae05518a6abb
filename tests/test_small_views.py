"""Error bars about a motion that the camera saw at a slant too small to be shown."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from toolkit.render import stage
from toolkit.scene import Scene
from toolkit.tracking.clip.joint import Camera, fit_jointly
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import fit_swing, start_swing

SIGMA = 0.03


def told(effects, even, seed=5):
    """σ over the true one, of both axes, where places of a filmed swing were found with noise alone."""
    camera = {
        "width_px": 640,
        "height_px": 480,
        "fps": 60,
        "duration_s": 4.0,
        "px_per_m": 620,
        "pivot_px": [318.0, 30.5],
    }
    table = {
        "pendulum": {"mass_kg": 0.1, "length_m": 0.6, "bob_radius_m": 0.02},
        "release": {"theta0_rad": 0.44},
        "effects": {"linear_drag": {"k_d_kg_per_s": 2e-3}},
        "camera": {**camera, **effects},
    }
    truth = stage(Scene.from_dict(table)).truth
    t, n = truth.stamp_s, truth.t_s.size
    x, y = np.array([truth.x_px, truth.y_px]) + np.random.default_rng(seed).normal(0, SIGMA, (2, n))
    one, yes = np.full(n, 0.02), np.ones(n, bool)
    swing = fit_swing(t, x, y, np.full(n, 0.1), start_swing(t, x, y))
    shake = SimpleNamespace(
        taken=False, by_string=False, x=np.zeros(n), y=np.zeros(n), sigma=np.zeros(n), unseen_px=0.02
    )
    joint = fit_jointly(
        Places(t, x, y, one, one, yes, ~yes), swing, shake, 0.0, None, Camera((640, 480), None, False, 0.2, 1.0, even)
    )
    return joint.bars.x * 0.02 / SIGMA, joint.bars.y * 0.02 / SIGMA, joint.view.shown


@pytest.mark.parametrize(
    "effects",
    [{}, {"rolling_shutter": {"readout_s": 0.008}}, {"lens_distortion": {"k1": -0.02}}],
    ids=["none", "shutter", "lens"],
)
def test_what_the_camera_did_is_no_error_of_the_places_though_too_small_to_be_shown(effects):
    ratios = []
    for seed in range(3):
        x, y, shown = told(effects, True, seed)
        assert shown == ()
        ratios.append((x, y))
    assert np.mean(ratios, axis=0) == pytest.approx([1.0, 1.0], abs=0.08)


def test_errors_of_an_uneven_bob_that_return_with_the_place_stay_errors():
    assert told({"rolling_shutter": {"readout_s": 0.008}}, False)[0] > 1.25

"""A bob whose stripes are by turns dark and as bright as the wall: its size and place by what shows of its outline."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from toolkit import Scene, render, track
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.begin.bold import learn_bold, on_swing
from toolkit.tracking.geometry.swing import Swing, fit_swing, start_swing
from toolkit.tracking.picture.looks import Sightings

WALL, DARK, RADIUS = 180.0, 70.0, 16.0


def striped_ball(cx, cy, turn, size=64, over=6):
    """6×6 samples a pixel of a ball with three dark and three wall-coloured stripes from pole to pole, turned by `turn`."""
    fine = (np.arange(size * over) + 0.5) / over - 0.5
    u, v = (fine[None, :] - cx) / RADIUS, (fine[:, None] - cy) / RADIUS
    square = u**2 + v**2
    longitude = np.arctan2(u + 0 * v, np.sqrt(np.maximum(1 - square, 0))) + turn
    dark = (square < 1) & (np.sin(3 * longitude) > 0)
    return WALL + (DARK - WALL) * dark.reshape(size, over, size, over).mean(axis=(1, 3))


def filmed(rng, t, x, y, turn, soft_px=0.0, exposure_s=0.0, noise=1.5, step_s=1e-4):
    """Pictures 64×64 of it at times t, the lens of this blur (normal, px), and where their first pixels lie."""
    x0, y0 = np.floor(x).astype(int) - 32, np.floor(y).astype(int) - 32
    parts = np.linspace(-0.5, 0.5, 9) * exposure_s if exposure_s else [0.0]
    vx, vy = np.gradient(x, t), np.gradient(y, t)
    images = []
    for k in range(t.size):
        shots = [striped_ball(x[k] + u * vx[k] - x0[k], y[k] + u * vy[k] - y0[k], turn[k]) for u in parts]
        image = np.mean(shots, axis=0)
        image = gaussian_filter(image, soft_px) if soft_px else image
        images.append((image + rng.normal(0, noise, image.shape)).astype(np.float32))
    return images, x0, y0


def learned(guessed, pull_px, **how):
    """What is learned of it swinging, at 30 pictures a second, if it is found beside its place, towards where it is dark."""
    rng = np.random.default_rng(5)
    t = np.arange(48) / 30
    theta = 0.2 * np.cos(5 * t)
    x, y, turn = 300 + 300 * np.sin(theta), -100 + 300 * np.cos(theta), 2.4 * t
    images, x0, y0 = filmed(rng, t, x, y, turn, **how)
    wall = np.full((64, 64), WALL, np.float32)
    vx, vy = np.gradient(x, t), np.gradient(y, t)

    def show(k, look, centre, streak_s):
        guess = Guess(*centre, vx[k] * streak_s, vy[k] * streak_s)
        return guess, Patch(images[k], wall, np.full_like(wall, 20.0), x0[k], y0[k])

    pulled = x + pull_px * np.sin(3 * turn)
    swing = fit_swing(t, pulled, y, np.full(t.size, 0.3), start_swing(t, pulled, y))
    seen = Sightings(pulled, y, vx, vy, show)
    return learn_bold(seen, t, Look(guessed * RADIUS, 1.0, -20.0), swing, None, 1 / 30), t, x


@pytest.mark.parametrize(("guessed", "soft_px"), [(0.9, 0.6), (1.12, 0.6), (0.9, 1.2), (1.12, 1.2), (0.9, 2.2)])
def test_size_and_edge_of_a_bob_are_learned_though_half_of_its_outline_is_the_walls(guessed, soft_px):
    found, t, x = learned(guessed, 2.5, soft_px=soft_px)
    assert found.looks.look.radius_px == pytest.approx(RADIUS, rel=0.03)
    assert found.looks.look.edge_px == pytest.approx(np.hypot(soft_px, 1 / np.sqrt(12)), rel=0.2)
    assert found.looks.look.contrast == pytest.approx(DARK - WALL, rel=0.15)
    assert 300 * found.looks.exposure_s < 1.5 * soft_px + 0.5  # px, about: so short a streak hardly adds to the edge
    assert found.calm
    assert np.std(found.swing.position(t)[0] - x) < 0.5 * np.std(2.5 * np.sin(7.2 * t))


def test_its_exposure_is_learned_too():
    found, _, _ = learned(1.05, 0.5, soft_px=0.6, exposure_s=0.5 / 30)
    assert found.looks.exposure_s == pytest.approx(0.5 / 30, abs=0.15 / 30)
    assert found.looks.look.radius_px == pytest.approx(RADIUS, rel=0.03)


def tracked(tmp_path, pendulum, theta0_rad, camera, **asked):
    """The track of a rendered film, and how far (rms, px) its places are off along either axis."""
    camera = {
        "width_px": 320, "height_px": 240, "fps": 30, "px_per_m": 400, "pivot_px": [160.3, 20.4], "codec": {"name": "lossless"},
        **camera,
    }  # fmt: skip
    pendulum = {"mass_kg": 0.1, "length_m": 0.4, **pendulum}
    scene = Scene.from_dict({"pendulum": pendulum, "release": {"theta0_rad": theta0_rad}, "camera": camera})
    film = tmp_path / "film.mkv"
    truth, found = render(scene, film), track(film, **asked)
    off = np.array([found.x_px - truth.x_px[found.frame], found.y_px - truth.y_px[found.frame]])
    return found, np.sqrt(np.mean(off[:, found.ok] ** 2, axis=1))


def test_a_stripe_as_bright_as_the_wall_draws_the_place_to_no_side(tmp_path):
    camera = {
        "duration_s": 3.0, "seed": 5, "sensor_noise": {"read_sigma": 1.5}, "wall": {"colour_rgb": [202.0, 197.0, 222.0]},
        "bob_look": {"look": "rotating_pattern", "colour_rgb": [44.0, 52.0, 56.0], "strength": 0.79, "spin_rad_per_s": -2.7},
    }  # fmt: skip
    found, off_px = tracked(tmp_path, {"bob_radius_m": 0.045}, 0.15, camera)
    assert found.localiser == "edge"
    assert found.ok.mean() > 0.95
    assert np.all(off_px < 0.5)


@pytest.mark.parametrize(("localiser", "least"), [("edge", 0.75), ("disc", 0.85)])
def test_a_bob_that_turns_a_face_nearly_as_bright_as_the_wall_is_believed(tmp_path, localiser, least):
    """Half of it hardly differs from what stands behind it, as if something hid it; but its outline is seen all around."""
    camera = {
        "duration_s": 4.0, "seed": 6, "sensor_noise": {"read_sigma": 1.0},
        "wall": {"colour_rgb": [155.0, 155.0, 155.0], "gradient": 0.3},
        "bob_look": {"look": "two_coloured", "colour_rgb": [60.0, 60.0, 60.0], "strength": 0.45, "spin_rad_per_s": 1.6},
    }  # fmt: skip
    found, off_px = tracked(tmp_path, {"bob_radius_m": 0.035}, 0.6, camera, localiser=localiser)
    assert found.ok.mean() > least  # else it is half of them
    assert np.all(off_px < 0.5)


def test_a_motion_that_runs_beyond_all_numbers_draws_no_place():
    """As it was fitted to a bob that a hand held for two seconds: undamped fifteenfold a second, and more the faster it is."""
    swing = Swing(
        np.array([737.3, 408.8, 117.8, 0.338, 2.35, -2.09, -15.45, 0.027, 0.0165]), np.zeros((9, 9)), 0.0333, 0.88
    )
    t_s = np.arange(72) / 30
    places = {k: (780.0, 515.0 + k) for k in range(72)}
    with np.errstate(all="ignore"):
        assert not np.isfinite(swing.position(t_s)).all()
        assert on_swing(places, t_s, swing) == places
        drawn = on_swing(dict(list(places.items())[:3]), t_s[:3], swing)
    assert list(drawn) == [0, 1, 2]
    assert np.isfinite(list(drawn.values())).all()

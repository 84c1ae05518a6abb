"""One contract for all camera effects: documented, bounded, repeatable, nothing when off, and true to the light."""

from __future__ import annotations

import copy
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from toolkit import UsageError, camera
from toolkit.camera.effect import KINDS
from toolkit.render import stage
from toolkit.scene import Scene

NAMES = camera.effect_names()
MOVING = [n for n in NAMES if camera.load_effect(n).kind in ("clock", "exposure", "geometry")]
WHITE_ON_BLACK = {
    "string": {"width_px": 0},
    "wall": {"colour_rgb": [0, 0, 0]},
    "bob_look": {"colour_rgb": [255, 255, 255]},
}


def scene(**effects) -> Scene:
    """A small quick film with these camera effects."""
    return Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.05, "length_m": 0.5, "bob_radius_m": 0.025},
            "release": {"theta0_rad": 0.6},
            "camera": {
                "width_px": 320,
                "height_px": 240,
                "fps": 30,
                "duration_s": 0.7,
                "px_per_m": 360,
                "pivot_px": [161.3, 22.7],
                "seed": 4,
                **copy.deepcopy(effects),
            },
        }
    )


def frames(**effects) -> list[np.ndarray]:
    return list(stage(scene(**effects)).frames())


@pytest.mark.parametrize("name", NAMES)
def test_documented(name):
    effect = camera.load_effect(name)
    assert effect.kind in KINDS
    assert len(effect.meaning) > 30
    module = sys.modules[f"toolkit.camera.{name}"]
    assert len(module.__doc__ or "") > 30
    assert effect.parameters
    for p in effect.parameters:
        assert p.meaning
        assert p.choices or p.unit
        assert p.name.endswith(f"_{p.unit.lower()}") or p.unit not in ("s", "px", "rad", "m", "Hz")
    assert camera.check_parameters(name, effect.example).keys() == {p.name for p in effect.parameters}


@pytest.mark.parametrize("name", NAMES)
def test_values_outside_their_range_are_refused(name):
    with pytest.raises(UsageError, match="unknown key 'nonsense'"):
        camera.check_parameters(name, {"nonsense": 1})
    for p in camera.load_effect(name).parameters:
        wrong = ["a", None, True, float("nan"), [1]]
        wrong += [] if p.minimum is None or p.choices else [p.minimum - 1]
        wrong += [] if p.maximum is None or p.choices else [p.maximum + 1]
        for value in wrong:
            with pytest.raises(UsageError, match=p.name):
                camera.check_parameters(name, {p.name: value})


def test_an_unknown_effect_is_named():
    with pytest.raises(UsageError, match="did you mean 'motion_blur'"):
        camera.check_parameters("motion_blurr", {})


def test_checking_parameters_draws_nothing():
    code = (
        "import sys; from toolkit import camera\n"
        "[camera.check_parameters(n, {}) for n in camera.effect_names()]\n"
        "assert not {'cv2', 'av', 'scipy', 'numba'} & set(sys.modules), sorted(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_the_same_film(name):
    example = {name: dict(camera.load_effect(name).example)}
    first, second = stage(scene(**example)), stage(scene(**example))
    np.testing.assert_array_equal(first.truth.x_px, second.truth.x_px)
    last = int(first._take[-1])
    np.testing.assert_array_equal(first.develop(first.expose(last), last), second.develop(second.expose(last), last))


@pytest.mark.parametrize("name", [n for n in NAMES if camera.load_effect(n).off is not None])
def test_switched_off_it_changes_nothing(name):
    plain = stage(scene())
    off = stage(scene(**{name: dict(camera.load_effect(name).off)}))
    np.testing.assert_allclose(off.truth.x_px, plain.truth.x_px, atol=1e-9)
    np.testing.assert_allclose(off.truth.y_px, plain.truth.y_px, atol=1e-9)
    np.testing.assert_allclose(off.truth.t_s, plain.truth.t_s, atol=1e-12)
    np.testing.assert_array_equal(off.truth.visible, 1)
    for number in (0, 9):
        np.testing.assert_allclose(off.expose(number), plain.expose(number), atol=1e-2)


@pytest.mark.parametrize("name", [n for n in NAMES if camera.load_effect(n).kind not in ("clock", "file")])
def test_switched_on_it_shows(name):
    """The example changes the picture (a rolling shutter and gamma show on what moves and on edges)."""
    plain = stage(scene())
    film = stage(scene(**{name: dict(camera.load_effect(name).example)}))
    number = 13  # near the middle of the swing
    seen = film.develop(film.expose(number), number).astype(int)
    bare = plain.develop(plain.expose(number), number)
    assert np.abs(seen - bare).max() > 5


@pytest.mark.parametrize("name", MOVING)
@pytest.mark.parametrize("exposure_s", [0.0, 0.01])
def test_the_centroid_of_the_light_is_the_truth(name, exposure_s):
    """A white bob on black: the first moments of each noiseless frame are the truth to 0.01 px, its area πr²."""
    effects = {**WHITE_ON_BLACK, "motion_blur": {"exposure_s": exposure_s}}
    if name != "motion_blur":
        effects[name] = dict(camera.load_effect(name).example)
    studio = stage(scene(**effects))
    truth = studio.truth
    y, x = np.mgrid[:240, :320]
    for frame in range(0, truth.frame.size, 3):
        light = studio.expose(int(studio._take[frame]))[:, :, 1].astype(float)
        total = light.sum()
        assert abs((light * x).sum() / total - truth.x_px[frame]) < 0.01
        assert abs((light * y).sum() / total - truth.y_px[frame]) < 0.01
        assert total / 255 == pytest.approx(np.pi * truth.radius_px[frame] ** 2, rel=2e-4)


@pytest.mark.parametrize("name", [n for n in NAMES if n not in MOVING])
def test_what_only_changes_light_leaves_the_truth(name):
    plain, film = stage(scene()), stage(scene(**{name: dict(camera.load_effect(name).example)}))
    np.testing.assert_array_equal(film.truth.x_px, plain.truth.x_px)
    np.testing.assert_array_equal(film.truth.y_px, plain.truth.y_px)
    np.testing.assert_array_equal(film.truth.theta_rad, plain.truth.theta_rad)


def test_one_effect_never_changes_anothers_chance():
    alone = stage(scene(hand_shake={"rms_px": 3.0})).truth
    crowded = stage(scene(hand_shake={"rms_px": 3.0}, sensor_noise={}, clutter={}, texture={})).truth
    np.testing.assert_array_equal(alone.x_px, crowded.x_px)


def test_exposure_mean_of_a_known_motion():
    """Over a long exposure the mean position is the integral of the path, not its middle."""
    exposure = 0.02
    studio = stage(scene(motion_blur={"exposure_s": exposure}))
    fine = np.linspace(-0.5, 0.5, 4001)
    for frame in (0, 5, 13):
        theta = studio._theta(studio.truth.t_s[frame] + exposure * fine)
        x = 161.3 + 180 * np.trapezoid(np.sin(theta), fine)
        assert abs(studio.truth.x_px[frame] - x) < 2e-3
        middle = 161.3 + 180 * np.sin(studio.truth.theta_rad[frame])
        if frame == 0:
            assert abs(middle - x) > 0.02  # so that the test can tell the two apart


def test_rolling_shutter_times_the_bobs_own_row():
    readout = 0.02
    truth = stage(scene(rolling_shutter={"readout_s": readout})).truth
    delay = (truth.y_px - 119.5) * readout / 240
    np.testing.assert_allclose(truth.t_s, truth.stamp_s + delay, atol=1e-12)
    still = stage(scene())
    np.testing.assert_allclose(truth.x_px, 161.3 + 180 * np.sin(still._theta(truth.t_s)), atol=1e-6)


def test_perspective_is_a_pinhole():
    """Against a projection written another way: rays from the camera's place through the picture plane."""
    yaw, distance = 0.3, 1.2
    near = scene(perspective={"yaw_rad": yaw, "distance_m": distance})
    truth = stage(
        near.with_(pendulum=replace(near.pendulum, bob_radius_m=1e-6))
    ).truth  # a point: a ball is seen beside it
    aim = np.array([(159.5 - 161.3) / 360, (119.5 - 22.7) / 360, 0])
    ahead = np.array([np.sin(yaw), 0, np.cos(yaw)])
    right = np.array([np.cos(yaw), 0, -np.sin(yaw)])
    eye = aim - distance * ahead
    bob = 0.5 * np.stack([np.sin(truth.theta_rad), np.cos(truth.theta_rad), 0 * truth.t_s], axis=1) - eye
    depth = bob @ ahead
    np.testing.assert_allclose(truth.x_px, 159.5 + 360 * distance * (bob @ right) / depth, atol=1e-8)
    np.testing.assert_allclose(truth.y_px, 119.5 + 360 * distance * bob[:, 1] / depth, atol=1e-8)


_FINE = 11  # rays a pixel's side


def _counted(film: Scene, number: int, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The light of a frame's white ball on black: rays from all over the pixels go back through shutter, lens and pinhole and
    meet the ball or do not; then the optics blur it."""
    from scipy.ndimage import gaussian_filter

    studio, effects = stage(film), film.camera.effects
    parts = (np.arange(_FINE) - _FINE // 2) / _FINE
    x, y = np.meshgrid(np.add.outer(columns, parts).ravel(), np.add.outer(rows, parts).ravel())
    when = studio.truth.stamp_s[number] + (y - 119.5) * effects.get("rolling_shutter", {}).get("readout_s", 0.0) / 240
    lens = effects.get("lens_distortion", {})
    right, down = x - 159.5, y - 119.5
    seen, corner = np.hypot(right, down), np.hypot(159.5, 119.5)
    r = seen
    for _ in range(40):
        r = seen / (1 + lens.get("k1", 0) * (r / corner) ** 2 + lens.get("k2", 0) * (r / corner) ** 4)
    right, down = right * r / seen, down * r / seen
    stand = effects.get("perspective", {})
    yaw, pitch, distance = stand.get("yaw_rad", 0), stand.get("pitch_rad", 0), stand.get("distance_m", 1e6)
    turn = np.array([[1, 0, 0], [0, np.cos(pitch), np.sin(pitch)], [0, -np.sin(pitch), np.cos(pitch)]]) @ np.array(
        [[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]]
    )
    ray = np.stack([right / 360, down / 360, np.full_like(x, distance)], axis=-1) @ turn
    theta = studio._theta(when)
    aim = np.array([(159.5 - 161.3) / 360, (119.5 - 22.7) / 360, 0])
    ball = 0.5 * np.stack([np.sin(theta), np.cos(theta), 0 * theta], axis=-1) - aim + distance * turn[2]
    along = np.sum(ray * ball, axis=-1) / np.sum(ray * ray, axis=-1)
    hit = np.sum((along[..., None] * ray - ball) ** 2, axis=-1) < film.pendulum.bob_radius_m**2
    light = gaussian_filter(hit.astype(float), studio.sigma_px * _FINE, truncate=5)
    return 255 * light[_FINE // 2 :: _FINE, _FINE // 2 :: _FINE]


@pytest.mark.parametrize(
    ("effects", "left_out_px"),
    [
        ({"lens_distortion": {"k1": -0.2, "k2": 0.05}}, 2.5e-3),
        ({"perspective": {"yaw_rad": 0.3, "pitch_rad": -0.1, "distance_m": 0.8}}, 2.5e-3),
        ({"lens_distortion": {"k1": 0.1}, "perspective": {"distance_m": 0.8}}, 2.5e-3),
        ({"lens_distortion": {"k1": -0.1}, "rolling_shutter": {"readout_s": 0.03}}, 5e-3),
    ],
)
def test_the_picture_of_a_ball_is_that_of_its_rays(effects, left_out_px):
    """Drawn light and stated place against rays counted one by one, which is good to 0.002 px: the image of the ball's centre
    is 0.2 px and more away. A rolling shutter is drawn to first order in the rows' times."""
    film = scene(**WHITE_ON_BLACK, **effects)
    film = film.with_(pendulum=replace(film.pendulum, bob_radius_m=0.055))
    studio = stage(film)
    for number in (0, 7):
        truth = np.array([studio.truth.x_px[number], studio.truth.y_px[number]])
        columns, rows = (np.arange(int(at) - 32, int(at) + 33) for at in truth)
        counted = _counted(film, number, columns, rows)
        drawn = studio.expose(number)[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1, 1].astype(float)
        assert np.abs(drawn - counted).max() < 6  # of 255; a hundredth of a pixel
        for light in (counted, drawn):
            assert abs((light.sum(axis=0) @ columns) / light.sum() - truth[0]) < left_out_px
            assert abs((light.sum(axis=1) @ rows) / light.sum() - truth[1]) < left_out_px
        assert np.hypot(*(studio.exposures[number].centres[0] - truth)) > 0.2


def test_a_lens_that_folds_the_picture_still_draws_a_bob():
    film = stage(scene(lens_distortion={"k1": -0.4, "k2": -0.4}))
    assert all(np.isfinite(film.expose(number)).all() for number in (0, 7, 13))


def test_noise_has_the_stated_variance():
    film = stage(scene(sensor_noise={"read_sigma": 3.0, "shot_sigma_at_white": 6.0}))
    clean = film.expose(0)
    wall = film.develop(clean, 0)[60:, :, :].astype(float)[clean[60:] > 199.9]
    assert wall.var() == pytest.approx(3.0**2 + 6.0**2 * 200 / 255 + 1 / 12, rel=0.03)
    other = film.develop(clean, 1).astype(float)
    inner = (slice(190, 240), slice(None))
    assert abs(np.corrcoef(film.develop(clean, 0)[inner].ravel(), other[inner].ravel())[0, 1]) < 0.02


def test_gamma_blends_light_not_levels():
    """Half-covered pixels of black on white: light 1/2 is level 255 · 0.5^(1/2.2)."""
    looks = {"wall": {"colour_rgb": [255, 255, 255]}, "bob_look": {"colour_rgb": [0, 0, 0]}}
    film = stage(scene(gamma={"gamma": 2.2}, **looks))
    light = film.expose(0)
    half = np.abs(light - 127.5) < 2
    assert half.any()
    np.testing.assert_allclose(film.develop(light, 0)[half], 255 * 0.5 ** (1 / 2.2), atol=3)


def test_a_post_hides_the_bob_and_truth_says_how_much():
    post = {"x_px": 161.3, "width_px": 9.0}  # half a bob: at the middle of the swing it hides the middle of the disc
    truth = stage(scene(occluding_post=post)).truth
    half = 4.5 / 9.0  # half width over the radius
    widest = 1 - 2 / np.pi * (np.arcsin(half) + half * np.sqrt(1 - half**2))
    nearest = np.argmin(np.abs(truth.x_px - 161.3))
    assert truth.visible[nearest] == pytest.approx(widest, abs=0.05)
    assert truth.visible[0] == 1
    off_screen = stage(scene(hand_shake={"rms_px": 90.0})).truth
    assert off_screen.visible.min() < 0.9


def test_clock_effects_count_frames():
    dropped = stage(scene(dropped_frames={"fraction": 0.3})).truth
    assert dropped.frame.size < 21
    assert np.diff(dropped.stamp_s).max() > 1.5 / 30
    counted = stage(scene(dropped_frames={"fraction": 0.3, "stamps": "counted"})).truth
    np.testing.assert_allclose(np.diff(counted.stamp_s), 1 / 30)
    np.testing.assert_array_equal(counted.t_s, dropped.t_s)
    twice = stage(scene(duplicated_frames={"fraction": 0.3}))
    same = np.diff(twice.truth.t_s) == 0
    assert same.any()
    film = list(twice.frames())
    for i in np.flatnonzero(same):
        np.testing.assert_array_equal(film[i], film[i + 1])
    varied = stage(scene(variable_frame_rate={"jitter_s": 0.006})).truth
    np.testing.assert_allclose(varied.t_s, varied.stamp_s, atol=1e-12)
    assert np.diff(varied.t_s).std() > 0.003

"""What the camera did is found from the renderer's own geometry, which shares no code with the fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from toolkit.calibrate import calibrate
from toolkit.render import stage
from toolkit.scene import Scene
from toolkit.track import Track
from toolkit.tracking.clip.clock import lone_strays, out_of_time, place_lost_frames, strays_told, timed_swing
from toolkit.tracking.clip.places import Places
from toolkit.tracking.clip.shake import Shake
from toolkit.tracking.geometry.swing import Swing, fit_swing, start_swing
from toolkit.tracking.geometry.view import AT
from toolkit.tracking.geometry.view_fit import Lines, fit_view
from toolkit.tracking.picture.stillness import CameraShift

SIGMA = 0.03


def seen(theta0=0.44, string=True, bias=(0.0, 0.0), off_px=0.02, beyond_px=0.0, **effects):
    """View of a filmed swing of 25°, and its truth: noisy places, the string's line on every third frame."""
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
        "release": {"theta0_rad": theta0},
        "effects": {"linear_drag": {"k_d_kg_per_s": 2e-3}},
        "camera": {**camera, **effects},
    }
    studio = stage(Scene.from_dict(table))
    truth = studio.truth
    rng = np.random.default_rng(5)
    t, n = truth.stamp_s, truth.t_s.size
    x, y = truth.x_px + bias[0] + rng.normal(0, SIGMA, n), truth.y_px + bias[1] + rng.normal(0, SIGMA, n)
    lines = strings(studio, t[::3], rng, beyond_px) if string else None
    sigma = np.full(n, SIGMA)
    view = fit_view(t, x, y, sigma, sigma, start_swing(t, x, y), (640, 480), lines, off_px=off_px)
    return view, truth, (t, x, y)


def strings(studio, t, rng, beyond_px=0.0):
    """Straight lines fitted to the string as the picture shows it, bent by lens and shutter as that may be; looked for so far
    `beyond_px` its upper end, where nothing is."""
    fitted = []
    for when in t:
        (x, y), _ = (a.T for a in studio._optics.see(np.linspace(0.05, 0.9, 60), np.full(60, when)))
        slope, x0 = np.polyfit(y, x, 1)
        middle = 0.5 * (y[0] + y[-1])
        half = 0.5 * np.hypot(x[-1] - x[0], y[-1] - y[0])
        middle, half = middle - 0.5 * beyond_px * np.cos(np.arctan(slope)), half + 0.5 * beyond_px
        fitted.append((x0 + slope * middle, middle, np.arctan(slope) + rng.normal(0, 2e-4), 2e-4, 0.02, half, when))
    return Lines(*np.array(fitted).T)


def errors(view, truth, places):
    """Relative error of all angles, its stated σ, and what else is wrong (rad, rms)."""
    theta, _ = view.angles(*places)
    design = np.column_stack([np.ones_like(theta), truth.theta_rad])
    zero, factor = np.linalg.lstsq(design, theta, rcond=None)[0]
    _, scale_u, _, _ = view.uncertainty(*places)
    return factor - 1, scale_u, float(np.std(theta - zero - factor * truth.theta_rad))


@pytest.mark.parametrize("off_px", [0.3, -0.3])
def test_a_pattern_that_turns_as_often_as_the_bob_swings_is_no_view(off_px):
    """Its error returns with the place, and hides in tilt and lens: only what is known of the bob's looks tells of it. Stripes
    look the same after half a turn."""
    _, truth, (t, x, y) = seen(0.75, string=False)
    turned = np.unwrap(np.arctan2(np.gradient(truth.theta_rad, t) / 4.0, truth.theta_rad))
    x, y = x + off_px * np.cos(2 * turned), y + off_px * np.sin(2 * turned)
    sigma = np.full(t.size, 0.06)
    view = fit_view(t, x, y, sigma, sigma, start_swing(t, x, y), (640, 480), bent_px=0.15)
    off, u, _ = errors(view, truth, (t, x, y))
    assert view.shown == ()
    assert abs(off) < min(1e-3, 2 * u)


def test_a_square_view_is_left_alone():
    view, truth, places = seen()
    assert view.shown == ()
    off, u, rest = errors(view, truth, places)
    assert abs(off) < 5e-4
    assert off**2 < (4 * u) ** 2
    assert rest < 1.3 * SIGMA / 372
    assert np.hypot(*(np.array(view.pivot_px) - (318.0, 30.5))) < 0.1


@pytest.mark.parametrize(
    ("effects", "group"),
    [
        ({"perspective": {"yaw_rad": 0.25, "pitch_rad": 0.08, "distance_m": 1.5}}, "tilt"),
        ({"out_of_plane": {"amplitude_rad": 0.1, "phase_rad": 1.5708 + 1.5708, "distance_m": 2.0}}, "sway"),
        ({"rolling_shutter": {"readout_s": 0.012}}, "readout"),
    ],
)
def test_what_the_camera_did_is_found_and_taken_out(effects, group):
    view, truth, places = seen(**effects)
    assert group in view.shown
    off, u, rest = errors(view, truth, places)
    assert abs(off) < 4 * u + 1e-3
    assert abs(off) < 0.01
    if group == "readout":
        assert view["readout"] == pytest.approx(0.012, abs=0.002)
    else:
        assert rest < 2e-3 * 0.44


def test_a_string_that_the_lens_bends_tells_the_lens():
    view, truth, places = seen(lens_distortion={"k1": 0.04})
    assert view.shown == ("lens",)
    assert view["k1"] == pytest.approx(0.04, abs=0.005)
    off, u, rest = errors(view, truth, places)
    assert abs(off) < min(1e-3, 4 * u)
    assert rest < 1e-3 * 0.44
    assert np.hypot(*(np.array(view.pivot_px) - truth.pivot_px[0])) < 0.5


def test_a_string_looked_for_beyond_its_pivot_ends_there():
    """The line is that of the bent string's own piece, which is not the piece that was looked at: taken for it, all angles are off."""
    view, truth, places = seen(0.8, beyond_px=120.0, lens_distortion={"k1": 0.056})
    assert view.shown == ("lens",)
    off, u, rest = errors(view, truth, places)
    assert abs(off) < min(2e-3, 4 * u)
    assert rest < 1e-3 * 0.8


def test_the_string_outvotes_an_arc_that_a_swing_in_depth_bends():
    view, truth, places = seen(0.11, out_of_plane={"amplitude_rad": 0.054, "phase_rad": 4.72, "distance_m": 2.2})
    off, u, _ = errors(view, truth, places)  # by the arc alone the angles would be a quarter too large
    assert abs(off) < min(0.02, 4 * u)
    assert np.hypot(*(np.array(view.pivot_px) - truth.pivot_px[0])) < 2.0


def test_a_bob_found_beside_its_centre_is_allowed_for():
    view, truth, places = seen(0.9, bias=(0.0, 0.4), off_px=0.4)
    off, u, _ = errors(view, truth, places)
    assert abs(off) < 3 * u
    assert u > 0.4 / 372 / 3  # it may be told apart from other effects, but not to nothing


def test_the_scale_is_off_by_what_is_said_of_it():
    """Cameras as the priors have them, small and large swings, with and without a string: no error beyond 4 σ."""
    rng = np.random.default_rng(11)
    pulls = []
    for k in range(10):
        yaw, pitch, k1, sway = rng.normal(0, (0.15, 0.1, 0.03, 0.03))
        view, truth, places = seen(
            float(rng.choice([0.1, 0.25, 0.6])),
            k % 2 == 0,
            perspective={"yaw_rad": yaw, "pitch_rad": pitch, "distance_m": 1.5},
            lens_distortion={"k1": k1},
            out_of_plane={"amplitude_rad": abs(sway), "phase_rad": float(rng.uniform(0, 6.28))},
        )
        off, u, _ = errors(view, truth, places)
        pulls.append(off / u)
    assert np.abs(pulls).max() < 4, pulls
    assert 0.2 < np.sqrt(np.mean(np.square(pulls))) < 1.6, pulls


def test_a_swing_turned_out_of_the_picture_is_as_uncertain_as_a_tilt_makes_it():
    """A swing in depth in time with the swing looks like a camera from the side: the angles differ by 1.5 % between the two,
    and the clip can hardly say which it was."""
    view, truth, places = seen(0.36, out_of_plane={"amplitude_rad": 0.061, "phase_rad": 4.69, "distance_m": 2.5})
    off, u, _ = errors(view, truth, places)
    assert abs(off) < min(3 * u, 0.015)
    assert u > 1e-3


def test_a_tilt_from_near_or_from_afar_is_left_open():
    """What a tilt of 3° does from near, one of 5° does from afar: the scale is off by no more than is said."""
    view, truth, places = seen(
        0.48,
        perspective={"yaw_rad": -0.046, "pitch_rad": -0.027, "roll_rad": -0.077, "distance_m": 1.76},
        lens_distortion={"k1": -0.009},
    )
    off, u, _ = errors(view, truth, places)
    nearness = view.samples[:, AT["log_nearness"]]
    middle = view.weights @ nearness
    assert abs(off) < 3 * u
    assert np.sqrt(view.weights @ (nearness - middle) ** 2) > 0.2  # the prior's is 0.5


def test_a_wide_ellipse_before_a_tilted_camera_is_found_for_what_it_is():
    """Its path is no arc at all: from a swing in one plane, no tilt leads there. How the plane of the swing is turned is told
    by perspective only, and the angles are as uncertain as that."""
    view, truth, places = seen(
        0.123,
        out_of_plane={"amplitude_rad": 0.102, "phase_rad": 0.42, "distance_m": 1.4},
        perspective={"yaw_rad": -0.068, "pitch_rad": 0.096, "roll_rad": -0.06, "distance_m": 2.2},
    )
    off, u, rest = errors(view, truth, places)
    assert {"tilt", "sway"} <= set(view.shown)
    assert abs(off) < 4 * u
    assert rest < 3 * np.sqrt(np.mean(view.uncertainty(*places)[3] ** 2))
    assert np.std(view.position(*places)[1] - places[2]) < 1.2 * SIGMA
    assert np.hypot(*(np.array(view.pivot_px) - truth.pivot_px[0])) < 1.0


def test_a_swing_of_which_one_side_is_hidden_keeps_its_vertical():
    view, truth, (t, x, y) = seen(string=False)
    side = truth.theta_rad > 0.1
    n = t.size
    sigma = np.where(side, SIGMA, np.nan)
    shown = Track(
        np.arange(n), t, x, y, sigma, sigma, np.where(side, "ok", "lost"), 20.0, view.pivot_px, view.pivot_sigma_px, "disc",
        {"view": view},
    )  # fmt: skip
    series = calibrate(shown)
    np.testing.assert_allclose(series.theta_rad, truth.theta_rad[side], atol=2e-3)


@pytest.mark.parametrize("bias", [(0.0, 0.0), (0.2, 1.1)])
def test_places_beside_the_bob_that_string_and_arc_tell_of_are_warned_of(bias):
    """As where a shadow right under the bob is taken for part of it: the angles are right all the same."""
    view, truth, (t, x, y) = seen(0.6, bias=bias, off_px=0.5)
    n = t.size
    track = Track(
        np.arange(n), t, x, y, np.full(n, SIGMA), np.full(n, SIGMA), np.full(n, "ok"), 20.0, view.pivot_px, view.pivot_sigma_px,
        "disc", {"view": view},
    )  # fmt: skip
    series = calibrate(track)
    told = [w for w in series.meta["warnings"] if w.key == "calibrate.beside"]
    assert len(told) == (bias != (0.0, 0.0))
    assert all(w.values["off_px"] == pytest.approx(np.hypot(*bias), abs=0.3) for w in told)
    np.testing.assert_allclose(series.theta_rad, truth.theta_rad, atol=2e-3)


@pytest.mark.parametrize(("sway", "odd"), [(0.1, False), (0.25, True)])
def test_a_view_that_hardly_any_camera_has_is_warned_of(sway, odd):
    """As where the ellipse of a swing out of its plane was taken for another swing: scene 4089, three times too wide, unmentioned."""
    view, _, (t, x, y) = seen()
    values = view.values.copy()
    values[AT["sway_sin"]] = sway
    n, sigma = t.size, np.full(t.size, SIGMA)
    view = replace(view, values=values, shown=("sway",))
    found = Track(
        np.arange(n),
        t,
        x,
        y,
        sigma,
        sigma,
        np.full(n, "ok"),
        20.0,
        view.pivot_px,
        view.pivot_sigma_px,
        "disc",
        {"view": view},
    )
    told = [w for w in calibrate(found).meta["warnings"] if w.key == "calibrate.odd_view"]
    assert len(told) == odd
    assert all("sway_sin_rad 0.25" in w for w in told)


def placed(t, x, y):
    """Places that were all measured, to 0.05 px."""
    sigma = np.full(t.size, 0.05)
    return Places(t, x, y, sigma, sigma, np.ones(t.size, bool), np.zeros(t.size, bool))


def test_a_lost_frame_is_placed_where_the_motion_leaps():
    motion = Swing(np.array([320, -60, 400, 0.0, 12.0, 0.02, 0.0, 0.4, 0.0]), np.zeros((9, 9)), 0.0, 0.0)
    true = np.arange(301) / 60
    true = np.delete(true, 130)  # the camera lost this one and counted on
    x, y = motion.position(true)
    rng = np.random.default_rng(1)
    x, y = x + rng.normal(0, 0.05, x.size), y + rng.normal(0, 0.05, y.size)
    stamps = np.arange(300) / 60
    swing = fit_swing(stamps, x, y, np.full(300, 0.1), motion.values)
    warned: list[str] = []
    found, better = place_lost_frames(placed(stamps, x, y), swing, warned)
    assert len(warned) == 1
    np.testing.assert_allclose(found.t_s, true, atol=2e-3)
    assert better.rms_px < 0.06
    same, _ = place_lost_frames(placed(true, x, y), better, [])
    np.testing.assert_array_equal(same.t_s, true)


@pytest.mark.parametrize(("fraction", "theta0"), [(0.05, 0.3), (0.18, 0.6)])
def test_frames_lost_again_and_again_are_all_counted(fraction, theta0):
    """A camera that loses frames by chance and counts on: each comes to its own time."""
    lossy = {"dropped_frames": {"fraction": fraction, "stamps": "counted"}}
    _, truth, (stamps, x, y) = seen(theta0, False, **lossy)
    true = truth.t_s - truth.t_s[0]
    assert true[-1] > (1 + 0.5 * fraction) * stamps[-1]
    start = start_swing(stamps[:60], x[:60], y[:60])
    followed = fit_swing(stamps[:60], x[:60], y[:60], np.full(60, 0.1), start)
    warned: list[str] = []
    found, swing = timed_swing(followed, placed(stamps, x, y), Path("clip"), warned)
    assert [w.key for w in warned] == ["track.lost_frames"]
    speed = np.abs(np.gradient(truth.theta_rad, true))
    fast = speed > 0.3 * speed.max()  # a bob at rest shows no time
    late = (found.t_s - true)[fast]
    np.testing.assert_allclose(late, late[0], atol=1e-6)
    assert 2 * np.pi / swing.period_s == pytest.approx(np.sqrt(9.81 / 0.6), rel=2e-3)


def test_lost_frames_are_counted_about_what_the_camera_saw():
    """Out of its plane the bob turns px beside the arc, where it moves that far in several frames."""
    depth = {"amplitude_rad": 0.09, "phase_rad": 3.1, "distance_m": 2.0}
    lossy = {"fraction": 0.16, "stamps": "counted"}
    _, truth, (stamps, x, y) = seen(
        0.8, False, out_of_plane=depth, dropped_frames=lossy, rolling_shutter={"readout_s": 0.006}
    )
    true = truth.t_s - truth.t_s[0]
    start = start_swing(stamps[:60], x[:60], y[:60])
    followed = fit_swing(stamps[:60], x[:60], y[:60], np.full(60, 0.1), start)
    warned: list[str] = []
    found, _ = timed_swing(followed, placed(stamps, x, y), Path("clip"), warned, (640, 480))
    assert [w.key for w in warned] == ["track.lost_frames"]
    speed = np.abs(np.gradient(truth.theta_rad, true))
    late = (found.t_s - true)[speed > 0.1 * speed.max()]
    np.testing.assert_allclose(late, late[0], atol=4e-3)  # a frame lasts 17 ms, the shutter rolls 3


def test_frames_are_not_placed_where_more_is_amiss():
    motion = Swing(np.array([320, -60, 400, 0.0, 12.0, 0.02, 0.0, 0.4, 0.0]), np.zeros((9, 9)), 0.0, 0.0)
    true = np.delete(np.arange(301) / 60, 130)
    x, y = motion.position(true)
    x = x + 12 * np.sin(2.1 * true)  # something else moves it too
    stamps = np.arange(300) / 60
    swing = fit_swing(stamps, x, y, np.full(300, 0.1), motion.values)
    warned: list[str] = []
    found, _ = place_lost_frames(placed(stamps, x, y), swing, warned)
    np.testing.assert_array_equal(found.t_s, stamps)
    assert not warned


def test_draws_of_which_hardly_one_counts_come_to_an_end(monkeypatch):
    """First draws a thousand times too wide: nearly all weights are zero to the last digit."""
    from toolkit.tracking.geometry import view_fit

    narrow = view_fit._Problem.sample

    def wide(problem, modes):
        return narrow(problem, [mode._replace(normal=1e-6 * mode.normal) for mode in modes])

    monkeypatch.setattr(view_fit._Problem, "sample", wide)
    view, _, _ = seen(perspective={"yaw_rad": 0.15})
    if view is not None:  # too few that count is an honest end too
        assert np.isfinite(view.weights).all()
        assert view.weights.sum() == pytest.approx(1)


def test_a_repeated_picture_near_a_turning_point_is_left_out():
    """The bob stands where it was one frame before: half a pixel off, too little for a leap, far too much for chance."""
    t = np.arange(240) / 60
    rng = np.random.default_rng(8)
    angle = 0.4 * np.cos(4.1 * t)
    x, y = 320 + 400 * np.sin(angle), 20 + 400 * np.cos(angle)
    x, y = x + rng.normal(0, 0.02, t.size), y + rng.normal(0, 0.02, t.size)
    speed = np.hypot(np.gradient(x), np.gradient(y))
    slow = [int(k) for k in np.flatnonzero((speed > 0.6) & (speed < 2.4))[2::5]]
    assert len(slow) > 2
    for k in slow:
        x[k], y[k] = x[k - 1], y[k - 1]
    swing = fit_swing(t, x, y, np.full(t.size, 0.1), start_swing(t, x, y))
    assert swing is not None
    left_out = out_of_time(placed(t, x, y), swing, *swing.position(t))
    assert set(slow) <= set(np.flatnonzero(left_out).tolist())
    assert left_out.sum() <= len(slow) + 2


@pytest.mark.parametrize("real", [True, False])
def test_a_shake_without_which_the_bob_swings_more_evenly_was_none(real):
    t = np.arange(240) / 60
    angle = 0.4 * np.cos(4.1 * t)
    sway = 0.4 * np.sin(1.7 * t)  # what the background seemed to tell of the camera
    rng = np.random.default_rng(3)
    x, y = 320 + 400 * np.sin(angle) + sway * real, 20 + 400 * np.cos(angle)
    x, y = (p + rng.normal(0, 0.02, t.size) for p in (x, y))
    shifts = [CameraShift(s, 0.0, 0.0, 0.003, 320.0, 240.0) for s in sway]
    record = SimpleNamespace(
        index=list(range(t.size)), shift=shifts, place=[SimpleNamespace(x_px=a, y_px=b) for a, b in zip(x, y)]
    )
    shake = Shake(SimpleNamespace(record=record, shaking=True, checks={}), np.ones(t.size, bool))
    still = placed(t, x - shake.x, y - shake.y)
    swing = fit_swing(t, still.x_px, still.y_px, np.full(t.size, 0.1), start_swing(t, x, y))
    found, motion = shake.checked(still, swing)
    np.testing.assert_allclose(found.x_px, x - sway * real, atol=0.01)
    assert shake.taken is real
    assert len(shake.told()) == real
    assert motion.rms_px < 0.1  # the sway alone is 0.28


@pytest.mark.parametrize("rolls", [True, False])
def test_what_noise_a_shake_was_measured_with_is_smoothed_away_and_what_is_left_is_told(rolls):
    t = np.arange(240) / 60
    rng = np.random.default_rng(8)
    x, y = 320 + 250 * np.sin(0.7 * np.cos(4.1 * t)), np.full(t.size, 480.0)
    sway, roll = 2.0 * np.sin(5.0 * t), rolls * 0.002 * np.sin(3.1 * t)
    true_x, true_y = sway - roll * (y - 240), roll * (x - 320)
    seen = sway + rng.normal(0, 0.05, t.size), rng.normal(0, 0.05, t.size), roll + rolls * rng.normal(0, 2e-4, t.size)
    record = SimpleNamespace(
        index=list(range(t.size)),
        shift=[CameraShift(*row, 320.0, 240.0, 0.06, 3e-4) for row in np.transpose(seen)],
        place=[SimpleNamespace(x_px=a, y_px=b) for a, b in zip(x, y)],
    )
    shake = Shake(SimpleNamespace(record=record, shaking=True, checks={}), np.ones(t.size, bool))
    off = np.concatenate([shake.x - true_x, shake.y - true_y])
    assert np.std(off) < 0.7 * np.std(np.concatenate([shake.raw_x - true_x, shake.raw_y - true_y]))
    assert 0.75 < np.std(off / np.tile(shake.sigma, 2)) < 1.35


def test_single_frames_far_from_those_about_them_are_left_out_and_a_slow_error_is_not():
    t = np.arange(300) / 60
    rng = np.random.default_rng(9)
    angle = 0.4 * np.cos(4.1 * t)
    x, y = 320 + 400 * np.sin(angle), 20 + 400 * np.cos(angle)
    x, y = (p + rng.normal(0, 0.03, t.size) + 0.5 * np.sin(2.3 * t) for p in (x, y))
    swing = fit_swing(t, x, y, np.full(t.size, 0.1), start_swing(t, x, y))
    assert swing is not None
    assert not lone_strays(placed(t, x, y), *swing.position(t)).any()
    astray = [40, 41, 150, 222]
    x[astray] += 0.8
    found = lone_strays(placed(t, x, y), *swing.position(t))
    assert np.flatnonzero(found).tolist() == astray
    assert [sentence.key for sentence in strays_told(placed(t, x, y), found)] == ["track.lone_strays"]
    x[::5] += 0.8  # so many: something else is amiss
    assert lone_strays(placed(t, x, y), *swing.position(t)) is None


def test_rows_read_at_other_times_are_allowed_for_before_they_show_clearly():
    """The classroom's phone reads its rows in 20 ms, which its clip shows to 3 σ only: the times are those of the bob's row all the
    same, nearly, and θ at the times told is as good as its error bars say."""
    from pathlib import Path

    import pandas as pd

    from toolkit import calibrate, track

    samples = Path(__file__).resolve().parents[1] / "data" / "samples"
    truth = pd.read_csv(samples / "classroom.truth.csv").to_numpy()
    found = track(samples / "classroom.mp4")
    series = calibrate(found)
    assert "readout" not in series.meta["calibration"]["camera"]
    row_s, theta = truth[found.frame[found.ok], 1], truth[found.frame[found.ok], 2]
    late = series.t_s - row_s
    assert np.std(late) < 0.4 * np.std(found.t_s[found.ok] - row_s)
    rate = np.gradient(theta, row_s)
    design = np.stack([np.ones_like(theta), theta, rate], axis=1)  # zero, scale and the start of time are told apart
    off = series.theta_rad - theta - rate * late
    off -= design @ np.linalg.lstsq(design, off, rcond=None)[0]
    assert np.std(off / series.sigma_theta_rad) < 1.1

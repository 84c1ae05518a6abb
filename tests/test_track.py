"""Tracking of small clips drawn here, where the truth is known."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from toolkit.calibrate import arc_pivot, calibrate, line_pivot, write_calibration_json
from toolkit.errors import JobError, UsageError
from toolkit.track import OK, PREDICTED, track, write_track_csv
from toolkit.tracking.clip.hands import held_still
from toolkit.tracking.clip.places import Places
from toolkit.tracking.geometry.swing import NAMES, fit_circle, fit_swing
from toolkit.tracking.opening import Asked, Opening, begin
from toolkit.video import open_video

av = pytest.importorskip("av")
cv2 = pytest.importorskip("cv2")

W, H, FPS, PIVOT, LENGTH, RADIUS, OMEGA = 320, 240, 60.0, (160.0, -40.0), 230.0, 11.0, 5.0


def angles(t, amplitude=0.3):
    """A lightly damped small swing, good enough as a pendulum for amplitudes of 0.3."""
    from scipy.integrate import solve_ivp

    def motion(_, y):
        return [y[1], -(OMEGA**2) * np.sin(y[0]) - 0.04 * y[1]]

    return solve_ivp(motion, (0, t[-1] + 1), [amplitude, 0.0], t_eval=t, rtol=1e-9, atol=1e-10).y[0]


def draw(x, y, rng, pivot=PIVOT, string=True, post=None, board=None):
    """One frame: wall and board, string, bob as an exact anti-aliased disc, post, then noise."""
    big = np.full((H, W), 190.0)
    if board:
        big[:, board[0] : board[1]] = 100.0
    if string:
        cv2.line(
            big, tuple(round(16 * v) for v in (x, y)), tuple(round(16 * v) for v in pivot), 110.0, 1, cv2.LINE_AA, 4
        )
    rows, columns = np.mgrid[0:H, 0:W]
    share = np.clip(RADIUS + 0.5 - np.hypot(columns - x, rows - y), 0, 1)
    big = big * (1 - share) + 60.0 * share
    if post:
        big[:, post[0] : post[1]] = 120.0
    return np.clip(big + rng.normal(0, 1.5, big.shape), 0, 255).astype(np.uint8)


def film(path, frames, fps=FPS):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator())
        stream.width, stream.height, stream.pix_fmt = W, H, "yuv420p"
        stream.options = {"crf": "10", "preset": "veryfast"}
        for picture in frames:
            container.mux(
                stream.encode(av.VideoFrame.from_ndarray(np.repeat(picture[..., None], 3, 2), format="rgb24"))
            )
        container.mux(stream.encode())
    return path


def swing_clip(path, seconds=3.0, amplitude=0.3, **how):
    rng = np.random.default_rng(0)
    t = np.arange(round(seconds * FPS)) / FPS
    theta = angles(t, amplitude)
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    film(path, (draw(a, b, rng, **how) for a, b in zip(x, y)))
    return t, theta, x, y


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    path = tmp_path_factory.mktemp("plain") / "plain.mp4"
    return path, swing_clip(path)


def test_plain_clip_with_no_click(plain):
    path, (t, theta, x, y) = plain
    found = track(path)
    assert found.ok.all()
    assert np.allclose(found.t_s, t, atol=1e-4)
    errors = np.concatenate([found.x_px - x, found.y_px - y])
    assert np.sqrt(np.mean(errors**2)) < 0.05
    pulls = errors / np.concatenate([found.sigma_x_px, found.sigma_y_px])
    assert 0.8 < np.std(pulls) < 1.25
    assert found.radius_px == pytest.approx(RADIUS, abs=0.3)
    series = calibrate(found)
    assert np.hypot(*(np.array(series.meta["calibration"]["pivot_px"]) - PIVOT)) < 1.0
    assert np.degrees(np.sqrt(np.mean((series.theta_rad - theta) ** 2))) < 0.02
    assert series.meta["calibration"]["pivot_px"][1] < 0  # above the picture


def test_a_bob_larger_than_the_picture_is_refused_at_once(plain):
    with pytest.raises(UsageError, match="radius 1000 px"):
        track(plain[0], radius=1000)


def test_files(plain, tmp_path):
    import csv
    import json

    found = track(plain[0], bob=(plain[1][2][0], plain[1][3][0]))
    write_track_csv(found, tmp_path / "track.csv")
    with open(tmp_path / "track.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:7] == ["frame", "t_s", "x_px", "y_px", "sigma_x_px", "sigma_y_px", "status"]
    assert len(rows) == found.frame.size
    assert float(rows[7]["x_px"]) == pytest.approx(found.x_px[7], abs=1e-4)
    write_calibration_json(calibrate(found), tmp_path / "calibration.json")
    content = json.loads((tmp_path / "calibration.json").read_text(encoding="utf-8"))
    assert {"pivot_px", "pivot_sigma_px", "radius_px", "radius_sigma_px", "vertical_rad", "fps"} <= set(content)


def test_a_post_hides_the_bob_for_a_while(tmp_path):
    _, _, x, _ = swing_clip(tmp_path / "post.mp4", seconds=4.0, post=(150, 175))
    found = track(tmp_path / "post.mp4")
    hidden = (x > 150 - 4) & (x < 175 + 4)
    clear = (x < 150 - RADIUS - 2) | (x > 175 + RADIUS + 2)
    assert (found.status[hidden] == PREDICTED).all()
    assert (found.status[clear] == OK).mean() > 0.97
    back = np.flatnonzero(clear[1:] & ~clear[:-1]) + 1
    assert back.size
    assert all(found.ok[k : k + 2].any() for k in back)  # seen again within two frames of being wholly clear
    assert np.abs((found.x_px - x)[found.status == OK]).max() < 0.6
    assert np.nanmax(np.abs((found.x_px - x)[found.status == PREDICTED])) < 1.0


def test_a_bob_before_a_board_that_is_not_much_brighter(tmp_path):
    _, _, x, y = swing_clip(tmp_path / "board.mp4", board=(150, 210))
    found = track(tmp_path / "board.mp4")
    before = (x > 150 + RADIUS) & (x < 210 - RADIUS)
    assert before.mean() > 0.1
    assert found.ok[before].mean() > 0.97
    assert found.ok.mean() > 0.95
    assert np.hypot(found.x_px - x, found.y_px - y)[found.ok].max() < 0.5


def test_a_hand_holds_the_bob_before_its_release_and_catches_it(tmp_path):
    rng = np.random.default_rng(0)
    t = np.arange(250) / FPS
    theta = np.interp(t - 0.6, t[:181], angles(t[:181]))
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    film(tmp_path / "held.mp4", (draw(a, b, rng) for a, b in zip(x, y)))
    found = track(tmp_path / "held.mp4")
    swings = (t > 0.7) & (t < 3.55)
    assert found.ok[swings].all()
    assert not found.ok[(t < 0.6) | (t > 3.65)].any()
    assert np.hypot(*np.subtract(found.pivot_px, PIVOT)) < 2
    assert np.hypot(found.x_px - x, found.y_px - y)[found.ok].max() < 0.3
    assert "track.held_still" in [getattr(line, "key", "") for line in found.meta["log"]]
    assert not found.meta["warnings"]


def test_a_fitted_motion_is_told_without_whole_turns():
    t = np.arange(120) / FPS
    theta = angles(t)
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    turn = 2 * np.pi
    start = np.array([*PIVOT, LENGTH, -3 * turn, OMEGA**2, 0.02, 0.0, theta[0] + 4 * turn, 0.0])
    swing = fit_swing(t, x, y, np.full(t.size, 0.1), start)
    assert swing is not None
    assert abs(swing.values[NAMES.index("vertical")]) < 0.01
    np.testing.assert_allclose(swing.angle(t)[0], theta, atol=1e-3)


def test_a_swing_that_dies_away_is_not_held():
    t = np.arange(1200) / 60
    rng = np.random.default_rng(1)
    theta = 0.3 * np.exp(-0.5 * t) * np.cos(5 * t)
    x, y = (p + rng.normal(0, 0.05, t.size) for p in (160 + 230 * np.sin(theta), 230 * np.cos(theta)))
    one = np.full(t.size, 0.05)
    places = Places(t, x, y, one, one, np.ones(t.size, bool), np.zeros(t.size, bool))
    assert np.ptp(x[-120:]) < 1  # it stands still at last
    assert held_still(places, []) is places


def test_how_bright_the_bob_is_is_known_before_the_first_frame_is_followed(plain):
    follower, _ = begin(open_video(plain[0]), Asked(), Opening(1, 1.6))
    shade, scatter = follower.ordinary_shade
    assert shade == pytest.approx(16 + 60 * 219 / 255, abs=1.5)  # as drawn, in the luma of a video
    assert scatter < 2


@pytest.mark.parametrize("behind", [True, False])
def test_someone_walks_by_after_the_background_was_learned(tmp_path, behind):
    rng = np.random.default_rng(0)
    t = np.arange(240) / FPS
    theta = angles(t)
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    left = (100 * (t - 1.8)).round().astype(int)
    sides = [(max(0, a), max(0, a + 60)) if a < W else None for a in left]
    how = "board" if behind else "post"
    film(tmp_path / "by.mp4", (draw(a, b, rng, **{how: side}) for a, b, side in zip(x, y, sides)))
    found = track(tmp_path / "by.mp4")
    meets = (x > left - RADIUS) & (x < left + 60 + RADIUS)
    hidden = (x > left + 4) & (x < left + 60 - 4)
    assert meets.mean() > 0.15
    assert found.ok[~meets].mean() > 0.97
    assert found.ok[meets].mean() > 0.9 if behind else not found.ok[hidden].any()
    off = np.hypot(found.x_px - x, found.y_px - y)
    assert off[found.ok].max() < 0.4
    assert (off / np.hypot(found.sigma_x_px, found.sigma_y_px))[found.ok & meets].max() < 5


@pytest.mark.parametrize("kind", ["still", "noise", "passing", "short", "one"])
def test_what_is_no_pendulum_is_refused(tmp_path, kind):
    rng = np.random.default_rng(3)
    path = tmp_path / "no.mp4"
    n = {"short": 14, "one": 1}.get(kind, 90)
    if kind == "noise":
        frames = [np.clip(rng.normal(128, 20, (H, W)), 0, 255).astype(np.uint8) for _ in range(n)]
    elif kind == "passing":
        frames = [draw(20 + 3 * i, 120.0, rng, string=False) for i in range(n)]
    elif kind == "short":
        theta = angles(np.arange(n) / FPS)
        frames = [draw(PIVOT[0] + LENGTH * np.sin(a), PIVOT[1] + LENGTH * np.cos(a), rng) for a in theta]
    else:
        frames = [draw(200.0, 120.0, rng) for _ in range(n)]
    film(path, frames)
    with pytest.raises(JobError) as caught:
        track(path)
    assert "\n" not in str(caught.value)


def test_wrong_calls(plain):
    with pytest.raises(UsageError):
        track(plain[0], bob=(9999, 3))
    with pytest.raises(UsageError):
        track(plain[0], fps_factor=0)
    with pytest.raises(UsageError):
        track(plain[0], localiser="disk")


def test_slow_motion_factor_scales_time(plain):
    found = track(plain[0], fps_factor=4)
    assert found.t_s[-1] == pytest.approx(plain[1][0][-1] / 4)


def test_swing_fit_recovers_its_own_motion():
    t = np.arange(0, 6, 1 / 60)
    truth = np.array([320, -100, 400, 0.01, 9.0, 0.01, 0.02, 0.35, 0.1])
    start = truth * 1.02
    from toolkit.tracking.geometry.swing import Swing

    x, y = Swing(truth, np.zeros((9, 9)), 0.0, 0.0).position(t)
    rng = np.random.default_rng(1)
    fitted = fit_swing(
        t, x + rng.normal(0, 0.05, t.size), y + rng.normal(0, 0.05, t.size), np.full(t.size, 0.05), start
    )
    assert fitted is not None
    assert fitted.rms_px == pytest.approx(0.05, rel=0.15)
    sigma = np.sqrt(np.diag(fitted.covariance))
    assert np.all(np.abs(fitted.values - truth) < 5 * sigma), dict(zip(NAMES, fitted.values))


def test_pivot_by_arc_has_the_error_it_says():
    rng = np.random.default_rng(2)
    amplitude, sigma, n = 0.35, 0.03, 600
    pulls = []
    for _ in range(60):
        theta = amplitude * np.sin(np.linspace(0, 40, n))
        x, y = (
            300 + 400 * np.sin(theta) + rng.normal(0, sigma, n),
            -90 + 400 * np.cos(theta) + rng.normal(0, sigma, n),
        )
        found = arc_pivot(x, y, np.full(n, sigma), np.full(n, sigma))
        pulls.append((found.xy - (300, -90)) / found.sigma_px)
    assert 0.75 < np.std(pulls) < 1.25
    # the closed form for a swing through a small angle, sampled evenly in time: σ_L = 4√2 σ/(√N θ₀²)
    assert found.sigma_px[1] == pytest.approx(4 * np.sqrt(2) * sigma / np.sqrt(n) / amplitude**2, rel=0.2)


def test_pivot_by_lines():
    rng = np.random.default_rng(4)
    angle = 0.05 * np.sin(np.linspace(0, 30, 200))
    x, y = 300 + 350 * np.sin(angle), -90 + 350 * np.cos(angle)
    measured = angle + rng.normal(0, 2e-4, angle.size)
    found = line_pivot(x, y, measured, np.full(angle.size, 2e-4 * 350))
    assert np.all(np.abs(found.xy - (300, -90)) < 4 * np.array(found.sigma_px))
    assert found.sigma_px[0] < 0.02


def test_circle_fit_is_exact_on_a_circle():
    a = np.linspace(-0.4, 0.3, 25)
    cx, cy, r, rms = fit_circle(10 + 50 * np.sin(a), -7 + 50 * np.cos(a))
    assert (cx, cy, r) == pytest.approx((10, -7, 50), abs=1e-8)
    assert rms < 1e-9


def test_red_apple(shared_data):
    found = track(shared_data / "redapple" / "redapple_480p.mov")
    assert found.frame.size == 1299
    assert found.ok.mean() >= 0.99
    assert found.pivot_px[1] < 0


@pytest.mark.parametrize("name", ["star", "leaf", "tree2"])
def test_no_invented_pendulum(shared_data, name):
    with pytest.raises(JobError, match="--bob"):
        track(shared_data / "redapple" / f"{name}_480p.mov")


def test_what_passes_by_is_no_slow_swing_and_a_swing_is_one():
    from types import SimpleNamespace

    from toolkit.trackers.localiser import Look
    from toolkit.tracking.begin.trail import swing_through

    t, noise = np.arange(96) / FPS, np.random.default_rng(3).normal(0, 0.1, (2, 96))
    batch = [SimpleNamespace(t_s=float(s)) for s in t]
    rolling = 20 + 120 * t + noise[0], 60 + 5 * t + noise[1]
    swinging = PIVOT[0] + LENGTH * np.sin(angles(t)) + noise[0], PIVOT[1] + LENGTH * np.cos(angles(t)) + noise[1]
    assert swing_through(batch, dict(enumerate(zip(*rolling))), Look(11.0)) is None
    found = swing_through(batch, dict(enumerate(zip(*swinging))), Look(11.0))
    assert found.period_s == pytest.approx(2 * np.pi / OMEGA, rel=0.02)

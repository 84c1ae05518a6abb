"""How the bob looks, learned from pictures drawn here; and the rules of the follower that rest on it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import ndtr
from test_search import disc, swinging
from test_track import H, W, angles, film

from toolkit.track import OK, track
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.begin.trial import _by_speed
from toolkit.tracking.picture.looks import Looks, Sightings, _exposure, _nears, _total, learn_looks
from toolkit.tracking.picture.stillness import Anchors

pytest.importorskip("av")
pytest.importorskip("cv2")

RADIUS, EDGE, INTERVAL = 11.5, 0.7, 1 / 30


def streaked(x, y, streak):
    """A dark disc smeared evenly along `streak` (px, along x) before a wall of 180."""
    rows, columns = np.mgrid[0:100, 0:160]
    at = x + streak * (np.arange(33) / 32 - 0.5)
    bob = np.mean([ndtr((RADIUS - np.hypot(columns - a, rows - y)) / EDGE) for a in at], axis=0)
    return 180.0 - 110.0 * bob


def sightings(exposure_s, lag=0.0):
    """A bob seen at speeds up to 1500 px/s, thought `lag` px above where it is where it is fast."""
    rng = np.random.default_rng(4)
    speed = np.linspace(5.0, 1500.0, 30)
    x, y = rng.uniform(75, 85, 30), rng.uniform(45, 55, 30)
    pictures = [streaked(a, b, v * exposure_s) + rng.normal(0, 1.5, (100, 160)) for a, b, v in zip(x, y, speed)]
    wall, often = np.full((100, 160), 180, np.float32), np.full((100, 160), 9, np.float32)

    def show(k, look, centre, streak_s):
        return Guess(*centre, speed[k] * streak_s, 0.0), Patch(pictures[k].astype(np.float32), wall, often, 0.0, 0.0)

    return Sightings(x, y - lag * speed / speed.max(), speed, 0 * speed, show)


@pytest.mark.parametrize("exposure_s", [0.009, 0.013])
@pytest.mark.parametrize("lag", [0.0, 6.0])
def test_the_exposure_is_told_by_the_streak(exposure_s, lag):
    """Also where the places were found without knowing of it, beyond the reach of a sharp disc; and an empty wall, which a
    long faint streak fits well, says nothing."""
    found = learn_looks(sightings(exposure_s, lag), Look(RADIUS, 2.5, -105.0, 8.0), None, INTERVAL, (100, 160))
    assert found.exposure_s == pytest.approx(exposure_s, abs=0.1 * INTERVAL)
    assert found.look.radius_px == pytest.approx(RADIUS, abs=0.1)
    assert found.look.edge_px == pytest.approx(EDGE, abs=0.25)
    assert found.look.even


def test_what_is_clear_without_a_streak_and_seen_with_none_says_that_there_is_none():
    """Misfits squared of ten sightings with streaks of 0 to 10 tenths: three half behind a post are like a streak's end, whichever."""
    cost = np.full((11, 10), np.nan)
    cost[0] = 9.0
    cost[:7:3, 7:] = [[50.0] * 3, [20.0] * 3, [10.0] * 3]
    assert np.argmin(_total(cost, 3)) == 0
    cost[0, :7] = 60.0  # not clear: then a fit that failed says nothing
    assert np.argmin(_total(cost, 3)) == 6


def growing(x, speed, size, walls=None):
    """A dark bob of these sizes seen at these places, before a wall of 180, or of these greys though 180 was learned."""
    rows, columns = np.mgrid[0:100, 0:160]
    rng = np.random.default_rng(6)
    bobs = [ndtr((r - np.hypot(columns - a, rows - 50)) / EDGE) for a, r in zip(x, size)]
    grey = np.full(x.size, 180.0) if walls is None else walls
    pictures = [(g + (70 - g) * bob + rng.normal(0, 1.5, bob.shape)).astype(np.float32) for g, bob in zip(grey, bobs)]
    often = np.full((100, 160), 9, np.float32)

    def show(k, *_):
        return Guess(x[k], 50.0), Patch(pictures[k], np.full((100, 160), grey[k], np.float32), often, 0, 0)

    return Sightings(x, 50 + 0 * x, 0 * x, speed, show)


def test_a_size_that_grows_is_learned_though_the_bob_turns_beyond_the_rim():
    """Nearer to the camera on the right, where its slowest frames show only a part of it."""
    speed = np.abs(np.linspace(-1, 1, 40)) ** 0.5 * -300 + 300  # slow at both ends
    x = np.linspace(20, 158, 40)
    speed[x < 80] *= 0.3
    found = learn_looks(growing(x, speed, 11.0 + 0.02 * x), Look(12.0, 1.0, -105.0, 8.0), None, 1e-4, (100, 160))
    assert found.look.radius_free
    assert found.growth[0] == pytest.approx(0.02, abs=0.003)


def test_a_size_that_grows_much_stays_known():
    """Seen more often where it is small: learned as of the size it has there, it is not to be lost where it is large."""
    x = np.concatenate([np.linspace(22, 50, 22), np.linspace(115, 140, 14)])
    size = 14.0 + 0.03 * x
    found = learn_looks(growing(x, 0 * x + 20.0, size), Look(15.8, 1.0, -105.0, 8.0), None, 1.0, (100, 160))
    assert found.growth is not None
    assert found.growth[0] == pytest.approx(0.03, abs=0.003)


def test_a_size_that_grows_is_learned_though_something_dark_passes_where_the_bob_turns():
    """There it has another contrast, and tells nothing; where it is faster on that side it does."""
    speed = np.abs(np.linspace(-1, 1, 40)) ** 0.5 * -300 + 300
    x = np.linspace(24, 140, 40)
    walls = np.where(x > 129, 105.0, 180.0)
    size = np.where(x > 129, 14.0, 11.0 + 0.02 * x)
    found = learn_looks(growing(x, speed, size, walls), Look(12.0, 1.0, -105.0, 8.0), None, 1e-4, (100, 160))
    assert found.growth is not None
    assert found.growth[0] == pytest.approx(0.02, abs=0.003)


def test_a_wall_that_is_darker_on_one_side_does_not_change_which_sightings_tell():
    """There the bob has a third of the contrast: that side is asked for more, which are as little like the others."""
    x = np.linspace(24, 140, 40)
    speed = np.full(40, 300.0) + x
    speed[[0, 1, 2, 3, 34, 35, 36, 37, 38, 39]] = 20.0
    seen = growing(x, speed, np.full(40, 12.0), np.where(x < 82, 105.0, 180.0))
    found = learn_looks(seen, Look(12.0, 1.0, -80.0, 8.0), None, 1e-4, (100, 160))
    assert found.look.contrast == pytest.approx(-110, abs=3)


def test_what_a_rolling_shutter_shears_is_not_hidden():
    speed = np.linspace(0, 1000, 100)
    (slow, fast), (least_slow, least_fast) = _by_speed(speed, np.where(speed > 700, 0.8, 1.0))
    assert slow < 300 < 700 < fast
    assert least_slow == 0.85
    assert 0.65 <= least_fast <= 0.8


def test_a_window_on_something_that_moves_is_no_anchor():
    rng = np.random.default_rng(6)
    wall = 150 + rng.normal(0, 1, (240, 320))
    for x, y in ((40, 60), (250, 180), (60, 190)):
        wall[y - 9 : y + 9, x - 12 : x + 12] = 70.0
    pictures = []
    for k in range(8):
        picture = wall.copy()
        picture[100:120, 40 + 30 * k : 60 + 30 * k] = 90.0  # it passes
        pictures.append(np.clip(picture, 0, 255).astype(np.uint8))
    anchors = Anchors(pictures[0], np.zeros((240, 320), bool))
    passing = [100 - 8 <= y <= 120 + 8 for _, y in anchors.points]
    assert 0 < sum(passing) < len(passing)
    for picture in pictures[1:]:
        anchors.shift(picture)
    assert anchors.forget_passing()
    assert not any(100 - 8 <= y <= 120 + 8 for _, y in anchors.points)
    assert len(anchors) == len(passing) - sum(passing)
    shift = anchors.shift(pictures[3])
    assert np.hypot(shift.x_px, shift.y_px) < 0.1


def test_a_dark_thing_behind_the_bob_in_fading_light_hides_no_frame(tmp_path):
    """It has a fifth of its contrast there, and the wall beside it tells nothing of the light; but its outline is clear."""

    def light(t):
        return 1 - 1.2 * np.clip(t - 1.75, 0.0, 0.4)

    frames, x, y = swinging(3.0, light=light)
    for k in range(100, 180):  # after the frames read ahead
        left = 4 * (k - 100)
        bare = 1 - disc(x[k], y[k], 11.0, (H, W))
        bare[:, : max(0, left - 60)] = bare[:, left:] = 0.0
        frames[k][:] = np.where(bare > 0.5, 85 * light(k / 60), frames[k]).astype(np.uint8)
    found = track(film(tmp_path / "behind.mp4", frames))
    assert (found.status == OK).mean() > 0.93
    assert np.hypot(found.x_px - x, found.y_px - y)[found.ok].max() < 1.0


def test_someone_as_dark_as_the_bob_walks_by_behind_it(tmp_path):
    """Seven grey levels tell them apart, the other half of the outline where the bob is; less light on the wall does not
    explain such a picture, though it fits."""
    frames, x, y = swinging(3.4)
    rng = np.random.default_rng(8)
    late = np.arange(x.size) / 60 - 1.75  # after the frames read ahead
    left = np.where(late > 0, 192 + 18 * late, -99).astype(int)
    for k in np.flatnonzero(late > 0):
        bare = 1 - disc(x[k], y[k], 11.0, (H, W))
        body = np.zeros((H, W))
        body[:, left[k] : left[k] + 16] = bare[:, left[k] : left[k] + 16]
        frames[k][:] = np.clip(frames[k] * (1 - body) + (67.0 + rng.normal(0, 1, body.shape)) * body, 0, 255).astype(
            np.uint8
        )
    found = track(film(tmp_path / "dark.mp4", frames))
    meets = (x > left - 11) & (x < left + 27)
    assert meets.mean() > 0.08
    off = np.hypot(found.x_px - x, found.y_px - y)
    assert found.ok[meets].mean() > 0.9
    assert np.sqrt(np.mean(off[found.ok & meets] ** 2)) < 0.08  # with the light left free, 0.18


@pytest.mark.parametrize(("nearing", "larger"), [(8e-4, True), (0.0, False), (1e-4, False)])
def test_a_bob_that_nears_the_camera_on_its_way_is_larger_than_on_its_way_back(nearing, larger):
    """Seen where it turns, at either end; its size grows with speed too where blur widens it, which tells nothing."""
    vx = np.concatenate([np.linspace(-250, 250, 8), np.linspace(250, -250, 8)])
    x = np.repeat([40.0, 600.0], 8)
    sizes = 17 + nearing * vx + 2e-4 * np.abs(vx) + np.random.default_rng(6).normal(0, 0.03, 16)
    assert _nears(sizes, x, vx, 2800.0) is larger


def test_a_streak_that_shows_no_bob_says_nothing_of_the_exposure():
    bob = Look(10.0, 0.6, -67.0, 2.6)

    def fitted(k, look, exposure_s, centre):  # without a streak the bob, poorly; with one the empty wall, well
        fit = np.zeros(14)
        fit[2], fit[3], fit[8] = 10.0, 0.6, 0.9
        fit[7], fit[9] = (5.3 + 300 * exposure_s, -60.0) if exposure_s < 0.005 else (1.0, -6.0)
        return fit

    seen = SimpleNamespace(x_px=np.linspace(100, 500, 10), fit_from_far=fitted)
    assert not _exposure(seen, Looks(bob), np.arange(10), 1 / 30, None, {})


def lit_ball(x, y, radius):
    """A ball lit from the left above, with a highlight: (share of each pixel, brightness)."""
    rows, columns = np.mgrid[0:H, 0:W]
    right, down = (columns - x) / radius, (rows - y) / radius
    far = np.hypot(right, down)
    near = np.sqrt(np.clip(1 - far**2, 0, 1))
    lit = np.clip(-0.45 * right - 0.6 * down + 0.66 * near, 0, 1)
    glint = np.clip(-0.25 * right - 0.33 * down + 0.91 * near, 0, 1) ** 30
    return np.clip(radius * (1 - far) + 0.5, 0, 1), 40.0 + 40.0 * lit + 120.0 * glint


def test_a_ball_with_a_highlight_that_is_nowhere_slow_draws_a_streak(tmp_path):
    """At 15 frames a second with the shutter open for most of the time: what the streak leaves of the outline is no pattern."""
    rng, fps, exposed = np.random.default_rng(7), 15.0, 0.8
    t = np.arange(75) / fps
    parts = (np.arange(9) + 0.5) / 9 - 0.5
    fine = np.arange(t.size * 9) / (9 * fps)
    theta = np.interp((t[:, None] + exposed * parts / fps).clip(0), fine, angles(1.6 * fine, 0.35))
    x, y = 160 + 190 * np.sin(theta), 10 + 190 * np.cos(theta)
    frames = []
    for xs, ys in zip(x, y):
        level = np.mean(
            [190 + share * (shade - 190) for share, shade in (lit_ball(a, b, 14) for a, b in zip(xs, ys))], axis=0
        )
        frames.append(np.clip(level + rng.normal(0, 2, level.shape), 0, 255).astype(np.uint8))
    found = track(film(tmp_path / "ball.mp4", frames, fps))
    off = np.array([found.x_px - x[:, 4], found.y_px - y[:, 4]])[:, found.status == OK]
    assert found.meta["exposure_s"] == pytest.approx(exposed / fps, rel=0.1)
    assert (found.status == OK).mean() > 0.95
    assert np.hypot(*off.std(axis=1)) < 0.7  # what the light does is about the same on all frames

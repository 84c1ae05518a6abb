"""A post before the bob's way: drawn here, so that what it hides is known."""

from __future__ import annotations

import numpy as np
import pytest
from test_track import FPS, LENGTH, OMEGA, PIVOT, RADIUS, H, W, draw, film

from toolkit.track import OK, track
from toolkit.trackers.disc import fit_disc
from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.picture.background import Background
from toolkit.tracking.picture.front import Rhythm, enough_shows, find_front

pytest.importorskip("av")

POST = (166, 190)  # columns; the bob's middle goes from 137 to 183
LOOK = Look(RADIUS, 0.6, -130.0, 2.0)


def small_swing(t):
    """One of which the right turning point lies behind the post."""
    theta = 0.1 * np.exp(-0.02 * t) * np.cos(OMEGA * t + 2.0)
    return PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)


def visible(x, y):
    """How much of the bob the post leaves."""
    columns, rows = np.meshgrid(np.arange(W), np.arange(H))
    disc = np.hypot(columns - x, rows - y) < RADIUS
    return 1 - disc[:, POST[0] : POST[1]].sum() / disc.sum()


def patches(t, before=True, grey=120.0):
    """The post, so bright, before or behind the bob."""
    rng = np.random.default_rng(1)
    empty = np.full((H, W), 190.0, np.float32)
    empty[:, POST[0] : POST[1]] = grey
    for x, y in zip(*small_swing(t)):
        image = draw(x, y, rng, string=False, post=POST).astype(np.float32)
        image[:, POST[0] : POST[1]] += grey - 120.0
        if not before:
            rows, columns = np.mgrid[0:H, 0:W]
            image[np.hypot(columns - x, rows - y) < RADIUS] = 60.0
        x0, y0 = int(x) - 20, int(y) - 20
        window = (slice(y0, y0 + 41), slice(x0, x0 + 41))
        yield Guess(x, y), Patch(image[window], empty[window], np.full((41, 41), 9.0, np.float32), x0, y0)


def test_a_rhythm_holds_though_a_third_of_its_points_are_wrong():
    t = np.arange(100) / FPS
    x, y = small_swing(t)
    wrong = np.arange(100) % 3 == 0
    fits = {i: np.array([a + 15 * w, b + 8 * w]) for i, (a, b, w) in enumerate(zip(x, y, wrong))}
    rhythm = Rhythm.through(t, fits, 1.1 * 2 * np.pi / OMEGA)
    assert np.array_equal(rhythm.true, ~wrong)
    assert np.hypot(*(rhythm.position(t) - np.column_stack([x, y])).T).max() < 0.5


@pytest.mark.parametrize("grey", [120.0, 85.0])
def test_what_stands_before_the_way_is_found_and_nothing_else(grey):
    t = np.arange(90) / FPS
    seen = list(patches(t, grey=grey))
    back = Background((H, W))
    places = {i: (guess.x_px, guess.y_px) for i, (guess, _) in enumerate(seen)}
    front = find_front(lambda i, *_: seen[i], places, back, LOOK, 60.0)
    columns = np.flatnonzero(front.any(axis=0))
    assert abs(columns[0] - POST[0]) <= 3
    assert columns[-1] <= POST[1] + 3
    behind = list(patches(t, before=False, grey=grey))
    assert find_front(lambda i, *_: behind[i], places, back, LOOK, 60.0) is None


def test_a_disc_is_measured_by_what_is_not_hidden_of_it():
    for guess, patch in patches(np.arange(12) / FPS):
        before = patch.back < 150
        if not enough_shows(before, guess.x_px - patch.x_px, guess.y_px - patch.y_px, RADIUS):
            continue
        masked = patch._replace(seen=np.where(before, -1e9, patch.seen).astype(np.float32))
        found = fit_disc(masked, LOOK, guess)
        assert found[0] + patch.x_px == pytest.approx(guess.x_px, abs=0.15)


@pytest.mark.parametrize(("x", "half", "enough"), [(40, 5, True), (30, 30, False), (14, 12, True), (40, 60, False)])
def test_how_much_must_show(x, half, enough):
    front = np.zeros((80, 80), bool)
    front[:, max(0, x - half) : x + half] = True
    assert enough_shows(front, 40.0, 40.0, 16.0) is enough


def test_a_small_swing_half_behind_a_post(tmp_path):
    t = np.arange(150) / FPS
    x, y = small_swing(t)
    rng = np.random.default_rng(0)
    film(tmp_path / "post.mp4", (draw(a, b, rng, post=POST) for a, b in zip(x, y)))
    found = track(tmp_path / "post.mp4")
    shown = np.array([visible(a, b) for a, b in zip(x, y)])
    assert (shown < 0.5).mean() > 0.3  # or there is nothing to see
    assert (found.status[shown == 1] == OK).all()
    assert not (found.status[shown < 0.5] == OK).any()
    off = np.hypot(found.x_px - x, found.y_px - y)[found.ok]
    assert off.max() < 0.35
    assert np.sqrt(np.mean(off**2)) < 0.1

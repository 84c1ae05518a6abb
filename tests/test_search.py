"""The search for the bob and what follows it: pictures drawn here, whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_track import LENGTH, PIVOT, RADIUS, H, W, angles, film

from toolkit.track import OK, track
from toolkit.trackers.localiser import Look
from toolkit.tracking.begin.acquire import _is_shadow_of, find_bob
from toolkit.tracking.begin.search import find_round_movers, find_round_near
from toolkit.tracking.begin.trail import Rough
from toolkit.tracking.geometry.swing import fit_swing, start_swing
from toolkit.tracking.picture.plane import silhouette, still_picture
from toolkit.tracking.picture.sight import Sight, best_sight
from toolkit.video import Frame

pytest.importorskip("av")
cv2 = pytest.importorskip("cv2")


def disc(x, y, radius, shape=(120, 160)):
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]]
    return np.clip(radius + 0.5 - np.hypot(columns - x, rows - y), 0, 1)


def test_the_still_picture_is_the_median():
    planes = np.random.default_rng(1).integers(0, 256, (9, 40, 50), dtype=np.uint8)
    assert np.array_equal(still_picture(list(planes)), np.median(planes, axis=0))


@pytest.mark.parametrize("light", [0.6, 1.0, 1.4])
def test_a_silhouette_is_whole_in_any_light_and_pattern(light):
    rng = np.random.default_rng(2)
    wall = 120 + 15 * np.sin(np.arange(160) / 9.0)[None, :] * np.ones((120, 1))
    bob = disc(80, 60, 20)
    stripes = np.where(np.arange(160)[None, :] % 12 < 6, 60.0, 175.0)
    shown = light * ((1 - bob) * wall + bob * stripes) + rng.normal(0, 1, wall.shape)
    differs = silhouette(shown, wall)
    assert differs[bob > 0.99].mean() > 90
    assert differs[bob == 0].mean() < 15


def test_a_round_outline_is_centred_though_a_part_of_it_is_missing():
    picture = 100 * disc(73.3, 58.8, 16).astype(np.float32)
    picture[:, 81:] = 0.0  # a post: more than a third of the outline is gone
    x, y, share = find_round_near(picture, 16.0, 1)
    assert np.hypot(x - 73.3, y - 58.8) < 0.6
    assert share > 0.3


def test_what_passes_by_does_not_take_all_places_from_a_bob_of_its_size():
    rng = np.random.default_rng(3)
    pictures = []
    for k in range(12):
        x = 60 + 30 * np.cos(0.8 * k)
        level = 190 - 130 * disc(10 + 12 * k, 30, 9) - 90 * disc(x, 90, 8)
        pictures.append((level + rng.normal(0, 1, level.shape)).astype(np.float32))
    found = find_round_movers(pictures, 1)
    assert any(abs(h.y_px - 90) < 3 and 6 < h.radius_px < 11 for h in found)
    assert any(abs(h.y_px - 30) < 3 for h in found)


def swinging(seconds, lost=(), light=None, behind=None):
    """(frames, x, y) of a swing of 0.3 rad before `behind`, in `light` (t -> factor), without the frames `lost`."""
    rng = np.random.default_rng(0)
    t = np.arange(round(seconds * 60)) / 60
    theta = angles(t)
    x, y = PIVOT[0] + LENGTH * np.sin(theta), PIVOT[1] + LENGTH * np.cos(theta)
    wall = np.full((H, W), 190.0) if behind is None else behind
    keep = [k for k in range(t.size) if k not in lost]
    frames = []
    for k in keep:
        bob = disc(x[k], y[k], RADIUS, (H, W))
        level = (1.0 if light is None else light(t[k])) * ((1 - bob) * wall + 60.0 * bob)
        frames.append(np.clip(level + rng.normal(0, 1.5, level.shape), 0, 255).astype(np.uint8))
    return frames, x[keep], y[keep]


def test_flicker_and_fading_light_hide_no_frame(tmp_path):
    frames, x, y = swinging(3.0, light=lambda t: (0.85 + 0.15 * np.sin(2 * np.pi * 20 * t)) * (1 - 0.1 * t))
    found = track(film(tmp_path / "flicker.mp4", frames))
    assert (found.status == OK).mean() > 0.97
    assert np.hypot(found.x_px - x, found.y_px - y)[found.ok].max() < 0.5


def test_lost_frames_lose_no_bob(tmp_path):
    lost = {20, 21, 45, 46, 47, 81, 111, 112, 140}
    frames, x, y = swinging(3.0, lost)
    found = track(film(tmp_path / "lost.mp4", frames))
    assert (found.status == OK).mean() > 0.95
    assert np.hypot(found.x_px - x, found.y_px - y)[found.ok].max() < 0.5


def shown(pictures):
    """Frames, 60 a second."""
    return [Frame(k, k / 60, picture, lambda kind: None) for k, picture in enumerate(pictures)]


@pytest.mark.parametrize(("radius_px", "off_px", "level"), [(2.5, 4, 160.0), (3.0, 3, 160.0), (3.0, 4, 170.0)])
def test_a_highlight_is_not_taken_for_the_bob(radius_px, off_px, level):
    """On a dark bob before a rough wall it is the clearest thing that swings; but what is about it swings too."""
    rough = cv2.GaussianBlur(np.random.default_rng(5).normal(0, 1, (H, W)), (0, 0), 4)
    frames, x, y = swinging(1.6, behind=140 + 14 * rough / rough.std())
    for frame, a, b in zip(frames, x, y):
        spot = disc(a - off_px, b - off_px, radius_px, (H, W))
        frame[:] = (frame * (1 - spot) + level * spot).astype(np.uint8)
    found = find_bob(shown(frames), None, None, "drawn")
    assert found.look.radius_px == pytest.approx(RADIUS, abs=1)
    assert np.median([np.hypot(px - x[k], py - y[k]) for k, (px, py) in found.points.items()]) < 0.5


@pytest.mark.parametrize(("x_px", "y_px"), [(96.0, 177.0), (100.0, 171.0), (92.0, 177.0)])
def test_what_stands_where_the_bob_turns_and_looks_like_it_does_not_hold_it(x_px, y_px):
    bob_like = disc(x_px, y_px, RADIUS, (H, W))
    wall = np.full((H, W), 190.0) * (1 - bob_like) + 60.0 * bob_like
    frames, x, y = swinging(1.6, behind=wall)
    found = find_bob(shown(frames), None, None, "drawn")
    near = [np.hypot(px - x[k], py - y[k]) < 2 for k, (px, py) in found.points.items()]
    assert sum(near) > 0.85 * len(frames)


def test_a_wall_full_of_things_is_no_wall_of_one_level(tmp_path):
    wall = np.full((H, W), 190.0)
    for k in range(14):  # round and square things all along the bob's way
        cv2.rectangle(wall, (20 + 20 * k, 150 + 7 * (k % 5)), (32 + 20 * k, 200), 90.0 + 9 * k, -1)
        cv2.circle(wall, (30 + 19 * k, 140 + 5 * (k % 3)), 8, 230.0 - 11 * k, -1)
    frames, x, y = swinging(2.0, behind=wall)
    found = track(film(tmp_path / "clutter.mp4", frames))
    assert (found.status == OK).mean() > 0.8
    assert np.median(np.hypot(found.x_px - x, found.y_px - y)[found.ok]) < 0.3


@pytest.mark.parametrize(
    ("off", "look", "shadows"),
    [
        ((-24, 22), Look(11.0, 3.5, -49.0, 1.2), True),
        ((-24, 22), Look(11.0, 0.5, -90.0, 1.2), False),  # as clear as the other
        ((4, 2), Look(5.0, 3.5, -49.0, 1.2), False),  # a part of it
        (None, Look(11.0, 3.5, -49.0, 1.2), False),  # on a way of its own
    ],
)
def test_what_goes_beside_another_fainter_and_softer_is_its_shadow(off, look, shadows):
    t = np.arange(60) / 30
    x, y = 200 + 100 * np.sin(4 * t), 300 - 20 * np.sin(4 * t) ** 2
    u, v = (x + off[0], y + off[1]) if off else (100 + 50 * t, 100 + 0 * t)
    swing = fit_swing(t, x, y, np.full(60, 0.3), start_swing(t, x, y))
    bob = Rough(Look(11.0, 0.6, -96.0, 7.7), swing, dict(enumerate(zip(x, y))), 40.0, Sight())
    other = Rough(look, swing, dict(enumerate(zip(u, v))), 70.0, Sight())
    assert _is_shadow_of(other, bob) is shadows
    assert not _is_shadow_of(bob, other)
    lost = {i: (a + 40, b) if i in (20, 21, 22, 50, 51) else (a, b) for i, (a, b) in bob.points.items()}
    astray = replace(bob, points=lost, score=1.0)  # behind a post something else is taken for the bob
    assert _is_shadow_of(other, astray) is shadows


def test_a_post_beside_the_bob_does_not_make_its_brightness_useless():
    wall = np.full((60, 120), 190.0)
    wall[:, 68:71] = 60.0
    bob = disc(52, 30, 9, wall.shape)
    luma = (wall * (1 - bob) + 140 * bob).astype(np.uint8)
    tint = (bob[::2, ::2] > 0.5).astype(np.uint8)
    frame = Frame(0, 0.0, luma, lambda kind: (128 - 5 * tint, 128 + 5 * tint))
    assert best_sight([frame], [(52.0, 30.0)], 9.0).name == "brightness"

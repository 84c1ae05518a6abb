"""A brief look at the film first; a thorough one where its track is not sound, and then the sounder of the two."""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_track import LENGTH, PIVOT, angles, draw, film, swing_clip

from toolkit.errors import UsageError
from toolkit.sentence import said
from toolkit.track import track
from toolkit.tracking.opening import Asked, begin, openings
from toolkit.tracking.soundness import HOPELESS, SOUND, faults, soundest
from toolkit.video import open_video

pytest.importorskip("av")

STRAYS = said("track.strays", "it strays")
HARMLESS = said("track.clock_slips", "the clock slips")


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    path = tmp_path_factory.mktemp("look") / "swing.mp4"
    return path, swing_clip(path)


def test_a_track_is_sound_if_it_has_nearly_all_frames_and_warns_of_no_places(clip):
    whole = track(clip[0])

    def faults_of(measured, warnings, log=()):
        status = np.where(np.arange(whole.frame.size) < measured * whole.frame.size, "ok", "lost")
        return faults(replace(whole, status=status, meta={**whole.meta, "warnings": warnings, "log": log}))

    assert faults_of(0.95, [HARMLESS]) < SOUND
    assert faults_of(0.85, []) > SOUND
    assert faults_of(1.0, [STRAYS]) >= SOUND
    assert faults_of(0.7, []) > faults_of(1.0, [STRAYS])
    assert faults_of(0.7, [], [said("track.held_still", "a hand catches it")]) < SOUND


def test_a_shadow_that_is_tracked_well_does_not_replace_its_bob(clip):
    bob = track(clip[0])
    lame = replace(bob, meta={**bob.meta, "warnings": [STRAYS]})
    soft = {**bob.meta, "contrast": 0.6 * bob.meta["contrast"], "edge_px": 3 * bob.meta["edge_px"]}
    shadow = replace(bob, x_px=bob.x_px + 16, y_px=bob.y_px + 18, meta=soft)
    kept = soundest([lame, shadow])
    assert np.array_equal(kept.x_px, bob.x_px)
    assert "apart" in kept.meta["warnings"][-1]
    elsewhere = replace(shadow, x_px=bob.x_px * 0.5)  # goes its own way
    assert np.array_equal(soundest([lame, elsewhere]).x_px, elsewhere.x_px)


def test_a_brief_look_is_for_films_that_show_enough_in_it():
    looks = {
        fps: openings(SimpleNamespace(fps_header=fps, width_px=640, height_px=480))
        for fps in (None, 30.0, 59.94, 120.0)
    }
    assert [look.brief for look in looks[59.94]] == [True, False, False, False, False]
    assert looks[120.0] == looks[59.94]
    assert looks[None] == looks[30.0] == looks[59.94][1:]
    spans = [look.most_s for look in looks[30.0] if look.every == 1]
    assert spans == sorted(spans)
    large = openings(SimpleNamespace(fps_header=60.0, width_px=3840, height_px=2160))
    assert sum(look.every == 1 and not look.brief for look in large) == 1  # memory holds no longer a look


def test_a_clear_bob_needs_no_thorough_look(clip):
    path, (_, _, x, y) = clip
    brief, thorough = openings(open_video(path))[:2]
    follower, _ = begin(open_video(path), Asked(), brief)
    other, _ = begin(open_video(path), Asked(), thorough)
    assert len(follower.first) < 0.6 * len(other.first)
    found = track(path)
    assert np.hypot(found.x_px - x, found.y_px - y).max() < 0.2


def test_a_bob_that_hardly_moves_yet_gets_a_thorough_look(tmp_path):
    t = np.arange(240) / 60.0
    swung = np.concatenate([np.full(45, 0.3), angles(t[:-45])])
    x, y = PIVOT[0] + LENGTH * np.sin(swung), PIVOT[1] + LENGTH * np.cos(swung)
    rng = np.random.default_rng(1)
    path = film(tmp_path / "late.mp4", (draw(a, b, rng) for a, b in zip(x, y)))
    brief = openings(open_video(path))[0]
    assert begin(open_video(path), Asked(), brief) is None
    found = track(path)
    assert np.hypot(found.x_px - x, found.y_px - y)[found.ok].max() < 0.5


def test_of_some_tracks_the_soundest_is_kept_and_that_they_differ_is_said(clip):
    one = track(clip[0])
    lame = replace(one, x_px=one.x_px + 7.0, meta={**one.meta, "warnings": [STRAYS]})
    for kept in (soundest([lame, one]), soundest([lame, lame, one])):
        assert np.array_equal(kept.x_px, one.x_px)
        (warning,) = kept.meta["warnings"]
        assert "7.0 px apart" in warning
    assert soundest([replace(lame, x_px=one.x_px), one]).meta["warnings"] == []
    gappy = replace(one, status=np.where(np.arange(one.status.size) % 4, one.status, "lost"))
    assert soundest([lame, gappy]).x_px[0] == lame.x_px[0]  # neither is sound
    first = np.arange(one.status.size) < one.status.size // 2
    halves = [replace(one, status=np.where(part, one.status, "lost")) for part in (first, ~first)]
    assert "no common frame" in soundest(halves).meta["warnings"][0]


def test_a_bob_said_to_be_outside_the_picture_is_misuse(clip):
    with pytest.raises(UsageError, match="outside the picture"):
        track(clip[0], bob=(-3.0, 20.0))


def test_what_strays_as_far_as_the_bob_is_large_is_not_the_bob_and_the_clip_is_searched_over_a_longer_time(
    clip, monkeypatch
):
    bob = track(clip[0])
    astray = replace(
        bob, x_px=bob.x_px * 0.5, meta={**bob.meta, "residual_rms_px": bob.radius_px, "warnings": [STRAYS]}
    )
    assert faults(bob) < SOUND < HOPELESS < faults(astray)
    assert soundest([astray, bob]).meta["warnings"] == []  # that what is no bob is elsewhere says nothing

    module, searched = importlib.import_module("toolkit.track"), []
    follow, end = module.follow_bob, module.finish

    def noted(video, asked, opening, progress):
        searched.append(opening.every)
        return follow(video, asked, opening, progress)

    def finished(*what):
        end(*what)
        return bob if searched[-1] > 1 else astray

    monkeypatch.setattr(module, "follow_bob", noted)
    monkeypatch.setattr(module, "finish", finished)
    assert np.array_equal(track(clip[0]).x_px, bob.x_px)
    assert searched[-1] == 3

"""Two pendulums in the picture: which is meant, no picture tells, and that is said. Films drawn here."""

from __future__ import annotations

import numpy as np
import pytest
from test_search import disc
from test_track import FPS, H, W, angles, film

from toolkit.track import track

pytest.importorskip("av")

LENGTH, RADIUS = 150.0, 11.0


def swings(path, others):
    """A film of a bob about (90, 20) px, and of `others`: (pivot x, phase s, rate, radius, brightness)."""
    rng = np.random.default_rng(3)
    t = np.arange(150) / FPS
    frames = []
    for at in t:
        level = np.full((H, W), 190.0)
        for pivot_px, phase_s, rate, radius_px, bright in [(90.0, 0.0, 1.0, RADIUS, 60.0), *others]:
            theta = angles(np.array([0.0, rate * (at + phase_s)]))[1] if at + phase_s > 0 else 0.3
            bob = disc(pivot_px + LENGTH * np.sin(theta), 20 + LENGTH * np.cos(theta), radius_px, (H, W))
            level = (1 - bob) * level + bob * bright
        frames.append(np.clip(level + rng.normal(0, 1.5, level.shape), 0, 255).astype(np.uint8))
    return film(path, frames)


def told(path):
    return "track.rival" in {getattr(warning, "key", "") for warning in track(path).meta["warnings"]}


@pytest.mark.parametrize(("phase_s", "rate"), [(0.4, 1.0), (0.1, 1.3)])
def test_another_pendulum_is_told_of(tmp_path, phase_s, rate):
    assert told(swings(tmp_path / "two.mp4", [(230.0, phase_s, rate, RADIUS, 60.0)]))


def test_what_goes_to_and_fro_with_the_bob_is_none(tmp_path):
    """Its reflection in a window, fainter and smaller."""
    assert not told(swings(tmp_path / "two.mp4", [(230.0, 0.0, 1.0, 0.9 * RADIUS, 90.0)]))
    assert not told(swings(tmp_path / "one.mp4", []))

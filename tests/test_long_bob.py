"""A bob that is far from round: a brass cylinder that tilts with its string. Films drawn here."""

from __future__ import annotations

import numpy as np
import pytest
from test_track import H, W, angles, film

from toolkit.track import OK, track

pytest.importorskip("av")


def brass(half_px):
    """A cylinder with two bright lines along it: share of the pixels that are so far (px) across and along it, and brightness."""

    def show(across, along):
        share = np.clip(half_px[0] + 0.5 - abs(across), 0, 1) * np.clip(half_px[1] + 0.5 - abs(along), 0, 1)
        u = np.clip(across / half_px[0], -1, 1)
        shine = (
            0.35 + 0.5 * np.exp(-(((u + 0.35) / 0.18) ** 2)) + 0.25 * np.exp(-(((u - 0.55) / 0.25) ** 2)) - 0.2 * u * u
        )
        return share, 164 * shine**0.45

    return show


@pytest.mark.parametrize("half_px", [(12.0, 24.0), (15.0, 30.0)])
def test_a_cylinder_that_tilts_with_its_string_is_found_by_its_middle(tmp_path, half_px):
    """A circle of whatever size lies on it now higher, now lower, now across."""
    rng, fps = np.random.default_rng(11), 30.0
    show = brass(half_px)
    fine = np.arange(150 * 15) / (fps * 15)
    every = angles(fine, 0.6)
    rows, columns = np.mgrid[0:H, 0:W]
    frames, theta = [], []
    for k in range(2, 150):
        parts = every[15 * k - 2 : 15 * k + 3]
        level = np.zeros((H, W))
        for tilt in parts:
            right, down = columns - 160 - 170 * np.sin(tilt), rows - 20 - 170 * np.cos(tilt)
            across, along = right * np.cos(tilt) - down * np.sin(tilt), right * np.sin(tilt) + down * np.cos(tilt)
            string = 190 - 100 * np.clip(1.2 - abs(across), 0, 1) * (along < 0) * (rows > 20)
            share, shade = show(across, along)
            level += (string + share * (shade - string)) / len(parts)
        theta.append(every[15 * k])
        frames.append(np.clip(level + rng.normal(0, 2, level.shape), 0, 255).astype(np.uint8))
    found, theta = track(film(tmp_path / "cylinder.mp4", frames, fps)), np.array(theta)
    ok = found.status == OK
    right, down = found.x_px - 160 - 170 * np.sin(theta), found.y_px - 20 - 170 * np.cos(theta)
    across, along = right * np.cos(theta) - down * np.sin(theta), right * np.sin(theta) + down * np.cos(theta)
    assert ok.mean() > 0.95
    assert across[ok].std() < 0.2  # it makes the angle
    assert along[ok].std() < 0.5

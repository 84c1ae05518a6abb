"""Something that passes behind the bob (a person, a shadow on the wall): the background that was learned does not show it."""

from __future__ import annotations

import numpy as np

from toolkit.trackers.localiser import Guess, Look, Patch
from toolkit.tracking.picture.looks import light_on

_BESIDE = 3.0  # times the edge's width, and two pixels more, from the outline: so far out nothing of the bob is seen
# of the bob's contrast: by so much it differs from the background learned; and on so much of what is beside the bob
_OTHER, _SOME = 0.2, 0.08


def surroundings(patch: Patch, look: Look, guess: Guess) -> Patch | None:
    """The patch with what is seen just beside a bob of these looks, guessed there, drawn on behind it (and outwards). None
    where that is what stands still there anyway."""
    import cv2

    rows, columns = patch.image.shape
    x, y = np.arange(columns) - (guess.x_px - patch.x_px), np.arange(rows)[:, None] - (guess.y_px - patch.y_px)
    streak = np.hypot(guess.streak_x_px, guess.streak_y_px) + 1e-9
    ux, uy = guess.streak_x_px / streak, guess.streak_y_px / streak
    along = np.clip(x * ux + y * uy, -0.5 * streak, 0.5 * streak)
    x, y = x - along * ux, y - along * uy  # from the nearest place of its middle's way
    longer = (look.radius_px + _BESIDE * look.edge_px + 2) / np.maximum(np.hypot(x, y), 1e-9) - 1
    there = np.arange(rows)[:, None] + y * longer, np.arange(columns) + x * longer
    v, u = (np.rint(place).astype(int).clip(0, size - 1) for place, size in zip(there, (rows, columns)))
    beside, still = (cv2.blur(picture, (3, 3))[v, u] for picture in (patch.image, patch.back))
    if np.mean(np.abs(beside - light_on(patch) * still) > _OTHER * abs(look.contrast)) < _SOME:
        return None
    return patch._replace(back=beside, seen=np.where(patch.seen < 0, patch.seen, 0).astype(np.float32))

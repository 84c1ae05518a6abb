"""What the picture is without the bob: a running mean of each pixel over the frames in which nothing covers it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np


class Background:
    """Mean picture `mean` (h, w) float32 and in how many frames each pixel was seen, `seen` (h, w) float32."""

    def __init__(self, shape: tuple[int, int], fill: float = 0.0) -> None:
        self.mean = np.full(shape, fill, np.float32)
        self.seen = np.zeros(shape, np.float32)

    def add(
        self,
        plane: np.ndarray,
        box: tuple[int, int, int, int],
        bob: tuple[float, float, float],
        pivot: tuple[float, float] | None,
        gain: float = 1.0,
        most: float = 60.0,
    ) -> None:
        """Take in the piece box = (x0, y0, x1, y1) of `plane`, whose first pixel is (x0, y0) of the whole frame.

        The bob (x, y, radius to leave out) and the string to the pivot do not count. After `most` frames old ones
        fade, so that slow changes of light are followed.
        """
        px, py = pivot if pivot is not None else (np.nan, np.nan)
        _compiled()(plane, self.mean, self.seen, *box, *bob, px, py, 1.0 / gain, most)

    def window(self, x0: int, y0: int, width: int, height: int, dx: float, dy: float) -> tuple[np.ndarray, np.ndarray]:
        """Mean and seen of the pixels from (x0, y0) on, moved by a fraction of a pixel; beyond the rim the rim's."""
        import cv2

        back = np.array([[1.0, 0.0, x0 - dx], [0.0, 1.0, y0 - dy]])
        how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        a, b = max(0, min(x0 - 2, self.mean.shape[1] - 4)), max(0, min(y0 - 2, self.mean.shape[0] - 4))
        c, d = min(self.mean.shape[1], a + width + 4), min(self.mean.shape[0], b + height + 4)
        back[:, 2] -= (a, b)
        mean, seen = (
            cv2.warpAffine(p[b:d, a:c], back, (width, height), flags=how, borderMode=cv2.BORDER_REPLICATE)
            for p in (self.mean, self.seen)
        )
        return mean, seen

    def fill_gaps(self, box: tuple[int, int, int, int]) -> None:
        """Give pixels of the box that were never seen the level of seen pixels near them (`seen` stays 0)."""
        import cv2

        x0, y0, x1, y1 = box
        mean, seen = self.mean[y0:y1, x0:x1], self.seen[y0:y1, x0:x1]
        known = (seen > 0).astype(np.float32)
        if not known.any():
            return
        level = np.full_like(mean, float(mean[seen > 0].mean()))
        for width in (81, 31, 11, 5):
            weight = cv2.blur(known, (width, width))
            near = cv2.blur(mean * known, (width, width)) / np.maximum(weight, 1e-6)
            level = np.where(weight > 0.02, near, level)
        np.copyto(mean, level, where=known == 0)


@cache
def _compiled() -> Any:
    import numba

    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def add(plane, mean, seen, x0, y0, x1, y1, bx, by, radius, px, py, factor, most):
        string = 0.0 if np.isnan(px) else 1.0
        ux, uy = (px - bx, py - by) if string else (1.0, 0.0)
        length = np.sqrt(ux * ux + uy * uy) + 1e-9
        ux, uy = ux / length, uy / length
        for y in range(y1 - y0):
            row, known, new = mean[y0 + y, x0:x1], seen[y0 + y, x0:x1], plane[y, : x1 - x0]
            dy = y0 + y - by
            for x in range(x1 - x0):  # without a branch, so that several pixels are done at once
                dx = x0 + x - bx
                along = dx * ux + dy * uy
                wide = string * (4.0 + 0.25 * max(0.0, 2 * radius - along))
                hidden = (dx * dx + dy * dy < radius * radius) | ((along > 0) & (abs(dx * uy - dy * ux) < wide))
                n = min(known[x] + 1.0, most)
                row[x] += 0.0 if hidden else (new[x] * factor - row[x]) / n
                known[x] = known[x] if hidden else n

    return add

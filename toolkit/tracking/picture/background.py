"""What the picture is without the bob: a running mean of each pixel over the frames in which nothing covers it."""

from __future__ import annotations

import math

import numpy as np

from toolkit.motion.compiled import address, call, kernel

_MOST = 60.0  # frames
_BEFORE = -1e9  # plus one it stays what it is, and what is mixed with it is negative


class Background:
    """Mean picture `mean` (h, w) float32 and in how many frames each pixel was seen, `seen` (h, w) float32: negative where what
    is seen stands before the bob's way."""

    def __init__(self, shape: tuple[int, int], fill: float = 0.0) -> None:
        self.mean = np.full(shape, fill, np.float32)
        self.seen = np.zeros(shape, np.float32)
        self._numbers = np.empty(7)
        self._at = address(self.mean), address(self.seen), address(self._numbers)

    def add(
        self,
        plane: np.ndarray,
        box: tuple[int, int, int, int],
        bob: tuple[float, float, float],
        pivot: tuple[float, float] | None,
        gain: float = 1.0,
        most: float = _MOST,
    ) -> None:
        """Take in the piece box = (x0, y0, x1, y1) of `plane`, whose first pixel is (x0, y0) of the whole frame.

        The bob (x, y, radius to leave out) and the string to the pivot do not count. After `most` frames old ones
        fade, so that slow changes of light are followed.
        """
        x0, y0, x1, y1 = box
        bx, by, *rest = _hidden(bob, pivot, gain, most)
        self._numbers[:] = bx - x0, by - y0, *rest
        plane = np.ascontiguousarray(plane, np.float32)
        width, (mean, seen, numbers) = self.mean.shape[1], self._at
        skipped = 4 * (y0 * width + x0)
        add = kernel("add", "toolkit.tracking.picture._back_kernel", "the background's mean")
        call(add, plane.ctypes.data, mean + skipped, seen + skipped, numbers, y1 - y0, x1 - x0, plane.shape[1], width)

    def add_all(
        self,
        pictures: list[np.ndarray],
        shifts: list[tuple[int, int]],
        box: tuple[int, int, int, int],
        bobs: list[tuple[float, float, float]],
        pivot: tuple[float, float] | None,
    ) -> None:
        """Take in the box of each whole picture (h, w) uint8, whose pixels lie one beside the other in each row, moved by its
        shift (x, y): as `add` does one by one, but that none fades."""
        height, width = self.mean.shape
        x0, y0, x1, y1 = box
        table = [
            (p.ctypes.data, p.strides[0], dx, dy, max(x0, -dx), max(y0, -dy), min(x1, width - dx), min(y1, height - dy))
            for p, (dx, dy) in zip(pictures, shifts)
        ]
        each = np.array([_hidden(bob, pivot) for bob in bobs])
        arrays = np.array(table, np.int64), self.mean, self.seen, each, np.empty(2 * width, np.float32)
        add_all = kernel("add_all", "toolkit.tracking.picture._back_kernel", "the background's mean")
        call(add_all, *(address(a) for a in arrays), len(table), *box, width)

    def stand_before(self, front: np.ndarray) -> None:
        """What is seen at these pixels, (h, w) bool, hides the bob."""
        self.seen[front] = _BEFORE

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
        gaps = seen <= 0
        if gaps.all() or not gaps.any():
            return
        whole = float(mean[~gaps].mean())
        rows, columns = (np.flatnonzero(gaps.any(axis=axis)) for axis in (1, 0))
        about = np.s_[max(0, rows[0] - 41) : rows[-1] + 42, max(0, columns[0] - 41) : columns[-1] + 42]
        mean, seen = mean[about], seen[about]
        known = (seen > 0).astype(np.float32)
        level = np.full_like(mean, whole)
        for width in (81, 31, 11, 5):
            weight = cv2.blur(known, (width, width))
            near = cv2.blur(mean * known, (width, width)) / np.maximum(weight, 1e-6)
            level = np.where(weight > 0.02, near, level)
        np.copyto(mean, level, where=known == 0)


def _hidden(
    bob: tuple[float, float, float], pivot: tuple[float, float] | None, gain: float = 1.0, most: float = _MOST
) -> tuple[float, ...]:
    """What the kernel is to know of one picture."""
    bx, by, radius = bob
    ux, uy = (pivot[0] - bx, pivot[1] - by) if pivot is not None else (0.0, 0.0)
    length = math.sqrt(ux * ux + uy * uy) + 1e-9
    return bx, by, radius, ux / length, uy / length, 1 / gain, most

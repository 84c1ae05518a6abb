"""How the camera moved: shift and roll of the still background between the first frame and any other.

Small windows on the background's best corners are followed by Lucas–Kanade (inverse compositional, gradients of the
first frame); a shift and a roll are fitted to them, windows that disagree (something passed before them) are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.motion.compiled import address, call, kernel
from toolkit.tracking.picture.plane import shrink


class CameraShift(NamedTuple):
    """Shift (px) and roll (rad) about `centre`, the middle of what was followed, against the first frame, and the uncertainties of
    the shift (per axis) and of the roll."""

    x_px: float
    y_px: float
    roll_rad: float
    centre_x_px: float
    centre_y_px: float
    sigma_px: float
    roll_sigma_rad: float = 0.0

    def at(self, x_px: float, y_px: float) -> tuple[float, float]:
        """How far the still point that was at (x, y) in the first frame has moved."""
        dx, dy = x_px - self.centre_x_px, y_px - self.centre_y_px
        return self.x_px - self.roll_rad * dy, self.y_px + self.roll_rad * dx


STILL = CameraShift(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_HALF = 12
_BLUR = 3
_WIDTH = 640  # px: so wide a picture shows where corners are
_WORST_SIGMA_PX = 0.15
_ROLL = 0.004  # rad: so far hands roll a camera (a standard deviation, by judgement)
_WINDOW_PX = 0.03  # what a window's place may be off by for other reasons than noise


class Anchors:
    """Windows of the first frame that stand still, and their shift in any other frame."""

    def __init__(self, luma: np.ndarray, moving: np.ndarray, most: int = 24) -> None:
        """`moving` (h, w) bool is True where the bob or the string may come."""
        import cv2

        factor = max(1, luma.shape[1] // _WIDTH)
        small = shrink(luma, factor).astype(np.uint8)
        mask = np.where(moving[factor // 2 :: factor, factor // 2 :: factor], 0, 255).astype(np.uint8)
        mask = np.ascontiguousarray(mask[: small.shape[0], : small.shape[1]])
        rim = -(-(_HALF + 4) // factor)
        mask[:rim], mask[-rim:], mask[:, :rim], mask[:, -rim:] = 0, 0, 0, 0
        smooth = cv2.GaussianBlur(small, (0, 0), 1.0 / factor)
        apart, block = 2.0 * _HALF / factor, max(3, round(9 / factor) | 1)
        corners = cv2.goodFeaturesToTrack(smooth, most, 0.01, apart, mask=mask, blockSize=block)
        points = np.zeros((0, 2)) if corners is None else (corners.reshape(-1, 2) + 0.5) * factor - 0.5
        noise = 1.0 + _pixel_noise(luma)
        points = np.round(points).astype(np.int64)
        windows = np.zeros((len(points), 2 * _HALF + 1, 2 * _HALF + 1), np.float32)
        for window, (x, y) in zip(windows, points.tolist()):
            window[:] = _window(luma, x, y)
        good = _place_sigma(windows, noise) < _WORST_SIGMA_PX
        self.points, self.windows = points[good], windows[good]
        self._centre()
        self._last = np.zeros((len(self.points), 2))
        self._found = np.zeros(len(self.points))  # on how many pictures each window was
        self._asked = 0

    def __len__(self) -> int:
        return len(self.points)

    def forget_passing(self) -> bool:
        """Drop the windows that were not found again on half of the pictures: they lay on something that moves (a string). Were
        there any?"""
        stays = self._found >= 0.5 * self._asked
        self.points, self.windows, self._last = self.points[stays], self.windows[stays], self._last[stays]
        self._found = self._found[stays]
        self._centre()
        return not stays.all()

    def _centre(self) -> None:
        """Shift and roll about the windows' middle are measured independently."""
        self.centre = (float(self.points[:, 0].mean()), float(self.points[:, 1].mean())) if len(self) else (0.0, 0.0)

    def shift(self, luma: np.ndarray) -> CameraShift | None:
        """The camera's shift in this frame; None where the windows are too few or disagree."""
        n = len(self.points)
        if n < 2:
            return None
        moved = np.zeros((n, 4))
        follow = kernel("follow", "toolkit.tracking.picture._anchor_kernel", "the camera's shift")
        call(
            follow, luma.ctypes.data, address(self.windows), address(self.points), address(self._last), address(moved),
            n, self.windows.shape[1], *luma.shape, *luma.strides,
        )  # fmt: skip
        good = moved[:, 3] > 0
        self._found += good
        self._asked += 1
        if good.sum() < 2:
            return None
        sigma = np.hypot(moved[:, 2], _WINDOW_PX)
        middle = np.median(moved[good, :2], axis=0)
        off = np.hypot(*(moved[:, :2] - middle).T)
        limit = max(1.0, 3 * float(np.median(off[good])))
        good &= off < limit
        first, *others = moved[good, :2]
        if not others or (len(others) == 1 and np.hypot(*(others[0] - first)) > 3.0):
            return None  # one window alone, or one of two that disagree, may sit on something that moves
        dx, dy = self.points[:, 0] - self.centre[0], self.points[:, 1] - self.centre[1]
        one, nil = np.ones(n), np.zeros(n)
        design = np.concatenate([np.column_stack([one, nil, -dy]), np.column_stack([nil, one, dx])])
        value = np.concatenate([moved[:, 0], moved[:, 1]])
        weight = np.where(good, 1 / sigma**2, 0.0)
        for _ in range(3):
            pull = (design * np.tile(weight, 2)[:, None]).T
            covariance = np.linalg.inv(pull @ design + np.diag([0.0, 0.0, 1 / _ROLL**2]))
            x, y, roll = (covariance @ pull @ value).tolist()
            size = np.hypot(*(value - design @ (x, y, roll)).reshape(2, n))
            used = weight > 0
            worse = float(np.sum(weight * size**2)) / max(1.0, 2 * used.sum() - 3)
            near = good & (size < max(0.3, 3 * float(np.median(size[good]))))
            if not near.any():
                return None
            weight = np.where(near, 1 / sigma**2, 0.0)
        error = np.sqrt(np.diag(covariance) * max(worse, 1.0))
        self._last[:, 0] = x - roll * dy
        self._last[:, 1] = y + roll * dx
        shift_sigma = max(float(np.hypot(error[0], error[1])) / np.sqrt(2), 1e-3)
        return CameraShift(x, y, roll, *self.centre, shift_sigma, min(float(error[2]), _ROLL))


def _pixel_noise(picture: np.ndarray) -> float:
    """Noise of single pixels in grey levels, from the median of their second differences."""
    some = picture[:: max(4, picture.shape[0] // 90)].astype(np.float32)
    return 1.4826 * float(np.median(np.abs(some[:, 2:] - 2 * some[:, 1:-1] + some[:, :-2]))) / np.sqrt(6)


def _window(luma: np.ndarray, x: int, y: int) -> np.ndarray:
    """What lies about a pixel, smoothed."""
    import cv2

    reach = _HALF + _BLUR
    some = np.ascontiguousarray(luma[y - reach : y + reach + 1, x - reach : x + reach + 1])
    return cv2.GaussianBlur(some, (2 * _BLUR + 1,) * 2, 1.0)[_BLUR:-_BLUR, _BLUR:-_BLUR]


def _place_sigma(windows: np.ndarray, noise: float) -> np.ndarray:
    """How well noise lets each of the windows be placed, px, along its worse direction."""
    gy, gx = np.gradient(windows, axis=(1, 2))
    xx, xy, yy = (np.einsum("kij,kij->k", a, b) for a, b in ((gx, gx), (gx, gy), (gy, gy)))
    least = 0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy)  # eigenvalue of [[xx, xy], [xy, yy]]
    return np.asarray(noise / np.sqrt(np.maximum(least, 1e-9)))

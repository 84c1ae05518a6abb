"""Ways to follow the bob on frames held in memory, given its radius, its first place and a window about where it must be
next: our localisers alone, and what public packages offer."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from toolkit.render import Truth
from toolkit.scene import Scene

Window = tuple[int, int, np.ndarray]  # left, top, pixels
Locate = Callable[[np.ndarray, float, float], tuple[float, float] | None]  # frame, expected x, y -> x, y
Prepare = Callable[[list[np.ndarray], float, float, float], Locate]  # frames, first x, y, radius


def localiser(name: str, scene: Scene, truth: Truth) -> Prepare:
    """One of our localisers, given what the pipeline would have learnt: radius, edge, wall without bob, streak."""
    from toolkit.trackers import load_tracker
    from toolkit.trackers.localiser import Guess, Look, Patch

    def prepare(frames: list[np.ndarray], x: float, y: float, radius: float) -> Locate:
        every = max(1, len(frames) // 40)
        wall = np.median(np.stack(frames[::every]), axis=0).astype(np.float32)
        known = np.full_like(wall, len(frames[::every]))
        camera = scene.camera
        share = 0.0 if camera is None else truth.meta["exposure_s"] * camera.fps
        size = math.ceil(radius + 8)
        cx, cy = round(x), round(y)
        template = frames[0][cy - size : cy + size + 1, cx - size : cx + size + 1].astype(np.float32)
        inside = float(np.median(frames[0][cy - 3 : cy + 4, cx - 3 : cx + 4]))
        look = Look(radius, truth.meta["edge_sigma_px"], inside - float(wall[cy, cx]), 3.0, template)
        locate_in = load_tracker(name).locate
        last = [x, y]

        def locate(frame: np.ndarray, gx: float, gy: float) -> tuple[float, float] | None:
            streak = share * (gx - last[0]), share * (gy - last[1])
            last[:] = gx, gy
            half = 1.3 * radius + 8 + math.hypot(*streak)
            left, top, window = _window(frame, gx, gy, half)
            cut = (slice(top, top + window.shape[0]), slice(left, left + window.shape[1]))
            place = locate_in(
                Patch(window.astype(np.float32), wall[cut], known[cut], left, top), look, Guess(gx, gy, *streak)
            )
            return (place.x_px, place.y_px) if np.isfinite(place.x_px) else None

        return locate

    return prepare


def _window(frame: np.ndarray, x: float, y: float, half: float) -> Window:
    left = int(np.clip(x - half, 0, frame.shape[1] - 2 * half - 1))
    top = int(np.clip(y - half, 0, frame.shape[0] - 2 * half - 1))
    return left, top, frame[top : top + 2 * int(half) + 1, left : left + 2 * int(half) + 1]


def _template(frames: list[np.ndarray], x: float, y: float, radius: float) -> Locate:
    """OpenCV's matchTemplate (squared differences), the first frame as template, a parabola through the minimum."""
    import cv2

    half = math.ceil(radius + 4)
    cx, cy = round(x), round(y)
    mask = np.ascontiguousarray(frames[0][cy - half : cy + half + 1, cx - half : cx + half + 1])

    def peak(a: float, b: float, c: float) -> float:
        bend = a - 2 * b + c
        return 0.0 if bend == 0 else 0.5 * (a - c) / bend

    def locate(frame: np.ndarray, gx: float, gy: float) -> tuple[float, float] | None:
        left, top, window = _window(frame, gx, gy, half + 12)
        score = cv2.matchTemplate(window, mask, cv2.TM_SQDIFF)
        _, _, (i, j), _ = cv2.minMaxLoc(score)
        if not (0 < i < score.shape[1] - 1 and 0 < j < score.shape[0] - 1):
            return None
        sx = peak(*(float(v) for v in score[j, i - 1 : i + 2]))
        sy = peak(*(float(v) for v in score[j - 1 : j + 2, i]))
        return left + i + half + sx + x - cx, top + j + half + sy + y - cy

    return locate


def _hough(frames: list[np.ndarray], x: float, y: float, radius: float) -> Locate:
    """OpenCV's HoughCircles in a window, the circle nearest to where the bob must be."""
    import cv2

    def locate(frame: np.ndarray, gx: float, gy: float) -> tuple[float, float] | None:
        left, top, window = _window(frame, gx, gy, 2 * radius + 12)
        smooth = cv2.GaussianBlur(np.ascontiguousarray(window), (5, 5), 1)
        found = cv2.HoughCircles(
            smooth, cv2.HOUGH_GRADIENT, 1, radius, param1=80, param2=10,
            minRadius=int(0.8 * radius), maxRadius=math.ceil(1.2 * radius),
        )  # fmt: skip
        if found is None:
            return None
        circles = np.asarray(found).reshape(-1, 3)
        best = circles[np.argmin(np.hypot(circles[:, 0] + left - gx, circles[:, 1] + top - gy))]
        return left + float(best[0]), top + float(best[1])

    return locate


def _mean_shift(frames: list[np.ndarray], x: float, y: float, radius: float) -> Locate:
    """OpenCV's meanShift on the back-projection of the bob's histogram, then that window's centroid."""
    import cv2

    half = round(0.6 * radius)
    cx, cy = round(x), round(y)
    inside = np.ascontiguousarray(frames[0][cy - half : cy + half + 1, cx - half : cx + half + 1])
    histogram = cv2.calcHist([inside], [0], None, [32], [0, 256])
    cv2.normalize(histogram, histogram, 0, 255, cv2.NORM_MINMAX)
    size = 2 * math.ceil(radius) + 5

    def locate(frame: np.ndarray, gx: float, gy: float) -> tuple[float, float] | None:
        left, top, window = _window(frame, gx, gy, 2 * radius + 12)
        likely = cv2.calcBackProject([np.ascontiguousarray(window)], [0], histogram, [0, 256], 1)
        start = (max(0, round(gx - left - size / 2)), max(0, round(gy - top - size / 2)), size, size)
        _, (i, j, w, h) = cv2.meanShift(likely, start, (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 0.1))
        m = cv2.moments(likely[j : j + h, i : i + w])
        return None if m["m00"] == 0 else (left + i + m["m10"] / m["m00"], top + j + m["m01"] / m["m00"])

    return locate


def _trackpy(frames: list[np.ndarray], x: float, y: float, radius: float) -> Locate:
    """trackpy.locate on a dark feature in a window, the feature nearest to where the bob must be."""
    import trackpy

    trackpy.quiet()
    diameter = 2 * math.ceil(1.5 * radius) + 1  # by trial: the one that suits a disc best

    def locate(frame: np.ndarray, gx: float, gy: float) -> tuple[float, float] | None:
        left, top, window = _window(frame, gx, gy, 2.2 * radius + 14)
        found = trackpy.locate(255 - window, diameter, engine="numba")
        if not len(found):
            return None
        at = np.argmin(np.hypot(found.x + left - gx, found.y + top - gy))
        return left + float(found.x.iloc[at]), top + float(found.y.iloc[at])

    return locate


PEERS: dict[str, Prepare] = {
    "OpenCV template": _template,
    "OpenCV Hough": _hough,
    "OpenCV mean-shift": _mean_shift,
    "trackpy": _trackpy,
}

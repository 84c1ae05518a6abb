"""What is looked at: the brightness of a frame, or the mix of its colour planes in which the bob stands out best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolkit.video import Frame

LUMA = (1.0, 0.0, 0.0)
_COLOURS = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_GREY = 6.0  # levels: by so much light of another colour may tinge a shadow


@dataclass(frozen=True)
class Sight:
    """A weighted sum of luma and the two colour differences (each less 128), plus 128 where colour is in it.

    Half-size colour planes are taken to lie in the middle of the pixels that they stand for.
    """

    weights: tuple[float, float, float] = LUMA

    @property
    def name(self) -> str:
        """`brightness` or `colour`."""
        return "brightness" if self.weights == LUMA else "colour"

    def window(self, frame: Frame, x0: int, y0: int, x1: int, y1: int) -> np.ndarray:
        """(y1 − y0, x1 − x0) float32 of the frame's columns x0 … x1 − 1 and rows y0 … y1 − 1."""
        if self.weights == LUMA:
            return frame.luma[y0:y1, x0:x1].astype(np.float32, order="C")  # turned pictures too
        wy, wu, wv = self.weights
        window = np.full((y1 - y0, x1 - x0), 128.0, np.float32)
        if wy:
            window += wy * (frame.luma[y0:y1, x0:x1].astype(np.float32) - 128)
        chroma = frame.chroma
        if chroma is not None:
            for weight, plane in zip((wu, wv), chroma):
                if weight:
                    window += weight * (_enlarged(plane, frame.luma.shape, x0, y0, x1, y1) - 128)
        return window


def _enlarged(plane: np.ndarray, shape: tuple[int, ...], x0: int, y0: int, x1: int, y1: int) -> np.ndarray:
    """The window of a plane that may be half the size of the picture, interpolated to full size."""
    import cv2

    fy, fx = round(shape[0] / plane.shape[0]), round(shape[1] / plane.shape[1])
    if fx == 1 and fy == 1:
        return plane[y0:y1, x0:x1].astype(np.float32, order="C")
    sx, sy = 0.5 * (fx - 1) / fx, 0.5 * (fy - 1) / fy
    u0, v0 = max(0, x0 // fx - 2), max(0, y0 // fy - 2)
    u1, v1 = min(plane.shape[1], x1 // fx + 3), min(plane.shape[0], y1 // fy + 3)
    part = plane[v0:v1, u0:u1].astype(np.float32)
    back = np.array([[1 / fx, 0, x0 / fx - sx - u0], [0, 1 / fy, y0 / fy - sy - v0]])
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(part, back, (x1 - x0, y1 - y0), flags=how, borderMode=cv2.BORDER_REPLICATE)


def small_planes(frame: Frame, factor: int, colour: bool) -> list[np.ndarray]:
    """Shrunken luma, or with `colour` the two shrunken colour planes, all of one size, float32."""
    import cv2

    from toolkit.tracking.picture.plane import shrink

    luma = shrink(frame.luma, factor)
    if not colour:
        return [luma]
    chroma = frame.chroma
    if chroma is None:
        return []
    size = (luma.shape[1], luma.shape[0])
    return [cv2.resize(np.ascontiguousarray(p), size, interpolation=cv2.INTER_AREA).astype(np.float32) for p in chroma]


Seen = Callable[[tuple[float, float, float]], tuple[np.ndarray, np.ndarray]]


def _apart(frames: list[Frame], places: list[tuple[float, float]], radius_px: float) -> Seen | None:
    """What gives the pixels of the bob and those of the wall about it, in the mix of planes asked for; None where it is nowhere
    in the picture. frames and the bob's centre (x, y) in each."""
    views: list[tuple[Frame, tuple[int, int, int, int], np.ndarray]] = []
    half = int(1.7 * radius_px + 4)
    for frame, (x, y) in zip(frames, places):
        x0, y0 = max(0, int(x) - half), max(0, int(y) - half)
        x1, y1 = min(frame.luma.shape[1], int(x) + half), min(frame.luma.shape[0], int(y) + half)
        if x1 - x0 < 4 or y1 - y0 < 4:
            continue
        rows, columns = np.ogrid[y0:y1, x0:x1]
        views.append((frame, (x0, y0, x1, y1), np.hypot(columns - x, rows - y)))

    def seen(weights: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
        planes = [(Sight(weights).window(frame, *box).astype(float), d) for frame, box, d in views]
        bob = [plane[d < 0.8 * radius_px] for plane, d in planes]
        return np.concatenate(bob), np.concatenate([plane[d > 1.25 * radius_px + 2] for plane, d in planes])

    return seen if views else None


def maybe_shadow(frames: list[Frame], places: list[tuple[float, float]], radius_px: float) -> bool:
    """Could what is seen at these places (x, y) be a shadow: the wall in less light, but of its colour?"""
    seen = _apart(frames, places, radius_px)
    if seen is None:
        return False
    (bright, wall), *colours = (tuple(map(np.median, seen(plane))) for plane in (LUMA, *_COLOURS))
    left = bright / max(wall, 1.0)
    return bool(left < 1 and all(abs(c - 128 - left * (beside - 128)) < _GREY for c, beside in colours))


def best_sight(frames: list[Frame], places: list[tuple[float, float]], radius_px: float) -> Sight:
    """The mix that separates bob from wall best: brightness if that is good, else Fisher's discriminant.

    frames and the bob's centre (x, y) in each; colour is only chosen where it gains much, for its planes are coarse.
    """
    seen = _apart(frames, places, radius_px)
    if seen is None:
        return Sight()
    a, b = seen(LUMA)
    differs = abs(np.median(a) - np.median(b))
    low, high = np.percentile(b, [16, 84])
    by_luma = differs / min(np.sqrt(np.var(b, ddof=1) + 0.5), 0.5 * (high - low) + 0.7)  # a post beside it is no noise
    # a wall's texture counts as noise here, but is learned later: where brightness differs much, it will do
    if (by_luma > 6 and differs > 20) or (by_luma > 2.5 and differs > 35):
        return Sight()
    inside, outside = (np.array(p) for p in zip((a, b), *map(seen, _COLOURS)))
    difference = np.median(inside, axis=1) - np.median(outside, axis=1)
    mix = np.linalg.solve(np.cov(outside) + 0.5 * np.eye(3), difference)
    by_mix = float(np.sqrt(difference @ mix))
    if not by_mix > 2 * by_luma:
        return Sight()
    mix = mix / np.abs(mix).sum()
    return Sight((float(mix[0]), float(mix[1]), float(mix[2])))

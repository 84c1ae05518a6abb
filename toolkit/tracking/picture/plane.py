"""Whole planes of a frame: made smaller, evened in their light, and held against what stands still."""

from __future__ import annotations

import numpy as np

from toolkit.motion.compiled import address, call, kernel

_ROWS = 32  # of some pictures: what stays in the processor's caches
_EVEN = 0.003  # of their light: so far most rows go before it is called uneven


def shrink(plane: np.ndarray, factor: int) -> np.ndarray:
    """`plane` (h, w) uint8 averaged over factor × factor pixels, float32. Pixel (i, j) is centred on (i + ½)·factor − ½."""
    if factor == 1:
        return plane.astype(np.float32, order="C")
    plane = plane if plane.strides[1] == 1 and plane.dtype == np.uint8 else np.ascontiguousarray(plane, np.uint8)
    rows, columns = plane.shape[0] // factor, plane.shape[1] // factor
    small, row = np.empty((rows, columns), np.float32), np.empty(columns * factor, np.float32)
    average = kernel("shrink", "toolkit.tracking.picture._shrink_kernel", "smaller pictures")
    call(average, plane.ctypes.data, address(small), address(row), rows, columns, factor, plane.strides[0])
    return small


def still_picture(planes: list[np.ndarray]) -> np.ndarray:
    """The median of each pixel over the planes (h, w): what stands still, where nothing covers it half the time."""
    import cv2

    middle = np.empty(planes[0].shape, planes[0].dtype)
    for top in range(0, middle.shape[0], _ROWS):
        lines = [plane[top : top + _ROWS] for plane in planes]
        for i in range(len(lines) // 2 + 1):  # a bubble sort as far as the middle: many pixels at a time
            for j in range(len(lines) - 1, i, -1):
                a, b = lines[j - 1], lines[j]
                lines[j - 1], lines[j] = cv2.min(a, b), cv2.max(a, b)
        middle[top : top + _ROWS] = lines[len(lines) // 2]
    return middle


def silhouette(image: np.ndarray, back: np.ndarray) -> np.ndarray:
    """(h, w) float32 from 0 to 100: where a piece of a frame differs from what stands still, in whatever light. What differs at
    all counts as much as what differs much: a bob's pattern is no outline."""
    gain = rim_level(image / np.maximum(back, 1.0))
    away = np.abs(image - gain * back)
    clear = max(8.0, 4 * rim_level(away), 0.3 * float(np.percentile(away, 95)))
    return np.minimum(100 * away / clear, 100.0).astype(np.float32)


def rim_level(picture: np.ndarray) -> float:
    """The median of its outermost pixels."""
    rim = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    low, high = (rim.size - 1) // 2, rim.size // 2
    rim.partition((low, high))  # a tenth of the time of `np.median`
    return float(0.5 * (rim[low] + rim[high]))


def even_light(samples: list[np.ndarray]) -> list[np.ndarray]:
    """The pictures (h, w) with each row's brightness as it is on most of them: flicker and drifting light are no motion."""
    if len(samples) < 5:
        return samples
    rows = np.array([p.mean(axis=1) for p in samples])
    if np.median(np.abs(rows / np.maximum(np.median(rows, axis=0), 1.0) - 1)) < _EVEN:
        return samples
    some = [np.ascontiguousarray(p[:, ::4]) for p in samples]
    middle = some[0].shape[1] // 2
    gains = np.partition(some / np.maximum(still_picture(some), 1.0), middle, axis=2)[:, :, middle]
    return [(p / np.clip(g, 0.5, 2.0)[:, None]).astype(np.float32) for p, g in zip(samples, gains)]

"""Where might the bob be? Round things that move, found by letting moving edges vote for centres.

An edge pixel that changes with time votes, for each radius, for the centre that lies that far along its gradient.
Bobs collect a whole circle of votes, strings and soft shadows do not. Votes need no background, so a small swing
(whose bob never uncovers its middle) is found like a large one.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from toolkit.motion.compiled import address, call, kernel


class Hypothesis(NamedTuple):
    """A round moving thing: index into the sampled frames, centre and radius in full-frame px, bob darker (−1) or
    brighter (+1) than the wall, and the fraction of the circle that voted."""

    sample: int
    x_px: float
    y_px: float
    radius_px: float
    sign: int
    score: float


def find_round_movers(samples: list[np.ndarray], factor: int, most: int = 24) -> list[Hypothesis]:
    """Hypotheses, best first, from shrunken frames (h, w) float32 that `factor` has shrunk; needs three or more."""
    import cv2

    if len(samples) < 3:
        return []
    spread = np.ptp(samples, axis=0) if len(samples) < 5 else _scatter(samples)
    noise = float(np.median(spread[::2, ::2]))
    moving = cv2.dilate((spread > max(4 * noise, 2.0)).astype(np.uint8), np.ones((3, 3), np.uint8))
    if not moving.any():
        return []
    found: list[Hypothesis] = []
    table = _table(moving.shape, 1.0)
    biggest = 0.2 * min(moving.shape)
    radii = [r for r in 2.5 * 1.25 ** np.arange(16) if r <= biggest]
    reaches = np.array([(sign * r, max(1.0, r / 7)) for r in radii for sign in (-1, 1)]).reshape(-1, 2)
    here = np.flatnonzero(moving)
    for k, picture in enumerate(samples):
        edges = _edges(picture, here, max(2.0, 2 * noise))
        if edges.shape[1] < 8:
            continue
        if edges.shape[1] > 4000:
            edges = np.take(edges, np.argpartition(edges[4], -4000)[-4000:], axis=1)
        strong = np.partition(edges[4], edges.shape[1] * 9 // 10)[edges.shape[1] * 9 // 10]
        edges[4] = np.minimum(np.sqrt(edges[4] / strong), 1.0)
        for (reach, _), both in zip(reaches.tolist(), _vote(edges, reaches, picture.shape, table).tolist()):
            radius, sign = abs(reach), 1 if reach > 0 else -1
            for x, y, votes in both:
                score = votes / (2 * np.pi * radius)
                u, v = (x + 0.5) * factor - 0.5, (y + 0.5) * factor - 0.5
                found.append(Hypothesis(k, u, v, radius * factor, sign, score))
    found.sort(key=lambda h: -h.score)
    return _distinct(found, most)


def find_round_near(
    picture: np.ndarray, radius_px: float, sign: int, edge_px: float = 1.0
) -> tuple[float, float, float] | None:
    """Where in a piece of a frame (h, w) float32 the outline of a disc of this radius, darker (−1) or brighter (+1) than
    what is about it, gathers most votes: (x, y, fraction of the circle) in its pixels; None where nothing votes."""
    import cv2

    if min(picture.shape) < 8:
        return None
    smooth = cv2.GaussianBlur(np.ascontiguousarray(picture), (0, 0), max(0.8, 0.7 * edge_px))
    gx = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=0.125)
    gy = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=0.125)
    size = np.hypot(gx, gy)
    strong = float(np.percentile(size, 98))
    rows, columns = np.nonzero(size > max(0.35 * strong, 0.5))
    if rows.size < 8:
        return None
    length = size[rows, columns]
    weight = np.sqrt(length / max(strong, 1e-9)).clip(0, 1)
    nx, ny = gx[rows, columns] / length, gy[rows, columns] / length
    bin_size = max(1.0, radius_px / 7)
    edges = np.array([columns, rows, nx, ny, weight], float)
    how = np.array([[sign * radius_px, bin_size]])
    x, y, votes = _vote(edges, how, picture.shape, _table(picture.shape, bin_size))[0, 0].tolist()
    x, y = _centred(x, y, columns, rows, -sign * nx, -sign * ny, weight, radius_px)
    return x, y, votes / (2 * np.pi * radius_px)


def _centred(
    x: float,
    y: float,
    columns: np.ndarray,
    rows: np.ndarray,
    nx: np.ndarray,
    ny: np.ndarray,
    weight: np.ndarray,
    radius: float,
) -> tuple[float, float]:
    """The centre of the circle of about this radius through the edge pixels near it that face away from it (nx, ny): what part
    of the outline is missing moves it little."""
    start, a = (x, y), np.zeros(3)
    near = np.hypot(columns - x, rows - y) < 2 * radius  # what is farther away can be on no such circle
    columns, rows, nx, ny, weight = columns[near], rows[near], nx[near], ny[near], weight[near]
    for _ in range(6):
        dx, dy = columns - start[0] - a[0], rows - start[1] - a[1]
        d = np.hypot(dx, dy) + 1e-9
        rest = d - radius - a[2]
        faces = (dx * nx + dy * ny) / d
        w = np.where((faces > 0.85) & (np.abs(rest) < 0.3 * radius), weight / (1 + rest**2), 0.0)
        design = np.column_stack([dx / d, dy / d, np.ones(d.size)])
        normal = (design * w[:, None]).T @ design + np.diag([0.1, 0.1, 0.2 * w.sum() + 0.1])
        step = np.linalg.solve(normal, design.T @ (w * rest) - np.array([0, 0, (0.2 * w.sum() + 0.1) * a[2]]))
        a = a + step
        if np.abs(step).max() < 0.02:
            break
    if not np.hypot(a[0], a[1]) < 0.4 * radius:
        return start
    return start[0] + float(a[0]), start[1] + float(a[1])


def _distinct(found: list[Hypothesis], most: int) -> list[Hypothesis]:
    """The best few that are not the same circle again; at most three of one radius and sign near one place on its way:
    something large that passes by must not take all the places from a bob of its size."""
    kept: list[Hypothesis] = []
    for h in found:
        if len(kept) == most:
            break
        if any(o.sample == h.sample and hypot(o.x_px - h.x_px, o.y_px - h.y_px) < h.radius_px for o in kept):
            continue
        alike = [o for o in kept if o.sign == h.sign and 0.75 < o.radius_px / h.radius_px < 1.34]
        rivals = sum(any(o.sample == r.sample and r.score > o.score for r in alike) for o in alike)
        second = any(o.sample == h.sample for o in alike)
        if (rivals if second else len(alike) - rivals) < 3:
            kept.append(h)
    return kept


def _scatter(samples: list[np.ndarray]) -> np.ndarray:
    """The standard deviation of each pixel, (h, w) float32."""
    import cv2

    total, squares = np.zeros_like(samples[0]), np.zeros_like(samples[0])
    for picture in samples[1:]:  # less the first one, so that single precision is enough
        away = cv2.subtract(picture, samples[0])
        cv2.accumulate(away, total)
        cv2.accumulateSquare(away, squares)
    n = len(samples)
    return np.sqrt(np.maximum(squares / n - (total / n) ** 2, 0.0))


def _edges(picture: np.ndarray, here: np.ndarray, least: float) -> np.ndarray:
    """(5, n) the columns, rows, directions of the slope (x, y) and slopes of the pixels `here` (m,) whose slope is more than
    `least`."""
    edges, count, limit = np.empty((5, here.size)), np.empty(1, np.int64), np.array([least])
    find = kernel("edges", "toolkit.tracking.begin._edge_kernel", "the search")
    arrays = np.ascontiguousarray(picture), here.astype(np.int64, copy=False), limit, edges, count
    call(find, *(address(a) for a in arrays), here.size, *picture.shape)
    return np.ascontiguousarray(edges[:, : count[0]])


def _vote(edges: np.ndarray, reaches: np.ndarray, shape: tuple[int, ...], table: np.ndarray) -> np.ndarray:
    """The two centres (shrunken px) with most votes at each signed distance along the gradient, and how many each has: (r, 2, 3).

    edges : (5, n) the edge pixels' columns, rows, directions of the gradient (x, y) and weights.    reaches : (r, 2) signed
    distances and the bins' sizes.    table : all zero, and left so.
    """
    bins, numbers = np.empty(edges.shape[1], np.int64), np.array(reaches.T, float, order="C")
    found = np.zeros((len(reaches), 2, 3))
    vote = kernel("vote", "toolkit.tracking.begin._vote_kernel", "the search")
    arrays = edges, numbers, table, bins, found
    call(vote, *(address(a) for a in arrays), edges.shape[1], len(reaches), *shape)
    return found


def _table(shape: tuple[int, ...], bin_size: float) -> np.ndarray:
    """Room for the votes in a picture of this shape, and bins of this size or larger."""
    return np.zeros((int(shape[0] / bin_size) + 3, int(shape[1] / bin_size) + 3), np.float32)

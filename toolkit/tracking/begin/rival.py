"""Another thing that swings in the picture, of its own accord: the next group's pendulum. Which is meant, no picture tells."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from toolkit.sentence import said
from toolkit.tracking.begin.trail import Rough

_OWN = 0.25  # of its motion: so much at least does not follow the bob's, of what is neither its shadow nor a piece of its string
_COMMON = 12  # frames on which both were seen, at least


def find_rival(best: Rough, others: Iterable[Rough]) -> tuple[float, float] | None:
    """Where (px) the first of the others that swings of its own accord was seen first."""
    rival = next((other for other in others if other is not best and _swings_alone(best, other)), None)
    return None if rival is None else rival.points[min(rival.points)]


def rival_told(place_px: tuple[float, float] | None) -> list[str]:
    """A warning, if there is a rival."""
    if place_px is None:
        return []
    return [
        said(
            "track.rival",
            "something else swings in the picture, first seen at ({x_px:.0f}, {y_px:.0f}) px: see in the report's picture of a frame, "
            "or with --overlay, whether the circle is on the bob you mean; if not, give --bob X,Y",
            x_px=place_px[0],
            y_px=place_px[1],
        )
    ]


def _swings_alone(best: Rough, other: Rough) -> bool:
    """Shadow, reflection and string go to and fro as the bob does: their motion is in proportion to its own."""
    common = sorted(best.points.keys() & other.points.keys())
    if len(common) < _COMMON:
        return False
    (bob, its), size_px = (np.array([rough.points[i] for i in common]) for rough in (best, other)), other.look.radius_px
    if np.any(np.hypot(*(its - bob).T) < size_px):
        return False
    along, way = (_along(points) for points in (bob, its))
    design = np.column_stack([np.ones_like(along), along])
    rest = way - design @ np.linalg.lstsq(design, way, rcond=None)[0]
    return bool(np.std(rest) > _OWN * np.std(way))


def _along(points: np.ndarray) -> np.ndarray:
    """How far (n,) points (n, 2) are from their middle along the direction in which they spread most."""
    away = points - points.mean(axis=0)
    return np.asarray(away @ np.linalg.svd(away, full_matrices=False)[2][0])

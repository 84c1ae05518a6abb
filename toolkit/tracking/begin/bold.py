"""A bob with so bold a pattern that no disc fits it (stripes, some of them as bright as the wall): its size, by its outline alone.

Now one part of the outline shows, now another. With too large a radius, or with another edge than the bob's, that draws the bob
to the side on which it shows, and it wavers as the pattern turns. So its radius is the one that the outlines of most frames
agree on, found about where a swing through all of them says, and its edge the one with which it wavers least.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.trackers.edge import fit_outline
from toolkit.trackers.localiser import Look
from toolkit.tracking.geometry.swing import Swing, fit_swing
from toolkit.tracking.picture.looks import Sightings, light_on

_EDGES = 0.7, 1.5, 2.3, 3.1  # px
_MANY = 32  # sightings that are looked at
_MOST = 0.6  # of them
_ROUNDS = 6
_SETTLED = 0.05  # px
_RANGE = 1.3  # times the radius at first, at most
_CALM = 0.1  # of the radius: what strays more from a swing is not where that says


class Bold(NamedTuple):
    """The looks, the motion through the places found with them, and whether this says where the bob is better than they do."""

    look: Look
    swing: Swing
    calm: bool


def learn_bold(seen: Sightings, t_s: np.ndarray, look: Look, swing: Swing, radius: float | None) -> Bold | None:
    """The bob that was seen at times t_s (n,), looks about like `look` and swings about so; its `radius` if that is known. None
    where its outline is not found on most frames."""
    look = look._replace(contrast=_contrast(seen, look), radius_free=False, even=False)
    best = None
    for edge in _EDGES:
        found = _with_edge(seen, t_s, look._replace(edge_px=edge), swing, radius)
        if found is not None and (best is None or found.swing.rms_px < best.swing.rms_px):
            best = found
        elif best is not None:
            break
    return best


def _with_edge(seen: Sightings, t_s: np.ndarray, look: Look, swing: Swing, radius: float | None) -> Bold | None:
    """The radius with which it wavers least, of those to which the outlines lead one after another."""
    centres = {k: (float(seen.x_px[k]), float(seen.y_px[k])) for k in range(0, t_s.size, max(1, t_s.size // _MANY))}
    first_px, best = look.radius_px, None
    for _ in range(_ROUNDS):
        fits = {}
        for k, centre in centres.items():
            guess, patch = seen.show(k, look, centre, 0.0)
            fit = None if patch is None else fit_outline(patch, look, guess)
            if fit is not None:
                fits[k] = fit
        if len(fits) < max(10, _MOST * len(centres)):
            break
        t = t_s[list(fits)]
        x, y = np.array([(place.x_px, place.y_px) for place, _ in fits.values()]).T
        through = fit_swing(t, x, y, np.full(t.size, 0.3), swing.values_at(t[0]))
        size = radius or float(np.median([size for _, size in fits.values()]))
        if through is None or not 1 / _RANGE < size / first_px < _RANGE:
            break
        grown, calm = size - look.radius_px, through.rms_px < _CALM * size
        look = look._replace(radius_px=size, noise=float(np.median([place.misfit for place, _ in fits.values()])))
        if best is None or through.rms_px < best.swing.rms_px:
            best = Bold(look, through, calm)
        if abs(grown) < _SETTLED:
            break
        if calm:
            centres = dict(zip(centres, zip(*(c.tolist() for c in through.position(t_s[list(centres)])))))
        else:
            centres |= {k: (place.x_px, place.y_px) for k, (place, _) in fits.items()}
    return best


def _contrast(seen: Sightings, look: Look) -> float:
    """Bob less wall, by the larger half of what differs well within the outline."""
    found = [np.zeros(1)]
    for k in range(0, seen.x_px.size, max(1, seen.x_px.size // 12)):
        x, y = float(seen.x_px[k]), float(seen.y_px[k])
        patch = seen.show(k, look, (x, y), 0.0)[1]
        if patch is not None:
            rows, columns = np.ogrid[: patch.image.shape[0], : patch.image.shape[1]]
            near = np.hypot(columns + patch.x_px - x, rows + patch.y_px - y) < 0.6 * look.radius_px
            found.append((patch.image - light_on(patch) * patch.back)[near])
    values = np.concatenate(found)
    return float(np.mean(values[np.abs(values) >= np.median(np.abs(values))]))

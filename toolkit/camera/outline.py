"""What a near camera and a lens make of a ball's outline: an ellipse beside the image of its centre, and that bent.

A first-order map of the ball about the image of its centre leaves out what moves its light: by (R/D)² of the way from the
middle of the picture for a ball of radius R at a depth of D, by about 3 k₁ (R/r)² of it for a lens of k₁ at the corner, r away.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_NODES = 5  # a side, of the polynomial through the map from the picture to the unit disc,
_REACH = 1.6  # and how many radii away from the centre
_CHORDS = 12  # steps of its inversion at most, each of which leaves a tenth,
_INVERTED = 1e-5  # px before the last of them, where there is an inverse
_AROUND = 32  # points of an outline

Bend = Callable[[np.ndarray], np.ndarray]  # points (k, n, 2) before the lens, to where the picture shows them


def seen_ball(centre_m: np.ndarray, radius_m: float, focal_px: float) -> tuple[np.ndarray, np.ndarray]:
    """The ellipse that a pinhole camera sees of a ball: its centre (k, 2) from the middle of the picture, and (k, 2, 2) from
    the unit disc to offsets about that, in px.

    centre_m : (k, 3) the ball's centre as seen by the camera, z ahead. The silhouette is the cone of the directions at
    asin(R/|c|) from the centre's; with m the centre's image and ρ = R/z the plane cuts it in an ellipse about m/(1 − ρ²) of
    half axes ρ/√(1 − ρ²) across and √((1 + m² − ρ²)/(1 − ρ²)) times that along m.
    """
    depth = centre_m[:, 2]
    image = centre_m[:, :2] / depth[:, None]
    rest = 1 - (radius_m / depth) ** 2
    square = np.sum(image**2, axis=1)
    longer = np.sqrt((square + rest) / rest)
    along = image / np.sqrt(np.maximum(square, 1e-30))[:, None]
    turned = np.eye(2) + (longer - 1)[:, None, None] * along[:, :, None] * along[:, None, :]
    size = focal_px * radius_m / depth / np.sqrt(rest)
    return focal_px * image / rest[:, None], size[:, None, None] * turned


def bent_shapes(bend: Bend, flat: np.ndarray, shapes: np.ndarray, centre: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """(k, 2, n, n): what `shapes` (k, 2, 2) leaves out of the map from the picture to the unit disc, as polynomials of the
    offset from the image of the ball's centre in radii: [disc axis, power down, power right].

    flat : (k, 2) the ball's centre before the lens.    centre, spread : its outline there, as of `seen_ball`.
    Where the lens folds the picture, and the map has no inverse, it is 0.
    """
    radius = 1 / np.sqrt(np.abs(np.linalg.det(shapes)))
    size = np.sqrt(np.abs(np.linalg.det(spread)))[:, None, None]
    nodes = _REACH * np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    grid = np.stack([np.tile(nodes, _NODES), np.repeat(nodes, _NODES)], axis=-1)
    wanted = bend(flat[:, None]) + radius[:, None, None] * grid
    to_unit = np.swapaxes(shapes, 1, 2)
    unit = radius[:, None, None] * grid @ to_unit
    points = flat[:, None] + size * unit
    for _ in range(_CHORDS):
        left = wanted - bend(points)
        points = points + size * np.clip(left @ to_unit, -1, 1)
        if np.abs(left).max() < _INVERTED:
            break
    exact = (points - centre[:, None]) @ np.swapaxes(np.linalg.inv(spread), 1, 2)
    inverted = np.abs(left).max(axis=(1, 2)) < _INVERTED
    rest = np.where(inverted[:, None, None], exact - unit, 0.0).transpose(0, 2, 1).reshape(-1, 2, _NODES, _NODES)
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    return powers @ rest @ powers.T


def centre_of_light(bend: Bend, centre: np.ndarray, spread: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the light of an even ball is in the picture, (k, 2), and the radius (k,) of a disc of its area: by Green's
    theorem around its outline."""
    angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
    outline = bend(centre[:, None] + np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ np.swapaxes(spread, 1, 2))
    origin = outline.mean(axis=1)
    x, y = np.moveaxis(outline - origin[:, None], -1, 0)
    slopes = 1j * np.fft.fftfreq(_AROUND, 1 / _AROUND)
    dx, dy = (np.fft.ifft(slopes * np.fft.fft(values)).real for values in (x, y))
    area = np.mean(x * dy - y * dx, axis=1)  # over π, twice the half
    moments = np.stack([np.mean(x * x * dy, axis=1), -np.mean(y * y * dx, axis=1)], axis=-1)
    return origin + moments / area[:, None], np.sqrt(np.abs(area))

"""Soft shapes with exact centres: the light that a disc or a string covers, after lens, pixel and motion blur.

Edges are the normal distribution's, the convolution of a straight edge with a Gaussian point spread; sampled at pixel
centres such a disc keeps its centroid to better than 1e-4 px for an edge of 0.5 px or more.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from toolkit.camera.shoot import Colour, Patch

Painter = Callable[[np.ndarray, np.ndarray, int], np.ndarray]
_REACH = 4.5  # sigmas after which an edge has no light left


def edge_sigma(point_spread_px: float, extra_px: float = 0.0) -> float:
    """Edge width in px: the lens's Gaussian, a further Gaussian and the pixel's own aperture (variance 1/12)."""
    return math.sqrt(point_spread_px**2 + extra_px**2 + 1 / 12)


def cover_disc(
    centres: np.ndarray,
    shapes: np.ndarray,
    sigma_px: float,
    colours: Painter | None = None,
    rests: np.ndarray | None = None,
) -> tuple[int, int, np.ndarray, np.ndarray | None]:
    """Mean coverage of a soft disc that stands at each of `centres` for an equal share of the exposure.

    centres : (k, 2) px.    shapes : (k, 2, 2), from a pixel offset to the unit disc.    colours : None, or a function
    (u, v, k) -> (h, w, 3) of unit-disc coordinates.    rests : None, or what `shapes` leave out of the map to the unit disc
    (`outline.bent_shapes`). Returns x0, y0, alpha (h, w) and the mean colour (h, w, 3).
    The disc's area is kept: a soft disc of radius r' covers π(r'² + σ²) (integral of the normal edge), so r'² = r² − σ².
    """
    from scipy.special import ndtr

    radii = 1 / np.sqrt(np.abs(np.linalg.det(shapes)))
    reach = 1 / np.linalg.svd(shapes, compute_uv=False).min() + _REACH * sigma_px + 1
    x0, y0 = np.floor(centres.min(axis=0) - reach).astype(int)
    x1, y1 = np.ceil(centres.max(axis=0) + reach).astype(int)
    x, y = np.arange(x0, x1 + 1, dtype=float), np.arange(y0, y1 + 1, dtype=float)[:, None]
    alpha = np.zeros((y.size, x.size))
    light = None if colours is None else np.zeros((*alpha.shape, 3))
    for k, ((cx, cy), m, radius) in enumerate(zip(centres, shapes, radii)):
        u = m[0, 0] * (x - cx) + m[0, 1] * (y - cy)
        v = m[1, 0] * (x - cx) + m[1, 1] * (y - cy)
        inner = math.sqrt(max(radius**2 - sigma_px**2, (0.2 * radius) ** 2))
        if rests is None:
            far = radius * np.hypot(u, v)
        else:
            u, v, far = _bent(u, v, (x - cx) / radius, (y - cy) / radius, m * radius, rests[k])
            far *= radius
        share = ndtr((inner - far) / sigma_px)
        alpha += share
        if light is not None and colours is not None:
            light += share[:, :, None] * colours(u, v, k)
    alpha /= len(centres)
    if light is not None:
        light /= len(centres) * np.maximum(alpha, 1e-12)[:, :, None]
    return int(x0), int(y0), alpha, light


def _bent(
    u: np.ndarray, v: np.ndarray, right: np.ndarray, down: np.ndarray, shape: np.ndarray, rest: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit-disc coordinates with their `rest`, and 1 more than the distance from the outline, inwards negative: to first
    order from the slopes there, so that an edge is as soft on all sides. `right`, `down`, distance and `shape` in radii."""
    count = rest.shape[-1]
    across, along = np.vander(right.ravel(), count, increasing=True), np.vander(down.ravel(), count, increasing=True)
    power = np.arange(1, count)
    u, v = u + along @ rest[0] @ across.T, v + along @ rest[1] @ across.T
    u_right, v_right = (row + along @ (r[:, 1:] * power) @ across[:, :-1].T for row, r in zip(shape[:, 0], rest))
    u_down, v_down = (row + along[:, :-1] @ (r[1:] * power[:, None]) @ across.T for row, r in zip(shape[:, 1], rest))
    far = np.hypot(u, v)
    steep = np.hypot(u * u_right + v * v_right, u * u_down + v * v_down) / np.maximum(far, 1e-9)
    return u, v, 1 + (far - 1) / np.maximum(steep, 0.5)


def soft_disc(
    x_px: float, y_px: float, radius_px: float, sigma_px: float, rgb: np.ndarray | Colour, strength: float = 1.0
) -> Patch:
    """A still soft disc as a patch."""
    shape = np.eye(2)[None] / radius_px
    x0, y0, alpha, _ = cover_disc(np.array([[x_px, y_px]]), shape, sigma_px)
    return Patch(x0, y0, alpha * strength, rgb)


def soft_box(
    x0_px: float,
    x1_px: float,
    y0_px: float,
    y1_px: float,
    sigma_px: float,
    rgb: np.ndarray | Colour,
    strength: float = 1.0,
) -> Patch:
    """A still soft upright rectangle as a patch."""
    from scipy.special import ndtr

    def span(low: float, high: float) -> tuple[int, np.ndarray]:
        at = np.arange(math.floor(low - _REACH * sigma_px), math.ceil(high + _REACH * sigma_px) + 1, dtype=float)
        return int(at[0]), ndtr((at - low) / sigma_px) - ndtr((at - high) / sigma_px)

    (x0, across), (y0, down) = span(x0_px, x1_px), span(y0_px, y1_px)
    return Patch(x0, y0, strength * down[:, None] * across, rgb)


def lay(image: np.ndarray, patch: Patch, rgb: np.ndarray) -> None:
    """Composite a patch onto image (h, w, 3), in place; `rgb` is the patch's colour in the image's own units."""
    top, left = max(patch.y0, 0), max(patch.x0, 0)
    bottom = min(patch.y0 + patch.alpha.shape[0], image.shape[0])
    right = min(patch.x0 + patch.alpha.shape[1], image.shape[1])
    if top >= bottom or left >= right:
        return
    cut = (slice(top - patch.y0, bottom - patch.y0), slice(left - patch.x0, right - patch.x0))
    alpha = patch.alpha[cut].astype(np.float32)[:, :, None]
    under = image[top:bottom, left:right]
    under += alpha * (np.asarray(rgb[cut] if np.ndim(rgb) == 3 else rgb, dtype=np.float32) - under)


def lay_line(
    image: np.ndarray, curve: np.ndarray, smear: np.ndarray, width_px: float, sigma_px: float, rgb: np.ndarray
) -> None:
    """Draw a soft line of `width_px` along `curve` (n, 2), moved by `smear` (n, 2) during the exposure, in place.

    Across the line its light is box (width) ⊗ box (smear) ⊗ Gaussian, which is a second difference of
    F(z) = z Φ(z/σ) + σ φ(z/σ): exact for a line that moves evenly.
    """
    if abs(curve[-1, 0] - curve[0, 0]) > abs(curve[-1, 1] - curve[0, 1]):  # work along the longer axis
        image, curve, smear = image.transpose(1, 0, 2), curve[:, ::-1], smear[:, ::-1]
    if curve[-1, 1] < curve[0, 1]:
        curve, smear = curve[::-1], smear[::-1]
    first, last = curve[0, 1], curve[-1, 1]
    rows = np.arange(max(math.floor(first), 0), min(math.ceil(last), image.shape[0] - 1) + 1)
    if rows.size == 0 or last - first < 1e-6:
        return
    x = np.interp(rows, curve[:, 1], curve[:, 0])
    slope = np.gradient(curve[:, 0], curve[:, 1])
    slope = np.interp(rows, curve[:, 1], slope)
    across = 1 / np.sqrt(1 + slope**2)
    moved = np.interp(rows, curve[:, 1], smear[:, 0]) - slope * np.interp(rows, curve[:, 1], smear[:, 1])
    moved = np.maximum(np.abs(moved * across), 1e-2 * sigma_px)[:, None]
    reach = (moved.max() / 2 + width_px / 2 + _REACH * sigma_px) / across.min()
    columns = np.round(x)[:, None].astype(int) + np.arange(-math.ceil(reach), math.ceil(reach) + 1)
    d = (columns - x[:, None]) * across[:, None]
    w, b = width_px / 2, moved / 2
    alpha = (
        _ramp(d + w + b, sigma_px)
        - _ramp(d + w - b, sigma_px)
        - _ramp(d - w + b, sigma_px)
        + _ramp(d - w - b, sigma_px)
    ) / moved
    ends = np.clip(rows - first + 0.5, 0, 1) * np.clip(last - rows + 0.5, 0, 1)
    alpha = (alpha * ends[:, None]).astype(np.float32)
    inside = (columns >= 0) & (columns < image.shape[1]) & (alpha > 1e-6)
    at = (np.broadcast_to(rows[:, None], columns.shape)[inside], columns[inside])
    under = image[at]
    image[at] = under + alpha[inside][:, None] * (np.asarray(rgb, dtype=np.float32) - under)


def _ramp(z: np.ndarray, sigma: float) -> np.ndarray:
    from scipy.special import ndtr

    q = z / sigma
    return z * ndtr(q) + sigma / math.sqrt(2 * math.pi) * np.exp(-0.5 * q * q)

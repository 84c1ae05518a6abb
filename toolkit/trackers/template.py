"""Template: the bob's mean picture slid over the patch, then shifted by least squares to a fraction of a pixel."""

from __future__ import annotations

import numpy as np

from toolkit.trackers.localiser import NOWHERE, Guess, Localiser, Look, Patch, Place, disc_share


def locate(patch: Patch, look: Look, guess: Guess) -> Place:
    """Best match of `look.template` (a disc of the known size and contrast where there is none)."""
    import cv2

    template = look.template if look.template is not None else drawn(look, float(np.median(patch.back)))
    size = template.shape[0]
    half = size // 2
    if patch.image.shape[0] < size + 2 or patch.image.shape[1] < size + 2:
        return NOWHERE
    image = np.ascontiguousarray(patch.image, np.float32)
    score = cv2.matchTemplate(image, np.ascontiguousarray(template), cv2.TM_CCOEFF_NORMED)
    _, best, _, at = cv2.minMaxLoc(score)
    if best < 0.6:
        return NOWHERE
    u, v = int(at[0]), int(at[1])
    gy, gx = np.gradient(template)
    design = np.column_stack([gx.ravel(), gy.ravel(), template.ravel(), np.ones(template.size)])
    dx = dy = 0.0
    for _ in range(6):
        move = np.array([[1.0, 0.0, u + dx], [0.0, 1.0, v + dy]])
        piece = cv2.warpAffine(
            image, move, (size, size), flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE
        )
        a, _, rank, _ = np.linalg.lstsq(design, piece.ravel().astype(float), rcond=None)
        if rank < 4 or abs(a[2]) < 0.2:
            return NOWHERE
        # piece(p) = g·template(p + step): the template must move by −step
        step = a[:2] / a[2]
        dx, dy = dx - float(step[0]), dy - float(step[1])
        if abs(dx) > 2 or abs(dy) > 2:
            return NOWHERE
        if np.hypot(*step) < 0.01:
            break
    rest = piece.ravel() - design @ a
    misfit = float(np.sqrt(rest @ rest / max(1, rest.size - 4)))
    covariance = np.linalg.inv(design.T @ design)[:2, :2] * misfit**2 / a[2] ** 2
    sx, sy = (max(float(np.sqrt(c)), 1e-4) for c in np.diag(covariance))
    spread = float(template.std()) * abs(float(a[2]))
    visible = 1.0 if misfit < 0.5 * spread else 0.5
    contrast = look.contrast * float(a[2]) if look.contrast else float(np.ptp(template)) * float(a[2])
    return Place(u + dx + half + patch.x_px, v + dy + half + patch.y_px, sx, sy, misfit, visible, contrast)


def drawn(look: Look, wall: float) -> np.ndarray:
    """A template (k, k) float32, k odd, of a plain disc of the look's radius, edge and contrast on a level wall."""
    half = int(np.ceil(look.radius_px + 3 * look.edge_px + 1))
    rows, columns = np.mgrid[-half : half + 1, -half : half + 1]
    return (wall + (look.contrast or -100.0) * disc_share(np.hypot(rows, columns), look)).astype(np.float32)


LOCALISER = Localiser("template", "least-squares shift of the bob's mean picture", locate, circle=True)

"""From where the bob was in the picture to θ(t): the pivot, the vertical and the error bars.

Pivot: the centre of the arc (geometric least squares; for N points of scatter σ over ±θ₀ about the vertical the
length is known to σ_L = 4√2·σ/(√N·θ₀²)·… of the arc's sagitta) and, where the string was seen, the point in which its
lines meet. Vertical: the middle of the swing, from a fit that allows for decay. An error of the pivot along the
vertical scales all angles alike, so it is kept apart from the random σ of each frame.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.output import whole_file
from toolkit.scene import Scene
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.track import LOST, PREDICTED, Track
from toolkit.tracking.swing import fit_circle, fit_swing, start_swing

_CLICK_SIGMA_PX = 1.0
# What one picture plane cannot tell, as standard uncertainties of the scale of all angles. Alone, an arc or a string hides a
# camera some 8° off square (1 − cos 8°) or a phone's uncorrected lens. Together they show either, save for what a pitch
# of a few degrees from near adds to the arc's radius alone.
_VIEW_U = 0.01
_ARC_U = 0.006


@dataclass(frozen=True)
class PivotEstimate:
    """A pivot (x, y) in px with its (2, 2) covariance, how it was found, and the goodness of that fit.

    slant (2, 2) turns what was seen at a slant, about the pivot, into the plane of swing; None for a square view.
    view_u is the relative standard uncertainty of all angles from what the camera's tilt and lens may have done.
    """

    xy: np.ndarray
    covariance: np.ndarray
    method: str
    reduced_chi2: float = 1.0
    slant: np.ndarray | None = None
    view_u: float = _VIEW_U

    @property
    def sigma_px(self) -> tuple[float, float]:
        """Standard uncertainties of x and y."""
        return float(np.sqrt(self.covariance[0, 0])), float(np.sqrt(self.covariance[1, 1]))


def calibrate(track: Track, scene: Scene | None = None) -> ThetaSeries:
    """θ(t) of the measured frames (predicted and lost ones are left out), with σ.

    The σ of each frame is random; what is common to all is in the meta: `angle_scale_relative_u` (pivot along the
    vertical; what the camera's tilt and lens may do, `angle_scale_relative_u_of_view`) and `vertical_sigma_rad`.
    meta["calibration"] is the content of calibration.json.
    Raises JobError where too few frames were measured or times do not increase.
    """
    t, x, y, sx, sy, kept = _measured(track)
    log = list(track.meta.get("log", []))
    warnings = list(track.meta.get("warnings", []))
    pivot = _pivot(track, x, y, sx, sy, kept, log, warnings)
    px, py = pivot.xy
    if pivot.slant is not None:
        x, y = pivot.xy[:, None] + pivot.slant @ np.array([x - px, y - py])
        sx, sy = sx * pivot.slant[0, 0], sy * pivot.slant[1, 1]
    direction = np.unwrap(np.arctan2(x - px, y - py))
    distance = np.hypot(x - px, y - py)
    length = float(np.median(distance))
    vertical, vertical_sigma = _vertical(track, t, x, y, sx, sy, pivot)
    theta = direction - vertical
    sigma = np.hypot(np.cos(direction) * sx, np.sin(direction) * sy) / distance
    rounding = float(track.meta.get("time_sigma_s", 0.0))  # a file that keeps times to the millisecond only
    if rounding > 0:
        sigma = np.hypot(sigma, np.abs(np.gradient(direction, t)) * rounding)
    scale_u = float(np.hypot(pivot.sigma_px[1] / length, pivot.view_u))
    amplitude = float(np.percentile(np.abs(theta), 99))
    calibration: dict[str, Any] = {
        "pivot_px": [float(px), float(py)],
        "pivot_sigma_px": list(pivot.sigma_px),
        "pivot_method": pivot.method,
        "slant": None if pivot.slant is None else pivot.slant.tolist(),
        "radius_px": float(track.radius_px),
        "radius_sigma_px": float(track.meta.get("radius_sigma_px", 0.1)),
        "vertical_rad": vertical,
        "vertical_sigma_rad": vertical_sigma,
        "angle_scale_relative_u": scale_u,
        "angle_scale_relative_u_of_pivot": pivot.sigma_px[1] / length,
        "angle_scale_relative_u_of_view": pivot.view_u,
        "length_px": length,
        "length_sigma_px": pivot.sigma_px[1],
        "fps": track.meta.get("fps"),
        "time_source": track.meta.get("time_source"),
        "frames": {
            "ok": int(track.ok.sum()),
            "predicted": int((track.status == PREDICTED).sum()),
            "lost": int((track.status == LOST).sum()),
        },
        "localiser": track.localiser,
        **_scale(scene, length, track.radius_px, warnings),
    }
    log += [
        said(
            "calibrate.pivot",
            "Pivot at ({x_px:.2f}, {y_px:.2f}) px ± ({x_u_px:.2f}, {y_u_px:.2f}) px by {method}; pivot to bob {length_px:.2f} px.",
            x_px=float(px),
            y_px=float(py),
            x_u_px=float(pivot.sigma_px[0]),
            y_u_px=float(pivot.sigma_px[1]),
            method=pivot.method,
            length_px=float(length),
        ),
        said(
            "calibrate.vertical",
            "The vertical is the middle of the decaying swing: {angle_deg:.3f}° ± {u_deg:.3f}° from the picture's own.",
            angle_deg=float(np.degrees(vertical)),
            u_deg=float(np.degrees(vertical_sigma)),
        ),
        said(
            "calibrate.errors",
            "Angles up to {widest_deg:.1f}°; random error of one frame {frame_deg:.4f}°, common relative error of all angles "
            "{common:.2g} ({by_pivot:.2g} from the pivot, {by_view:.2g} from the camera's view).",
            widest_deg=float(np.degrees(amplitude)),
            frame_deg=float(np.degrees(np.median(sigma))),
            common=float(scale_u),
            by_pivot=float(pivot.sigma_px[1] / length),
            by_view=float(pivot.view_u),
        ),
    ]
    if pivot.slant is None and pivot.view_u >= _VIEW_U:
        log.append(
            said(
                "calibrate.view",
                "Camera tilt not distinguishable from this clip: angles may be scaled by about {share:.1%} (assumed: a camera "
                "within some 8° of square, or a phone's lens). A visible string and a larger swing would tell.",
                share=float(pivot.view_u),
            )
        )
    meta = {
        "source": track.meta.get("source", "track"),
        "log": log,
        "warnings": warnings,
        "angle_scale_relative_u": scale_u,
        "angle_scale_relative_u_of_view": pivot.view_u,
        "vertical_sigma_rad": vertical_sigma,
        "exposure_s": track.meta.get("exposure_s"),
        "calibration": calibration,
    }
    if scene is not None and scene.pendulum.length_m is not None:
        meta["length_m"] = scene.pendulum.length_m
    return ThetaSeries(t, theta, np.maximum(sigma, 1e-9), meta)


def write_calibration_json(series: ThetaSeries, path: str | Path) -> None:
    """Write calibration.json, the calibration that `calibrate` put into the series' meta."""
    content = series.meta.get("calibration")
    if not isinstance(content, Mapping):
        raise UsageError("this series holds no calibration; only a series from a video has one")
    with whole_file(path) as scratch:
        scratch.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _measured(track: Track) -> tuple[np.ndarray, ...]:
    """t, x, y, σx, σy of the ok frames in the still frame of the background, and which frames these are."""
    kept = np.flatnonzero(track.ok)
    if kept.size < 8:
        raise JobError(f"only {kept.size} frames were measured; an angle needs at least 8")
    zero = np.zeros(track.t_s.size)
    x = (track.x_px - np.asarray(track.meta.get("shift_x_px", zero)))[kept]
    y = (track.y_px - np.asarray(track.meta.get("shift_y_px", zero)))[kept]
    t = track.t_s[kept]
    shake = np.asarray(track.meta.get("shift_sigma_px", zero))
    rising = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])
    if rising.sum() < 8:
        raise JobError("the video's time stamps do not increase; convert it with a fixed frame rate")
    kept = kept[rising]
    sx, sy = (np.hypot(s[kept], shake[kept]) for s in (track.sigma_x_px, track.sigma_y_px))
    return t[rising], x[rising], y[rising], sx, sy, kept


def arc_pivot(x: np.ndarray, y: np.ndarray, sx: np.ndarray, sy: np.ndarray) -> PivotEstimate | None:
    """The centre of the arc through points (n,) with standard uncertainties; None where they do not bend."""
    cx, cy, radius, _ = fit_circle(x, y, 1 / (sx * sy))
    if not np.isfinite(radius):
        return None
    ux, uy = (x - cx) / radius, (y - cy) / radius
    sigma = np.hypot(ux * sx, uy * sy)
    rest = (np.hypot(x - cx, y - cy) - radius) / sigma
    jacobian = np.column_stack([-ux, -uy, -np.ones(x.size)]) / sigma[:, None]
    chi2 = float(rest @ rest) / max(1, x.size - 3)
    try:
        covariance = np.linalg.inv(jacobian.T @ jacobian) * max(1.0, chi2)
    except np.linalg.LinAlgError:
        return None
    return PivotEstimate(np.array([cx, cy]), covariance[:2, :2], said("pivot.arc", "the arc of the bob"), chi2)


def line_pivot(x: np.ndarray, y: np.ndarray, angle: np.ndarray, sigma: np.ndarray) -> PivotEstimate | None:
    """The point nearest to lines (n,) through (x, y) with direction `angle` (rad from the downward image axis,
    positive to the right) and `sigma` (px) their distance errors at the pivot. None for fewer than 8 lines."""
    if x.size < 8:
        return None
    nx, ny = np.cos(angle), -np.sin(angle)
    offset = nx * x + ny * y
    weight = 1 / sigma**2
    for _ in range(6):
        normal = np.array(
            [[np.sum(weight * nx * nx), np.sum(weight * nx * ny)], [np.sum(weight * nx * ny), np.sum(weight * ny * ny)]]
        )
        try:
            covariance = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        xy = covariance @ np.array([np.sum(weight * nx * offset), np.sum(weight * ny * offset)])
        rest = (nx * xy[0] + ny * xy[1] - offset) / sigma
        spread = 1.4826 * np.median(np.abs(rest)) + 1e-12
        weight = np.where(np.abs(rest) < 4 * spread, 1 / sigma**2, 0.0)
    used = weight > 0
    chi2 = float(np.sum(rest[used] ** 2)) / max(1, int(used.sum()) - 2)
    return PivotEstimate(xy, covariance * max(1.0, chi2), said("pivot.lines", "the string's lines"), chi2)


def _pivot(
    track: Track,
    x: np.ndarray,
    y: np.ndarray,
    sx: np.ndarray,
    sy: np.ndarray,
    kept: np.ndarray,
    log: list[str],
    warnings: list[str],
) -> PivotEstimate:
    if track.meta.get("pivot_given"):
        sigma = max(
            _CLICK_SIGMA_PX, *(track.pivot_sigma_px if np.all(np.isfinite(track.pivot_sigma_px)) else (0.0, 0.0))
        )
        return PivotEstimate(
            np.array(track.pivot_px, float), np.eye(2) * sigma**2, said("pivot.given", "the position given")
        )
    arc = arc_pivot(x, y, sx, sy)
    lines = _string_pivot(track, kept)
    if arc is None and lines is None:
        raise JobError("the bob's path does not bend and no string is seen: give --pivot X,Y")
    if arc is None or lines is None:
        return arc if lines is None else lines  # type: ignore[return-value]
    difference = arc.xy - lines.xy
    both = arc.covariance + lines.covariance
    chi2 = float(difference @ np.linalg.solve(both, difference))
    log.append(
        said(
            "calibrate.two_pivots",
            "The arc puts the pivot at ({arc_x_px:.2f}, {arc_y_px:.2f}) px, the string's lines at ({lines_x_px:.2f}, "
            "{lines_y_px:.2f}) px.",
            arc_x_px=float(arc.xy[0]),
            arc_y_px=float(arc.xy[1]),
            lines_x_px=float(lines.xy[0]),
            lines_y_px=float(lines.xy[1]),
        )
    )
    together = said("pivot.both", "the arc and the string's lines together")
    gain = arc.covariance @ np.linalg.inv(both)
    xy = arc.xy - gain @ difference
    covariance = arc.covariance - gain @ arc.covariance
    # a view that scales angles by 1 + ε scales the arc's radius by 1 + 2ε against the string's length
    away = float(np.hypot(*(np.mean([x, y], axis=1) - xy)))
    apart = np.hypot(float(np.hypot(*difference)) if chi2 > 11.8 else 0.0, np.sqrt(both[1, 1])) / away
    view_u = 0.5 * float(np.hypot(apart, _ARC_U))
    if chi2 > 11.8:  # 3σ for two numbers
        differ = said(
            "calibrate.pivots_differ",
            "the pivot by the arc and by the string differ by {apart_px:.1f} px ({sigmas:.0f}σ): the camera was tilted, its lens "
            "distorts, or the bob swung out of the plane",
            apart_px=float(np.hypot(*difference)),
            sigmas=float(np.sqrt(chi2)),
        )
        slant = _slant(x - lines.xy[0], y - lines.xy[1])
        if slant is None:
            wrong = "{differ}; angles may be wrong by about {share:.1%}"
            warnings.append(said("calibrate.pivots_kept", wrong, differ=differ, share=view_u))
            return PivotEstimate(xy, covariance * chi2 / 2, together, chi2, view_u=view_u)
        # seen at a slant a circle is an ellipse; the string's lines still meet in its centre
        small, large = np.linalg.eigvalsh(slant)
        tilt = float(np.degrees(np.arccos(small / large)))
        warnings.append(
            said(
                "calibrate.slant",
                "{differ}; read as a view at a slant of {slant_deg:.0f}°, which was taken out; for it angles are uncertain by "
                "{share:.1%}",
                differ=differ,
                slant_deg=tilt,
                share=float((large / small - 1) / 3),
            )
        )
        view_u = max(_ARC_U / 2, (large / small - 1) / 3)
        slanted = said("pivot.slanted", "the string's lines, the arc seen at a slant")
        return PivotEstimate(lines.xy, lines.covariance, slanted, chi2, slant, view_u)
    return PivotEstimate(xy, covariance, together, view_u=min(view_u, _VIEW_U))


def _slant(dx: np.ndarray, dy: np.ndarray) -> np.ndarray | None:
    """The symmetric (2, 2) matrix that turns the ellipse about (0, 0) through the points into a circle of about the same
    size; None where the points lie on no such ellipse or it is very flat."""
    size = float(np.median(np.hypot(dx, dy)))
    u, v = dx / size, dy / size
    a, b, c = np.linalg.lstsq(np.column_stack([u * u, u * v, v * v]), np.ones(u.size), rcond=None)[0]
    values, vectors = np.linalg.eigh(np.array([[a, b / 2], [b / 2, c]]))
    if values[0] <= 0 or not 1.03 < values[1] / values[0] < 4:  # less than 10° a bent lens does as well
        return None
    return np.asarray(vectors @ np.diag(np.sqrt(values)) @ vectors.T)


def _string_pivot(track: Track, kept: np.ndarray) -> PivotEstimate | None:
    if track.meta.get("string_angle_rad") is None:
        return None
    x, y, angle, turn, place = (
        np.asarray(track.meta[f"string_{n}"])[kept]
        for n in ("x_px", "y_px", "angle_rad", "angle_sigma_rad", "sigma_px")
    )
    good = np.isfinite(angle)
    if good.sum() < 8:
        return None
    reach = np.hypot(x - track.pivot_px[0], y - track.pivot_px[1])
    return line_pivot(x[good], y[good], angle[good], np.hypot(turn * reach, place)[good] + 1e-3)


def _vertical(
    track: Track, t: np.ndarray, x: np.ndarray, y: np.ndarray, sx: np.ndarray, sy: np.ndarray, pivot: PivotEstimate
) -> tuple[float, float]:
    """Direction of rest in the picture and its σ: a decaying swing fitted with the pivot held.

    Where the motion is no free swing (a driven one), the middle between the extremes, with a wide σ.
    """
    px, py = pivot.xy
    direction = np.unwrap(np.arctan2(x - px, y - py))
    length = float(np.median(np.hypot(x - px, y - py)))
    middle = float(0.5 * (direction.max() + direction.min()))
    wide = middle, float(np.ptp(direction) / 20)
    known = track.meta.get("swing")
    start = start_swing(t, x, y) if known is None else np.array(known, float)
    if start is None:
        return wide
    turned = np.arctan2(start[0] - px, length) * (1 if known is not None else 0)
    start[:4] = px, py, length, start[3] + turned
    every = max(1, t.size // 2000)
    free = ("length", "vertical", "omega2", "gamma", "beta", "theta0", "rate0")
    sigma = np.maximum(np.sqrt(sx * sy), 1e-4)
    swing = fit_swing(t[::every], x[::every], y[::every], sigma[::every], start, free=free)
    if swing is None or abs(swing.values[3] - middle) > 0.3 * np.ptp(direction):
        return wide
    return float(swing.values[3]), float(np.sqrt(max(swing.covariance[3, 3], 1e-18)))


def _scale(scene: Scene | None, length_px: float, radius_px: float, warnings: list[str]) -> dict[str, Any]:
    """px_per_m from a known bob radius or length; both known and disagreeing is said."""
    if scene is None:
        return {}
    pendulum = scene.pendulum
    found: dict[str, Any] = {}
    by_length = length_px / pendulum.length_m if pendulum.length_m else None
    by_radius = radius_px / pendulum.bob_radius_m if pendulum.bob_radius_m else None
    if by_length is not None:
        found |= {"px_per_m": by_length, "px_per_m_from": "length_m"}
    elif by_radius is not None:
        found |= {"px_per_m": by_radius, "px_per_m_from": "bob_radius_m", "length_from_radius_m": length_px / by_radius}
    if by_length is not None and by_radius is not None:
        found["px_per_m_by_radius"] = by_radius
        if abs(by_length / by_radius - 1) > 0.05:
            warnings.append(
                said(
                    "calibrate.scales_differ",
                    "length_m gives {by_length:.0f} px per metre, bob_radius_m {by_radius:.0f}: one of them is wrong, or the "
                    "camera was tilted",
                    by_length=by_length,
                    by_radius=by_radius,
                )
            )
    return found

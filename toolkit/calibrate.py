"""From where the bob was in the picture to θ(t): the pivot, the vertical, the camera's view and the error bars.

The view (`toolkit.tracking.geometry.view`) is one fit of motion, pivot and camera to all positions and string lines. Each place is
turned into an angle by it. What is common to all frames (the zero and the scale of all angles) is kept apart from the
random σ of each frame; what the camera may have done beyond these two is in σ.
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
from toolkit.tracking.geometry.pivot import PivotEstimate, arc_pivot, line_pivot
from toolkit.tracking.geometry.swing import start_swing
from toolkit.tracking.geometry.view import View
from toolkit.tracking.geometry.view_fit import PRIOR, Lines, fit_view, out_of_the_ordinary

__all__ = ["arc_pivot", "calibrate", "line_pivot", "write_calibration_json"]

_CLICK_SIGMA_PX = 1.0
_ODD_PX = 0.3  # arc and string disagree by so much for reasons of their own (a string's shading, the bob's shadow)
_VIEW_U = 0.01  # where no view could be fitted: a camera some 8° off square (1 − cos 8°), or a phone's uncorrected lens
_BESIDE_PX = 0.1  # a share of a pixel that the user need not hear of, however clearly it shows
_WIDE_U = 0.08  # an uncertainty of all angles that the user must hear of


@dataclass(frozen=True)
class _Angles:
    """θ of the measured frames at their times with σ, and what is common to all of them."""

    t_s: np.ndarray
    theta_rad: np.ndarray
    sigma_rad: np.ndarray
    pivot_px: tuple[float, float]
    pivot_sigma_px: tuple[float, float]
    vertical_rad: float
    vertical_sigma_rad: float
    length_px: float
    scale_u: float
    scale_u_of_pivot: float
    sigma_common_share: float
    readout_s: float
    readout_u_s: float
    rows_by_angle: tuple[float, float]
    method: str
    shown: tuple[str, ...] = ()

    @property
    def scale_u_of_view(self) -> float:
        """What of the scale's uncertainty is the camera's."""
        return float(np.sqrt(max(self.scale_u**2 - self.scale_u_of_pivot**2, 0.0)))

    @property
    def row_time_u_s(self) -> float:
        """Standard uncertainty of the time in which the camera reads as many rows as the string is long."""
        return self.readout_u_s * self.rows_by_angle[0]


def calibrate(track: Track, scene: Scene | None = None) -> ThetaSeries:
    """θ(t) of the measured frames (predicted and lost ones are left out), with σ.

    The σ of each frame is random; what is common to all is in the meta: `angle_scale_relative_u` (pivot along the
    vertical; what the camera's tilt and lens may do, `angle_scale_relative_u_of_view`), `vertical_sigma_rad`, and
    `row_time_u_s`, the uncertainty of the time in which the camera reads as many rows as the string is long: all times
    share it times cos(θ − `row_direction_rad`). A delay that is the same at all angles is not counted: no fit can tell it
    from φ. A delay moves θ one way or the other as the bob moves, tilt and lens move it alike both ways: so neither is the
    other's, whatever readout, tilt and lens go together in the views that the clip allows. What tilt and lens may do beyond
    zero and scale is in each frame's σ, though it is alike wherever the angle is: `sigma_common_share` says how much of σ it is.
    meta["calibration"] is the content of calibration.json.
    Raises JobError where too few frames were measured or times do not increase.
    """
    t, x, y, sx, sy, kept = _measured(track)
    log = list(track.meta.get("log", []))
    warnings = list(track.meta.get("warnings", []))
    arc, lines = arc_pivot(x, y, sx, sy), _string_pivot(track, kept)
    view = _view(track, t, x, y, sx, sy, kept)
    found = _plain(track, t, x, y, sx, sy, arc, lines) if view is None else _seen(view, t, x, y, sx, sy, lines)
    rounding = float(track.meta.get("time_sigma_s", 0.0))  # a file that keeps times to the millisecond only
    sigma = found.sigma_rad
    if rounding > 0:
        sigma = np.hypot(sigma, np.abs(np.gradient(found.theta_rad, found.t_s)) * rounding)
    amplitude = float(np.percentile(np.abs(found.theta_rad), 99))
    apart = _disagreement(arc, lines, view, log)
    calibration: dict[str, Any] = {
        "pivot_px": list(found.pivot_px),
        "pivot_sigma_px": list(found.pivot_sigma_px),
        "pivot_method": found.method,
        "pivot_disagreement_sigma": apart,
        "camera": {} if view is None else view.camera(),
        "radius_px": float(track.radius_px),
        "radius_sigma_px": float(track.meta.get("radius_sigma_px", 0.1)),
        "vertical_rad": found.vertical_rad,
        "vertical_sigma_rad": found.vertical_sigma_rad,
        "angle_scale_relative_u": found.scale_u,
        "angle_scale_relative_u_of_pivot": found.scale_u_of_pivot,
        "angle_scale_relative_u_of_view": found.scale_u_of_view,
        "sigma_common_share": found.sigma_common_share,
        "readout_s": found.readout_s,
        "readout_u_s": found.readout_u_s,
        "row_time_u_s": found.row_time_u_s,
        "row_direction_rad": found.rows_by_angle[1],
        "length_px": found.length_px,
        "length_sigma_px": found.pivot_sigma_px[1],
        "fps": track.meta.get("fps"),
        "time_source": track.meta.get("time_source"),
        "frames": {
            "ok": int(track.ok.sum()),
            "predicted": int((track.status == PREDICTED).sum()),
            "lost": int((track.status == LOST).sum()),
        },
        "localiser": track.localiser,
        **_scale(scene, found.length_px, track.radius_px, warnings),
    }
    log += [
        said(
            "calibrate.pivot",
            "Pivot at ({x_px:.2f}, {y_px:.2f}) px ± ({x_u_px:.2f}, {y_u_px:.2f}) px by {method}; pivot to bob {length_px:.2f} px.",
            x_px=found.pivot_px[0],
            y_px=found.pivot_px[1],
            x_u_px=found.pivot_sigma_px[0],
            y_u_px=found.pivot_sigma_px[1],
            method=found.method,
            length_px=found.length_px,
        ),
        said(
            "calibrate.vertical",
            "The vertical is the middle of the decaying swing: {angle_deg:.3f}° ± {u_deg:.3f}° from the picture's own.",
            angle_deg=float(np.degrees(found.vertical_rad)),
            u_deg=float(np.degrees(found.vertical_sigma_rad)),
        ),
        said(
            "calibrate.errors",
            "Angles up to {widest_deg:.1f}°; random error of one frame {frame_deg:.4f}°, common relative error of all angles "
            "{common:.2g} ({by_pivot:.2g} from the pivot, {by_view:.2g} from the camera's view).",
            widest_deg=float(np.degrees(amplitude)),
            frame_deg=float(np.degrees(np.median(sigma))),
            common=found.scale_u,
            by_pivot=found.scale_u_of_pivot,
            by_view=found.scale_u_of_view,
        ),
        said(
            "calibrate.rows",
            "Times are those at which the bob's row was read, with {readout_ms:.1f} ± {u_ms:.1f} ms from the first row to the last.",
            readout_ms=1000 * found.readout_s,
            u_ms=1000 * found.readout_u_s,
        ),
    ]
    if view is not None and view.shown:
        effects = _listed(view.camera())
        log.append(
            said(
                "calibrate.camera",
                "The clip shows what the camera did, and it was taken out: {effects}.",
                effects=effects,
            )
        )
    elif found.scale_u_of_view >= _VIEW_U:
        log.append(
            said(
                "calibrate.view",
                "Camera tilt not distinguishable from this clip: angles may be scaled by about {share:.1%} (assumed: a camera "
                "within some 10° of square, or a phone's lens). A visible string and a larger swing would tell.",
                share=found.scale_u_of_view,
            )
        )
    odd = {} if view is None else out_of_the_ordinary(view)
    if odd:
        warnings.append(
            said(
                "calibrate.odd_view",
                "only a camera, or a swing out of its plane, as is hardly ever met explains this clip ({effects}): its angles may be wrong "
                "by more than their error bars say. Film square on to the swing, with the string in view, or give --pivot X,Y",
                effects=_listed(odd),
            )
        )
    off_px = 0.0 if view is None or "bob" not in view.shown else float(np.hypot(view["off_x"], view["off_y"]))
    if off_px > _BESIDE_PX:
        warnings.append(
            said(
                "calibrate.beside",
                "string and arc tell that the bob was found about {off_px:.1f} px beside its centre on all frames (a shadow or a "
                "highlight taken for part of it?): the angles allow for it, the places in track.csv do not",
                off_px=off_px,
            )
        )
    if found.scale_u > _WIDE_U:
        warnings.append(
            said(
                "calibrate.wide",
                "all angles may be scaled by {share:.1%}: this clip tells neither the pivot nor the camera's tilt better; give "
                "--pivot X,Y, or film with the string in view and a larger swing",
                share=found.scale_u,
            )
        )
    meta = {
        "source": track.meta.get("source", "track"),
        "log": log,
        "warnings": warnings,
        "angle_scale_relative_u": found.scale_u,
        "angle_scale_relative_u_of_view": found.scale_u_of_view,
        "vertical_sigma_rad": found.vertical_sigma_rad,
        "sigma_common_share": found.sigma_common_share,
        "row_time_u_s": found.row_time_u_s,
        "row_direction_rad": found.rows_by_angle[1],
        "exposure_s": track.meta.get("exposure_s"),
        "calibration": calibration,
    }
    if scene is not None and scene.pendulum.length_m is not None:
        meta["length_m"] = scene.pendulum.length_m
    return ThetaSeries(found.t_s, found.theta_rad, np.maximum(sigma, 1e-9), meta)


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
    off_x, off_y = (
        sum(np.asarray(track.meta.get(f"{what}_{axis}_px", zero)) for what in ("shift", "mean")) for axis in "xy"
    )
    x, y = (track.x_px - off_x)[kept], (track.y_px - off_y)[kept]
    t = track.t_s[kept]
    shake = np.asarray(track.meta.get("shift_sigma_px", zero))
    rising = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])
    if rising.sum() < 8:
        raise JobError("the video's time stamps do not increase; convert it with a fixed frame rate")
    kept = kept[rising]
    sx, sy = (np.hypot(s[kept], shake[kept]) for s in (track.sigma_x_px, track.sigma_y_px))
    return t[rising], x[rising], y[rising], sx, sy, kept


def _view(
    track: Track, t: np.ndarray, x: np.ndarray, y: np.ndarray, sx: np.ndarray, sy: np.ndarray, kept: np.ndarray
) -> View | None:
    """The track's own view, or one fitted to it; None where the motion is no free swing."""
    known = track.meta.get("view")
    if known is None:
        start = start_swing(t, x, y)
        if start is None:
            return None
        size = (int(track.meta.get("width_px", 2 * x.max())), int(track.meta.get("height_px", 2 * y.max())))
        clicked = (*track.pivot_px, _CLICK_SIGMA_PX) if track.meta.get("pivot_given") else None
        known = fit_view(t, x, y, sx, sy, start, size, _lines(track, kept), clicked)
        if known is None:
            return None
    direction = np.unwrap(np.arctan2(x - known.pivot_px[0], y - known.pivot_px[1]))
    off = known["vertical"] - 0.5 * (direction.max() + direction.min())
    mx, my = known.position(t, x, y)
    strays = np.hypot(x - mx, y - my) > np.maximum(0.1, 3 * np.hypot(sx, sy))  # else one side was hidden, no more
    driven = not known.shown and abs(off) > 0.3 * float(np.ptp(direction)) and strays.mean() > 0.3
    return None if driven else known


def _listed(effects: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in effects.items())


def _seen(
    view: View,
    t: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    sx: np.ndarray,
    sy: np.ndarray,
    lines: PivotEstimate | None,
) -> _Angles:
    """Angles by the view."""
    theta, (tx, ty) = view.angles(t, x, y)
    zero_u, scale_u, scale_u_of_pivot, other = view.uncertainty(t, x, y)
    random = np.hypot(tx * sx, ty * sy) / (tx * tx + ty * ty)
    arc = said("pivot.arc", "the arc of the bob")
    return _Angles(
        view.row_time(t, x, y),
        theta,
        np.hypot(random, other),
        view.pivot_px,
        view.pivot_sigma_px,
        view["vertical"],
        zero_u,
        view["length"],
        scale_u,
        min(scale_u_of_pivot, scale_u),
        float(np.sqrt(np.mean(other**2 / (random**2 + other**2)))),
        view.readout_s,
        view.readout_u_s,
        view.rows_by_angle(theta),
        arc if lines is None else said("pivot.both", "the arc and the string's lines together"),
        view.shown,
    )


def _plain(
    track: Track,
    t: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    sx: np.ndarray,
    sy: np.ndarray,
    arc: PivotEstimate | None,
    lines: PivotEstimate | None,
) -> _Angles:
    """Angles where the motion is no free swing: about the pivot given, the string's, or the arc's; from the middle."""
    pivot = lines or arc
    if track.meta.get("pivot_given"):
        given = said("pivot.given", "the position given")
        pivot = PivotEstimate(np.array(track.pivot_px, float), np.eye(2) * _CLICK_SIGMA_PX**2, given)
    if pivot is None:
        raise JobError("the bob's path does not bend and no string is seen: give --pivot X,Y")
    px, py = (float(v) for v in pivot.xy)
    direction = np.unwrap(np.arctan2(x - px, y - py))
    distance = np.hypot(x - px, y - py)
    length = float(np.median(distance))
    sigma = np.hypot(np.cos(direction) * sx, np.sin(direction) * sy) / distance
    middle = float(0.5 * (direction.max() + direction.min()))
    by_pivot = pivot.sigma_px[1] / length
    seen = track.meta.get("view")
    along_x = seen is not None and seen.rows_along_x
    rows = float(track.meta.get("width_px", 2 * x.max()) if along_x else track.meta.get("height_px", 2 * y.max()))
    return _Angles(
        t,
        direction - middle,
        sigma,
        (px, py),
        pivot.sigma_px,
        middle,
        float(np.ptp(direction) / 20),
        length,
        float(np.hypot(by_pivot, _VIEW_U)),
        by_pivot,
        0.0,
        0.0,
        PRIOR["readout"][1],
        (length / rows, (0.5 * np.pi if along_x else 0.0) - middle),
        pivot.method,
    )


def _disagreement(arc: PivotEstimate | None, lines: PivotEstimate | None, view: View | None, log: list[str]) -> float:
    """By how many σ the pivots by the arc and by the string's lines differ, where no camera effect was taken out for it."""
    if arc is None or lines is None:
        return 0.0
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
    if view is not None and view.shown:
        return 0.0
    inflation = 1.0 if view is None else max(1.0, view.inflation)
    both = (arc.covariance + lines.covariance) * inflation**2 + np.eye(2) * _ODD_PX**2
    difference = arc.xy - lines.xy
    return float(np.sqrt(difference @ np.linalg.solve(both, difference)))


def _lines(track: Track, kept: np.ndarray) -> Lines | None:
    """The string's lines on the measured frames; None where there are few."""
    if track.meta.get("string_angle_rad") is None:
        return None
    names = ("x_px", "y_px", "angle_rad", "angle_sigma_rad", "sigma_px", "half_px")
    return Lines(*[*(np.asarray(track.meta[f"string_{n}"]) for n in names), track.t_s]).of(kept).seen()


def _string_pivot(track: Track, kept: np.ndarray) -> PivotEstimate | None:
    k = _lines(track, kept)
    if k is None:
        return None
    reach = np.hypot(k.x_px - track.pivot_px[0], k.y_px - track.pivot_px[1])
    return line_pivot(k.x_px, k.y_px, k.angle_rad, np.hypot(k.sigma_rad * reach, k.sigma_px) + 1e-3)


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

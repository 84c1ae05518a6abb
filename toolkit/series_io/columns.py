"""Which column is time, angle or uncertainty, in which unit; and from columns to a clean ThetaSeries."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.table_text import Table

_TIME_UNITS = {
    1.0: "s sec secs second seconds seg segundos segundo sekunde sekunden secondes วินาที",
    1e-3: "ms msec millisecond milliseconds มิลลิวินาที",
    1e-6: "us µs μs microseconds",
    60.0: "min minutes",
}
_ANGLE_UNITS = {
    1.0: "rad rads radian radians radianes radiant เรเดียน",
    1e-3: "mrad milliradians",
    float(np.pi / 180): "deg degs degree degrees ° º grad gradi grados graus องศา",
}
_TIME_WORDS = frozenset(
    ["t", "time", "times", "zeit", "tempo", "tiempo", "temps", "tijd", "clock", "elapsed", "timestamp", "เวลา"]
)
_ANGLE_WORDS = frozenset(
    [
        "θ",
        "ϑ",
        "th",
        "theta",
        "angle",
        "angles",
        "winkel",
        "angulo",
        "ángulo",
        "ângulo",
        "φ",
        "phi",
        "มุม",
        "inclination",
        "tilt",
    ]
)
_SIGMA_WORDS = frozenset(
    [
        "sigma",
        "σ",
        "uncertainty",
        "uncertainties",
        "unc",
        "uncert",
        "err",
        "error",
        "errors",
        "std",
        "stdev",
        "sd",
        "delta",
        "δ",
        "u",
        "±",
        "ความไม่แน่นอน",
    ]
)
_OTHER_WORDS = frozenset(
    [
        "period",
        "amplitude",
        "velocity",
        "omega",
        "ω",
        "speed",
        "acceleration",
        "alpha",
        "torque",
        "fit",
        "model",
        "residual",
        "residuals",
    ]
)


@dataclass(frozen=True)
class Column:
    """What a column's name says: `quantity` is t, theta, x, y or "" ; `scale` to SI, None if no unit is named."""

    quantity: str
    scale: float | None
    sigma: bool


def understand(name: str) -> Column:
    """What the column called `name` holds."""
    plain = unicodedata.normalize("NFC", name).strip().strip('"').lower()
    sigma = plain.endswith(("'", "′", "’"))
    plain = plain.rstrip("'′’")
    outside = re.sub(r"[(\[].*", " ", plain)
    words = [w for w in re.split(r"[^\w\u0e00-\u0e7f±]+|_", outside) if w]
    if words and len(words[0]) > 1 and words[0][0] in "σδ±":  # σθ, Δt
        words = [words[0][0], words[0][1:], *words[1:]]
    sigma = sigma or bool(set(words) & _SIGMA_WORDS)
    quantity = ""
    if set(words) & _OTHER_WORDS and not set(words) & {"θ", "theta"}:
        quantity = ""
    elif set(words) & _ANGLE_WORDS or words[:2] == ["angular", "displacement"]:
        quantity = "theta"
    elif set(words) & _TIME_WORDS:
        quantity = "t"
    elif {"x", "y"} & set(words):
        quantity = "x" if "x" in words else "y"
    elif sigma:
        quantity = "theta"
    if set(words) & {"fit", "model", "residual", "residuals", "true", "truth"}:
        quantity = ""
    return Column(quantity, _scale(plain, _ANGLE_UNITS if quantity == "theta" else _TIME_UNITS), sigma)


def _scale(name: str, units: dict[float, str]) -> float | None:
    words = re.split(r"[^\w\u0e00-\u0e7f°ºµμ]+|_", name)
    for scale, spellings in units.items():
        known = spellings.split()
        if any(word in known for word in words[1:]) or any(s in name for s in known if s in "°º" or s[0] > "ก"):
            return scale
    return None


def series_from_table(table: Table, path: Path, what: str = "") -> ThetaSeries:
    """The series in a table with a time and an angle column. Raises JobError where there is none or it is unclear."""
    log, warnings = list(table.log), list(table.warnings)
    chosen = _choose(table, path, log, warnings)
    values = {key: table.columns[:, k] for key, (k, _) in chosen.items()}
    both = np.isfinite(values["t"]) & np.isfinite(values["theta"])
    _in_order([values["t"][both]], path, [])  # a wrong time column is told before a missing unit
    angle_scale = chosen["theta"][1]
    if angle_scale is None:
        angle_scale = angle_scale_by_size(values["theta"], path, warnings)
    time_scale = chosen["t"][1]
    if time_scale is None:
        time_scale = 1.0
        warnings.append(said("series.seconds_assumed", "The time column names no unit; seconds were assumed."))
    sigma_t = values.get("sigma_t")
    sigma = values.get("sigma_theta")
    return clean_series(
        values["t"] * time_scale,
        values["theta"] * angle_scale,
        None if sigma is None else sigma * (chosen["sigma_theta"][1] or angle_scale),
        sigma_t_s=None if sigma_t is None else sigma_t * (chosen["sigma_t"][1] or time_scale),
        path=path,
        log=log,
        warnings=warnings,
        meta={"format": what} if what else {},
    )


def _choose(table: Table, path: Path, log: list[str], warnings: list[str]) -> dict[str, tuple[int, float | None]]:
    width = table.columns.shape[1]
    if table.names is None:
        if width not in (2, 3):
            hint = "; with decimal commas use tabs or semicolons between columns" if width in (4, 6) else ""
            raise JobError(f"{path} has {width} columns without names; name them, as in t_s,theta_rad{hint}")
        warnings.append(
            said("series.three_assumed", "The columns have no names; time, angle, σ of the angle were assumed.")
            if width == 3
            else said("series.two_assumed", "The columns have no names; time, angle were assumed.")
        )
        return {key: (k, None) for k, key in enumerate(("t", "theta", "sigma_theta")[:width])}
    columns = [understand(name) for name in table.names]
    found: dict[str, tuple[int, float | None]] = {}
    for k, column in enumerate(columns):
        key = ("sigma_" if column.sigma else "") + column.quantity
        if column.quantity in ("t", "theta") and key not in found:
            found[key] = (k, column.scale)
    if "t" not in found and "theta" not in found:  # X Y [X' Y'], as fitting programs of lab courses have it
        for k, column in enumerate(columns):
            key = ("sigma_" if column.sigma else "") + {"x": "t", "y": "theta"}.get(column.quantity, "")
            if column.quantity in ("x", "y") and key not in found:
                found[key] = (k, None)
        if {"t", "theta"} <= set(found):
            warnings.append(said("series.x_and_y", "Columns X and Y were taken as time and angle."))
    for key, example in (("t", "t_s"), ("theta", "theta_rad or theta_deg")):
        if key not in found:
            names = ", ".join(repr(name[:30]) for name in table.names[:8])
            kind = "times" if key == "t" else "angles"
            raise JobError(f"{path} has no column of {kind} (columns: {names}); name one {example}")
    names = ", ".join(repr(table.names[k][:40]) for k, _ in found.values())
    log.append(said("series.columns", "Columns used: {names}.", names=names))
    return found


def angle_scale_by_size(theta: np.ndarray, path: Path, warnings: list[str]) -> float:
    """1 or π/180, from how large the angles are; says so in `warnings`. Raises JobError where both are possible."""
    theta = theta[np.isfinite(theta)]
    largest = float(np.max(np.abs(theta))) if theta.size else 0.0
    if largest <= 1.7:
        in_radians = "No unit is named; the angles reach {largest:.3g}, so radians were assumed."
        warnings.append(said("series.radians_assumed", in_radians, largest=largest))
        return 1.0
    if largest > 3.2:
        in_degrees = "No unit is named; the angles reach {largest:.3g}, so degrees were assumed."
        warnings.append(said("series.degrees_assumed", in_degrees, largest=largest))
        return float(np.pi / 180)
    raise JobError(
        f"{path}: angles up to {largest:.3g} without a unit could be degrees or radians; name it theta_deg or theta_rad"
    )


def clean_series(
    t_s: np.ndarray,
    theta_rad: np.ndarray,
    sigma_rad: np.ndarray | None,
    *,
    path: Path,
    log: list[str],
    warnings: list[str],
    sigma_t_s: np.ndarray | None = None,
    meta: dict[str, Any] | None = None,
    shift: bool = True,
) -> ThetaSeries:
    """A ThetaSeries from raw columns: missing rows left out, order and repeats dealt with, σ of time turned into σ of θ.

    A few rows out of place are sorted; a time that jumps back (two runs in one file) is refused. Raises JobError.
    """
    keep = np.isfinite(t_s) & np.isfinite(theta_rad)
    if not keep.any():
        raise JobError(f"{path} has no row with both a time and an angle; export θ(t) again")
    if not keep.all():
        left_out = "{count} of {rows} rows have no time or no angle and were left out."
        warnings.append(said("series.left_out", left_out, count=int(np.sum(~keep)), rows=keep.size))
    columns = [c[keep] if c is not None else None for c in (t_s, theta_rad, sigma_rad, sigma_t_s)]
    columns = _in_order(columns, path, warnings)
    columns = _without_repeats(columns, path, warnings)
    t, theta, sigma, sigma_t = columns
    assert t is not None
    assert theta is not None
    if shift and t.size > 1 and (t[0] < 0 or t[0] > 0.1 * (t[-1] - t[0])):
        begin = "The file's times begin at {start_s:.6g} s; t = 0 is its first row here."
        log.append(said("series.start", begin, start_s=float(t[0])))
        t = t - t[0]
    sigma = _positive(sigma, said("series.of_angle", "angle"), warnings)
    if sigma_t is not None and t.size > 2:
        sigma_t = _positive(sigma_t, said("series.of_time", "time"), warnings)
    if sigma_t is not None and t.size > 2:
        through_time = sigma_t * np.abs(np.gradient(theta, t))
        sigma = through_time + 1e-12 if sigma is None else np.hypot(sigma, through_time)
        added = "σ of time ({sigma_ms:.3g} ms) was added into σ of the angle as σ_t·|dθ/dt|."
        log.append(said("series.sigma_t", added, sigma_ms=1e3 * float(np.median(sigma_t))))
    all_of_it = {"source": str(path.name), "log": log, "warnings": warnings, **(meta or {})}
    return ThetaSeries(t, theta, sigma, all_of_it)


_Columns = list[np.ndarray | None]


def _in_order(columns: _Columns, path: Path, warnings: list[str]) -> _Columns:
    t = columns[0]
    assert t is not None
    steps = np.diff(t)
    back = np.flatnonzero(steps < 0)
    if back.size == 0:
        return columns
    forward = steps[steps > 0]
    few = back.size <= max(1, 0.02 * t.size) and forward.size and -steps.min() <= 10 * np.median(forward)
    if not few:
        k = int(back[0])
        raise JobError(
            f"{path}: time goes back from {t[k]:.6g} to {t[k + 1]:.6g} after row {k + 1} ({back.size} times in all); "
            "keep one run, sort its rows, or name the time column t_s"
        )
    sorted_rows = "{count} rows were out of order in time and have been sorted."
    warnings.append(said("series.sorted", sorted_rows, count=back.size))
    order = np.argsort(t, kind="stable")
    return [c[order] if c is not None else None for c in columns]


def _without_repeats(columns: _Columns, path: Path, warnings: list[str]) -> _Columns:
    t = columns[0]
    assert t is not None
    times, where, counts = np.unique(t, return_inverse=True, return_counts=True)
    extra = t.size - times.size
    if not extra:
        return columns
    if extra > 0.1 * t.size:
        raise JobError(
            f"{path}: {extra} of {t.size} rows repeat the time of another row; export times with more digits"
        )
    repeated = "{count} rows repeat the time of another row; their mean was taken."
    warnings.append(said("series.repeated_times", repeated, count=extra))
    return [times, *(np.bincount(where, c) / counts if c is not None else None for c in columns[1:])]


def _positive(sigma: np.ndarray | None, of: str, warnings: list[str]) -> np.ndarray | None:
    if sigma is None:
        return None
    good = np.isfinite(sigma) & (sigma > 0)
    if not good.any():
        none = "The column of σ of the {of} holds no positive number and was left out."
        warnings.append(said("series.no_positive_sigma", none, of=of))
        return None
    if not good.all():
        some = "{count} rows have no positive σ of the {of}; the median of the others was taken."
        warnings.append(said("series.some_sigma", some, count=int(np.sum(~good)), of=of))
        sigma = np.where(good, sigma, np.median(sigma[good]))
    return sigma

"""ThetaSeries: the narrow waist. Simulated, filmed and imported data all become one; nothing after it asks which."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.errors import UsageError

_LARGEST = {"t_s": 1e15, "theta_rad": 1e5, "sigma_theta_rad": 1e15}
"""Beyond these a column is not what it says it is."""


@dataclass(frozen=True)
class ThetaSeries:
    """θ(t) with error bars.

    t_s : (n,) strictly increasing times in s.
    theta_rad : (n,) angle from the downward vertical in rad, positive to the camera's right.
    sigma_theta_rad : (n,) standard uncertainty of each θ in rad, or None where it is not known (the fit then
        estimates it from the residuals).
    meta : where the data came from and all that was done to it. Keys in use: `source` (a sentence or a path),
        `log` (list of sentences, in the order done, for the methods section), `warnings` (list of sentences),
        `angle_scale_relative_u` (relative standard uncertainty common to all angles), `vertical_sigma_rad`,
        `row_time_u_s` in s and `row_direction_rad` (σ and ψ of the common uncertainty σ cos(θ − ψ) of all times, where
        the rows of a picture were read one after the other along the angle ψ), `sigma_common_share` (share of σ, rms, of
        errors that return with the angle), `length_m`, `exposure_s`, `calibration` (the content of calibration.json).

    Raises UsageError where shapes differ, a value is not finite or absurd, times do not increase or a σ is not positive.
    """

    t_s: np.ndarray
    theta_rad: np.ndarray
    sigma_theta_rad: np.ndarray | None = None
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        columns: dict[str, np.ndarray] = {}
        for name in ("t_s", "theta_rad", "sigma_theta_rad"):
            value = getattr(self, name)
            if value is None:
                continue
            column = np.array(value, dtype=float)  # a copy: the series owns its data
            if column.ndim != 1 or column.shape != np.shape(self.t_s):
                raise UsageError(
                    f"{name} must be one column as long as t_s, got shape {column.shape} for {np.shape(self.t_s)}"
                )
            if not np.all(np.isfinite(column)):
                raise UsageError(
                    f"{name} holds {np.sum(~np.isfinite(column))} values that are not finite; leave those rows out"
                )
            if (size := float(np.abs(column).max(initial=0.0))) > _LARGEST[name]:
                raise UsageError(f"{name} reaches {size:.3g}, which no pendulum's does; check the column and its unit")
            column.setflags(write=False)
            columns[name] = column
        if columns["t_s"].size == 0:
            raise UsageError("a series needs at least one point, got none")
        if np.any(np.diff(columns["t_s"]) <= 0):
            raise UsageError("t_s must increase from row to row; sort the rows and leave out duplicates")
        sigma = columns.get("sigma_theta_rad")
        if sigma is not None and np.any(sigma <= 0):
            raise UsageError("sigma_theta_rad must be positive; leave the column out where it is not known")
        for name, column in columns.items():
            object.__setattr__(self, name, column)

    def __len__(self) -> int:
        return int(self.t_s.size)

    @property
    def duration_s(self) -> float:
        """Last time minus first, in s."""
        return float(self.t_s[-1] - self.t_s[0])

    def between(self, start_s: float | None = None, stop_s: float | None = None) -> ThetaSeries:
        """The part with start_s ≤ t ≤ stop_s; t = 0 becomes the first time kept. Raises UsageError if empty."""
        keep = np.ones(len(self), dtype=bool)
        if start_s is not None:
            keep &= self.t_s >= start_s
        if stop_s is not None:
            keep &= self.t_s <= stop_s
        if not keep.any():
            raise UsageError(
                f"no data between {start_s} s and {stop_s} s; "
                f"the record runs from {self.t_s[0]:.3g} s to {self.t_s[-1]:.3g} s"
            )
        sigma = None if self.sigma_theta_rad is None else self.sigma_theta_rad[keep]
        kept = self.t_s[keep]
        return replace(self, t_s=kept - kept[0], theta_rad=self.theta_rad[keep], sigma_theta_rad=sigma)

    def logged(self, sentence: str) -> ThetaSeries:
        """The same series with one more sentence in its log (the report's methods section is made of these)."""
        return replace(self, meta={**self.meta, "log": [*self.meta.get("log", []), sentence]})

    @classmethod
    def from_csv(cls, path: str | Path) -> ThetaSeries:
        """Read our own theta.csv (`t_s,theta_rad[,sigma_theta_rad]`). For any other format use `read_series`."""
        from toolkit.series_io.theta_csv import read

        return read(Path(path))

    def to_csv(self, path: str | Path) -> None:
        """Write theta.csv: `t_s,theta_rad,sigma_theta_rad`; numbers read back to the last bit."""
        from toolkit.series_io.theta_csv import write

        write(self, Path(path))

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import series_html

        return series_html(self)

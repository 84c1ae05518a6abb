"""Trajectory: what `simulate` returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from toolkit.series import ThetaSeries


class SolveCost(NamedTuple):
    """What a solution cost: CPU seconds of the solve, of compiling (0 when cached), and evaluations made."""

    cpu_s: float = 0.0
    compile_s: float = 0.0
    evaluations: int = 0
    steps: int = 0


@dataclass(frozen=True)
class Event:
    """Something that happened at a time, and the state there: `slack`, `taut`, `stick`, `slip` …"""

    kind: str
    t_s: float
    theta_rad: float
    omega_rad_per_s: float = 0.0


@dataclass(frozen=True)
class Trajectory:
    """The motion at given times; 1-D arrays of one length, SI units.

    `method` names the route taken, `accuracy_rad` the largest error of θ that was asked for, `error_estimate_rad`
    the one estimated. `tension_n` and `energy_j` are NaN where the mass is not known. `theta_rad` is continuous
    (it grows past π when the pendulum goes over the top).
    """

    t_s: np.ndarray
    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    tension_n: np.ndarray
    energy_j: np.ndarray
    method: str
    cost: SolveCost = field(default_factory=SolveCost)
    accuracy_rad: float = 1e-9
    error_estimate_rad: float | None = None
    events: tuple[Event, ...] = ()
    warnings: tuple[str, ...] = ()
    equation_latex: str = ""
    meta: dict[str, Any] = field(default_factory=dict)

    def to_csv(self, path: str | Path) -> None:
        """Write `t_s,theta_rad,omega_rad_per_s,tension_n,energy_j`; numbers read back to the last bit."""
        import pandas as pd

        names = ("t_s", "theta_rad", "omega_rad_per_s", "tension_n", "energy_j")
        pd.DataFrame({name: getattr(self, name) for name in names}).to_csv(path, index=False)

    def _repr_html_(self) -> str:
        from toolkit.report.notebook import trajectory_html

        return trajectory_html(self)

    @property
    def series(self) -> ThetaSeries:
        """The same θ(t) as a `ThetaSeries` without error bars."""
        from toolkit.series import ThetaSeries

        return ThetaSeries(self.t_s, self.theta_rad, None, meta={"source": "simulation", "method": self.method})

"""Fits of pendulum models to θ(t): lmfit outside, our equation of motion and its sensitivities inside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class FittedParameter:
    """A fitted (or held) number. `stderr` is None where it was held fixed or could not be estimated."""

    value: float
    stderr: float | None
    unit: str
    fixed: bool = False
    initial: float | None = None
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True)
class FitResult:
    """One model fitted to one series.

    parameters : name -> FittedParameter, SI.    covariance : (k, k) over `free`, the names of the free parameters
    in order.    chi2, dof, aic, bic : of the fit with the σ used (`noise` says which).    residuals_rad : (n,)
    measured minus model.    theta_rad, omega_rad_per_s : (n,) the model at the series' times.
    success False comes with a `message` that says what happened and the remedy; nothing is raised.
    noise : sigma_rad used, where it came from, residual autocorrelation (rho1), inflation of the error bars.
    derived : name -> FittedParameter of what follows from the parameters (T0_s, Q, length_m …).
    lmfit : lmfit's own MinimizerResult.
    """

    model: str
    parameters: Mapping[str, FittedParameter]
    free: tuple[str, ...]
    covariance: np.ndarray
    chi2: float
    dof: int
    aic: float
    bic: float
    residuals_rad: np.ndarray
    theta_rad: np.ndarray
    omega_rad_per_s: np.ndarray
    success: bool
    message: str
    noise: Mapping[str, Any] = field(default_factory=dict)
    derived: Mapping[str, FittedParameter] = field(default_factory=dict)
    equation_latex: str = ""
    method: str = ""
    cpu_s: float = 0.0
    warnings: tuple[str, ...] = ()
    lmfit: Any = None

    @property
    def reduced_chi2(self) -> float:
        """χ² per degree of freedom."""
        return self.chi2 / self.dof if self.dof > 0 else float("nan")

"""What a model is: an equation of motion, the coefficients it leaves free, and θ(t) with its derivatives.

Models work on the reduced equation, in which neither mass nor length is needed (mass = length = 1, g = ω_g²):

    θ'' = −ω_g² sin θ − 2 α_d θ' − β |θ'| θ' − μ sgn θ' + a cos(2π f t + ψ)

with α_d = k_d/(2m), β = c ℓ/m, μ = τ/(m ℓ²), a = f0/(m ℓ). A model whose effects are not in this list (buoyancy,
sphere_drag …) is solved in the scene's own units instead, so it needs the scene's mass, length and bob radius.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import UsageError

if TYPE_CHECKING:
    from toolkit.scene import Scene

REDUCED = {
    "linear_drag": ("alpha_d",),
    "quadratic_drag": ("beta",),
    "pivot_friction": ("mu",),
    "cosine_drive": ("drive", "f", "drive_phase"),
}
"""The effects of the reduced equation and the coefficients that each brings."""

_EQUATION_NAME = {
    "alpha_d": "linear_drag.k_d_kg_per_s",
    "beta": "quadratic_drag.c_kg_per_m",
    "mu": "pivot_friction.torque_n_m",
    "drive": "cosine_drive.f0_n",
    "f": "cosine_drive.f_hz",
    "drive_phase": "cosine_drive.phase_rad",
}
_IN_TIME = ("shift", "stretch")
_ACCURACY_RAD = 1e-9


@dataclass(frozen=True)
class Motion:
    """A model's motion at n times: θ (n,) in rad, θ̇ (n,) in rad/s, and both derived by each coefficient asked for.

    d_theta, d_omega : (n, k), one column a name in the order asked for; d_omega has no rows where it was not asked for.
    """

    theta: np.ndarray
    omega: np.ndarray
    d_theta: np.ndarray
    d_omega: np.ndarray
    method: str = ""


@dataclass(frozen=True)
class _Start:
    """θ(0), θ̇(0), and for theta0, phi and omega_g the derivatives of both."""

    theta: float
    omega: float
    by: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Model:
    """A pendulum model.

    name : as in fit.json.    summary : a few words for tables.    effects : of `toolkit.effects`; they make the equation.
    small_angle : θ in place of sin θ.    closed_form : the paper's analytic solution (needs linear_drag, small_angle).
    fixed : effect parameters and pendulum constants that are not fitted, for the equation in the scene's own units
    (empty for the reduced equation).    formula : text of the scene's own torque.    from_scene : effects and small_angle
    are those of the scene (see `within`).
    """

    name: str
    summary: str
    effects: tuple[str, ...]
    small_angle: bool = False
    closed_form: bool = False
    fixed: Mapping[str, float] = field(default_factory=dict)
    formula: str = ""
    from_scene: bool = False

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the reduced coefficients that the effects bring (ω_g, θ₀ and φ are always there too)."""
        return tuple(name for effect in self.effects for name in REDUCED.get(effect, ()))

    @property
    def drags(self) -> tuple[str, ...]:
        """Those coefficients that take energy out, each ≥ 0 in nature."""
        return tuple(name for name in self.coefficients if name in ("alpha_d", "beta", "mu"))

    @property
    def needs_scene(self) -> bool:
        """True where mass and length cannot be divided out of the equation."""
        return any(effect not in REDUCED for effect in self.effects)

    @property
    def latex(self) -> str:
        """The equation of motion that is solved."""
        return str(self._equation().latex)

    def within(self, scene: Scene, shift_s: float = 0.0) -> Model:
        """This model in a scene: driven where the scene is, in the scene's own units where the equation needs them.

        shift_s : the scene's time at which the motion's own begins: held phases and formulas of t are moved by it.
        Raises UsageError where the scene lacks a number that the equation needs.
        """
        effects, small_angle, formula = self.effects, self.small_angle, self.formula
        if self.from_scene:
            effects = tuple(name for name in scene.effects if name != "slack_string")  # which only watches the tension
            small_angle = scene.approximations.small_angle
            formula = str(scene.effects.get("formula", {}).get("torque", ""))
            if shift_s:
                formula = re.sub(r"\bt\b", f"(t + {shift_s!r})", formula)
        if "cosine_drive" in scene.effects and "cosine_drive" not in effects:
            effects = (*effects, "cosine_drive")
        model = replace(self, effects=effects, small_angle=small_angle, formula=formula)
        return replace(model, fixed=model._constants(scene, shift_s)) if model.needs_scene else model

    def _constants(self, scene: Scene, shift_s: float) -> dict[str, float]:
        from toolkit.effects import check_parameters

        pendulum, air = scene.pendulum, scene.environment
        if pendulum.mass_kg is None or pendulum.length_m is None:
            raise UsageError(f"model {self.name!r} needs the pendulum's mass and length: give --mass-kg and --length-m")
        constants = {
            "mass_kg": pendulum.mass_kg,
            "length_m": pendulum.length_m,
            "fluid_density_kg_per_m3": air.fluid_density_kg_per_m3,
            "fluid_viscosity_pa_s": air.fluid_viscosity_pa_s,
        }
        if pendulum.bob_radius_m is not None:
            constants["bob_radius_m"] = pendulum.bob_radius_m
        for effect in self.effects:
            if effect not in REDUCED:
                table = check_parameters(effect, scene.effects.get(effect, {}))
                if "phase_rad" in table:
                    table["phase_rad"] += 2 * math.pi * table["f_hz"] * shift_s
                constants |= {
                    f"{effect}.{key}": value for key, value in table.items() if isinstance(value, int | float)
                }
        missing = [name for name in self._equation().parameters if name not in constants and "." not in name]
        if "bob_radius_m" in missing:
            raise UsageError(f"model {self.name!r} needs the bob's radius: give --bob-radius-m")
        return constants

    def motion(
        self, values: Mapping[str, float], t_s: np.ndarray, by: Sequence[str] = (), rates: bool = True
    ) -> Motion:
        """θ(t), θ̇(t) at `t_s` (increasing, ≥ 0) and their derivatives by the coefficients named in `by` (those of θ̇ only
        where `rates`).

        `values` holds theta0, phi, omega_g and `coefficients`. The start follows CONVENTIONS.md: with κ = sin(θ₀/2),
        sin(θ(0)/2) = κ sin φ and θ̇(0) = 2 κ ω_g cos φ; for small angles θ(0) = θ₀ sin φ, θ̇(0) = θ₀ ω_g cos φ.
        """
        if self.closed_form:
            return self._closed_form(values, t_s, by)
        parameters, scale = self._parameters(values)
        start = self._start(values)
        autonomous = not (self.fixed or "cosine_drive" in self.effects)
        chain = (self._chain_in_time if autonomous else self._chain)(values, parameters, scale, start, by)
        asked = tuple(dict.fromkeys(c for parts in chain for c in parts if c not in _IN_TIME))
        solution = self._equation().solve(
            parameters, start.theta, start.omega, t_s, accuracy_rad=_ACCURACY_RAD, sensitivities=asked
        )
        theta, omega = solution.theta_rad, solution.omega_rad_per_s
        rate = self._acceleration(values, theta, omega) if autonomous and rates else None
        columns = {c: solution.d_theta[:, i] for i, c in enumerate(asked)}
        d_theta = _combined(chain, columns | {"shift": omega, "stretch": t_s * omega}, len(t_s))
        if not rates:
            return Motion(theta, omega, d_theta, np.empty((0, len(by))), solution.method)
        columns = {c: solution.d_omega[:, i] for i, c in enumerate(asked)}
        if rate is not None:
            columns |= {"shift": rate, "stretch": t_s * rate + omega}
        return Motion(theta, omega, d_theta, _combined(chain, columns, len(t_s)), solution.method)

    def _parameters(self, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        """The equation's parameters, and by how much each grows with its reduced coefficient."""
        mass, length = self.fixed.get("mass_kg", 1.0), self.fixed.get("length_m", 1.0)
        scale = {
            "alpha_d": 2 * mass,
            "beta": mass / length,
            "mu": mass * length**2,
            "drive": mass * length,
            "f": 1.0,
            "drive_phase": 1.0,
        }
        parameters = {"mass_kg": 1.0, "length_m": 1.0, **self.fixed, "g_m_per_s2": values["omega_g"] ** 2 * length}
        parameters |= {_EQUATION_NAME[name]: scale[name] * values[name] for name in self.coefficients}
        return parameters, {name: scale[name] for name in self.coefficients}

    def _chain(
        self,
        values: Mapping[str, float],
        parameters: Mapping[str, float],
        scale: Mapping[str, float],
        start: _Start,
        by: Sequence[str],
    ) -> list[dict[str, float]]:
        """How each derivative is made of those by the equation's own parameters and start, for any equation."""
        chain = []
        for name in by:
            if name in scale:
                chain.append({_EQUATION_NAME[name]: scale[name]})
                continue
            by_theta, by_omega = start.by[name]
            chain.append({"theta0_rad": by_theta, "omega0_rad_per_s": by_omega})
            if name == "omega_g":
                chain[-1]["g_m_per_s2"] = 2 * parameters["g_m_per_s2"] / values["omega_g"]
        return chain

    def _chain_in_time(
        self,
        values: Mapping[str, float],
        parameters: Mapping[str, float],
        scale: Mapping[str, float],
        start: _Start,
        by: Sequence[str],
    ) -> list[dict[str, float]]:
        """The same for the reduced equation without a drive, with two variational equations fewer: time does not appear in
        it, so a shift in time (θ̇, θ̈) is the derivative along one start; and a unit of time can be chosen, so that
        ω_g ∂θ/∂ω_g = t θ̇ − α_d ∂θ/∂α_d − 2 μ ∂θ/∂μ at the same θ₀, φ."""
        at_start = float(self._acceleration(values, start.theta, start.omega))
        from_speed = abs(start.omega) * values["omega_g"] >= abs(at_start)  # which start a shift in time stands in for
        chain = []
        for name in by:
            if name in scale:
                chain.append({_EQUATION_NAME[name]: scale[name]})
            elif name == "omega_g":
                chain.append({"stretch": 1 / values["omega_g"]})
                for other, power in (("alpha_d", 1), ("mu", 2)):
                    if other in scale and (values[other] != 0 or other in by):
                        chain[-1][_EQUATION_NAME[other]] = -power * values[other] * scale[other] / values["omega_g"]
            else:
                by_theta, by_omega = start.by[name]
                if from_speed:
                    shift = by_theta / start.omega
                    chain.append({"shift": shift, "omega0_rad_per_s": by_omega - shift * at_start})
                else:
                    shift = by_omega / at_start
                    chain.append({"shift": shift, "theta0_rad": by_theta - shift * start.omega})
        return chain

    def _acceleration(self, values: Mapping[str, float], theta: Any, omega: Any) -> Any:
        """θ̈ of the reduced equation without a drive."""
        alpha_d, beta, mu = (values[n] if n in self.coefficients else 0.0 for n in ("alpha_d", "beta", "mu"))
        back = values["omega_g"] ** 2 * (theta if self.small_angle else np.sin(theta))
        return -back - (2 * alpha_d + beta * np.abs(omega)) * omega - mu * np.sign(omega)

    def _start(self, values: Mapping[str, float]) -> _Start:
        theta0, phi, omega_g = values["theta0"], values["phi"], values["omega_g"]
        sine, cosine = math.sin(phi), math.cos(phi)
        if self.small_angle:
            by = {
                "theta0": (sine, omega_g * cosine),
                "phi": (theta0 * cosine, -theta0 * omega_g * sine),
                "omega_g": (0.0, theta0 * cosine),
            }
            return _Start(theta0 * sine, theta0 * omega_g * cosine, by)
        kappa, d_kappa = math.sin(theta0 / 2), math.cos(theta0 / 2) / 2
        root = math.sqrt(max(1 - (kappa * sine) ** 2, 1e-300))
        by = {
            "theta0": (2 * d_kappa * sine / root, 2 * d_kappa * omega_g * cosine),
            "phi": (2 * kappa * cosine / root, -2 * kappa * omega_g * sine),
            "omega_g": (0.0, 2 * kappa * cosine),
        }
        return _Start(2 * math.asin(kappa * sine), 2 * kappa * omega_g * cosine, by)

    def _equation(self) -> Any:
        return _equation(self.effects, self.small_angle, self.formula)

    def _closed_form(self, values: Mapping[str, float], t_s: np.ndarray, by: Sequence[str]) -> Motion:
        from toolkit.motion.closed_form import paper_model

        names = {
            "theta0": ("theta0_rad", 1.0),
            "phi": ("phi_rad", 1.0),
            "alpha_d": ("alpha_d_per_s", 1.0),
            "omega_g": ("omega_g_rad_per_s", 1.0),
            "drive": ("drive_rad_per_s2", 1.0),
            "f": ("omega_f_rad_per_s", 2 * math.pi),
            "drive_phase": ("phase_rad", 1.0),
        }
        solved = paper_model(
            t_s,
            **{names[name][0]: names[name][1] * value for name, value in values.items() if name in names},
            derivatives=[names[name][0] for name in by],
        )
        scale = np.array([names[name][1] for name in by])
        return Motion(
            solved.theta_rad, solved.omega_rad_per_s, solved.d_theta * scale, solved.d_omega * scale, "closed form"
        )


def _combined(chain: Sequence[Mapping[str, float]], columns: Mapping[str, np.ndarray], count: int) -> np.ndarray:
    """(n, k) sums of the named columns, column by column in memory."""
    out = np.zeros((len(chain), count))
    for row, parts in zip(out, chain):
        for column, weight in parts.items():
            row += weight * columns[column]
    return out.T


@functools.lru_cache(maxsize=32)
def _equation(effects: tuple[str, ...], small_angle: bool, formula: str) -> Any:
    from toolkit.motion import build_equation

    return build_equation(effects, small_angle, {"formula": formula} if formula else None)

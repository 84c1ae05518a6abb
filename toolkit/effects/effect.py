"""What an effect is. One effect is one module of this package with a module-level `EFFECT`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Parameter:
    """A named, unit-bearing number of an effect. `default` None: the scene must give it.

    `symbol` is the LaTeX with which the equation of motion shows it.
    """

    name: str
    unit: str
    meaning: str
    default: float | None = None
    minimum: float | None = 0.0
    maximum: float | None = None
    symbol: str = ""


@dataclass(frozen=True)
class Harmonic:
    """A torque amplitude·cos(2π f t + phase): amplitude in N·m, f in Hz, phase in rad."""

    amplitude: Any
    f_hz: Any
    phase_rad: Any


@dataclass(frozen=True)
class Term:
    """What an effect adds to the equation  inertia · θ'' = torque.  Each entry is an expression of the symbols.

    torque : generalised torque in N·m.    harmonic : a torque that is a cosine of time.
    drag : force on the bob against its velocity, per speed, in kg/s: a torque −drag·ℓ·velocity (and, where the string
        is slack, drag in free flight).
    inertia : moment of inertia in kg·m², of parameters only.
    radial_force : force on the bob along the string, outwards, in N (the string's tension balances it).
    energy : stored energy in J, zero at rest at the bottom.
    """

    torque: Any = 0
    harmonic: Harmonic | None = None
    drag: Any = 0
    inertia: Any = 0
    radial_force: Any = 0
    energy: Any = 0


@dataclass(frozen=True)
class PivotMotion:
    """Velocity (m/s) and acceleration (m/s²) of the pivot, each (right, up)."""

    velocity: tuple[Any, Any]
    acceleration: tuple[Any, Any]


@dataclass(frozen=True)
class Effect:
    """One piece of physics.

    term : a function of the symbols (see `toolkit.motion.symbols.Symbols`) that returns a `Term`. The same function is
        called with SymPy symbols to derive and compile the equation, with NumPy arrays to find tension and
        energy, and with LaTeX to print it.
    needs : names of scene quantities besides length and g that the term uses (`mass_kg`, `bob_radius_m` …).
    linear : the torque is linear in θ and θ' with constant coefficients where sin θ is taken as θ.
    dissipative : it never raises the energy.
    pivot : the pivot's motion, for an effect that moves it.
    """

    name: str
    meaning: str
    term: Callable[[Any], Term]
    parameters: tuple[Parameter, ...] = ()
    needs: tuple[str, ...] = ()
    valid: str = ""
    reference: str = ""
    linear: bool = False
    dissipative: bool = False
    pivot: Callable[[Any], PivotMotion] | None = None

"""Scene: what hangs where, what acts on it, who films it. A scene is data; nothing in it is executed."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from toolkit.errors import JobError, UsageError
from toolkit.registry import did_you_mean

STANDARD_GRAVITY_M_PER_S2 = 9.80665
_MAX_SCENE_BYTES = 1_000_000


@dataclass(frozen=True)
class Pendulum:
    """Mass, length from pivot to bob centre, and bob radius; None where not known."""

    mass_kg: float | None = None
    length_m: float | None = None
    bob_radius_m: float | None = None

    def __post_init__(self) -> None:
        _require_positive("pendulum", self, "mass_kg", "length_m", "bob_radius_m")


@dataclass(frozen=True)
class Release:
    """Angle and angular velocity at t = 0."""

    theta0_rad: float = 0.1
    omega0_rad_per_s: float = 0.0


@dataclass(frozen=True)
class Environment:
    """Gravity (given, or from latitude and height by the WGS84 formula) and the fluid around the bob."""

    g_m_per_s2: float | None = None
    latitude_deg: float | None = None
    height_m: float = 0.0
    fluid_density_kg_per_m3: float = 1.2041
    fluid_viscosity_pa_s: float = 1.825e-5

    def __post_init__(self) -> None:
        _require_positive("environment", self, "g_m_per_s2", "fluid_density_kg_per_m3", "fluid_viscosity_pa_s")
        if self.g_m_per_s2 is not None and self.latitude_deg is not None:
            raise UsageError("[environment] gives both g_m_per_s2 and latitude_deg; keep one of them")
        if self.latitude_deg is not None and not -90 <= self.latitude_deg <= 90:
            raise UsageError(f"[environment] latitude_deg must lie between -90 and 90, got {self.latitude_deg}")

    @property
    def gravity_m_per_s2(self) -> float:
        """g in m/s²: as given, else normal gravity at the latitude and height, else the standard 9.80665."""
        if self.g_m_per_s2 is not None:
            return self.g_m_per_s2
        if self.latitude_deg is None:
            return STANDARD_GRAVITY_M_PER_S2
        return normal_gravity(self.latitude_deg, self.height_m)


@dataclass(frozen=True)
class Approximations:
    """Simplifications that the scene asks for."""

    small_angle: bool = False


@dataclass(frozen=True)
class Camera:
    """The camera of a rendered video; `effects` maps a camera effect's name to its parameters."""

    width_px: int = 640
    height_px: int = 480
    fps: float = 60.0
    duration_s: float = 10.0
    px_per_m: float = 600.0
    pivot_px: tuple[float, float] = (320.0, 40.0)
    seed: int = 0
    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _require_positive("camera", self, "width_px", "height_px", "fps", "duration_s", "px_per_m")
        from toolkit.camera import check_parameters

        object.__setattr__(self, "effects", _checked_effects(self.effects, "camera", check_parameters))


@dataclass(frozen=True)
class Scene:
    """All that is known or assumed about one pendulum experiment. See `from_toml` for its file form.

    `effects` maps an effect's name to its parameters (`{"linear_drag": {"k_d_kg_per_s": 0.16}}`); an effect that
    is not named does not act. Raises UsageError for an effect or a parameter that there is not, or that is out of range.
    """

    pendulum: Pendulum = field(default_factory=Pendulum)
    release: Release = field(default_factory=Release)
    environment: Environment = field(default_factory=Environment)
    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    approximations: Approximations = field(default_factory=Approximations)
    camera: Camera | None = None

    def __post_init__(self) -> None:
        from toolkit.effects import check_parameters

        object.__setattr__(self, "effects", _checked_effects(self.effects, "effects", check_parameters))

    def with_(self, **sections: Any) -> Scene:
        """A copy with whole sections replaced."""
        return replace(self, **sections)

    @classmethod
    def from_toml(cls, path: str | Path) -> Scene:
        """Read a scene file. Raises JobError if it cannot be read, UsageError naming the key that is wrong."""
        path = Path(path)
        try:
            if path.stat().st_size > _MAX_SCENE_BYTES:
                raise JobError(f"{path} is larger than 1 MB: not a scene file")
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise JobError(f"cannot read scene {path}: {error.strerror}; check the file's name") from error
        except UnicodeDecodeError as error:
            raise UsageError(f"{path} is not a text file in UTF-8; save it as UTF-8") from error
        except tomllib.TOMLDecodeError as error:
            raise UsageError(f"{path} is not valid TOML: {error}") from error
        try:
            return cls.from_dict(table)
        except UsageError as error:
            raise UsageError(f"{path}: {error}") from error

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Scene:
        """A scene from nested dicts, every key and value checked. Raises UsageError naming the key."""
        sections = dict(table)
        effects = sections.pop("effects", {})
        camera = sections.pop("camera", None)
        kinds: dict[str, type[Any]] = {
            "pendulum": Pendulum,
            "release": Release,
            "environment": Environment,
            "approximations": Approximations,
        }
        known = [*kinds, "effects", "camera"]
        for name in sections:
            if name not in kinds:
                raise UsageError(f"unknown section [{name}]{did_you_mean(name, known)}")
        parts: dict[str, Any] = {name: _read_section(kinds[name], section, name) for name, section in sections.items()}
        return cls(**parts, effects=effects, camera=None if camera is None else _read_camera(camera))

    def to_dict(self) -> dict[str, Any]:
        """Nested dicts of what is set (no None), as `from_dict` reads them."""
        table: dict[str, Any] = {}
        for name in ("pendulum", "release", "environment", "approximations"):
            section = {k: v for k, v in dataclasses.asdict(getattr(self, name)).items() if v is not None}
            if section:
                table[name] = section
        if self.effects:
            table["effects"] = {name: dict(values) for name, values in self.effects.items()}
        if self.camera is not None:
            camera = {k: v for k, v in dataclasses.asdict(self.camera).items() if k != "effects"}
            camera["pivot_px"] = list(self.camera.pivot_px)
            table["camera"] = {
                **camera,
                **{name: dict(values) for name, values in self.camera.effects.items()},
            }
        return table


def normal_gravity(latitude_deg: float, height_m: float = 0.0) -> float:
    """Normal gravity in m/s²: WGS84 Somigliana formula with the second-order height factor."""
    s2 = math.sin(math.radians(latitude_deg)) ** 2
    at_sea = 9.7803253359 * (1 + 0.00193185265241 * s2) / math.sqrt(1 - 0.00669437999013 * s2)
    a_m, flattening, ratio = 6378137.0, 1 / 298.257223563, 0.00344978650684
    linear = 2 / a_m * (1 + flattening + ratio - 2 * flattening * s2) * height_m
    return at_sea * (1 - linear + 3 * (height_m / a_m) ** 2)


_T = TypeVar("_T")


def _read_section(kind: type[_T], table: Any, where: str) -> _T:
    if not isinstance(table, Mapping):
        raise UsageError(f"[{where}] must be a table of keys, got {table!r}")
    fields = {f.name: f for f in dataclasses.fields(kind) if f.name != "effects"}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in fields:
            raise UsageError(f"unknown key {key!r} in [{where}]{did_you_mean(key, list(fields))}")
        values[key] = _checked(value, str(fields[key].type), f"{key} in [{where}]")
    return kind(**values)


def _checked(value: Any, kind: str, what: str) -> Any:
    if kind == "bool":
        if not isinstance(value, bool):
            raise UsageError(f"{what} must be true or false, got {value!r}")
        return value
    if kind.startswith("tuple"):
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise UsageError(f"{what} must be two numbers [x, y], got {value!r}")
        return tuple(checked_number(v, what) for v in value)
    number = checked_number(value, what)
    if kind == "int":
        if number != int(number):
            raise UsageError(f"{what} must be a whole number, got {value!r}")
        return int(number)
    return number


def checked_number(value: Any, what: str) -> float:
    """`value` as a finite float. Raises UsageError naming `what`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UsageError(f"{what} must be a finite number, got {value!r}")
    return float(value)


def _checked_effects(table: Any, where: str, check: Callable[[str, Any], dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """`table` with every effect's parameters checked and complete."""
    if not isinstance(table, Mapping):
        raise UsageError(f"[{where}] must hold one table an effect, got {table!r}")
    return {name: check(name, values) for name, values in table.items()}


def _read_camera(table: Any) -> Camera:
    if not isinstance(table, Mapping):
        raise UsageError(f"[camera] must be a table of keys, got {table!r}")
    keys = {k: v for k, v in table.items() if not isinstance(v, Mapping)}
    effects = {name: values for name, values in table.items() if isinstance(values, Mapping)}
    return replace(_read_section(Camera, keys, "camera"), effects=effects)


def _require_positive(where: str, section: Any, *names: str) -> None:
    for name in names:
        value = getattr(section, name)
        if value is not None and not value > 0:
            raise UsageError(f"[{where}] {name} must be positive, got {value}")

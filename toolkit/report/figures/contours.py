"""Which parameters lean on each other: contours of the two most correlated, and all correlations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import DRAGS, Material
from toolkit.report.style import BEST_MODEL, INK, PAPER_MODEL, draw, panels

if TYPE_CHECKING:
    from toolkit.fitting.contour import Contour

_LEVELS = (2.296, 6.180)  # Δχ² of two parameters at 68.3 and 95.4 %
_MOST_POINTS = 1500


def contours(material: Material) -> Figure | None:
    """1σ and 2σ contours (39 % and 86 %) of two parameters of the richest model, and its correlation matrix."""
    fits = [r for r in material.analysis.fits.values() if r.success and _covariance(r) is not None and len(r.free) >= 2]
    if not fits:
        return None
    result = max(fits, key=lambda r: (min(2, sum(n in DRAGS for n in r.free)), -r.aic))
    if (
        result is not material.best
        and _covariance(material.best) is not None
        and sum(n in DRAGS for n in material.best.free) >= 2
    ):
        result = material.best
    words = material.words
    covariance = _covariance(result)
    assert covariance is not None
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    first, second = _pair(result.free, correlation)
    labels = [_label(words, name) for name in result.free]
    parameters = [result.parameters[name] for name in result.free]
    powers = [_power(p.value, u) for p, u in zip(parameters, sigma)]
    values = np.array([p.value / 10.0**power for p, power in zip(parameters, powers)])
    units = [_unit(p.unit, power) for p, power in zip(parameters, powers)]
    scaled = covariance / np.outer(10.0 ** np.array(powers), 10.0 ** np.array(powers))

    profiled = _profile(material, result, result.free[first], result.free[second])

    def paint(figure: Any) -> None:
        left, right = panels(figure, 1, 2, left=0.85, gap=0.8, width_ratios=(1.15, 1))
        if profiled is not None:
            x, y = profiled.first / 10.0 ** powers[first], profiled.second / 10.0 ** powers[second]
            left.contour(
                *map(_smooth, (x, y, profiled.delta_chi2)), levels=_LEVELS, colors=[PAPER_MODEL], linewidths=[1.1, 0.8]
            )
        turn = np.linspace(0, 2 * np.pi, 4001)  # so many that a needle has points on its tip
        root = np.linalg.cholesky(scaled[np.ix_([first, second], [first, second])])
        for k, alpha in ((math.sqrt(_LEVELS[0]), 0.35), (math.sqrt(_LEVELS[1]), 0.18)):
            x, y = values[[first, second]][:, None] + k * root @ np.vstack([np.cos(turn), np.sin(turn)])
            left.fill(x, y, color=BEST_MODEL, alpha=alpha, linewidth=0)
        left.plot(values[first], values[second], "+", color=INK, markersize=6)
        possible = (x >= 0) | (result.free[first] not in DRAGS)  # a drag is not negative
        possible &= (y >= 0) | (result.free[second] not in DRAGS)
        for name, line, limits in ((result.free[first], x, left.set_xlim), (result.free[second], y, left.set_ylim)):
            if name in DRAGS and not possible.all() and possible.any():
                limits(max(limits()[0], 0.0), 1.1 * float(line[possible].max()))
        left.set_xlabel(f"{labels[first]} {units[first]}")
        left.set_ylabel(f"{labels[second]} {units[second]}")
        left.ticklabel_format(useOffset=False)
        right.grid(False)
        right.imshow(np.abs(correlation), cmap="Greys", vmin=0, vmax=1.6, aspect="auto")
        for i in range(len(labels)):
            for j in range(len(labels)):
                shown = f"{correlation[i, j] + 0.0:z.2f}".replace("-", "−")
                right.text(j, i, shown, ha="center", va="center", fontsize=7 if len(labels) < 7 else 6, color=INK)
        right.set_xticks(range(len(labels)), labels)
        right.set_yticks(range(len(labels)), labels)
        for side in right.spines.values():
            side.set_visible(False)

    data = {
        "parameter": np.array(result.free),
        **{f"correlation_{n}": correlation[i] for i, n in enumerate(result.free)},
    }
    if profiled is not None:
        data |= {f"{name}_of_profile": x.ravel() for name, x in zip(profiled.names, (profiled.first, profiled.second))}
        data["delta_chi2"] = profiled.delta_chi2.ravel()
    key = "caption.contours" if profiled is None else "caption.contours_profile"
    model = words.either(f"model.{result.model}", result.model)
    return Figure("contours", words(key, model=model), draw("contours", "en", 2.5, paint), data)


def _profile(material: Material, result: Any, first: str, second: str) -> Contour | None:
    """Δχ² with all other parameters fitted anew; None for a long record, where it would take longer than the report."""
    from toolkit.fitting.contour import contour

    if result.problem is None or material.t.size > _MOST_POINTS:
        return None
    found = contour(result, first, second, reach=2.8, count=9)
    return found if np.isfinite(found.delta_chi2).mean() > 0.5 else None


def _smooth(net: np.ndarray, times: int = 4) -> np.ndarray:
    """The net made `times` finer along both axes by cubics through its places (Catmull and Rom), so that lines are round."""
    for _ in range(2):
        net = np.vstack([2 * net[:1] - net[1:2], net, 2 * net[-1:] - net[-2:-1]])
        a, b, c, d = net[:-3], net[1:-2], net[2:-1], net[3:]
        finer = [
            b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)))
            for u in np.arange(times) / times
        ]
        net = np.vstack([np.stack(finer, axis=1).reshape(-1, net.shape[1]), net[-2:-1]]).T
    return net


def _covariance(result: Any) -> np.ndarray | None:
    c = np.asarray(result.covariance, dtype=float)
    n = len(result.free)
    good = c.shape == (n, n) and n and np.all(np.isfinite(c)) and np.all(np.diag(c) > 0)
    return c if good and np.all(np.linalg.eigvalsh(c / np.sqrt(np.outer(np.diag(c), np.diag(c)))) > 0) else None


def _pair(names: tuple[str, ...], correlation: np.ndarray) -> tuple[int, int]:
    drags = [i for i, name in enumerate(names) if name in DRAGS]
    if len(drags) >= 2:
        return drags[0], drags[1]
    off = np.abs(correlation - np.eye(len(names)))
    i, j = np.unravel_index(int(off.argmax()), off.shape)
    return int(min(i, j)), int(max(i, j))


def _label(words: Any, name: str) -> str:
    """The symbol as mathtext: symbols hold no Thai."""
    return "$" + words.either(f"symbol.{name}", name).replace("_{offset}", r"_\mathrm{offset}") + "$"


def _power(value: float, u: float) -> int:
    """The power of ten that stands with the unit, so that the ticks are plain numbers."""
    size = max(abs(value), u)
    power = math.floor(math.log10(size)) if size > 0 else 0
    return power if power < -2 or power > 3 else 0


def _unit(unit: str, power: int) -> str:
    shown = {"1": "", "1/s^2": "1/s²", "N·m": "N m"}.get(unit, unit)
    factor = f"$10^{{{power}}}$" if power else ""
    return f"({' '.join(part for part in (factor, shown) if part)})" if factor or shown else ""

"""Runs of integrators as ratios at equal accuracy, as a text and as a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from toolkit.cost._peers import SOLVE_IVP
from toolkit.cost.problems import Problem

OURS = ("solve", "simulate")


@dataclass(frozen=True)
class Run:
    """One method at one setting: largest error of θ over the judged samples, CPU of the best repetition, evaluations."""

    problem: str
    method: str
    setting: float
    error_rad: float
    cpu_ms: float
    evaluations: int
    route: str = ""


@dataclass(frozen=True)
class Measured:
    """All runs, and the CPU seconds of a first call in a fresh process: never compiled, and compiled before."""

    problems: tuple[Problem, ...]
    runs: tuple[Run, ...]
    first_call_s: dict[str, float] = field(default_factory=dict)


COLUMNS = ("solve", "simulate", "solve_ivp", "odeint", "solve_ivp/solve", "odeint/solve", "solve_ivp/simulate")


def ratios(measured: Measured) -> list[dict[str, Any]]:
    """Least CPU (ms) at equal accuracy: at 1e-5, 1e-7, 1e-9 and at the tightest errors that solve_ivp and odeint reach."""
    rows = []
    for problem in measured.problems:
        runs = [r for r in measured.runs if r.problem == problem.name]
        by_peers = [r.error_rad for r in runs if r.method in SOLVE_IVP]
        targets = {1e-5, 1e-7, 1e-9} | ({min(by_peers)} if by_peers else set())
        for target in sorted(targets, reverse=True):
            least = {m: _least(runs, (m,), target) for m in (*OURS, "odeint")}
            least["solve_ivp"] = _least(runs, SOLVE_IVP, target)
            row: dict[str, Any] = {"problem": problem.name, "error_rad": target, **least}
            for column in COLUMNS[4:]:
                above, below = column.split("/")
                over, under = least[above], least[below]
                row[column] = over / under if over and under else None
            rows.append(row)
    return rows


def _least(runs: list[Run], methods: tuple[str, ...], target: float) -> float | None:
    return min((r.cpu_ms for r in runs if r.method in methods and r.error_rad <= target), default=None)


def cell(value: float | None) -> str:
    """A number of the table, or nothing."""
    return "" if value is None else f"{value:.3g}"


def describe(measured: Measured, table: list[dict[str, Any]], quick: bool) -> str:
    """All that was measured, in words and columns."""
    lines = ["least CPU time (ms) to a largest error of θ; – where no setting reached it"]
    lines.append("".join(["problem  error ", *(f"{c:>19}" for c in COLUMNS)]))
    for row in table:
        cells = "".join(f"{cell(row[c]) or '–':>19}" for c in COLUMNS)
        lines.append(f"{row['problem']:7} {row['error_rad']:7.1e}{cells}")
    lines += [
        "",
        "problems:",
        *(f"  {p.name}: {p.what}; {p.duration_s:g} s, {p.samples} samples" for p in measured.problems),
    ]
    lines += ["  P4: RK45 and DOP853 of SciPy would need about a minute a run and are left out"]
    lines += ["", "accuracy asked for and reached by simulate:"]
    for problem in measured.problems:
        ours = [r for r in measured.runs if r.problem == problem.name and r.method == "simulate"]
        missed = [
            f"{r.setting:.0e} → {r.error_rad:.1e}" for r in ours if r.error_rad > r.setting and r.setting >= 0.9e-11
        ]
        routes = _routes([r.route for r in ours])
        lines.append(
            f"  {problem.name}: {'reached 1e-3 … 1e-11' if not missed else 'missed ' + ', '.join(missed)}; {routes}"
        )
    if measured.first_call_s:
        lines += [
            "",
            "first call of simulate in a fresh process, CPU s (cold: nothing compiled; warm: compiled before):",
        ]
        for name in dict.fromkeys(k.split()[0] for k in measured.first_call_s):
            cold, warm = (measured.first_call_s.get(f"{name} {k}", math.nan) for k in ("cold", "warm"))
            whole = measured.first_call_s.get(f"{name} process", math.nan)
            lines.append(f"  {name}: cold {cold:.2f}, warm {warm:.2f}; the whole warm process {whole:.2f}")
    if quick:
        lines += ["", "a quick run: shorter P3, P4 and D, half the tolerances; leave out --quick for the full tables"]
    return "\n".join(lines)


def _routes(names: list[str]) -> str:
    """Routes without repetition; orders of the series as a range."""
    series = "Taylor series of order "
    orders = sorted({int(n.removeprefix(series)) for n in names if n.startswith(series)})
    others = sorted({n for n in names if not n.startswith(series)})
    return ", ".join([*others, *([f"{series}{orders[0]} … {orders[-1]}"] if orders else [])])


_STYLES = {
    "solve": ("#D55E00", "o", "-"),
    "simulate": ("#D55E00", "s", "--"),
    "RK45": ("#56B4E9", "v", "-"),
    "DOP853": ("#0072B2", "^", "-"),
    "LSODA": ("#009E73", "D", "-"),
    "Radau": ("#CC79A7", "P", "-"),
    "odeint": ("#000000", "x", ":"),
}


def draw(measured: Measured, stem: Path) -> None:
    """CPU time against error, a panel a problem, as stem.png and stem.svg."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 6), layout="constrained")
    FigureCanvasAgg(figure)
    columns = 4
    panels = figure.subplots(2, columns).flat
    for i, (axes, problem) in enumerate(zip(panels, measured.problems)):
        for method, (colour, marker, dash) in _STYLES.items():
            points = [
                (max(r.error_rad, 1e-16), r.cpu_ms)
                for r in measured.runs
                if (r.problem, r.method) == (problem.name, method)
            ]
            if points:
                x, y = zip(*points)
                label = f"pendulab {method}" if method in OURS else method
                axes.loglog(x, y, color=colour, marker=marker, linestyle=dash, markersize=3, linewidth=0.9, label=label)
        axes.invert_xaxis()
        axes.set_title(f"{problem.name}: {problem.what}", fontsize=8, loc="left")
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.25, linewidth=0.4)
        if i >= columns:
            axes.set_xlabel("largest error of θ (rad)", fontsize=7)
        if i % columns == 0:
            axes.set_ylabel("CPU (ms)", fontsize=7)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=7, fontsize=8, frameon=False)
    figure.savefig(stem.with_suffix(".png"), dpi=200)
    figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None})

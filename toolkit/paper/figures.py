"""The paper's twelve panels, an overview sheet for each φ, and the misprints, drawn for print."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.paper.misprints import driven_part
from toolkit.paper.table1 import MODELS, PHASES, SWEEPS, Case, Motion, Sweep, solve_case
from toolkit.progress import Progress, silent

COLOURS = ("#0072B2", "#D55E00", "#009E73")  # Okabe & Ito: told apart by all kinds of colour vision
_DASHES = {"small angle": (4, 1.5), "full equation": ()}
_AXES = (
    ("theta", r"$\theta$ (rad)"),
    ("omega", r"$\dot{\theta}$ (rad/s)"),
    ("tension", r"$T$ (N)"),
)
_SYMBOLS = {"length_m": r"\ell", "f0_n": "f_0", "k_d_kg_per_s": "k_d", "theta0_rad": r"\theta_0"}
_PHI_TEXT = {"π/2": r"\pi/2", "0": "0"}
_STYLE = {
    "font.size": 8,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "mathtext.fontset": "dejavusans",
    "svg.hashsalt": "pendulab",
}
_SPAN_S = np.linspace(0.0, 20.0, 2001)


def draw_panels(folder: Path, progress: Progress = silent) -> list[Path]:
    """panel_2a.png, .svg … panel_7b: φ = π/2, 0 … 20 s, one width of a journal column each."""
    import matplotlib

    written = []
    with matplotlib.rc_context(_STYLE):
        for i, sweep in enumerate(SWEEPS):
            for j, (field, label) in enumerate(_AXES):
                figure, axes = _new_figure(3.5, 2.5)
                _draw(axes, sweep, "π/2", field, label)
                _name_lines(figure, axes, sweep, "π/2")
                written += _save(figure, folder / f"panel_{sweep.panels[j]}")
                progress(f"panel {sweep.panels[j]}", 0.6 * (3 * i + j + 1) / 12)
    return written


def draw_overview(folder: Path) -> list[Path]:
    """overview_phi_90.png, .svg and overview_phi_0: the twelve panels on one sheet."""
    import matplotlib

    written = []
    with matplotlib.rc_context(_STYLE):
        for phi, name in (("π/2", "overview_phi_90"), ("0", "overview_phi_0")):
            figure, grid = _new_figure(10.0, 9.5, (4, 3))
            for row, sweep in zip(grid, SWEEPS):
                for axes, (field, label), panel in zip(row, _AXES, sweep.panels):
                    _draw(axes, sweep, phi, field, label)
                    axes.set_title(f"({panel})", loc="left", fontsize=8)
                row[2].legend(
                    handles=_handles(sweep), loc="upper right", handlelength=1.2, title=_fixed(sweep), title_fontsize=7
                )
            figure.suptitle(
                rf"Table 1 with $\varphi = {_PHI_TEXT[phi]}$: full equation (solid), small-angle model (dashed)",
                fontsize=10,
            )
            written += _save(figure, folder / name)
    return written


def draw_misprints(folder: Path) -> list[Path]:
    """misprints.png, .svg: the driven part by (18) and (19), right and as printed, and the difference."""
    import matplotlib

    t, case = _SPAN_S, Case()
    right, printed = driven_part(case, t), driven_part(case, t, printed=True)
    with matplotlib.rc_context(_STYLE):
        figure, grid = _new_figure(7.0, 4.4, (2, 2))
        rows = zip(("(18)", "(19)"), (r"$\theta_i$ (rad)", r"$\dot{\theta}_i$ (rad/s)"), right, printed, strict=True)
        for column, (equation, label, good, bad) in enumerate(rows):
            top, bottom = grid[0][column], grid[1][column]
            top.plot(t, good, color=COLOURS[0], label=f"{equation} as derived")
            top.plot(t, bad, color=COLOURS[1], dashes=(4, 1.5), label=f"{equation} as printed")
            top.set_ylabel(label)
            top.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0, handlelength=1.6)
            bottom.plot(t, bad - good, color="black")
            worst = int(np.argmax(np.abs(bad - good)))
            bottom.plot(t[worst], (bad - good)[worst], "o", color=COLOURS[1], markersize=3)
            unit = label.split("(")[1].rstrip(")")
            bottom.set_title(f"largest error {abs((bad - good)[worst]):.3f} {unit}", loc="right", fontsize=8)
            bottom.set_ylabel(f"printed − derived ({unit})")
            bottom.set_xlabel(r"$t$ (s)")
        return _save(figure, folder / "misprints")


def _draw(axes: Any, sweep: Sweep, phi: str, field: str, label: str) -> None:
    for case, colour in zip(sweep.cases(), COLOURS):
        for model in MODELS:
            axes.plot(
                _SPAN_S,
                getattr(_solved(case, model, phi), field),
                color=colour,
                dashes=_DASHES[model],
                linewidth=1.0 if model == "full equation" else 0.8,
            )
    axes.set_xlim(_SPAN_S[0], _SPAN_S[-1])
    axes.set_xticks(range(0, 21, 5))
    axes.set_xlabel(r"$t$ (s)")
    axes.set_ylabel(label)


@cache
def _solved(case: Case, model: str, phi: str) -> Motion:
    return solve_case(case, model, PHASES[phi], _SPAN_S)


def _handles(sweep: Sweep) -> list[Any]:
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=colour, label=rf"${_SYMBOLS[sweep.field]}$ = {value} {sweep.unit}")
        for value, colour in zip(sweep.values, COLOURS)
    ]


def _fixed(sweep: Sweep) -> str:
    """What the other three parameters are."""
    case = sweep.cases()[0]
    parts = [rf"${_SYMBOLS[s.field]}$ = {getattr(case, s.field):g} {s.unit}" for s in SWEEPS if s.field != sweep.field]
    return ", ".join(parts)


def _name_lines(figure: Any, axes: Any, sweep: Sweep, phi: str) -> None:
    from matplotlib.lines import Line2D

    models = [Line2D([], [], color="0.2", dashes=_DASHES[m], linewidth=1.0, label=m) for m in reversed(MODELS)]
    first, second, third = _handles(sweep)
    figure.legend(
        handles=[first, models[0], second, models[1], third],  # filled column by column
        loc="outside upper center",
        ncols=3,
        columnspacing=1.0,
        handlelength=1.8,
        title=rf"{_fixed(sweep)}, $\varphi$ = ${_PHI_TEXT[phi]}$",
        title_fontsize=7,
    )


def _new_figure(width: float, height: float, shape: tuple[int, int] | None = None) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(*(shape or (1, 1)))


def _save(figure: Any, stem: Path) -> list[Path]:
    written = [stem.with_suffix(".png"), stem.with_suffix(".svg")]
    figure.savefig(written[0], dpi=300 if figure.get_figwidth() < 8 else 200)
    figure.set_layout_engine("none")  # as laid out already
    figure.savefig(written[1], metadata={"Date": None})
    return written

"""How figures look: colours that colour-blind readers can tell apart, one size, vector, no mathtext in any label."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from importlib.resources import files
from typing import Any

INK, GRID = "#1d2129", "#d5d9e0"
DATA, PAPER_MODEL, BEST_MODEL, THIRD = "#7b8494", "#d55e00", "#0072b2", "#009e73"  # after Okabe and Ito
COLOURS = {INK: "ink", GRID: "grid", DATA: "data", PAPER_MODEL: "orange", BEST_MODEL: "blue", THIRD: "green"}
"""Colour -> name of the CSS variable that stands for it in the HTML report (light and dark)."""

WIDTH_IN = 6.9
MAX_POINTS = 1200
_ID = re.compile(
    r' id="(?:figure|axes|patch|line2d|text|matplotlib\.axis|xtick|ytick|legend|PathCollection|FillBetweenPolyCollection|LineCollection|QuadMesh)_\d+"'
)
_LONG = re.compile(r'([ "ML]-?\d+\.\d\d)\d+')


def draw(key: str, lang: str, height_in: float, paint: Callable[[Any], None], width_in: float = WIDTH_IN) -> str:
    """SVG of a figure that `paint(figure)` fills; the same input gives the same bytes."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    from toolkit.report.ticks import draw_ticks

    with matplotlib.rc_context({**_RC, "svg.hashsalt": key, "font.family": _fonts(lang)}):
        figure = Figure(figsize=(width_in, height_in))
        paint(figure)
        for axes in figure.axes:
            draw_ticks(axes)
        buffer = io.StringIO()
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, "Creator": None})
    return _tidy(buffer.getvalue())


def panels(
    figure: Any,
    rows: int = 1,
    columns: int = 1,
    *,
    left: float = 0.6,
    gap: float = 0.5,
    between: float = 0.12,
    **choices: Any,
) -> Any:
    """Axes laid out by margins in inches (a layout engine would take as long as all the rest of a figure).

    left : for labels of the left axes.    gap : between columns.    between : between rows.    choices : to `subplots`.
    """
    width, height = figure.get_size_inches()
    right, bottom, top = 0.08, choices.pop("bottom", 0.48), choices.pop("top", 0.1)
    across = (width - left - right - gap * (columns - 1)) / columns
    down = (height - bottom - top - between * (rows - 1)) / rows
    margins = {
        "left": left / width,
        "right": 1 - right / width,
        "bottom": bottom / height,
        "top": 1 - top / height,
        "wspace": gap / across,
        "hspace": between / down,
    }
    axes = figure.subplots(rows, columns, gridspec_kw=margins, **choices)
    for axis in figure.axes:  # labels stand in the margins; looking for a free place costs a fifth of the drawing
        box = axis.get_position()
        room = left if box.x0 * width < left + 0.01 else gap
        axis.yaxis.set_label_coords(-(room - 0.14) / (box.width * width), 0.5)
        axis.xaxis.set_label_coords(0.5, -(bottom - 0.14) / (box.height * height))
        axis.yaxis.label.set_verticalalignment("center")
        axis.xaxis.label.set_verticalalignment("center")
        axis.minorticks_off()
        axis.locator_params(nbins=5)
    return axes


def formula(key: str, latex: str) -> str:
    """SVG of a displayed formula; "" where mathtext cannot set it (the writers then show the LaTeX)."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**_RC, "svg.hashsalt": key, "mathtext.fontset": "stix"}):
        figure = Figure(figsize=(1, 1))
        text = figure.text(0, 0, f"${_for_mathtext(latex)}$", fontsize=13, color=INK)
        canvas = FigureCanvasSVG(figure)
        try:
            box = text.get_window_extent(
                figure.canvas.get_renderer() if hasattr(figure.canvas, "get_renderer") else None
            )
        except (ValueError, RuntimeError, AttributeError):
            return ""
        width, height = box.width / figure.dpi, box.height / figure.dpi
        figure.set_size_inches(width + 0.1, height + 0.1)
        text.set_position((0.05 / (width + 0.1), (0.05 - box.y0 / figure.dpi) / (height + 0.1)))
        buffer = io.StringIO()
        canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})
    return _tidy(buffer.getvalue())


def _for_mathtext(latex: str) -> str:
    for old, new in (
        (r"\operatorname{sign}", r"\mathrm{sgn}"),
        (r"\operatorname{sgn}", r"\mathrm{sgn}"),
        (r"\dfrac", r"\frac"),
        (r"\text{", r"\mathrm{"),
        (r"\lvert", "|"),
        (r"\rvert", "|"),
    ):
        latex = latex.replace(old, new)
    return latex


def _tidy(svg: str) -> str:
    """Only the <svg> element, without ids that nothing refers to, coordinates to a hundredth of a point."""
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<!--.*?-->\s*", "", svg, flags=re.DOTALL)
    svg = _LONG.sub(r"\1", _ID.sub("", svg))
    return re.sub(r"\n\s*", "\n", svg)


def with_css_colours(svg: str) -> str:
    """The same SVG with CSS variables for its colours, for light and dark pages."""
    for colour, name in COLOURS.items():
        svg = svg.replace(colour, f"var(--{name})")
    return svg


def _fonts(lang: str) -> list[str]:
    """DejaVu for letters, digits and a minus as long as a plus, then the Thai font."""
    if lang != "th":
        return ["DejaVu Sans"]
    from matplotlib import font_manager

    family = "Noto Sans Thai"
    if not any(f.name == family for f in font_manager.fontManager.ttflist):
        for font in (files("toolkit.report") / "fonts").iterdir():
            if font.name.endswith(".ttf"):
                font_manager.fontManager.addfont(str(font))
    return ["DejaVu Sans", family]


_RC: dict[str, Any] = {
    "svg.fonttype": "path",
    "font.size": 8.5,
    "axes.labelsize": 8.5,
    "axes.titlesize": 9,
    "axes.titleweight": "regular",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,
    "legend.fontsize": 7.8,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "xtick.labelsize": 7.8,
    "ytick.labelsize": 7.8,
    "text.color": INK,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.6,
    "ytick.major.size": 2.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.xmargin": 0.02,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "lines.linewidth": 1.1,
    "lines.markersize": 2.2,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "axes.formatter.limits": (-4, 5),
    "savefig.transparent": True,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "errorbar.capsize": 0.0,
    "path.simplify": True,
    "path.simplify_threshold": 0.4,
}


def legend_above(axis: Any, columns: int = 4) -> None:
    """The legend on the axes' upper edge, where no data can be."""
    look = {"borderaxespad": 0.2, "columnspacing": 0.9, "handlelength": 1.1, "handletextpad": 0.5, "labelspacing": 0.2}
    axis.legend(loc="lower left", bbox_to_anchor=(-0.02, 1), ncols=columns, **look)


def dots(
    axis: Any, x: Any, y: Any, colour: str, size: float = 1.6, alpha: float = 1.0, label: str | None = None
) -> None:
    """Many round points as one short path: a tenth of the bytes and time of as many markers."""
    import numpy as np

    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    hair = 1e-4 * (float(np.ptp(x)) or 1.0) if x.size else 0.0
    xs = np.column_stack([x, x + hair, np.full(x.size, np.nan)]).ravel()
    ys = np.repeat(y, 3)
    axis.plot(xs, ys, "-", color=colour, linewidth=size, alpha=alpha, solid_capstyle="round")
    if label:
        axis.plot([], [], "o", color=colour, markersize=max(size, 2.2), label=label)

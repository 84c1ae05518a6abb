"""Ticks, grid and labels of axes as a few artists: matplotlib's own tick objects take most of a figure's time."""

from __future__ import annotations

from typing import Any

import numpy as np

_LONG, _SHORT, _GAP = 2.6, 1.5, 3.0  # points: of a tick, of a minor tick, to its number


def draw_ticks(axes: Any) -> None:
    """Draw what `axes.xaxis` and `axes.yaxis` would draw at their present limits, and hide those two."""
    for axis, across in ((axes.xaxis, True), (axes.yaxis, False)):
        _draw(axes, axis, across)
        axis.set_visible(False)


def _draw(axes: Any, axis: Any, across: bool) -> None:
    from matplotlib import rcParams

    params = axis.get_tick_params()
    width, height = axes.figure.get_size_inches()
    box = axes.get_position()
    point = 1 / 72 / (box.height * height if across else box.width * width)  # a point in shares of the axes
    places = _inside(axis, axis.get_major_locator()())
    numbers = axis.get_major_formatter().format_ticks(places)
    colour, size = rcParams["xtick.color"], rcParams["xtick.labelsize"]
    if params.get("gridOn"):
        look = {"color": rcParams["grid.color"], "linewidth": rcParams["grid.linewidth"], "zorder": 0.5}
        _strokes(axes, places, across, 0.0, 1.0, **look)
    for where, length in ((places, _LONG), (_inside(axis, axis.get_minor_locator()()), _SHORT)):
        _strokes(axes, where, across, -length * point, 0.0, color=colour, linewidth=rcParams["xtick.major.width"])
    if params.get("labelbottom" if across else "labelleft", True):
        away = -(_LONG + _GAP) * point
        look = {"size": size, "color": colour, "transform": _frame(axes, across)}
        for place, text in zip(places, numbers):
            if across:
                axes.text(place, away, text, ha="center", va="top", **look)
            else:
                axes.text(away, place, text, ha="right", va="center_baseline", **look)
        power = axis.get_major_formatter().get_offset()
        if power:
            at = (1.0, 2 * away, "right", "top") if across else (0.0, 1 - away, "left", "bottom")
            axes.text(*at[:2], power, ha=at[2], va=at[3], size=size, color=colour, transform=axes.transAxes)
    label = axis.get_label()
    if label.get_text():
        x, y = label.get_position()
        look = {"ha": "center", "va": "center", "color": colour, "size": rcParams["axes.labelsize"]}
        axes.text(x, y, label.get_text(), rotation=0 if across else 90, transform=axes.transAxes, **look)


def _inside(axis: Any, places: Any) -> np.ndarray:
    """The places within the axis's limits."""
    low, high = sorted(axis.get_view_interval())
    places = np.asarray(places, dtype=float)
    slack = 1e-9 * (high - low)
    return places[(places >= low - slack) & (places <= high + slack)]


def _frame(axes: Any, across: bool) -> Any:
    """Data along the axis, shares of the axes across it."""
    return axes.get_xaxis_transform() if across else axes.get_yaxis_transform()


def _strokes(axes: Any, places: np.ndarray, across: bool, begin: float, end: float, **look: Any) -> None:
    """Short lines across the axis at each place, as one path."""
    from matplotlib.lines import Line2D

    if not places.size:
        return
    along = np.repeat(places, 3)
    over = np.tile([begin, end, np.nan], places.size)
    x, y = (along, over) if across else (over, along)
    line = Line2D(x, y, transform=_frame(axes, across), clip_on=False, solid_capstyle="butt", **look)
    axes.add_artist(line)
    line.set_clip_on(False)

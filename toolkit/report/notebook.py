"""What results print in a notebook: the one-line `_repr_html_` of the dataclasses call these."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.report.material import thinned
from toolkit.report.numbers import number, rich, with_uncertainty

if TYPE_CHECKING:
    from toolkit.analyse import Analysis
    from toolkit.checks.finding import Finding
    from toolkit.fit import FitResult
    from toolkit.series import ThetaSeries
    from toolkit.track import Track
    from toolkit.trajectory import Trajectory

_TAGS = {"sub": "sub", "sup": "sup", "bold": "strong", "code": "code"}
_TONES = {"fails": "#b34700", "holds": "#00704f"}


def marked(text: str) -> str:
    """Text with the light marks of `numbers.rich` as HTML."""
    return "".join(f"<{_TAGS[s]}>{escape(p)}</{_TAGS[s]}>" if s in _TAGS else escape(p) for s, p in rich(text))


def series_html(series: ThetaSeries) -> str:
    """How many points, how long, how far it swings, and a sketch of θ(t)."""
    low, high = np.degrees([series.theta_rad.min(), series.theta_rad.max()])
    sigma = (
        "–" if series.sigma_theta_rad is None else f"{number(float(np.degrees(np.median(series.sigma_theta_rad))), 2)}°"
    )
    head = f"{len(series)} points, {number(series.duration_s, 4)} s, θ from {number(low, 3)}° to {number(high, 3)}°, median σ {sigma}"
    source = escape(str(series.meta.get("source", "")))
    return f"<div><b>θ(t)</b> {source}<br>{marked(head)}<br>{_sketch(series.t_s, series.theta_rad)}</div>"


def _sketch(x: np.ndarray, y: np.ndarray) -> str:
    """A line through at most 600 of the points."""
    some = thinned(x.size, 600)
    some = some[np.isfinite(x[some] + y[some])]
    if some.size < 2:
        return ""
    across = 400 * (x[some] - x[some].min()) / (np.ptp(x[some]) or 1.0)
    down = 105 - 100 * (y[some] - y[some].min()) / (np.ptp(y[some]) or 1.0)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down))
    line = f'<polyline points="{points}" fill="none" stroke="#0072b2" stroke-width="0.8"/>'
    return f'<svg viewBox="0 0 400 110" width="400" height="110">{line}</svg>'


def track_html(track: Track) -> str:
    """How many frames were measured and how well, the pivot, a sketch of x(t), and what to know."""
    ok = track.ok
    sigma = "–" if not ok.any() else number(float(np.median(np.hypot(track.sigma_x_px[ok], track.sigma_y_px[ok]))), 2)
    pivot = ", ".join(with_uncertainty(p, u, "px") for p, u in zip(track.pivot_px, track.pivot_sigma_px))
    head = (
        f"{int(ok.sum())} of {ok.size} frames measured by the {track.localiser} localiser, median σ {sigma} px, "
        f"bob's radius {number(track.radius_px, 3)} px, pivot at {pivot}"
    )
    notes = "".join(f"<li>{escape(str(line))}</li>" for line in track.meta.get("warnings", ()))
    source = escape(str(track.meta.get("source", "")))
    return f"<div><b>Track</b> {source}<br>{marked(head)}<br>{_sketch(track.t_s, track.x_px)}<ul>{notes}</ul></div>"


def trajectory_html(trajectory: Trajectory) -> str:
    """The route taken, its error and cost, a sketch of θ(t), events and warnings."""
    theta, error = np.degrees(trajectory.theta_rad), trajectory.error_estimate_rad
    head = (
        f"{theta.size} points to t = {number(float(trajectory.t_s[-1]), 4)} s, θ from {number(float(theta.min()), 3)}° to "
        f"{number(float(theta.max()), 3)}°; {trajectory.method}, {number(1e3 * trajectory.cost.cpu_s, 2)} ms of CPU"
    )
    if error is not None:
        head += f"; error of θ about {number(error, 2)} rad ({number(trajectory.accuracy_rad, 2)} rad asked for)"
    notes = "".join(f"<li>{escape(str(line))}</li>" for line in trajectory.warnings)
    notes += "".join(f"<li>{escape(e.kind)} at t = {number(e.t_s, 6)} s</li>" for e in trajectory.events[:20])
    sketch = _sketch(trajectory.t_s, trajectory.theta_rad)
    return f"<div><b>Trajectory</b><br>{marked(head)}<br>{sketch}<ul>{notes}</ul></div>"


def fit_html(result: FitResult, lang: str = "en") -> str:
    """The model, its parameters with uncertainties, χ² and what to know."""
    from toolkit.report.speech import model_name, say_whole, symbol
    from toolkit.report.words import load_words

    words = load_words(lang)
    if not result.success:
        return f"<div><b>{escape(model_name(words, result.model))}</b>: {escape(result.message)}</div>"
    rows = []
    for name, found in (*result.parameters.items(), *result.derived.items()):
        meaning = words.either(f"meaning.{name}", name)
        shown = with_uncertainty(found.value, found.stderr, found.unit)
        rows.append(
            f"<tr><td>{marked(symbol(words, name))}</td><td>{marked(shown)}</td><td>{marked(meaning)}</td></tr>"
        )
    tail = f"χ²/dof = {number(result.reduced_chi2, 3)}, {result.dof} dof, AIC {number(result.aic, 5)}"
    notes = "".join(f"<li>{escape(say_whole(words, w))}</li>" for w in result.warnings)
    title = escape(model_name(words, result.model))
    return f"<div><b>{title}</b><table>{''.join(rows)}</table>{marked(tail)}<ul>{notes}</ul></div>"


def finding_html(finding: Finding, lang: str = "en") -> str:
    """The verdict, its sentence and the remedy."""
    from toolkit.report.speech import assumption, remedy, sentence
    from toolkit.report.words import load_words

    words = load_words(lang)
    title = assumption(words, finding)
    tone = _TONES.get(finding.verdict, "#5b6270")
    label = f'<b style="color:{tone}">{escape(words(f"verdict.{finding.verdict}"))}</b>'
    label = words("language.sentence", text=label)
    return f"<div><b>{marked(title)}</b>: {label} {marked(sentence(words, finding))} <i>{marked(remedy(words, finding))}</i></div>"


def analysis_html(analysis: Analysis, lang: str = "en") -> str:
    """The report's first page without its pictures: the answers, what to read with care, and all findings."""
    from toolkit.report.essentials import cautions, facts, lead
    from toolkit.report.material import Material
    from toolkit.report.words import load_words

    material: Any = Material(analysis, load_words(lang))
    rows = "".join(
        f"<tr><td>{marked(f.question)}</td><td><b>{marked(f.answer)}</b><br><small>{marked(f.remark)}</small></td></tr>"
        for f in facts(material)
    )
    told = "".join(finding_html(f, lang) for f in analysis.findings)
    care = "".join(f"<li>{marked(line)}</li>" for line in cautions(material))
    if care:
        care = f'<div><b style="color:{_TONES["fails"]}">{escape(material.words("page.cautions"))}</b><ul>{care}</ul></div>'
    return (
        f"<div><b>{escape(analysis.source.name)}</b><br>{marked(lead(material))}<table>{rows}</table>{care}{told}</div>"
    )

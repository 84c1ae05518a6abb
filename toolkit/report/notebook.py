"""What results print in a notebook: the one-line `_repr_html_` of the dataclasses call these."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from toolkit.report.numbers import number, rich, with_uncertainty

if TYPE_CHECKING:
    from toolkit.analyse import Analysis
    from toolkit.checks.finding import Finding
    from toolkit.fit import FitResult
    from toolkit.series import ThetaSeries

_TAGS = {"sub": "sub", "sup": "sup", "bold": "strong", "code": "code"}
_TONES = {"fails": "#b34700", "holds": "#00704f"}


def marked(text: str) -> str:
    """Text with the light marks of `numbers.rich` as HTML."""
    return "".join(f"<{_TAGS[s]}>{escape(p)}</{_TAGS[s]}>" if s in _TAGS else escape(p) for s, p in rich(text))


def series_html(series: ThetaSeries) -> str:
    """How many points, how long, how far it swings, and a sketch of θ(t)."""
    import numpy as np

    from toolkit.report.material import thinned

    low, high = np.degrees([series.theta_rad.min(), series.theta_rad.max()])
    sigma = (
        "–" if series.sigma_theta_rad is None else f"{number(float(np.degrees(np.median(series.sigma_theta_rad))), 2)}°"
    )
    some = thinned(len(series), 600)
    t, theta = series.t_s[some], series.theta_rad[some]
    x = 400 * (t - t[0]) / (series.duration_s or 1)
    y = 55 - 50 * (theta - theta.mean()) / (np.abs(theta - theta.mean()).max() or 1)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
    line = f'<polyline points="{points}" fill="none" stroke="#0072b2" stroke-width="0.8"/>'
    head = f"{len(series)} points, {number(series.duration_s, 4)} s, θ from {number(low, 3)}° to {number(high, 3)}°, median σ {sigma}"
    source = escape(str(series.meta.get("source", "")))
    return f'<div><b>θ(t)</b> {source}<br>{marked(head)}<br><svg viewBox="0 0 400 110" width="400" height="110">{line}</svg></div>'


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
    return f"<div><b>{marked(title)}</b>: {label}. {marked(sentence(words, finding))} <i>{marked(remedy(words, finding))}</i></div>"


def analysis_html(analysis: Analysis, lang: str = "en") -> str:
    """The report's first page without its pictures: the answers and the two verdicts."""
    from toolkit.report.essentials import facts, lead
    from toolkit.report.material import Material
    from toolkit.report.words import load_words

    material: Any = Material(analysis, load_words(lang))
    rows = "".join(
        f"<tr><td>{marked(f.question)}</td><td><b>{marked(f.answer)}</b><br><small>{marked(f.remark)}</small></td></tr>"
        for f in facts(material)
    )
    told = "".join(finding_html(f, lang) for f in analysis.findings)
    return f"<div><b>{escape(analysis.source.name)}</b><br>{marked(lead(material))}<table>{rows}</table>{told}</div>"

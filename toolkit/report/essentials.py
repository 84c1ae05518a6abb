"""The first page: what was measured, the answers, the two verdicts with the picture that shows each."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from toolkit.fit import has_full_sine
from toolkit.report.budgets import whole_budget
from toolkit.report.document import Fact, Figure, Verdict
from toolkit.report.material import DRAGS, Material, parameter
from toolkit.report.numbers import number, percent, with_uncertainty
from toolkit.report.speech import assumption, model_name, remedy, say, say_whole, sentence, symbol
from toolkit.report.words import Words

if TYPE_CHECKING:
    from toolkit.checks.finding import Finding
    from toolkit.fit import FitResult, FittedParameter

_EXPLAINED = 0.9
"""Share of the angle's variance below which a reader is told that the model explains little."""

_CLEAR = 2.0
"""Standard uncertainties from zero beyond which (95 %) a number is told."""

MAIN = ("small_angle", "linear_drag")


def lead(material: Material) -> str:
    """One sentence on what was measured."""
    words, series, cycles = material.words, material.analysis.series, material.cycles
    widest = float(np.max(np.abs(material.theta - material.offset)))
    common = {"points": len(series), "duration": number(series.duration_s, 3)}
    if cycles is None:
        text = words("page.lead_few", first=number(math.degrees(widest), 3), **common)
    else:
        ends = material.ends
        first, last = (number(math.degrees(a), 3) for a in ends)
        swings = round(series.duration_s / float(np.median(cycles.period_s)))
        fell = "page.lead" if ends[1] < 0.97 * ends[0] else "page.lead_steady"
        text = words(fell, swings=swings, first=first, last=last, **common)
    recorded = series.meta.get("recorded_on")
    return f"{text} {words('page.recorded', date=words.date(recorded))}" if recorded else text


def facts(material: Material) -> tuple[Fact, ...]:
    """The five answers that a student looks for, and the numbers beside them."""
    words, best, scene = material.words, material.best, material.analysis.scene
    if not best.success:
        return (Fact(words("question.drag"), words("answer.failed"), say(words, best.message)),)
    remark = words("answer.model", model=model_name(words, best.model))
    drags = [name for name in DRAGS if name in best.parameters]
    if len(drags) > 1:
        parts = (words(f"law.{n}", symbol=symbol(words, n)) for n in drags)
        remark = f"{', '.join(parts)}; {remark}"
    if "alpha_d" in best.parameters:
        remark += f"; {_without_mass(words, best)}"
    answer, sure = drag_answer(material, best), _sure(material, best)
    if whole := _together(best):
        remark = f"{answer}; {remark}"
        shown = with_uncertainty(best.derived[whole].value, best.derived[whole].stderr, best.derived[whole].unit)
        answer = words("answer.together", symbol=symbol(words, whole), value=shown)
        sure = _how_sure(words, whole, best.derived[whole])
    found = [Fact(words("question.drag"), answer, remark)]
    found.append(Fact(words("question.sure"), sure, _inflation(words, best)))
    paper = material.paper
    if paper is not None and paper is not best and paper.success:
        wrong = any(f.verdict == "fails" for f in material.analysis.findings if f.assumption in MAIN)
        remark = words("answer.paper_wrong" if wrong else "answer.paper_off")
        found.append(Fact(words("question.drag_paper"), drag_answer(material, paper), remark))
    for name in MAIN:
        finding = _finding(material, name)
        if finding is not None:
            found.append(Fact(words(f"question.{name}"), _short_answer(material, finding), _theory(words, finding)))
    period = parameter(material.full_sine, "T0")
    if period is not None:
        shown = with_uncertainty(period.value, _u(material, "T0", period), "s")
        found.append(Fact(words("question.period"), f"{symbol(words, 'T0')} = {shown}", _mean_period(material, period)))
    g = scene.environment.gravity_m_per_s2
    for name in ("length", "equivalent_length"):
        length = parameter(material.full_sine, name)
        if length is not None:
            given = name == "length" and length.fixed
            remark = words("answer.given_length") if given else words("answer.equivalent", g=number(g, 6))
            shown = with_uncertainty(length.value, _u(material, name, length), "m")
            found.append(Fact(words("question.length"), shown, remark))
            break
    gravity = parameter(material.full_sine, "g_from_length")
    if gravity is not None:
        shown = with_uncertainty(gravity.value, _u(material, "g_from_length", gravity), "m/s²")
        found.append(Fact(words("question.g"), f"g = {shown}"))
    return tuple(found)


def _without_mass(words: Words, result: FitResult) -> str:
    """How k_d follows from α_d once the bob is weighed."""
    found = result.parameters["alpha_d"]
    per_gram = with_uncertainty(2e-3 * found.value, 2e-3 * found.stderr if found.stderr else None, "kg/s")
    if found.stderr and found.value < found.stderr:  # the bound at 95 %, as the answer gives it
        per_gram = f"< {number(2e-3 * (max(found.value, 0) + 1.645 * found.stderr), 2)} kg/s"
    return words("answer.no_mass", per_gram=per_gram)


def _mean_period(material: Material, small: FittedParameter) -> str:
    """Where the period is from, and what a stopwatch would give: the median of those measured, with its amplitude."""
    fitted = "from_fit" if has_full_sine(material.full_sine) else "from_small_fit"
    origin = material.words(f"answer.{fitted if small.stderr else 'from_length'}")
    if material.cycles is None:
        return origin
    angle = math.degrees(float(np.median(material.cycles.amplitude_rad)))
    longer = float(np.median(material.cycles.period_s))
    share = longer / small.value - 1
    key = "answer.mean_period" if share >= 0 else "answer.mean_period_shorter"
    swings = material.words(key, angle=number(angle, 3), period=number(longer, 5), percent=percent(abs(share)))
    return f"{origin}; {swings}"


def drag_answer(material: Material, result: FitResult) -> str:
    """The drag coefficients of a model with their uncertainties, `;` between them."""
    words, parts = material.words, []
    for name in DRAGS:
        found = result.parameters.get(name)
        if found is None:
            continue
        if found.stderr and found.value < found.stderr:
            bound = number(max(found.value, 0) + 1.645 * found.stderr, 2)
            unit = with_uncertainty(1.0, None, found.unit)[1:].strip()
            parts.append(words("answer.zero_drag", symbol=symbol(words, name), bound=f"{bound} {unit}".strip()))
        else:
            u = _u(material, name, found) if result is material.full_sine else found.stderr
            parts.append(f"{symbol(words, name)} = {with_uncertainty(found.value, u, found.unit)}")
    return "; ".join(parts) or "–"


def _u(material: Material, name: str, found: FittedParameter) -> float | None:
    """The combined standard uncertainty of the budget, else that of the fit."""
    drawn = whole_budget(material, name)
    return drawn.u if drawn is not None and drawn.u > 0 else found.stderr


def _sure(material: Material, result: FitResult) -> str:
    words, parts = material.words, []
    for name in DRAGS:
        found = result.parameters.get(name)
        if found is not None and found.stderr and found.value > found.stderr:
            u = (_u(material, name, found) if result is material.full_sine else found.stderr) or found.stderr
            parts.append(_how_sure(words, name, replace(found, stderr=u)))
    return ", ".join(parts) or "–"


def _how_sure(words: Words, name: str, found: FittedParameter) -> str:
    assert found.stderr is not None
    return words("answer.sure", symbol=symbol(words, name), percent=percent(found.stderr / found.value))


def _together(result: FitResult) -> str | None:
    """The name of the drag of all laws together where that is known, but of none of several how much is its."""
    laws = [found for name in DRAGS if (found := result.parameters.get(name)) is not None]
    if len(laws) < 2 or any(law.stderr is None or law.value >= law.stderr for law in laws):
        return None
    for name in ("equivalent_k_d", "equivalent_alpha_d"):
        whole = result.derived.get(name)
        if whole is not None and whole.stderr and whole.value > _CLEAR * whole.stderr:
            return name
    return None


def _inflation(words: Words, result: FitResult) -> str:
    factor = float(result.noise.get("inflation", 1.0) or 1.0)
    meaning = words("answer.sure_meaning")
    return f"{meaning}; {words('answer.inflated', factor=number(factor, 2))}" if factor > 1.15 else meaning


def _short_answer(material: Material, finding: Finding) -> str:
    """Yes, no or cannot tell, with the angle that divides."""
    words, where, evidence = material.words, finding.where, finding.evidence
    if finding.verdict == "not_distinguishable":
        return words("answer.unclear")
    if finding.assumption == "small_angle":
        widest = evidence.get("amplitude_max_rad")
        if finding.verdict == "fails" and "amplitude_above_rad" in where:
            angle = number(math.degrees(where["amplitude_above_rad"]), 2)
            if widest and where["amplitude_above_rad"] > 0.97 * widest:
                return words("answer.no_at_widest", widest=number(math.degrees(widest), 3))
            return words("answer.no_to", angle=angle, widest=number(math.degrees(widest), 3) if widest else "–")
        if finding.verdict == "holds" and widest:
            return words("answer.yes_to", angle=number(math.degrees(widest), 2))
    widest = float(np.max(np.abs(material.theta - material.offset)))
    if finding.words_key.endswith(".throughout"):
        return words("answer.throughout" if "amplitude_below_rad" in where else "answer.throughout_v2")
    if finding.verdict == "fails" and "amplitude_above_rad" in where:
        return words("answer.above", angle=number(math.degrees(where["amplitude_above_rad"]), 2))
    if finding.verdict == "fails" and "amplitude_below_rad" in where:
        return words("answer.below", angle=number(math.degrees(where["amplitude_below_rad"]), 2))
    return words("answer.yes" if finding.verdict == "holds" else "answer.no")


def _theory(words: Words, finding: Finding) -> str:
    """What theory alone says of the small-angle period at this swing's width; "" for other assumptions."""
    shift, widest = finding.evidence.get("period_shift_relative"), finding.evidence.get("amplitude_max_rad")
    if finding.assumption != "small_angle" or shift is None or widest is None:
        return ""
    return words("answer.theory", percent=percent(shift), angle=number(math.degrees(widest), 3))


def verdicts(material: Material) -> tuple[Verdict, ...]:
    """The two verdicts, each with the picture that shows it."""
    from toolkit.report.figures.decay import decay
    from toolkit.report.figures.period import period

    pictures = {"small_angle": period, "linear_drag": decay}
    cards = []
    for name in MAIN:
        finding = _finding(material, name)
        if finding is not None:
            cards.append(card(material.words, finding, pictures[name](material)))
    return tuple(cards)


def cautions(material: Material) -> tuple[str, ...]:
    """What the numbers of the first page leave out: failed checks of the record and what was noted about it, weightiest first.

    Correlated residuals are not among them: the error bars allow for them, as the answers say.
    """
    words, analysis = material.words, material.analysis
    failed = [
        f"**{assumption(words, f)}** ({words('verdict.fails')}): {sentence(words, f)}"
        for f in analysis.findings
        if f.verdict == "fails" and f.assumption not in (*MAIN, "white_residuals")
    ]
    explained = material.explained
    poor = [words("answer.explains_little", percent=percent(explained))] if explained < _EXPLAINED else []
    poor = poor if material.best.success else []  # no fit converged: the answers say so
    return tuple(poor + failed + notes(material))


def notes(material: Material) -> list[str]:
    """What was noted about the record and about the preferred fit."""
    of_fit = material.best.warnings if material.best.success else ()
    told = (*material.analysis.series.meta.get("warnings", ()), *of_fit)
    return list(dict.fromkeys(say_whole(material.words, line) for line in told))


def card(words: Words, finding: Finding, figure: Figure | None) -> Verdict:
    return Verdict(
        finding.assumption,
        finding.verdict,
        assumption(words, finding),
        words(f"verdict.{finding.verdict}"),
        sentence(words, finding),
        remedy(words, finding),
        figure,
    )


def _finding(material: Material, assumption: str) -> Finding | None:
    return next((f for f in material.analysis.findings if f.assumption == assumption), None)

"""From an Analysis to a Report: essentials first, then the details."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import PendulabError
from toolkit.report.document import Block, Equation, Fact, Figure, Paragraph, Report, Section, Table, Verdict
from toolkit.report.material import PAPER, Material, parameter, value
from toolkit.report.numbers import bare, number, percent, with_uncertainty
from toolkit.report.words import Words, load_words

if TYPE_CHECKING:
    from toolkit.analyse import Analysis
    from toolkit.checks.finding import Finding
    from toolkit.fit import FitResult

MAIN = ("small_angle", "linear_drag")
DRAGS = ("k_d", "alpha_d", "c", "beta", "torque", "mu")


def build(analysis: Analysis, lang: str) -> Report:
    """The report in a language. Raises UsageError for an unknown one."""
    from toolkit import __version__

    words = load_words(lang)
    material = Material(analysis, words)
    sections = [
        _experiment(material),
        _equation(material),
        _motion(material),
        _residuals(material),
        _models(material),
        _budget(material),
        _findings(material),
        _cost(material),
        _methods(material),
        _references(material),
    ]
    return Report(
        title=words("page.title"),
        subtitle=analysis.source.name,
        lead=lead(material),
        facts=facts(material),
        verdicts=verdicts(material),
        sections=tuple(s for s in sections if s is not None),
        footer=words("page.footer", version=__version__),
        words=words,
        sheets=_sheets(material),
    )


# -- the first page ---------------------------------------------------------------------------------------------------


def lead(material: Material) -> str:
    """One sentence on what was measured."""
    words, series, cycles = material.words, material.analysis.series, material.cycles
    widest = float(np.max(np.abs(material.theta - material.offset)))
    common = {"points": len(series), "duration": number(series.duration_s, 3)}
    if cycles is None:
        text = words("page.lead_few", first=number(math.degrees(widest), 3), **common)
    else:
        ends = cycles.amplitude_rad[0], cycles.amplitude_rad[-1]
        first, last = (number(math.degrees(a), 3) for a in ends)
        swings = round(series.duration_s / float(np.median(cycles.period_s)))
        text = words("page.lead", swings=swings, first=first, last=last, **common)
    recorded = series.meta.get("recorded_on")
    return f"{text} {words('page.recorded', date=words.date(recorded))}" if recorded else text


def facts(material: Material) -> tuple[Fact, ...]:
    """The five answers that a student looks for, and the numbers beside them."""
    words, best, scene = material.words, material.best, material.analysis.scene
    if not best.success:
        return (Fact(words("question.drag"), words("answer.failed"), best.message),)
    remark = words("answer.model", model=model_name(words, best.model))
    if "alpha_d" in best.parameters:
        remark += f"; {words('answer.no_mass')}"
    found = [Fact(words("question.drag"), _drag_answer(material, best), remark)]
    found.append(Fact(words("question.sure"), _sure(material, best), _inflation(words, best)))
    paper = material.paper
    if paper is not None and paper is not best and paper.success:
        wrong = any(f.verdict == "fails" for f in material.analysis.findings if f.assumption in MAIN)
        remark = words("answer.paper_wrong" if wrong else "answer.paper_off")
        found.append(Fact(words("question.drag_paper"), _drag_answer(material, paper), remark))
    for name in MAIN:
        finding = _finding(material, name)
        if finding is not None:
            found.append(Fact(words(f"question.{name}"), _short_answer(material, finding), _theory(words, finding)))
    period = parameter(material.full_sine, "T0")
    if period is not None:
        shown = with_uncertainty(period.value, period.stderr, "s")
        found.append(
            Fact(words("question.period"), f"{_symbol(words, 'T0')} = {shown}", _mean_period(material, period.value))
        )
    g = scene.environment.gravity_m_per_s2
    for name in ("length", "equivalent_length"):
        length = parameter(material.full_sine, name)
        if length is not None:
            given = name == "length" and length.fixed
            remark = words("answer.given_length") if given else words("answer.equivalent", g=number(g, 6))
            found.append(Fact(words("question.length"), with_uncertainty(length.value, length.stderr, "m"), remark))
            break
    gravity = parameter(material.full_sine, "g_from_length")
    if gravity is not None:
        found.append(Fact(words("question.g"), f"g = {with_uncertainty(gravity.value, gravity.stderr, 'm/s²')}"))
    return tuple(found)


def _mean_period(material: Material, small_s: float) -> str:
    """What a stopwatch would give: the median of the measured periods, with the amplitude it belongs to."""
    if material.cycles is None:
        return ""
    angle = math.degrees(float(np.median(material.cycles.amplitude_rad)))
    longer = float(np.median(material.cycles.period_s))
    share = percent(longer / small_s - 1)
    return material.words("answer.mean_period", angle=number(angle, 3), period=number(longer, 5), percent=share)


def _drag_answer(material: Material, result: FitResult) -> str:
    """The drag coefficients of a model with their uncertainties, `;` between them."""
    words, parts = material.words, []
    for name in DRAGS:
        found = result.parameters.get(name)
        if found is None:
            continue
        if found.stderr and found.value < found.stderr:
            bound = number(max(found.value, 0) + 1.645 * found.stderr, 2)
            unit = with_uncertainty(1.0, None, found.unit)[1:].strip()
            parts.append(words("answer.zero_drag", symbol=_symbol(words, name), bound=f"{bound} {unit}".strip()))
        else:
            parts.append(f"{_symbol(words, name)} = {with_uncertainty(found.value, found.stderr, found.unit)}")
    return "; ".join(parts) or "–"


def _sure(material: Material, result: FitResult) -> str:
    words, parts = material.words, []
    for name in DRAGS:
        found = result.parameters.get(name)
        if found is not None and found.stderr and found.value > found.stderr:
            parts.append(words("answer.sure", symbol=_symbol(words, name), percent=percent(found.stderr / found.value)))
    return ", ".join(parts) or "–"


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
            return words("answer.no_to", angle=angle, widest=number(math.degrees(widest), 3) if widest else "–")
        if finding.verdict == "holds" and widest:
            return words("answer.yes_to", angle=number(math.degrees(widest), 2))
    widest = float(np.max(np.abs(material.theta - material.offset)))
    if finding.verdict == "fails" and where.get("amplitude_below_rad", 0.0) >= 0.9 * widest:
        return words("answer.throughout")
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
            cards.append(_card(material.words, finding, pictures[name](material)))
    return tuple(cards)


def _card(words: Words, finding: Finding, figure: Figure | None) -> Verdict:
    return Verdict(
        finding.assumption,
        finding.verdict,
        words.either(f"assumption.{finding.assumption}", finding.assumption.replace("_", " ")),
        words(f"verdict.{finding.verdict}"),
        sentence(words, finding),
        remedy(words, finding),
        figure,
    )


def sentence(words: Words, finding: Finding) -> str:
    """What was found, in the reader's language where that language has it, else in the check's own English."""
    return _said(words, "finding", finding, finding.sentence)


def remedy(words: Words, finding: Finding) -> str:
    """What to do about it, likewise."""
    return _said(words, "remedy", finding, finding.remedy)


def _said(words: Words, kind: str, finding: Finding, otherwise: str) -> str:
    key = f"{kind}.{finding.words_key}"
    if finding.where.get("amplitude_below_rad", 0.0) > 3 and f"{key}.throughout" in words:
        key = f"{key}.throughout"
    if key not in words:
        return otherwise
    try:
        return words(key, **_shown(finding.words_values))
    except (KeyError, IndexError):
        return otherwise


_SHARES = frozenset(
    [
        "share",
        "visible_share",
        "share_bound",
        "share_at_end",
        "slack_share",
        "decay",
        "period_shift",
        "rate_change",
        "scale",
        "scale_u",
    ]
)


def _shown(values: Any) -> dict[str, str]:
    """words_values as texts: `…_rad` also as `…_deg` and `…_mrad`, shares also as `…_percent`."""
    shown: dict[str, str] = {}
    for key, found in values.items():
        if not isinstance(found, int | float) or isinstance(found, bool):
            shown[key] = str(found)
            continue
        shown[key] = number(float(found), 3)
        if key.endswith("_rad"):
            shown[key.removesuffix("_rad") + "_deg"] = number(math.degrees(found), 3)
            shown[key.removesuffix("_rad") + "_mrad"] = number(1e3 * found, 2)
        if key.endswith("_s"):
            shown[key.removesuffix("_s") + "_ms"] = number(1e3 * found, 2)
        if key in _SHARES or key.endswith(("_share", "_relative")):
            shown[key + "_percent"] = percent(abs(float(found)))
    return shown


def _finding(material: Material, assumption: str) -> Finding | None:
    return next((f for f in material.analysis.findings if f.assumption == assumption), None)


# -- the details ------------------------------------------------------------------------------------------------------


def _experiment(material: Material) -> Section:
    from toolkit.report.figures.frame import frame

    words, analysis = material.words, material.analysis
    blocks: list[Block] = []
    track = analysis.track
    if track is not None:
        ok = int(np.sum(track.ok))
        sizes = {"width": track.meta.get("width_px", "–"), "height": track.meta.get("height_px", "–")}
        share = percent(ok / max(1, track.frame.size))
        text = words("text.experiment_video", frames=track.frame.size, ok=ok, percent=share, **sizes)
    else:
        text = words("text.experiment_series")
    given = []
    for key, found in (
        ("mass", analysis.scene.pendulum.mass_kg),
        ("length", analysis.scene.pendulum.length_m),
        ("radius", analysis.scene.pendulum.bob_radius_m),
        ("g", analysis.scene.environment.gravity_m_per_s2),
    ):
        if found is not None:
            given.append(words(f"text.known_{key}", value=number(found, 6)))
    known = words("text.known", list=", ".join(given))
    if analysis.scene.pendulum.mass_kg is None and analysis.scene.pendulum.length_m is None:
        known += " " + words("text.known_nothing")
    blocks.append(Paragraph(f"{text} {known}"))
    picture = frame(material)
    if picture is not None:
        blocks.append(picture)
    return Section("experiment", words("section.experiment"), tuple(blocks))


def _equation(material: Material) -> Section:
    from toolkit.report.style import formula

    words, best = material.words, material.best
    blocks: list[Block] = [Paragraph(words("text.equation", model=model_name(words, best.model)))]
    if best.equation_latex:
        blocks.append(Equation(best.equation_latex, formula("equation", best.equation_latex)))
    blocks.append(_parameter_table(words, best))
    blocks.append(Paragraph(f"{words('text.conventions')} {words('text.start')}"))
    return Section("equation", words("section.equation"), tuple(blocks))


def _parameter_table(words: Words, result: FitResult) -> Table:
    rows = []
    for table, kind in ((result.parameters, None), (result.derived, "derived")):
        for name, found in table.items():
            if name in result.parameters and kind:
                continue
            state = kind or ("held" if found.fixed else "fitted")
            shown = _value(found)
            rows.append((_symbol(words, name), words.either(f"meaning.{name}", name), shown, words(f"kind.{state}")))
    header = tuple(words(f"column.{c}") for c in ("symbol", "meaning", "value", "status"))
    return Table("parameters", words("caption.parameters"), header, tuple(rows))


def _value(found: Any) -> str:
    """Value and uncertainty; angles in degrees too."""
    text = with_uncertainty(found.value, found.stderr, found.unit)
    if found.unit == "rad":
        u = None if found.stderr is None else math.degrees(found.stderr)
        text += f" = {with_uncertainty(math.degrees(found.value), u, 'deg', 4)}"
    return text


def _motion(material: Material) -> Section | None:
    from toolkit.report.figures.motion import motion
    from toolkit.report.figures.portrait import portrait

    return _pictures(material, "motion", (motion, portrait))


def _residuals(material: Material) -> Section | None:
    from toolkit.report.figures.residuals import residuals
    from toolkit.report.figures.spectrum import spectrum

    return _pictures(material, "residuals", (residuals, spectrum), material.words("text.residuals"))


def _pictures(material: Material, key: str, makers: tuple[Any, ...], text: str = "") -> Section | None:
    drawn = [figure for make in makers if (figure := make(material)) is not None]
    if not drawn:
        return None
    blocks: list[Block] = [Paragraph(text)] if text else []
    return Section(key, material.words(f"section.{key}"), (*blocks, *drawn))


def _models(material: Material) -> Section:
    from toolkit.report.figures.contours import contours

    words, fits = material.words, material.analysis.fits
    good = [r for r in fits.values() if r.success and math.isfinite(r.aic)]
    aic = min((r.aic for r in good), default=math.nan)
    bic = min((r.bic for r in good), default=math.nan)
    rows = []
    for name, result in fits.items():
        if result.success:
            rms = number(1e3 * float(np.sqrt(np.mean(np.square(result.residuals_rad)))), 3)
            numbers = (number(result.reduced_chi2, 3), number(result.aic - aic, 3), number(result.bic - bic, 3), rms)
            rows.append((model_name(words, name), str(len(result.free)), *numbers, _drag_answer(material, result)))
        else:
            rows.append((model_name(words, name), str(len(result.free)), "–", "–", "–", "–", words("kind.failed")))
    header = tuple(
        words(f"column.{c}") for c in ("model", "free", "reduced_chi2", "delta_aic", "delta_bic", "rms", "drag")
    )
    mark = list(fits).index(material.analysis.preferred)
    blocks: list[Block] = [
        Paragraph(words("text.models")),
        Table("ladder", words("caption.ladder"), header, tuple(rows), mark),
    ]
    picture = contours(material)
    if picture is not None:
        blocks.append(picture)
    return Section("models", words("section.models"), tuple(blocks))


def _budget(material: Material) -> Section | None:
    """A GUM budget of the first drag coefficient, of T₀ and of the equivalent length, with what the fit cannot know."""
    words, result = material.words, material.full_sine if material.full_sine.success else material.best
    names = [n for n in DRAGS if (p := parameter(result, n)) is not None and p.stderr and p.value > p.stderr][:1]
    names += [n for n in ("T0", "equivalent_length") if parameter(result, n) is not None]
    tables = [table for name in names if (table := _budget_table(material, result, name)) is not None]
    if not tables:
        return None
    return Section("budget", words("section.budget"), (Paragraph(words("text.budget")), *tables))


_CLOCK_HALF_WIDTH = 50e-6
_G_HALF_WIDTH = 0.026
_BY_CLOCK = {
    "T0": 1.0,
    "equivalent_length": 2.0,
    "k_d": -1.0,
    "alpha_d": -1.0,
    "c": 0.0,
    "beta": 0.0,
    "torque": -2.0,
    "mu": -2.0,
}
"""Power of the unit of time in each quantity: how a relative error of the clock passes into it."""


def _budget_table(material: Material, result: FitResult, name: str) -> Table | None:
    from scipy.stats import t as student

    from toolkit.fitting.budget import Row, budget

    words, environment = material.words, material.analysis.scene.environment
    try:
        drawn = budget(result, name)
    except PendulabError:
        return None
    rows = list(drawn.rows)
    assumed = [("time_scale", "1", 1.0, _CLOCK_HALF_WIDTH, _BY_CLOCK[name] * drawn.estimate)]
    if name == "equivalent_length" and environment.g_m_per_s2 is None and environment.latitude_deg is None:
        g = environment.gravity_m_per_s2
        assumed.append(("g", "m/s²", g, _G_HALF_WIDTH, drawn.estimate / g))
    for source, unit, estimate, half, sensitivity in assumed:
        u = half / math.sqrt(3)
        if sensitivity and all(row.quantity != source for row in rows):
            rows.append(Row(source, estimate, unit, u, "B", "rectangular", sensitivity, sensitivity * u, math.inf))
    statistical = math.sqrt(sum(r.contribution**2 for r in rows if r.kind == "A"))
    systematic = math.sqrt(sum(r.contribution**2 for r in rows if r.kind == "B"))
    total = math.hypot(statistical, systematic)
    fourth = sum(r.contribution**4 / r.dof for r in rows if r.dof > 0)
    factor = float(student.ppf(0.975, min(total**4 / fourth if fourth > 0 else math.inf, 1e9)))
    lines = [
        (
            words.either(f"budget.{row.quantity}", row.quantity),
            with_uncertainty(row.estimate, None, row.unit),
            with_uncertainty(row.u, None, row.unit, 2),
            row.kind,
            words(f"budget.{row.distribution}"),
            number(row.sensitivity, 3),
            with_uncertainty(abs(row.contribution), None, drawn.unit, 2),
        )
        for row in rows
    ]
    for key, part in (("statistical_total", statistical), ("systematic_total", systematic), ("total", total)):
        lines.append((words(f"budget.{key}"), "", "", "", "", "", with_uncertainty(part, None, drawn.unit, 2)))
    header = tuple(
        words(f"column.{c}")
        for c in ("source", "value", "uncertainty", "kind", "distribution", "sensitivity", "contribution")
    )
    caption = words(
        "budget.title",
        quantity=_symbol(words, name),
        value=with_uncertainty(drawn.estimate, total, drawn.unit),
        expanded=with_uncertainty(factor * total, None, drawn.unit, 2),
        k=number(factor, 3),
    )
    return Table(f"budget_{name}", caption, header, tuple(lines), len(lines) - 1)


def _findings(material: Material) -> Section | None:
    words = material.words
    others = [f for f in material.analysis.findings if f.assumption not in MAIN]
    if not others:
        return None
    rows = []
    for finding in others:
        card = _card(words, finding, None)
        text = f"{card.sentence} {card.remedy[:1].upper()}{card.remedy[1:]}".strip()
        rows.append((card.title, card.label, text))
    header = tuple(words(f"column.{c}") for c in ("check", "verdict", "finding"))
    return Section(
        "findings", words("section.findings"), (Table("checks", words("caption.checks"), header, tuple(rows)),)
    )


def _cost(material: Material) -> Section:
    words = material.words
    rows = []
    for name, result in material.analysis.fits.items():
        calls = getattr(result.lmfit, "nfev", None)
        state = words("kind.converged" if result.success else "kind.failed")
        rows.append((model_name(words, name), result.method or "–", str(calls or "–"), state, number(result.cpu_s, 2)))
    header = tuple(words(f"column.{c}") for c in ("model", "solution", "calls", "status", "cpu"))
    table = Table("cost", words("caption.cost"), header, tuple(rows), volatile=(4,))
    return Section("cost", words("section.cost"), (Paragraph(words("text.cost")), table))


def _methods(material: Material) -> Section:
    words, meta = material.words, material.analysis.series.meta
    log = tuple(str(line) for line in meta.get("log", ()))
    blocks: list[Block] = [Paragraph("" if log else words("text.no_log"), log)]
    notes = [str(line) for line in meta.get("warnings", ())]
    notes += [f"{w[:1].upper()}{w[1:]}" for w in material.best.warnings]
    if notes:
        blocks.append(Paragraph(words("text.warnings"), tuple(dict.fromkeys(notes))))
    return Section("methods", words("section.methods"), tuple(blocks))


def _references(material: Material) -> Section:
    words, fits = material.words, material.analysis.fits
    used = []
    if PAPER in fits:
        used.append("paper")
    if any(name.startswith("full") for name in fits):
        used.append("full_sine")
    if any("quadratic" in name for name in fits):
        used.append("quadratic")
    if any("coulomb" in name for name in fits):
        used.append("friction")
    used += ["gum", "lmfit"]
    kind = str(material.analysis.series.meta.get("format", "")).lower()
    used += [key for key in ("tracker", "phyphox") if key in kind]
    items = tuple(words(f"reference.{key}") for key in used)
    return Section("references", words("section.references"), (Paragraph(words("text.references"), items),))


def _sheets(material: Material) -> dict[str, dict[str, Any]]:
    """Numbers for a spreadsheet: the series with model and residuals, all parameters of all fits, the ladder."""
    series, best = material.analysis.series, material.best
    data: dict[str, Any] = {"t_s": series.t_s, "theta_rad": series.theta_rad}
    if series.sigma_theta_rad is not None:
        data["sigma_theta_rad"] = series.sigma_theta_rad
    if material.usable:
        data |= {
            "theta_model_rad": best.theta_rad,
            "omega_model_rad_per_s": best.omega_rad_per_s,
            "residual_rad": best.residuals_rad,
        }
    parameters: dict[str, list[Any]] = {k: [] for k in ("model", "parameter", "value", "stderr", "unit", "state")}
    ladder: dict[str, list[Any]] = {
        k: [] for k in ("model", "preferred", "success", "chi2", "dof", "reduced_chi2", "aic", "bic", "message")
    }
    for name, result in material.analysis.fits.items():
        for table, state in ((result.parameters, ""), (result.derived, "derived")):
            for key, found in table.items():
                row = (name, key, found.value, found.stderr, found.unit, state or ("held" if found.fixed else "fitted"))
                for column, cell in zip(parameters.values(), row):
                    column.append(cell)
        row2 = (
            name,
            name == material.analysis.preferred,
            result.success,
            result.chi2,
            result.dof,
            result.reduced_chi2,
            result.aic,
            result.bic,
            result.message,
        )
        for column, cell2 in zip(ladder.values(), row2):
            column.append(cell2)
    findings: dict[str, list[Any]] = {k: [] for k in ("assumption", "verdict", "sentence", "remedy")}
    for finding in material.analysis.findings:
        for column, cell3 in zip(
            findings.values(), (finding.assumption, finding.verdict, finding.sentence, finding.remedy)
        ):
            column.append(cell3)
    return {
        "data": data,
        "parameters": parameters,
        "models": ladder,
        "findings": findings,
        "budget": _budget_sheet(material),
    }


def _budget_sheet(material: Material) -> dict[str, list[Any]]:
    """The budgets of the report as one table of texts."""
    section = _budget(material)
    columns: dict[str, list[Any]] = {
        k: [] for k in ("quantity", "source", "value", "u", "type", "distribution", "sensitivity", "contribution")
    }
    for block in section.blocks if section else ():
        if isinstance(block, Table):
            for row in block.rows:
                for column, cell in zip(columns.values(), (block.key.removeprefix("budget_"), *map(bare, row))):
                    column.append(cell)
    return columns


def model_name(words: Words, name: str) -> str:
    """A model's name in words; its own name where the language has none."""
    return words.either(f"model.{name}", name.replace("_", " "))


def _symbol(words: Words, name: str) -> str:
    return words.either(f"symbol.{name}", name)


__all__ = ["build", "facts", "lead", "model_name", "remedy", "sentence", "value", "verdicts"]

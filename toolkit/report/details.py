"""The details after the first page, one function a section."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolkit.fit import FitResult
from toolkit.report.document import Block, Equation, Paragraph, Section, Table
from toolkit.report.essentials import MAIN, card, drag_answer, notes
from toolkit.report.material import PAPER, Material
from toolkit.report.numbers import number, percent, with_uncertainty
from toolkit.report.speech import model_name, say_whole, solver, symbol
from toolkit.report.words import Words


def experiment(material: Material) -> Section:
    """What was recorded and what was given, with a frame of the video."""
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


def equation(material: Material) -> Section | None:
    """The equation of motion as it was solved, with its values; None where no fit converged: it has none."""
    from toolkit.report.style import formula

    words, best = material.words, material.best
    if not best.success:
        return None
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
            rows.append((symbol(words, name), words.either(f"meaning.{name}", name), shown, words(f"kind.{state}")))
    header = tuple(words(f"column.{c}") for c in ("symbol", "meaning", "value", "status"))
    return Table("parameters", words("caption.parameters"), header, tuple(rows))


def _value(found: Any) -> str:
    """Value and uncertainty; angles in degrees too."""
    text = with_uncertainty(found.value, found.stderr, found.unit)
    if found.unit == "rad":
        u = None if found.stderr is None else math.degrees(found.stderr)
        text += f" = {with_uncertainty(math.degrees(found.value), u, 'deg', 4)}"
    return text


def motion(material: Material) -> Section | None:
    """Angle, velocity, tension and energy with the model."""
    from toolkit.report.figures.energy import energy
    from toolkit.report.figures.motion import motion
    from toolkit.report.figures.portrait import portrait

    return _pictures(material, "motion", (motion, energy, portrait))


def residuals(material: Material) -> Section | None:
    """What the models leave over, in four ways and as a spectrum."""
    from toolkit.report.figures.residuals import residuals
    from toolkit.report.figures.spectrum import spectrum

    return _pictures(material, "residuals", (residuals, spectrum), material.words("text.residuals"))


def _pictures(material: Material, key: str, makers: tuple[Any, ...], text: str = "") -> Section | None:
    drawn = [figure for make in makers if (figure := make(material)) is not None]
    if not drawn:
        return None
    blocks: list[Block] = [Paragraph(text)] if text else []
    return Section(key, material.words(f"section.{key}"), (*blocks, *drawn))


def models(material: Material) -> Section:
    """The ladder of models, and which parameters lean on each other."""
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
            rows.append((model_name(words, name), str(len(result.free)), *numbers, drag_answer(material, result)))
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


def checks(material: Material) -> Section | None:
    """The verdicts that have no card on the first page."""
    words = material.words
    others = [f for f in material.analysis.findings if f.assumption not in MAIN]
    if not others:
        return None
    rows = []
    for finding in others:
        told = card(words, finding, None)
        text = f"{told.sentence} {told.remedy[:1].upper()}{told.remedy[1:]}".strip()
        rows.append((told.title, told.label, text))
    header = tuple(words(f"column.{c}") for c in ("check", "verdict", "finding"))
    return Section(
        "findings", words("section.findings"), (Table("checks", words("caption.checks"), header, tuple(rows)),)
    )


def cost(material: Material) -> Section:
    """How each model was solved, how often, how long it took."""
    words = material.words
    rows = []
    for name, result in material.analysis.fits.items():
        calls = getattr(result.lmfit, "nfev", None)
        state = words("kind.converged" if result.success else "kind.failed")
        rows.append(
            (model_name(words, name), solver(words, result.method), str(calls or "–"), state, number(result.cpu_s, 2))
        )
    header = tuple(words(f"column.{c}") for c in ("model", "solution", "calls", "status", "cpu"))
    table = Table("cost", words("caption.cost"), header, tuple(rows), volatile=(4,))
    return Section("cost", words("section.cost"), (Paragraph(words("text.cost")), table))


def methods(material: Material) -> Section:
    """What was done to the data, in order, and what to know about them."""
    words, meta = material.words, material.analysis.series.meta
    log = tuple(say_whole(words, line) for line in meta.get("log", ()))
    blocks: list[Block] = [Paragraph("" if log else words("text.no_log"), log)]
    noted = notes(material)
    if noted:
        blocks.append(Paragraph(words("text.warnings"), tuple(noted)))
    return Section("methods", words("section.methods"), tuple(blocks))


def references(material: Material) -> Section:
    """The sources of the effects and methods that were used, and only those."""
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
    return Section("references", words("section.references"), (Paragraph("", items),))

"""The report: right numbers, every format, nothing from outside, the same bytes twice."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from toolkit.analyse import Analysis
from toolkit.errors import UsageError
from toolkit.report import build_report, check_choice, write_report
from toolkit.report.html import numbering
from toolkit.report.material import binned, thinned
from toolkit.report.numbers import bare, number, percent, rich, rounded, with_uncertainty
from toolkit.scene import Pendulum, Scene
from toolkit.series import ThetaSeries

MASS, LENGTH, K_D, C, G = 0.02, 0.5, 4e-4, 2.5e-3, 9.80665


def record(seconds=25.0, fps=25, amplitude=0.9, sigma=2e-3) -> ThetaSeries:
    """A light ball on a string, by SciPy, with noise."""

    def motion(_, y):
        speed = LENGTH * y[1]
        force = -K_D * speed - C * abs(speed) * speed
        return [y[1], -G / LENGTH * np.sin(y[0]) + force / (MASS * LENGTH)]

    t = np.arange(int(seconds * fps)) / fps
    theta = solve_ivp(motion, (0, t[-1]), [amplitude, 0.0], t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    noise = np.random.default_rng(7).normal(0, sigma, t.size)
    log = ["Measured with a ruler & a <clock>.", "σ is 2 mrad."]
    return ThetaSeries(t, theta + noise, np.full(t.size, sigma), {"log": log, "warnings": ["The table wobbled."]})


def analysed(series: ThetaSeries, scene: Scene) -> Analysis:
    from toolkit.diagnose import diagnose
    from toolkit.fit import choose_model, fit_models

    fits = fit_models(series, scene)
    return Analysis(Path("swing <1>.csv"), scene, series, fits, choose_model(fits), diagnose(series, fits, scene))


@pytest.fixture(scope="module")
def analysis() -> Analysis:
    return analysed(record(), Scene(pendulum=Pendulum(mass_kg=MASS, length_m=LENGTH)))


@pytest.fixture(scope="module")
def english(analysis):
    return build_report(analysis, "en")


@pytest.fixture(scope="module")
def thai(analysis):
    return build_report(analysis, "th")


# -- numbers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "u", "expected"),
    [
        (0.123456, 0.0056, ("0.1235", "0.0056")),
        (100.02147, 0.00035, ("100.02147", "0.00035")),  # JCGM 100, 7.2.2
        (10.47, 0.28, ("10.47", "0.28")),
        (1.2345, 0.0996, ("1.23", "0.10")),  # the uncertainty gains a digit by rounding
        (1.2345, 0.00995, ("1.234", "0.010")),
        (12345.6, 234.0, ("12350", "230")),
        (-0.0004, 0.01, ("0.000", "0.010")),
        (-5.678, 0.12, ("−5.68", "0.12")),
        (2.5, 25.0, ("2", "25")),
    ],
)
def test_rounding_as_the_gum_says(value, u, expected):
    assert rounded(value, u) == expected


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6))
def test_rounding_keeps_two_digits_and_the_value(value, u):
    shown, shown_u = (float(text.replace("−", "-")) for text in rounded(value, u))
    assert abs(shown_u - u) <= 0.051 * u
    assert abs(shown - value) <= 0.051 * u + 1e-9 * abs(value)


@pytest.mark.parametrize(
    ("value", "u", "unit", "expected"),
    [
        (0.16, 0.003, "kg/s", "(0.1600 ± 0.0030) kg/s"),
        (5.6123e-5, 8e-7, "kg/s", "(5.612 ± 0.080) × 10^−5 kg/s"),
        (0.002359, 0.000025, "1", "0.002359 ± 0.000025"),
        (84.03, 0.11, "deg", "(84.03 ± 0.11)°"),
        (0.0094, 0.00008, "1/s", "(0.009400 ± 0.000080) s^−1"),
        (0.5, None, "m", "0.5 m"),
        (0.5, float("nan"), "m", "0.5 m"),
        (float("nan"), 0.1, "m", "–"),
        (0.1, 3e-33, "rad", "0.1 rad"),  # a fit without residuals: below the value's own rounding
        (1e-7, 1e-30, "rad", "1 × 10^−7 rad"),
    ],
)
def test_values_with_units(value, u, unit, expected):
    assert bare(with_uncertainty(value, u, unit)) == expected


def test_small_and_large_numbers():
    assert number(0.0) == "0"
    assert number(1.17e5, 3) == "1.17 × 10^{5}"
    assert number(-0.00001234, 3) == "−1.23 × 10^{−5}"
    assert bare(percent(0.0034)) == "0.34 %"
    assert rich("k_{d}² **x** 10^{−5}") == [
        ("plain", "k"),
        ("sub", "d"),
        ("plain", "² "),
        ("bold", "x"),
        ("plain", " 10"),
        ("sup", "−5"),
    ]


# -- what a student reads ---------------------------------------------------------------------------------------------


def answer(report, words_key):
    question = report.words(words_key)
    return next(bare(fact.answer) for fact in report.facts if fact.question == question)


def test_the_first_page_answers_the_five_questions(analysis, english):
    drag = answer(english, "question.drag")
    assert "k_d = (" in drag
    assert "kg/s" in drag
    shown = re.search(r"c = \(([\d.]+) ± ([\d.]+)\)", drag)
    assert abs(float(shown[1]) - C) < 4 * float(shown[2])
    assert "%" in answer(english, "question.sure")
    assert re.match(
        r"No: only up to about [\d.]+° \(this swing reached 5[01]\.?\d*°\)", answer(english, "question.small_angle")
    )
    assert re.match(r"No: .*v²", answer(english, "question.linear_drag"))
    period = re.match(r"T_0 = \(?([\d.]+)", answer(english, "question.period"))
    assert float(period[1]) == pytest.approx(2 * np.pi * np.sqrt(LENGTH / G), rel=1e-3)
    assert [v.verdict for v in english.verdicts] == ["fails", "fails"]
    assert all(v.figure is not None for v in english.verdicts)


def test_the_first_page_gives_the_budgets_combined_uncertainty(analysis):
    free = analysed(analysis.series, Scene(pendulum=Pendulum(mass_kg=MASS)))
    report = build_report(free, "en")
    captions = [bare(b.caption) for s in report.sections if s.key == "budget" for b in s.blocks if hasattr(b, "rows")]
    for question in ("question.period", "question.length"):
        shown = re.search(r"\([\d.]+ ± [\d.]+\) (?:s|m)", answer(report, question))[0]
        assert any(shown in caption for caption in captions), shown
    alone = next(p for p in (free.best.derived | free.best.parameters).items() if p[0] == "equivalent_length")[1].stderr
    told = float(re.search(r"± ([\d.]+)", answer(report, "question.length"))[1])
    assert told > 3 * alone  # nobody gave g


@pytest.mark.parametrize("lang", ["en", "th"])
def test_drags_that_cannot_be_told_apart_are_told_together(analysis, lang):
    """Two laws that lean on each other: neither is clear of zero, but what they take together is measured."""
    best = analysis.best
    leaning = {n: replace(p, stderr=3 * abs(p.value)) if n in ("k_d", "c") else p for n, p in best.parameters.items()}
    poor = replace(analysis, fits={**analysis.fits, best.model: replace(best, parameters=leaning)})
    report = build_report(poor, lang)
    whole = best.derived["equivalent_k_d"]
    assert bare(with_uncertainty(whole.value, whole.stderr, "kg/s")) in answer(report, "question.drag")
    assert bare(percent(whole.stderr / whole.value)) in answer(report, "question.sure")
    question = report.words("question.drag")
    remark = next(bare(fact.remark) for fact in report.facts if fact.question == question)
    assert "k_d: " in remark
    assert "c: " in remark
    one = {n: replace(p, stderr=abs(p.value) / 9) if n == "c" else p for n, p in leaning.items()}
    clear = replace(analysis, fits={**analysis.fits, best.model: replace(best, parameters=one)})
    assert answer(build_report(clear, lang), "question.drag").startswith("k_d: ")


def test_a_reader_of_the_first_page_is_warned(analysis, english):
    assert english.cautions == ("The table wobbled.",)
    rubs = next(f for f in analysis.findings if f.assumption not in ("small_angle", "linear_drag", "white_residuals"))
    report = build_report(replace(analysis, findings=[*analysis.findings, replace(rubs, verdict="fails")]), "en")
    assert re.match(r"\*\*[^*]+\*\* \(fails\): ", report.cautions[0])
    assert report.cautions[-1] == "The table wobbled."
    t = np.arange(300) / 30
    noise = ThetaSeries(t, np.random.default_rng(3).normal(0, 0.01, t.size))
    assert any("explains only" in line for line in build_report(analysed(noise, Scene()), "en").cautions)


def test_a_drag_held_at_zero_is_told_by_its_symbol(analysis):
    from toolkit.report.speech import say_whole
    from toolkit.report.words import load_words
    from toolkit.sentence import Sentence

    held = Sentence("alpha_d came out negative", "fit.at_zero", name="alpha_d")
    for lang, beginning in (("en", "The coefficient α_{d} came"), ("th", "α_{d} ออก")):
        assert say_whole(load_words(lang), held).startswith(beginning)


@pytest.mark.parametrize(("period_s", "words"), [(1.5, "5.7 % longer"), (1.40, "1.3 % shorter")])
def test_a_stopwatch_is_longer_or_shorter_never_less_than_zero(analysis, period_s, words):
    from types import SimpleNamespace

    from toolkit.fit import FittedParameter
    from toolkit.report.essentials import _mean_period
    from toolkit.report.material import Material
    from toolkit.report.words import load_words

    one = np.ones(4)
    measured = SimpleNamespace(period_s=period_s * one, amplitude_rad=0.1 * one)
    material = Material(analysis, load_words("en"))
    material.__dict__["cycles"] = measured
    told = bare(_mean_period(material, FittedParameter(1.41859, 1e-4, "s")))
    assert words in told
    assert "−" not in told


def test_a_period_is_not_said_to_be_of_a_fit_that_failed(analysis):
    """Where only the paper's fit converged, its period is named as that: it is no full-sine fit's."""
    free = analysed(record(seconds=12), Scene())
    failed = {name: replace(fit, success=name.startswith("small")) for name, fit in free.fits.items()}
    poor = replace(free, fits=failed, preferred="small_angle_linear_drag")
    for lang, words, otherwise in (
        ("en", "from the small-angle fit", "from the full-sine fit"),
        ("th", "จากสูตรมุมเล็ก", "จากสมการ sin θ เต็ม"),
    ):
        for analysis, told in ((free, otherwise), (poor, words)):
            report = build_report(analysis, lang)
            question = report.words("question.period")
            assert next(fact.remark for fact in report.facts if fact.question == question).startswith(told)


def test_without_a_mass_no_k_d_is_claimed(analysis):
    report = build_report(replace(analysed(record(seconds=12), Scene())), "en")
    drag = answer(report, "question.drag")
    assert "k_d" not in drag
    assert any("give the bob's mass" in fact.remark for fact in report.facts)


def test_thai_says_the_same_numbers(english, thai):
    def digits(report):
        return [re.findall(r"\d[\d.]*", bare(fact.answer)) for fact in report.facts]

    assert digits(thai) == digits(english)
    assert all(any("\u0e00" <= c <= "\u0e7f" for c in fact.question) for fact in thai.facts)
    assert all(any("\u0e00" <= c <= "\u0e7f" for c in v.sentence) for v in thai.verdicts)


def test_every_finding_is_said_in_both_languages(analysis):
    from toolkit.report.speech import sentence
    from toolkit.report.words import load_words

    for finding in analysis.findings:
        said = sentence(load_words("th"), finding)
        assert any("\u0e00" <= c <= "\u0e7f" for c in said), finding.words_key
        assert "{" not in said + sentence(load_words("en"), finding)


def test_every_words_key_of_the_checks_is_known():
    """A check's key without words would leave English in the Thai report."""
    from toolkit.report.words import load_words

    source = "".join(
        p.read_text(encoding="utf-8") for p in (Path(__file__).parents[1] / "toolkit" / "checks").glob("*.py")
    )
    keys = set(re.findall(r'words_key="([\w.]+)"', source)) | set(re.findall(r'key, remedy = "([\w.]+)"', source))
    assert len(keys) > 10
    table = load_words("th").table
    assert sorted(key for key in keys if f"finding.{key}" not in table) == []


UNITS = "s ms m cm mm px kg g N J Hz mrad nrad rad ppm rms AIC BIC CPU dof sin cos ln"
SYMBOLS = "a c f h k m v s t x y A B E F N Q T U X Y L K d g eq offset dt"
NAMES = "pendulab JCGM GUM Tracker phyphox DOP853 Rodas4 fps factor start stop mass length cosine drive slack string"
LATIN_IN_THAI = {word for words in (UNITS, SYMBOLS, NAMES) for word in words.split()}


def latin_words(report) -> set[str]:
    """The Latin words of a report, but for file names, quoted names, the equation and the titles of references."""

    def texts():
        yield report.title
        yield report.lead
        yield report.footer
        for fact in report.facts:
            yield from (fact.question, fact.answer, fact.remark)
        for verdict in report.verdicts:
            yield from (verdict.title, verdict.label, verdict.sentence, verdict.remedy)
        for section in report.sections:
            yield section.title
            for block in section.blocks if section.key != "references" else ():
                yield from (getattr(block, "caption", ""), getattr(block, "text", ""))
                yield from getattr(block, "items", ())
                yield from (cell for row in getattr(block, "rows", ()) for cell in row)
                yield from getattr(block, "header", ())
        yield from (figure.caption for figure in report.figures)

    found = set()
    for text in texts():
        text = re.sub(r"'[^']*'|\S+\.(?:csv|txt|trk|mov|mp4)\b|\d+\.\d+\.\d+", " ", bare(text))
        found |= set(re.findall(r"[A-Za-z][A-Za-z0-9]*", text))
    return found - LATIN_IN_THAI


def test_a_thai_report_is_thai(analysis):
    """And a sentence without words in Thai would be seen."""
    quiet = replace(analysis, series=replace(analysis.series, meta={}))
    assert latin_words(build_report(quiet, "th")) == set()
    assert latin_words(build_report(analysis, "th")) == {
        "Measured",
        "with",
        "ruler",
        "clock",
        "is",
        "The",
        "table",
        "wobbled",
    }


@pytest.mark.parametrize(
    ("name", "stop_s"),
    [
        ("pendulum.mp4", 4.0),
        ("redapple/redapple_480p.mov", 4.0),
        ("yyz/lab1_tracker.txt", 40.0),
        ("jlefebvre/q2_data.txt", None),
        ("jlefebvre/pendulum_length1.trk", None),
    ],
)
def test_thai_reports_of_recordings_are_thai(name, stop_s, request):
    from toolkit.analyse import analyse

    shipped = Path(__file__).parents[1] / "data" / "samples" / name
    path = shipped if shipped.is_file() else request.getfixturevalue("shared_data") / name
    models = ("small_angle_linear_drag", "full_linear_drag", "full_linear_quadratic_coulomb")
    found = analyse(path, models=models, stop_s=stop_s)
    assert found.log
    assert latin_words(build_report(found, "th")) == set()


def test_references_are_those_used(analysis, english):
    def listed(report):
        return " ".join(report.sections[-1].blocks[0].items)

    assert "JCGM" in listed(english)
    assert "phyphox" not in listed(english)
    series = replace(analysis.series, meta={**analysis.series.meta, "format": "phyphox"})
    assert "phyphox" in listed(build_report(replace(analysis, series=series), "en"))


def test_the_budget_adds_up(english):
    tables = [b for s in english.sections if s.key == "budget" for b in s.blocks if hasattr(b, "rows")]
    assert tables
    for table in tables:
        parts = [float(re.match(r"[\d.]+", bare(row[-1]))[0]) for row in table.rows]
        scale = [bare(row[-1]).split("×")[1:] for row in table.rows]
        if all(s == scale[0] for s in scale):
            assert np.hypot(parts[-3], parts[-2]) == pytest.approx(parts[-1], rel=0.06)


# -- HTML -------------------------------------------------------------------------------------------------------------


class Outside(HTMLParser):
    """Everything in a page that could make a request, and everything that is not closed."""

    def __init__(self):
        super().__init__()
        self.found, self.open, self.text = [], [], []

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            request = name in ("src", "href", "xlink:href", "data", "action", "srcset", "poster")
            if request and value and not value.startswith(("#", "data:")):
                self.found.append((tag, name, value[:80]))
            if name == "style" and value and "url(" in value and "url(#" not in value:
                self.found.append((tag, name, value[:80]))
        if tag in ("script", "iframe", "object", "embed"):
            self.found.append((tag, "", ""))
        if tag not in ("meta", "link", "br", "img", "use", "path", "image"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ("use", "path", "image"):
            assert self.open.pop() == tag

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in ("meta", "link", "br", "img", "use", "path", "image"):
            self.open.pop()

    def handle_data(self, data):
        self.text.append(data)


@pytest.mark.parametrize("lang", ["en", "th"])
def test_html_is_complete_in_itself(english, thai, tmp_path, lang):
    report = english if lang == "en" else thai
    (path,) = write_report(report, tmp_path, ("html",))
    page = path.read_text(encoding="utf-8")
    assert path.stat().st_size < 3_000_000
    parser = Outside()
    parser.feed(page)
    assert parser.found == []
    assert parser.open == []
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)[1]
    assert "@import" not in style
    assert all(url.startswith("data:") for url in re.findall(r"url\(([^)]*)\)", style))
    assert page.count("<svg") == len(report.figures) + 1  # and the equation
    text = "".join(parser.text)
    assert "swing <1>.csv" in text
    assert "ruler & a <clock>" in text
    assert "prefers-color-scheme" in style
    assert "@media print" in style
    assert ("data:font" in style) == (lang == "th")
    assert "nan" not in re.sub(r"[\w-]*nan[\w-]+|[\w-]+nan[\w-]*", "", text.lower())


def test_svg_ids_do_not_collide(english):
    """Clip paths of two figures on one page must not share a name with another meaning."""
    clips: dict[str, str] = {}
    for figure in english.figures:
        for name, body in re.findall(r'<clipPath id="([^"]+)">\s*(.*?)\s*</clipPath>', figure.svg, re.DOTALL):
            assert clips.setdefault(name, body) == body
        used = set(re.findall(r"url\(#([^)]+)\)", figure.svg)) | set(re.findall(r'href="#([^"]+)"', figure.svg))
        assert used <= set(re.findall(r'id="([^"]+)"', figure.svg)), figure.key


def test_numbers_of_figures_and_tables(english):
    numbers = numbering(english)
    assert [numbers[f.key] for f in english.figures] == list(range(1, len(english.figures) + 1))
    assert len({f.key for f in english.figures}) == len(english.figures)


# -- PDF --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lang", ["en", "th"])
def test_pdf_is_the_same_twice(analysis, english, thai, tmp_path, lang):
    first = write_report(english if lang == "en" else thai, tmp_path / "a", ("pdf",))[0].read_bytes()
    slower = {name: replace(fit, cpu_s=fit.cpu_s + 1) for name, fit in analysis.fits.items()}
    again = build_report(replace(analysis, fits=slower, timings_s={"fit": 99.0}), lang)
    second = write_report(again, tmp_path / "b", ("pdf",))[0].read_bytes()
    assert first[:5] == b"%PDF-"
    assert first == second


def test_pdf_embeds_its_fonts_and_says_the_words(english, thai, tmp_path):
    import shutil
    import subprocess

    if not shutil.which("pdffonts"):
        pytest.skip("poppler's pdffonts is not on this machine")
    for report in (english, thai):
        path = write_report(report, tmp_path, ("pdf",))[0]
        rows = subprocess.run(["pdffonts", path], capture_output=True, text=True, check=True).stdout.splitlines()[2:]
        assert rows
        assert all(re.search(r"\s(yes)\s+(yes|no)\s+(yes|no)\s+\d+\s+\d+$", row) for row in rows)
        text = subprocess.run(
            ["pdftotext", "-f", "1", "-l", "1", path, "-"], capture_output=True, text=True, check=True
        ).stdout
        assert "\ufffd" not in text
        assert "kg/s" in text
    assert any("\u0e00" <= c <= "\u0e7f" for c in text)


# -- the other formats ------------------------------------------------------------------------------------------------


def test_latex_fragment(english, tmp_path):
    (path,) = write_report(english, tmp_path, ("tex",))
    text = path.read_text(encoding="utf-8")
    bare_text = re.sub(r"\\[\\{}]", "", text)
    assert bare_text.count("{") == bare_text.count("}")
    for name in ("tabular", "figure", "table", "itemize", "description", "equation"):
        assert text.count(f"\\begin{{{name}}}") == text.count(f"\\end{{{name}}}") > 0
    assert not re.search(
        r"(?<!\\)[&%#](?![^\n]*\\\\)", re.sub(r"^%.*$", "", text, flags=re.MULTILINE).replace(" & ", "")
    )
    for key in re.findall(r"\\includegraphics\[[^]]*\]\{(figures/\w+)\}", text):
        assert (tmp_path / f"{key}.pdf").read_bytes()[:5] == b"%PDF-"
        assert (tmp_path / f"{key}.csv").stat().st_size > 20


@pytest.mark.parametrize("lang", ["en", "th"])
def test_latex_compiles(english, thai, tmp_path, lang):
    """As the fragment's own head says, in the smallest document."""
    import shutil
    import subprocess
    from importlib.resources import files

    engine = shutil.which("pdflatex" if lang == "en" else "xelatex")
    if engine is None:
        pytest.skip("no TeX on this machine")
    (path,) = write_report(english if lang == "en" else thai, tmp_path, ("tex",))
    head = [line[4:] for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("%   ")]
    fonts = f"{files('toolkit.report') / 'fonts'}/"
    font = f"\\setmainfont{{NotoSansThai}}[Path={fonts},Extension=.ttf,UprightFont=*-Regular,BoldFont=*-Bold]"
    document = "\n".join(head).replace("\\setmainfont{Noto Sans Thai}", font)
    (tmp_path / "document.tex").write_text(document, encoding="utf-8")
    command = [engine, "-interaction=nonstopmode", "-halt-on-error", "document.tex"]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True).stdout.decode("utf-8", "replace")
    if re.search(r"! LaTeX Error: File `\w+\.sty' not found", told):
        pytest.skip("this TeX lacks a package")
    assert (tmp_path / "document.pdf").is_file(), told[-800:]
    log = (tmp_path / "document.log").read_text(encoding="utf-8", errors="replace")
    assert "Missing character" not in log
    wide = [float(points) for points in re.findall(r"Overfull \\hbox \(([\d.]+)pt too wide\)", log)]
    assert max(wide, default=0.0) < 20  # nothing runs out of the margin


def test_markdown_and_its_figures(english, tmp_path):
    (path,) = write_report(english, tmp_path, ("md",))
    text = path.read_text(encoding="utf-8")
    files = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert len(files) == len(english.figures)
    assert all((tmp_path / file).read_text(encoding="utf-8").startswith("<svg") for file in files)
    for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        widths = {len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}
        assert len(widths) == 1


def test_spreadsheet_holds_the_data(analysis, english, tmp_path):
    import openpyxl

    (path,) = write_report(english, tmp_path, ("xlsx",))
    book = openpyxl.load_workbook(path)
    assert {"answers", "data", "parameters", "models", "findings", "budget"} <= set(book.sheetnames)
    rows = list(book["data"].iter_rows(values_only=True))
    assert rows[0][:3] == ("t_s", "theta_rad", "sigma_theta_rad")
    column = np.array([row[1] for row in rows[1:]])
    assert np.allclose(column, analysis.series.theta_rad, rtol=1e-15, atol=0)  # the format keeps 16 digits
    parameters = {(r[0], r[1]): r[2] for r in book["parameters"].iter_rows(min_row=2, values_only=True)}
    for name, fit in analysis.fits.items():
        for key, found in fit.parameters.items():
            assert parameters[name, key] == pytest.approx(found.value, rel=1e-14)


def test_figure_numbers_read_back(analysis, english, tmp_path):
    write_report(english, tmp_path, ("md",))
    import pandas as pd

    table = pd.read_csv(tmp_path / "figures" / "motion.csv")
    assert np.array_equal(table["theta_rad"], analysis.series.theta_rad)


# -- wrong use, poor data ---------------------------------------------------------------------------------------------


def test_unknown_formats_and_languages():
    with pytest.raises(UsageError, match="html"):
        check_choice(("htm",), "en")
    with pytest.raises(UsageError, match="unknown language"):
        check_choice(("pdf",), "de")
    with pytest.raises(UsageError, match="no report format"):
        check_choice((), "en")


@pytest.mark.parametrize("lang", ["en", "th"])
def test_a_report_of_fits_that_failed(analysis, tmp_path, lang):
    empty = np.full(len(analysis.series), np.nan)
    failed = {
        name: replace(
            fit,
            success=False,
            message="no swing in the data",
            residuals_rad=empty,
            theta_rad=empty,
            omega_rad_per_s=empty,
            covariance=np.full_like(fit.covariance, np.nan),
            derived={},
            chi2=np.nan,
            aic=np.nan,
            bic=np.nan,
        )
        for name, fit in analysis.fits.items()
    }
    report = build_report(replace(analysis, fits=failed, findings=[]), lang)
    assert bare(report.facts[0].remark) == "no swing in the data"
    for path in write_report(report, tmp_path, ("html", "pdf", "md", "tex", "xlsx")):
        assert path.stat().st_size > 500


def test_a_report_of_less_than_two_swings(tmp_path):
    report = build_report(analysed(record(seconds=2.0), Scene()), "en")
    assert "angles over" in report.lead
    assert write_report(report, tmp_path)[0].stat().st_size > 10_000


def test_long_records_stay_small(analysis):
    """40 000 points: figures are thinned, outlined and averaged, and what they show is still all of it."""
    series = record(seconds=25.0, fps=1600)
    best = analysis.best
    problem = replace(best.problem, series=series, sigma=np.ones(len(series)))
    values = {n: p.value for n, p in best.parameters.items()}
    seen, _, motion = problem.predict(values, best.free)
    fit = replace(best, theta_rad=seen, omega_rad_per_s=motion.omega, residuals_rad=series.theta_rad - seen)
    report = build_report(replace(analysis, series=series, fits={best.model: fit}, preferred=best.model), "en")
    assert sum(len(f.svg) for f in report.figures) < 1_500_000
    motion_figure = next(f for f in report.figures if f.key == "motion")
    assert len(motion_figure.data["theta_rad"]) == len(series)


# -- in a notebook and a terminal -------------------------------------------------------------------------------------


def made_track():
    from toolkit.track import Track

    x = np.array([1.0, 2.0, np.nan, 3.0, 2.0, 1.0])
    one = np.ones(6)
    status = np.array(["ok", "ok", "lost", "ok", "ok", "ok"])
    meta = {"warnings": ["a < b"]}
    return Track(np.arange(6), np.arange(6) / 30, x, x, one, one, status, 5.0, (2.0, -9.0), (0.1, 0.2), "disc", meta)


def test_results_print_themselves(analysis):
    from toolkit.report.notebook import analysis_html, finding_html, fit_html, series_html, trajectory_html
    from toolkit.report.terminal import summary_lines
    from toolkit.simulate import simulate

    shown = [series_html(analysis.series), fit_html(analysis.best), analysis_html(analysis, "th")]
    shown += [finding_html(finding) for finding in analysis.findings]
    shown += [trajectory_html(simulate(analysis.scene, np.linspace(0, 2, 50)))]
    shown += [made_track()._repr_html_()]
    for html in shown:
        parser = Outside()
        parser.feed(html)
        assert parser.open == []
        assert parser.found == []
    assert "k<sub>d</sub>" in shown[1]
    assert "5 of 6 frames measured by the disc localiser" in shown[-1]
    assert "50 points to t = 2.000 s" in shown[-2]
    lines = summary_lines(analysis)
    assert any("k_d" in line for line in lines)
    assert not any("{" in line or "\n" in line for line in lines)


@pytest.mark.parametrize("width", [40, 80, 110])
@pytest.mark.parametrize("lang", ["en", "th"])
def test_a_terminals_lines_fit_it(analysis, lang, width):
    """No line is wider than the terminal but for single Thai phrases, which it breaks itself; no number loses its unit; nothing is
    lost."""
    from unicodedata import category

    from toolkit.report.terminal import summary_lines

    lines = summary_lines(analysis, lang, width)
    for line in lines:
        assert sum(category(c) != "Mn" for c in line) <= width or " " not in line.strip()
        assert not re.match(r"\s*%", line)
    whole = summary_lines(analysis, lang, 10**6)
    assert " ".join(" ".join(lines).split()) == " ".join(" ".join(whole).split())


@pytest.mark.parametrize("lang", ["en", "th"])
def test_every_way_of_reading_tells_what_to_read_with_care(analysis, lang):
    """What stands under `Read with care` in the report is told in the terminal, in a notebook and on the web page too."""
    from toolkit.report.notebook import analysis_html
    from toolkit.report.terminal import summary_lines

    rubs = next(f for f in analysis.findings if f.assumption == "frictionless_pivot")
    poor = replace(analysis, findings=[*analysis.findings, replace(rubs, verdict="fails")])
    cautions = build_report(poor, lang).cautions
    assert len(cautions) == 2
    shown, lines = analysis_html(poor, lang), summary_lines(poor, lang, 10**6)
    for caution in cautions:
        assert any(line.endswith(bare(caution)) for line in lines)
        assert bare(caution).split(": ")[-1] in bare(re.sub("<[^>]*>", "", shown))


# -- what figures do to data ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_ticks_are_matplotlibs_own(scale):
    """The same numbers at the same places as matplotlib writes by itself."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    from toolkit.report.ticks import draw_ticks

    def drawn():
        sheet = Sheet(figsize=(4, 3))
        axes = sheet.subplots()
        axes.plot([0.3, 7.1], [2, 5000])
        axes.set_yscale(scale)
        axes.minorticks_off()
        FigureCanvasAgg(sheet).draw()
        return axes

    plain, ours = drawn(), drawn()
    draw_ticks(ours)
    for axis, k in ((plain.xaxis, 0), (plain.yaxis, 1)):
        low, high = axis.get_view_interval()
        wanted = {label.get_text(): label.get_position()[k] for label in axis.get_majorticklabels()}
        wanted = {text: place for text, place in wanted.items() if low <= place <= high}
        ours_here = [
            text for text in ours.texts if text.get_ha() == ("center", "right")[k] and text.get_text() in wanted
        ]
        shown = {text.get_text(): text.get_position()[k] for text in ours_here}
        assert wanted
        assert shown == pytest.approx(wanted)


def test_figures_that_fit_share_a_line(english):
    from toolkit.report.paper import lines, width_percent

    blocks = [b for s in english.sections for b in s.blocks]
    rows = lines(blocks)
    assert [b for row in rows for b in row] == blocks
    assert ["energy", "portrait"] in [[b.key for b in row] for row in rows if hasattr(row[0], "svg") and len(row) > 1]
    assert all(sum(map(width_percent, row)) <= 100.5 for row in rows if len(row) > 1)


@given(st.integers(1, 20000), st.integers(1, 2000))
def test_thinning_keeps_the_whole_range(n, limit):
    kept = thinned(n, limit)
    assert kept.size <= max(limit, min(n, limit))
    assert np.all(np.diff(kept) > 0)
    assert kept[0] <= n / limit + 1
    assert kept[-1] >= n - 1 - 2 * n / min(n, limit)


def test_binned_means_use_every_point():
    rng = np.random.default_rng(5)
    x = rng.uniform(0, 1, 20000)
    at, mean, error = binned(x, 3 * x + rng.normal(0, 0.5, x.size), 20)
    assert np.all(np.abs(mean - 3 * at) < 5 * error + 0.003)
    assert np.allclose(error, np.hypot(0.5, 3 / 20 / np.sqrt(12)) / np.sqrt(x.size / 20), rtol=0.15)

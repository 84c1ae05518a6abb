"""The languages say the same things: same keys, same blanks to fill in, letters that the shipped fonts have."""

from __future__ import annotations

import ast
import string
from datetime import date
from importlib.resources import files
from pathlib import Path

import pytest

from toolkit.errors import UsageError
from toolkit.report.words import languages, load_words


def blanks(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


def test_english_and_thai_are_there():
    assert {"en", "th"} <= set(languages())
    with pytest.raises(UsageError, match="unknown language 'xx'"):
        load_words("xx")


@pytest.mark.parametrize("lang", languages())
def test_keys_and_blanks_agree(lang):
    english, other = load_words("en").table, load_words(lang).table
    said = "said.", "error."
    assert {key for key in other if not key.startswith(said)} == {key for key in english if not key.startswith(said)}
    for key, text in english.items():
        assert blanks(other[key]) == blanks(text), key
        assert other[key].strip(), key


def spoken() -> dict[str, set[str]]:
    """Key -> names of the values of every sentence that the toolkit says, out of its source; `key*` where the key's end is
    made while running."""
    found: dict[str, set[str]] = {}
    for path in (Path(__file__).parents[1] / "toolkit").rglob("*.py"):
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name)):
                continue
            if call.func.id not in ("said", "Sentence") or path.name == "sentence.py":
                continue
            key = call.args[call.func.id == "Sentence"]
            name = key.value if isinstance(key, ast.Constant) else f"{key.values[0].value}*"
            found[f"said.{name}"] = {k.arg for k in call.keywords}
    return found


@pytest.mark.parametrize("lang", sorted(set(languages()) - {"en"}))
def test_every_sentence_that_is_logged_can_be_said(lang):
    """English stands where it is said; another language has words for each, with no other blanks."""
    table, sentences = load_words(lang).table, spoken()
    assert len(sentences) > 60
    for key, values in sentences.items():
        matching = [k for k in table if k.startswith(key[:-1])] if key.endswith("*") else [key]
        assert all(k in table for k in matching), key
        assert matching
        assert all(blanks(table[k]) <= values for k in matching), key
    beginnings = tuple(key[:-1] for key in sentences if key.endswith("*"))
    others = {k for k in table if k.startswith("said.") and not k.startswith(("said.term.", "said.solver."))}
    assert {k for k in others - set(sentences) if not k.startswith(beginnings)} == set()


def raised() -> set[str]:
    """Shapes of the lines of every JobError that a recording can cause, out of the source: `{}` for what is filled in."""

    def shape(node: ast.expr) -> str:
        if isinstance(node, ast.JoinedStr):
            return "".join(shape(part) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        return str(node.value) if isinstance(node, ast.Constant) else "{}"

    toolkit = Path(__file__).parents[1] / "toolkit"
    rooms = [*(toolkit / "tracking").glob("*.py"), *(toolkit / "series_io").glob("*.py")]
    found = set()
    for path in rooms + [toolkit / f"{name}.py" for name in ("track", "calibrate", "video", "analyse", "series")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            error = node.exc if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) else None
            if error is not None and (ast.unparse(error.func) == "JobError" or path.name == "series.py"):
                found.add(shape(error.args[0]))
    return found


@pytest.mark.parametrize("lang", sorted(set(languages()) - {"en"}))
def test_every_error_of_a_recording_can_be_said(lang):
    """A Thai class page says in Thai why a recording was not analysed, with every blank filled once."""
    shapes = raised()
    table = dict(load_words(lang).under("error."))
    assert len(shapes) > 60
    assert sorted(shapes - set(table)) == []
    for key, told in table.items():
        assert blanks(told) == {str(i) for i in range(key.count("{}"))}, key


def test_an_error_is_said_with_its_parts():
    from toolkit.report.speech import say_error

    thai = load_words("th")
    line = "what moves in a.mp4 is no pendulum (it does not turn back); if there is one, give --bob X,Y (its centre in px on the first frame)"
    told = say_error(thai, line)
    assert "a.mp4" in told
    assert "ไม่แกว่งกลับ" in told
    assert "pendulum" not in told
    assert say_error(
        thai, "b.csv: line 7 has 4 cells where 2 are expected; check the delimiter and the decimal mark there"
    ) == ("b.csv: บรรทัด 7 มี 4 ช่อง แต่ควรมี 2 ตรวจตัวคั่นและจุดทศนิยมตรงนั้น")
    assert say_error(thai, "no words for this") == "no words for this"
    assert say_error(load_words("en"), line) == line


@pytest.mark.parametrize("lang", languages())
def test_no_word_switches_mathtext_on(lang):
    """matplotlib sets Thai wrongly in a string with $…$."""
    assert not [key for key, text in load_words(lang).table.items() if "$" in text]


def test_thai_is_thai():
    """No sentence was left in English: names of models, captions, findings and remedies hold Thai letters."""
    same = {
        "column.reduced_chi2",
        "column.delta_aic",
        "column.delta_bic",
        "column.cpu",
        "figure.theta_deg",
        "figure.omega",
    }
    for key, text in load_words("th").table.items():
        section = key.split(".")[0]
        if (
            section in ("language", "symbol", "reference")
            or key == "error.{}: {}"
            or key in same
            or key in ("date.year_offset", "text.known_g", "meaning.omega_g")
        ):
            continue
        assert any("\u0e00" <= c <= "\u0e7f" for c in text), key


def test_dates():
    day = date(2026, 11, 22)
    assert load_words("en").date(day) == "22 November 2026"
    assert load_words("th").date(day) == "22 พฤศจิกายน พ.ศ. 2569"


@pytest.mark.parametrize("lang", languages())
def test_figures_have_every_glyph(lang):
    """The words drawn by matplotlib are covered by the shipped Thai font and matplotlib's own DejaVu Sans."""
    from matplotlib import font_manager
    from matplotlib.ft2font import FT2Font

    paths = [font_manager.findfont("DejaVu Sans")]
    paths += [str(f) for f in (files("toolkit.report") / "fonts").iterdir() if f.name.endswith(".ttf")]
    known = set().union(*(FT2Font(path).get_charmap() for path in paths))
    for key, text in load_words(lang).table.items():
        if key.split(".")[0] in ("figure", "symbol"):
            assert {ord(c) for c in text} <= known, key


def test_the_font_s_licence_is_shipped():
    text = (files("toolkit.report") / "fonts" / "OFL.txt").read_text(encoding="utf-8")
    assert "SIL OPEN FONT LICENSE" in text.upper()

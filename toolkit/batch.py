"""A class at once: one report a recording, one table, one page that links them."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toolkit.analyse import SERIES_SUFFIXES, VIDEO_SUFFIXES
from toolkit.errors import JobError, PendulabError, UsageError
from toolkit.progress import Progress, silent
from toolkit.scene import Scene

if TYPE_CHECKING:
    from toolkit.analyse import Analysis


@dataclass(frozen=True)
class BatchRow:
    """One recording of a class: whether it was done, a sentence, the numbers for the table, and for the page the answers
    (question of `report/words` -> answer, with the marks of `report/numbers`) and what is to be read with care."""

    recording: str
    done: bool
    sentence: str
    numbers: dict[str, Any] = field(default_factory=dict)
    page: str = ""
    answers: dict[str, str] = field(default_factory=dict)
    cautions: tuple[str, ...] = ()


def analyse_folder(
    folder: str | Path,
    out: str | Path,
    scene: Scene | None = None,
    *,
    lang: str = "en",
    formats: tuple[str, ...] = ("html", "pdf"),
    jobs: int = 0,
    progress: Progress = silent,
) -> list[BatchRow]:
    """Analyse every recording in `folder`; write OUT/NAME/report.…, OUT/summary.csv and OUT/index.html.

    A recording NAME.mp4 with a NAME.toml beside it uses that scene. A recording that fails becomes a row with
    its one-line reason; the others go on. jobs : processes at once; 0 is one a processor.
    Raises JobError where there is no recording in the folder.
    """
    from joblib import Parallel, cpu_count, delayed

    from toolkit.output import try_folder
    from toolkit.report import check_choice

    folder, out = Path(folder), Path(out)
    check_choice(formats, lang)
    if not folder.is_dir():
        raise JobError(f"{folder} is not a folder; give the folder that holds the recordings")
    if jobs < 0:
        raise UsageError(f"--jobs must be 0 (one a processor) or more, got {jobs}")
    known = VIDEO_SUFFIXES | SERIES_SUFFIXES
    recordings = [p for p in folder.iterdir() if p.suffix.lower() in known and not p.name.endswith(".truth.csv")]
    recordings.sort(key=_as_people_count)
    if not recordings:
        raise JobError(f"{folder} holds no video and no θ(t) file; known endings are .mp4 .mov .avi … .csv .txt .trk")
    try_folder(out)
    tasks = (
        delayed(_analyse_one)(path, out / name, scene or Scene(), lang, formats)
        for path, name in zip(recordings, _distinct_names(recordings))
    )
    rows: list[BatchRow] = []
    workers = jobs or cpu_count()
    results: Iterator[BatchRow] = Parallel(n_jobs=min(workers, len(recordings)), return_as="generator")(tasks)
    for row in results:
        rows.append(row)
        progress(f"{len(rows)} of {len(recordings)} recordings", len(rows) / len(recordings))
    _write_summary(rows, out, lang)
    return rows


def _as_people_count(path: Path) -> list[tuple[bool, int, str]]:
    """A key that sorts group2 before group10."""
    parts = re.findall(r"[0-9]+|[^0-9]+", path.name.casefold())
    return [(not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in parts]


def _distinct_names(recordings: list[Path]) -> list[str]:
    """A folder name for each recording: its stem, or its whole name where two share a stem."""
    stems = [path.stem for path in recordings]
    return [path.stem if stems.count(path.stem) == 1 else path.name for path in recordings]


def _analyse_one(path: Path, out: Path, scene: Scene, lang: str, formats: tuple[str, ...]) -> BatchRow:
    from toolkit.make_report import make_report

    try:
        own_scene = path.with_suffix(".toml")
        if own_scene.is_file():
            scene = Scene.from_toml(own_scene)
        analysis, written = make_report(path, out, scene, formats=formats, lang=lang)
    except PendulabError as error:
        return BatchRow(path.name, False, " ".join(str(error).replace(str(path), path.name).split()))
    except Exception as error:
        return BatchRow(path.name, False, f"unexpected trouble ({type(error).__name__}: {error})")
    verdicts = {finding.assumption: finding.verdict for finding in analysis.findings}
    numbers: dict[str, Any] = {
        "points": len(analysis.series),
        "duration_s": analysis.series.duration_s,
        "preferred_model": analysis.preferred if analysis.best.success else "",
        "small_angle": verdicts.get("small_angle", ""),
        "linear_drag": verdicts.get("linear_drag", ""),
        "reduced_chi2": analysis.best.reduced_chi2,
    }
    found = {**analysis.best.parameters, **analysis.best.derived} if analysis.best.success else {}
    for name, parameter in found.items():
        key = name if parameter.unit in ("", "1") else f"{name} [{parameter.unit}]"
        numbers[key] = parameter.value
        numbers[f"u({key})"] = parameter.stderr
    model = analysis.preferred if analysis.best.success else "no fit converged"
    small, linear = (numbers[name].replace("_", " ") for name in ("small_angle", "linear_drag"))
    sentence = f"{model}; small angle {small}, linear drag {linear}"
    page = next((f"{out.name}/{p.name}" for p in written if p.suffix == ".html"), "")
    return BatchRow(path.name, True, sentence, numbers, page, *_told(analysis, lang))


_QUESTIONS = ("drag", "period", "small_angle", "linear_drag")


def _told(analysis: Analysis, lang: str) -> tuple[dict[str, str], tuple[str, ...]]:
    """The page's answers and what is to be read with care."""
    from toolkit.report.essentials import cautions, facts
    from toolkit.report.material import Material
    from toolkit.report.words import load_words

    words = load_words(lang)
    material = Material(analysis, words)
    told = {fact.question: fact.answer for fact in facts(material)}
    return {key: told.get(words(f"question.{key}"), "–") for key in _QUESTIONS}, cautions(material)


def _write_summary(rows: list[BatchRow], out: Path, lang: str) -> None:
    import pandas as pd

    from toolkit.output import whole_folder
    from toolkit.report.numbers import bare

    table = pd.DataFrame(
        [
            {
                "recording": r.recording,
                "done": r.done,
                "message": r.sentence,
                "read_with_care": " ".join(map(bare, r.cautions)),
                **r.numbers,
            }
            for r in rows
        ]
    )
    if "points" in table:
        table["points"] = table["points"].astype("Int64")  # counts, though failed rows have none
    with whole_folder(out) as unfinished:
        table.to_csv(unfinished / "summary.csv", index=False)
        (unfinished / "index.html").write_text(_index_page(rows, lang), encoding="utf-8")


def _index_page(rows: list[BatchRow], lang: str) -> str:
    """The class on one page: each recording's answers, or why it has none; `data-name` heads a cell on a phone."""
    from toolkit.report.html import page_style
    from toolkit.report.notebook import marked
    from toolkit.report.speech import say_error
    from toolkit.report.words import load_words

    words = load_words(lang)
    questions = [words("class.recording"), *(words(f"question.{key}") for key in _QUESTIONS)]
    lines = []
    for row in rows:
        name = html.escape(row.recording)
        cells = [f'<a href="{html.escape(row.page, quote=True)}">{name}</a>' if row.page else name]
        if row.done:
            cells += [marked(answer) for answer in row.answers.values()]
            told = zip(questions, cells)
            lines.append(
                "<tr>" + "".join(f'<td data-name="{html.escape(q)}"><span>{c}</span></td>' for q, c in told) + "</tr>"
            )
            if row.cautions:
                care = html.escape(words("page.cautions"))
                listed = "".join(f"<li>{marked(line)}</li>" for line in row.cautions)
                lines.append(f'<tr class="care"><td></td><td colspan="4"><b>{care}</b><ul>{listed}</ul></td></tr>')
        else:
            failed = f'<td data-name="{html.escape(words("class.failed"))}" colspan="4"><span>{html.escape(say_error(words, row.sentence))}</span></td>'
            lines.append(f'<tr class="failed"><td data-name="{html.escape(questions[0])}">{cells[0]}</td>{failed}</tr>')
    title = words("class.title", done=sum(row.done for row in rows), all=len(rows))
    style = page_style(lang)
    head = "".join(f"<th scope='col'>{html.escape(question)}</th>" for question in questions)
    return f"""<!doctype html>
<html lang="{words("language.html")}"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{html.escape(title)}</title>
<link rel="icon" href="data:,"><style>
{style}
.failed td{{color:var(--bad)}}
.care td{{font-size:.85em;color:var(--soft)}} .care ul{{margin:0;padding-left:1.2em}}
tr:has(+ .care),tr:has(+ .care) td{{border-bottom:0}}
@media screen and (max-width:38rem){{.care td{{display:block}} .care td:empty{{display:none}}}}
td:nth-child(3) span{{white-space:nowrap}}
</style></head><body><main>
<h1>{html.escape(title)}</h1>
<p>{words("class.numbers", file='<a href="summary.csv">summary.csv</a>')}</p>
<table><thead><tr>{head}</tr></thead><tbody>
{chr(10).join(lines)}
</tbody></table></main></body></html>
"""

"""report.xlsx: the answers, and the data, parameters, models, findings and budget as numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from toolkit.report.document import Report
from toolkit.report.numbers import bare


def write(report: Report, folder: Path) -> Path:
    """Write report.xlsx; returns its path."""
    import xlsxwriter

    path = folder / "report.xlsx"
    with xlsxwriter.Workbook(
        str(path), {"strings_to_formulas": False, "strings_to_urls": False, "nan_inf_to_errors": True}
    ) as book:
        book.set_properties({"title": report.title, "subject": report.subtitle, "created": _epoch()})
        head = book.add_format({"bold": True, "bottom": 1})
        _answers(book, report, head)
        for name, columns in report.sheets.items():
            sheet = book.add_worksheet(name)
            sheet.freeze_panes(1, 0)
            for k, (title, values) in enumerate(columns.items()):
                sheet.write(0, k, title, head)
                sheet.set_column(k, k, max(14, len(title) + 2))
                _column(sheet, k, list(values))
    return path


def _epoch() -> Any:
    """A fixed time of creation: the same report gives the same file."""
    from datetime import datetime

    return datetime(1980, 1, 1)


def _answers(book: Any, report: Report, head: Any) -> None:
    sheet = book.add_worksheet("answers")
    wrap = book.add_format({"text_wrap": True, "valign": "top"})
    sheet.set_column(0, 0, 48, wrap)
    sheet.set_column(1, 2, 60, wrap)
    sheet.write(0, 0, f"{bare(report.title)}: {report.subtitle}", head)
    sheet.write(1, 0, bare(report.lead))
    row = 3
    for fact in report.facts:
        sheet.write_row(row, 0, [bare(fact.question), bare(fact.answer), bare(fact.remark)])
        row += 1
    row += 1
    for verdict in report.verdicts:
        sheet.write_row(row, 0, [bare(verdict.title), verdict.label, bare(f"{verdict.sentence} {verdict.remedy}")])
        row += 1
    sheet.write(row + 1, 0, bare(report.footer))


def _column(sheet: Any, k: int, values: list[Any]) -> None:
    for row, value in enumerate(values, 1):
        value = value.item() if hasattr(value, "item") else value
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            continue
        if isinstance(value, bool):
            sheet.write_boolean(row, k, value)
        elif isinstance(value, int | float):
            sheet.write_number(row, k, value)
        else:
            sheet.write_string(row, k, str(value))

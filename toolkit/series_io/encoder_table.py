"""An encoder's record: `trigger_start_deg, sample_rate, duration_sec`, their values, then one column of degrees."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.columns import clean_series
from toolkit.series_io.series_format import Look, SeriesFormat
from toolkit.series_io.table_text import read_text


def _recognises(look: Look) -> bool:
    return bool(look.lines) and {"sample_rate", "duration_sec"} <= {w.strip() for w in look.lines[0].split(",")}


def read(path: Path) -> ThetaSeries:
    """The swing from its first pass through the bottom on (before it, the hand may hold). Raises JobError."""
    lines = [line.strip() for line in read_text(path).splitlines() if line.strip()]
    try:
        head = dict(zip((n.strip() for n in lines[0].split(",")), (float(v) for v in lines[1].split(","))))
        degrees = np.array([float(line) for line in lines[2:]])
        rate = head["sample_rate"]
        if not rate > 0 or degrees.size == 0:
            raise ValueError
    except (ValueError, IndexError, KeyError) as error:
        raise JobError(f"{path} is not an encoder record: a sample rate and one angle a line are expected") from error
    start = _first_pass(degrees)
    log: list[str] = [
        said(
            "series.encoder",
            "Read {count} angles in degrees at {rate_hz:g} Hz from {file}.",
            count=degrees.size,
            rate_hz=rate,
            file=path.name,
        ),
        said(
            "series.encoder_start",
            "The first {left_out_s:.3f} s, up to the first pass through the bottom, were left out: the release by hand is in them.",
            left_out_s=start / rate,
        ),
    ]
    own_zero = "The zero is the encoder's own; the fit finds how far it is from the vertical."
    warnings: list[str] = [said("series.encoder_zero", own_zero)]
    t_s = np.arange(degrees.size) / rate
    theta = np.radians(degrees)
    step = np.radians(np.min(np.abs(np.diff(degrees))[np.diff(degrees) != 0], initial=1.0))
    sigma = np.full(theta.size, step / np.sqrt(12))
    by_step = "σ of the angle is that of the encoder's step, {step_deg:.3g}°/√12."
    log.append(said("series.encoder_sigma", by_step, step_deg=float(np.degrees(step))))
    return clean_series(
        t_s[start:] - t_s[start],
        theta[start:],
        sigma[start:],
        path=path,
        log=log,
        warnings=warnings,
        meta={"format": "encoder record"},
    )


def _first_pass(degrees: np.ndarray) -> int:
    """Index of the first pass through zero after the largest excursion; 0 where there is none."""
    top = int(np.argmax(np.abs(degrees)))
    passes = np.flatnonzero(degrees[top + 1 :] * degrees[top] <= 0)
    return top + 1 + int(passes[0]) if passes.size else 0


FORMAT = SeriesFormat(
    "encoder_table", (), "a rotary encoder's record, one angle in degrees a line", _recognises, read, order=20
)

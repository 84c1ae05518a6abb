"""What of a series is too quick to be anything but chance: all above the band of what moves slowly in it, a hand's shake or a
motion that is not known well."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

_LONGER = 1.25  # times a piece's length is the longest wave, so that what is slow need not end where it began
_WIDEST = 0.6  # of all that a piece can hold: a wider band leaves too little beside it
_PIECE = 128  # frames


class Beyond(NamedTuple):
    """Series with their common slow band taken away.

    rest : (2, n), each value over its unit.    pieces : where each piece of the band lies, and its functions (m, k), orthonormal.
    left : how many independent values are left in each series.
    """

    rest: np.ndarray
    pieces: tuple[tuple[slice, np.ndarray], ...]
    left: int

    def holds(self, variances: np.ndarray) -> np.ndarray:
        """What independent errors of these variances (…, n), over the units' squares, leave in the rest in all, (…)."""
        share = [1 - np.sum(q**2, axis=1) for _, q in self.pieces]
        return np.asarray(variances @ np.concatenate(share))

    def mixes(self, variances: np.ndarray) -> np.ndarray:
        """What they leave in each value of it: (n, k) for (n, k)."""
        return self.mixing()(variances)

    def mixing(self) -> Callable[[np.ndarray], np.ndarray]:
        """The same, to be used again and again."""
        shares = [(span, (np.eye(len(q)) - q @ q.T) ** 2) for span, q in self.pieces]
        return lambda variances: np.concatenate([share @ variances[span] for span, share in shares])


def beyond_band(t_s: np.ndarray, series: np.ndarray, unit: np.ndarray) -> Beyond:
    """Take the slow band away from series (2, n) at times t_s (n,) of any distances, whose noise is about as large as `unit` (n,).

    The band is as wide as generalised cross-validation of both series asks for (Craven and Wahba 1979): it grows while each
    wave more takes away more than its share of noise.
    """
    n = t_s.size
    edges = np.linspace(0, n, max(1, round(n / _PIECE)) + 1).astype(int)
    spans = [slice(a, b) for a, b in pairwise(edges)]
    waves = int(_WIDEST * np.diff(edges).min() / 2)
    scaled = series / unit
    functions, gone = [], np.zeros((2, waves + 1))
    for span in spans:
        late = t_s[span] - t_s[span][0]
        phase = 2 * np.pi / max(_LONGER * late[-1], 1e-9) * np.outer(late, np.arange(1, waves + 1))
        columns = np.empty((late.size, 1 + 2 * waves))
        columns[:, 0], columns[:, 1::2], columns[:, 2::2] = 1.0, np.cos(phase), np.sin(phase)
        functions.append(np.linalg.qr(columns / unit[span, None])[0])
        gone += np.cumsum((scaled[:, span] @ functions[-1]) ** 2, axis=1)[:, ::2]
    square = np.sum(scaled**2, axis=1, keepdims=True) - gone
    left = n - len(spans) * (1 + 2 * np.arange(waves + 1))
    best = int(np.argmin(np.sum(np.log(np.maximum(square, 1e-300)), axis=0) - 4 * np.log(left)))
    pieces = tuple((span, q[:, : 1 + 2 * best]) for span, q in zip(spans, functions))
    for span, q in pieces:
        scaled[:, span] -= (scaled[:, span] @ q) @ q.T
    return Beyond(scaled, pieces, int(left[best]))

"""How much worse the bob is found on a codec's pictures of one type (I, P, B) than on those of another."""

from __future__ import annotations

import numpy as np

# Logarithms of what encoders ordinarily quantise more finely (I) or coarsely (B) than P pictures, by PyAV's numbers of the types: by
# the ratios 1.4 and 1.3 that x264 and x265 are set to, unless told otherwise; and by how much (standard deviation) types stray
# from that, by judgement.
_USUAL = {1: -np.log(1.4), 2: 0.0, 3: np.log(1.3)}
_APART = 0.4
_TURNS = 20


def factors_of_types(
    kind: np.ndarray, squares: np.ndarray, own: np.ndarray, known: np.ndarray, worth: float = 1.0
) -> np.ndarray:
    """What the σ of pictures of these types (n,) int are to be multiplied by, (n,), 1 in the mean square; all 1 where all are of one
    type. The likeliest, by scoring, each drawn towards what is usual the more the fewer pictures are of its type.

    squares (m,) : of residuals.    own (m, k) : how much of each one's variance is the pictures' of each type.
    known (m,) : what of it is of another origin.    worth : how many of them are independent, in all.
    """
    types = np.unique(kind)
    if types.size < 2:
        return np.ones(kind.size)
    usual = np.array([_USUAL.get(int(one), 0.0) for one in types])
    pull = (np.eye(types.size) - 1 / types.size) / _APART**2  # how large all are together is told by the squares alone
    log, share = usual.copy(), worth / squares.size
    for _ in range(_TURNS):
        part = own * np.exp(2 * log)
        expected = part.sum(axis=1) + known
        part /= expected[:, None]
        score = share * part.T @ (squares / expected - 1) - pull @ (log - usual)
        step = np.clip(np.linalg.solve(2 * share * part.T @ part + pull, score), -0.5, 0.5)
        log += step
        if np.abs(step).max() < 1e-3:
            break
    factors = np.exp(log)[np.searchsorted(types, kind)]
    return np.asarray(factors / np.sqrt(np.mean(factors**2)))

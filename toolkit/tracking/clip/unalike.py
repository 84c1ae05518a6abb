"""How much worse the bob is found on some frames than on others, beyond what the localiser says: on a codec's pictures of one type
(I, P, B), on those that it coarsely quantised, where the bob is fast, and on one side of its swing."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

# What follows was measured on 365 films of x264 whose truth is known: logarithms of how much worse the bob is found, ordinarily, and
# their standard deviations from film to film.
_TYPE = {1: -0.65, 2: 0.0, 3: 0.35}  # on I and B pictures than on P pictures, by PyAV's numbers of the types
_TYPE_APART = 0.4
# The coarser a picture is quantised, the less of the camera's noise it keeps, and the less a fit leaves unexplained; but the more
# the codec's errors move the bob. So σ, which goes with what is unexplained, is wrong by a power of it, as far as a codec makes it vary.
_KEPT, _KEPT_APART, _KEPT_REACH = -1.0, 0.6, 0.2
# The likelihood of the outline of a bob of more than one shade is steep here and flat there, partly by chance, and so is its σ: as far
# as it goes up and down within a film it is wrong by a power, which differs much from film to film.
_STEEP, _STEEP_APART, _STEEP_REACH = -0.15, 0.75, 1.6
_FAST, _FAST_APART = -0.05, 0.1  # a unit of kinetic energy (1 in the mean) more
_ASIDE_APART = 0.1  # a standard deviation of the swing to one side
_TURNS = 20


class Traits(NamedTuple):
    """What σ goes with, k things: columns (n, k), which logarithm of it ordinarily goes with each, (k,), and how far (standard deviation) that
    differs from film to film, (k,)."""

    columns: np.ndarray
    usual: np.ndarray
    apart: np.ndarray


def traits(
    kind: np.ndarray | None, misfit: np.ndarray | None, uneven: np.ndarray | None, xy: np.ndarray, velocity: np.ndarray
) -> Traits:
    """Those of frames of a codec's types (n,) int, which left `misfit` (n,) unexplained, with the bob at xy so fast, (2, n); `uneven` : the
    localiser's own σ (n,), if the bob is of more than one shade. A codec whose pictures are all of one type codes each by itself: then
    what is unexplained tells σ well."""
    energy = np.sum(velocity**2, axis=0)
    wide = xy[int(np.argmax(np.std(xy, axis=1)))]
    found = [
        (np.ones(wide.size), 0.0, np.inf),  # how large all are is told by the residuals alone
        (energy / np.mean(energy) - 1, _FAST, _FAST_APART),
        ((wide - np.mean(wide)) / np.std(wide), 0.0, _ASIDE_APART),
    ]
    types = np.unique(kind).tolist() if kind is not None else []
    if len(types) > 1:
        found += [(kind == one, _TYPE.get(one, 0.0), _TYPE_APART) for one in types]
    if uneven is not None:
        found.append((_about_median(uneven, _STEEP_REACH), _STEEP, _STEEP_APART))
    elif misfit is not None and len(types) > 1 and np.all(misfit > 0):
        found.append((_about_median(misfit, _KEPT_REACH), _KEPT, _KEPT_APART))
    columns, usual, apart = zip(*found)
    return Traits(np.column_stack(columns).astype(float), np.array(usual), np.array(apart))


def _about_median(values: np.ndarray, reach: float) -> np.ndarray:
    """Their logarithms about the median's, at most so far from it."""
    return np.clip(np.log(values / np.median(values)), -reach, reach)


def relative_sigma(
    told_by: Traits,
    squares: np.ndarray,
    spread: Callable[[np.ndarray], np.ndarray],
    known: np.ndarray,
    worth: float = 1.0,
) -> np.ndarray:
    """What the σ of frames of these traits are to be multiplied by, (n,), 1 in the mean square: the likeliest, by scoring, drawn towards
    what is usual the more the fewer residuals tell of it.

    squares (m,) : of residuals.    spread : gives how much of each one's variance is the frames', (m, k), if these have (n, k)
    times the variance of their own σ.    known (m,) : what of it is of another origin.    worth : how many of them are
    independent, in all.
    """
    columns, usual, apart = told_by
    pull = np.diag(apart**-2.0)
    log, share = usual.copy(), worth / squares.size
    for _ in range(_TURNS):
        variance = np.exp(2 * columns @ log)[:, None]
        parts = spread(np.column_stack([variance, variance * columns])).T
        expected = parts[0] + known
        slopes = parts[1:] / expected
        score = share * slopes @ (squares / expected - 1) - pull @ (log - usual)
        step = np.clip(np.linalg.solve(2 * share * slopes @ slopes.T + pull, score), -0.5, 0.5)
        log += step
        if np.abs(step).max() < 1e-3:
            break
    factors = np.exp(columns @ log)
    return np.asarray(factors / np.sqrt(np.mean(factors**2)))

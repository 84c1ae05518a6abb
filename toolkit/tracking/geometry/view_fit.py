"""The joint second pass: motion, pivot, and what the camera did to them, as far as the clip can tell.

One fit of all positions and string lines at once. Weak priors say what cameras do. Two answers come of it: the simplest view
that explains the clip, effects being added only while one explains much of what is left (Occam), and samples of
every view that clip and priors allow, all effects free. The first gives the angles, the second their uncertainty; no
effect is ever taken to be exactly absent.

How the period depends on amplitude is kept out of it by a free factor between the motion's angle and the picture's:
that evidence belongs to the fit of the physics, which would else count it twice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolkit.motion.compiled import address, call, kernel
from toolkit.tracking.geometry.least_squares import Minimum, least_squares
from toolkit.tracking.geometry.pivot import line_pivot
from toolkit.tracking.geometry.swing import LANES, swing_address
from toolkit.tracking.geometry.swing import NAMES as SWING_NAMES
from toolkit.tracking.geometry.view import AT, GROUPS, NAMES, View

_STEPS = np.array(
    [1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-5, 1e-5, 1e-4, 1e-6, 1e-5, 1e-5, 1e-7, 1e-3, 1e-3]
)
# Standard deviations of what cameras do, by judgement: some 10 degrees off square, lenses that bend 5 % at the corner,
# swings 3 degrees out of the plane, readouts of 15 ms; focal lengths of 1.2 to 3.3 picture widths (nearness = width / focal length).
PRIOR = {
    "factor": (1.0, 0.3), "yaw": (0.0, 0.2), "pitch": (0.0, 0.12), "log_nearness": (-0.7, 0.5), "k1": (0.0, 0.05),
    "sway_sin": (0.0, 0.05), "sway_cos": (0.0, 0.05), "readout": (0.0, 0.015),
}  # fmt: skip
_ORDINARY = 3.5  # of these deviations: hardly any camera is farther off (one effect of 2000)
_TILTS = ((0.1, 0.05), (-0.1, 0.05), (0.1, -0.05), (-0.1, -0.05))
_SWAYS = ((0.06, 0.0), (-0.06, 0.0), (0.0, 0.06), (0.0, -0.06))
_POOR = 2.0  # times what σ and bent errors alone leave: then the view may be one of a wide ellipse
_SQUARE = (*SWING_NAMES, "factor")
_BENDING = tuple(AT[name] for name in NAMES[10:])  # what bends the model: sampled; the rest follows linearly
_MOST = 160  # positions, and half as many lines, are enough to see what the camera did
_MEETS = 0.1  # of half a line's length: as well the lines have to tell where they meet
_CLEAR = 25.0  # by how much χ² must fall before a camera effect is believed
_NEARNESSES = (-1.7, -1.2, -0.7, -0.2, 0.3)  # along which a valley is looked for: two standard deviations either way
_BENT = 0.5, 3.0  # times σ: a bent error is at least and at most so large; part of a larger one would be seen
_LIKELY = 10.0  # so much higher in χ², a place still stands for some of what the clip allows
_SAMPLES, _ROUNDS, _ENOUGH = 100, 10, 50  # draws a round; so many independent ones are wanted


class Lines(NamedTuple):
    """The string on some frames: a point (px), its direction (rad from the downward axis, positive to the right), the
    uncertainties of direction and place, half the length (px) of the piece that was seen about the point, and when (s)."""

    x_px: np.ndarray
    y_px: np.ndarray
    angle_rad: np.ndarray
    sigma_rad: np.ndarray
    sigma_px: np.ndarray
    half_px: np.ndarray
    t_s: np.ndarray

    def of(self, chosen: np.ndarray) -> Lines:
        """Some of them, by index or mask."""
        return Lines(*(column[chosen] for column in self))

    @property
    def apart_px(self) -> float:
        """By how much they miss the point in which they meet best (rms but for strays)."""
        meet = line_pivot(self.x_px, self.y_px, self.angle_rad, np.ones(self.x_px.size))
        return np.inf if meet is None else float(np.sqrt(meet.reduced_chi2))

    def below_pivot(self) -> Lines:
        """The same, each as far up as where they meet: it was looked for as far as the pivot was thought to be, and above the pivot
        itself there is no string. As they are where it is not clear where they meet."""
        meet = line_pivot(self.x_px, self.y_px, self.angle_rad, np.ones(self.x_px.size))
        if meet is None or max(meet.sigma_px) > _MEETS * float(np.median(self.half_px)):
            return self
        right, down = np.sin(self.angle_rad), np.cos(self.angle_rad)
        above = (self.x_px - meet.xy[0]) * right + (self.y_px - meet.xy[1]) * down
        # a point that lies lower than the middle of what was looked at is none on this string
        less = np.where(above > 0, 0.5 * np.maximum(self.half_px - above, 0.0), 0.0)
        return self._replace(x_px=self.x_px + less * right, y_px=self.y_px + less * down, half_px=self.half_px - less)

    def seen(self) -> Lines | None:
        """Those that were measured; None where they are too few to tell a pivot."""
        measured = np.isfinite(self.half_px)
        return self.of(measured) if measured.sum() >= 8 else None


def fit_view(
    t_s: np.ndarray,
    x_px: np.ndarray,
    y_px: np.ndarray,
    sigma_x_px: np.ndarray,
    sigma_y_px: np.ndarray,
    start: np.ndarray,
    size_px: tuple[int, int],
    lines: Lines | None = None,
    pivot: tuple[float, float, float] | None = None,
    rows_along_x: bool = False,
    off_px: float = 0.02,
    bent_px: float = 0.0,
) -> View | None:
    """Fit the joint model to positions (n,) with standard uncertainties at stamps t_s, from a swing's values (9,), whose
    state is that at t_s[0]. `pivot` is (x, y, σ) where it is known otherwise; `off_px` is how far the places may be off the
    bob's centre, the same on all frames, and `bent_px` by how much that may change with the place. None where no pendulum
    motion fits.
    """
    n = t_s.size
    some = np.unique(np.linspace(0, n - 1, min(n, _MOST)).astype(int))
    values = np.concatenate([start, [1.0], np.zeros(len(NAMES) - 10)])
    values[AT["log_nearness"]] = PRIOR["log_nearness"][0]
    model = View(
        values, np.zeros(0), np.zeros(0), np.zeros(0), (), ((size_px[0] - 1) / 2, (size_px[1] - 1) / 2),
        float(t_s[0]), 1.0, rows_along_x,
    )  # fmt: skip
    prior = {**PRIOR, "off_x": (0.0, off_px), "off_y": (0.0, off_px)}
    places = t_s[some], x_px[some], y_px[some], sigma_x_px[some], sigma_y_px[some]
    problem = _Problem(model, *places, lines, pivot, prior, bent_px)
    square = problem.solve(values, _SQUARE, 25)
    if square is None:
        return None
    problem.trim(square.values)
    chosen = problem.solve(square.values, _SQUARE, 8) or square
    sides = problem.modes(chosen.values, *_turned(chosen.values), deep=np.inf)
    wide = bool(sides) and problem.inflation(sides[0].values) > _POOR * problem.least_inflation
    if wide:
        sides = problem.modes(sides[0].values, *_swayed(_turned(chosen.values)[1]), deep=np.inf)
    modes = sides[:1]
    shown: tuple[str, ...] = ()
    while modes and len(shown) < len(GROUPS):
        less, deepest = problem.weaker, modes[0].chi2
        problem.weigh(problem.inflation(modes[0].values))
        chosen = problem.solve(chosen.values, _names(shown), 8) or chosen
        # data that weigh less leave no less than their weight's share of what they left before, with the same strays left out
        if not shown and chosen.chi2 - min(1.0, less / problem.weaker) ** 2 * deepest < _CLEAR:
            break
        modes = problem.modes(modes[0].values, chosen.values)
        if not modes or chosen.chi2 - modes[0].chi2 < _CLEAR:
            break
        best, winner = chosen, ""
        for group in GROUPS:
            if group in shown:
                continue
            trials = [chosen.values] if group != "tilt" else _turned(chosen.values)
            if wide:
                trials += [modes[0].values]
            for trial in trials:
                found = problem.solve(trial, _names((*shown, group)), 8)
                if found is not None and found.chi2 < best.chi2:
                    best, winner = found, group
        if not winner or chosen.chi2 - best.chi2 < _CLEAR:
            break
        shown = (*shown, winner)
        problem.trim(best.values)
        chosen = problem.solve(best.values, _names(shown), 12) or best
    modes = problem.modes(*(m.values for m in (*modes, *sides[1:])))
    if not modes:
        return None
    try:
        covariance = _spread(chosen, _names(shown))
        samples, weights = problem.sample(modes + problem.along(modes[0]))
    except np.linalg.LinAlgError:
        return None
    return View(
        chosen.values, covariance, samples, weights, shown, model.middle_px, model.t0_s, problem.weaker, rows_along_x,
        modes[0].values,
    )  # fmt: skip


def out_of_the_ordinary(view: View) -> dict[str, float]:
    """Of the effects that a clip shows those that hardly any camera has, as `View.camera` names them: what the clip shows may be
    something else."""
    names = [name for group in view.shown for name in GROUPS[group]]
    odd = {n for n in names if n in PRIOR and abs(view[n] - PRIOR[n][0]) > _ORDINARY * PRIOR[n][1]}
    return {told: value for name, (told, value) in zip(names, view.camera().items()) if name in odd}


def _names(shown: tuple[str, ...]) -> tuple[str, ...]:
    """The parameters that are free where these camera effects are in the model."""
    more = [name for group in shown for name in GROUPS[group]]
    if "tilt" in shown or "sway" in shown:
        more.append("log_nearness")
    return tuple(name for name in NAMES if name in _SQUARE or name in more)


def _turned(values: np.ndarray) -> list[np.ndarray]:
    """The same seen from four sides: mirrored views are minima of their own."""
    return _each_with(values, ("yaw", "pitch"), _TILTS)


def _swayed(values: np.ndarray) -> list[np.ndarray]:
    """The same in a plane that is turned one way or the other, or in an ellipse that is run through either way round."""
    return _each_with(values, ("sway_sin", "sway_cos"), _SWAYS)


def _each_with(values: np.ndarray, names: tuple[str, str], pairs: tuple[tuple[float, float], ...]) -> list[np.ndarray]:
    """Copies of the values, one with each of the pairs for these two."""
    copies = []
    for pair in pairs:
        copies.append(values.copy())
        copies[-1][[AT[name] for name in names]] = pair
    return copies


def _spread(least: Minimum, names: tuple[str, ...]) -> np.ndarray:
    """Covariance of all parameters, zero where held."""
    index = [AT[name] for name in names]
    whole = np.zeros((len(NAMES), len(NAMES)))
    whole[np.ix_(index, index)] = np.linalg.inv(least.normal)
    return whole


def _crossings(lines: Lines, model: View) -> np.ndarray:
    """Of the lines (9, m) what the residuals need: x and y of two places on each, σ of direction (rad) and place (px), by how
    much of the readout the lower is seen later, when, and its weight."""
    # a straight line fitted to a bent string crosses it in the two Gauss points
    reach = np.maximum(np.nan_to_num(lines.half_px, nan=1.0), 1.0) / np.sqrt(3)
    dx, dy = reach * np.sin(lines.angle_rad), reach * np.cos(lines.angle_rad)
    ends = lines.x_px - dx, lines.y_px - dy, lines.x_px + dx, lines.y_px + dy
    later = np.where(np.isfinite(lines.t_s), model.rows(*ends[2:]) - model.rows(*ends[:2]), 0.0)
    when = np.nan_to_num(lines.t_s - model.t0_s)
    return np.array([*ends, lines.sigma_rad, lines.sigma_px, later, when, np.ones_like(dx)])


class _Problem:
    """The residuals of a clip."""

    def __init__(
        self,
        model: View,
        t_s: np.ndarray,
        x: np.ndarray,
        y: np.ndarray,
        sx: np.ndarray,
        sy: np.ndarray,
        lines: Lines | None,
        pivot: tuple[float, float, float] | None,
        prior: dict[str, tuple[float, float]],
        bent_px: float = 0.0,
    ) -> None:
        self.model = model
        if lines is not None and lines.x_px.size > _MOST // 2:
            lines = lines.of(np.unique(np.linspace(0, lines.x_px.size - 1, _MOST // 2).astype(int)))
        lines = None if lines is None else lines.below_pivot()
        # all that is known, in one piece: six lists of the places, nine of the lines, three of the values tied
        tied = [(AT[name], *pair) for name, pair in prior.items()]
        if pivot is not None:
            tied += [(0, pivot[0], pivot[2]), (1, pivot[1], pivot[2])]
        self.n, self.m, self.tied = t_s.size, 0 if lines is None else lines.x_px.size, len(tied)
        places = np.array([t_s - model.t0_s, model.rows(x, y), x, y, 1 / sx, 1 / sy])
        strings = np.zeros((9, 0)) if lines is None else _crossings(lines, model)
        self.given = np.concatenate([places.ravel(), strings.ravel(), np.array(tied).T.ravel()])
        self.t, self.wx, self.wy = (self.given[k * self.n :][: self.n] for k in (0, 4, 5))
        self.line_weight = self.given[6 * self.n + 8 * self.m :][: self.m]
        self.timeless = np.arange(self.n, dtype=np.int64)
        times = np.concatenate([places[0], strings[7]])
        self.order = np.argsort(np.argsort(times, kind="stable")).astype(np.int64)
        self.turning = bool(strings[6].any())
        self.numbers = np.array([*model.middle_px, 1.0])
        self.steps = _STEPS.copy()
        self.steps[4] *= abs(model.values[4])
        self.bent = float(np.clip(bent_px * np.median(np.minimum(self.wx, self.wy)), *_BENT))

    def rest(self, v: np.ndarray, motion: np.ndarray | None = None) -> np.ndarray:
        """Positions (x then y), lines, priors, over their standard uncertainties: (r,) for v (19,), (k, r) for (k, 19). Of each set
        the number of its `motion`, (k,) int, may be given, where some share one; a number's first set brings it."""
        sets = v.reshape(-1, len(NAMES)).copy()
        many = motions = len(sets)
        if motion is None:
            motion = np.arange(many, dtype=np.int64)
        else:
            motions = int(motion.max()) + 1
        # the lower point of a line is seen later: it is turned back to when the upper one was
        order = self.order if self.turning and sets[:, 16].any() else self.timeless
        room, at, size = np.empty(2 * self.n + self.m), np.empty(LANES + motions * (9 + 3 * order.size)), order.size
        its = np.array([address(at) + 8 * LANES, address(at), size, motions, 0])
        found = np.empty((many, 2 * self.n + self.m + self.tied))
        work = kernel("rest", "toolkit.tracking.geometry._view_kernel", "the camera's view")
        call(
            work, address(sets), address(self.numbers), address(self.given), address(motion), address(order),
            address(room), address(found), many, self.n, self.m, self.tied, swing_address(), address(its),
        )  # fmt: skip
        return found if v.ndim > 1 else found[0]

    def slopes(self, v: np.ndarray, index: list[int]) -> np.ndarray:
        """d rest / d v[index], (r, len(index)): the motion is solved anew only for what moves it."""
        moving = [4 <= i <= 9 or i == 16 for i in index]
        motion = np.array([0, *np.cumsum(moving) * moving], np.int64)
        sets = np.tile(v, (len(index) + 1, 1))
        sets[range(1, len(sets)), index] += self.steps[index]
        found = self.rest(sets, motion)
        return ((found[1:] - found[0]) / self.steps[index][:, None]).T

    @property
    def weaker(self) -> float:
        """By what all data are, as their residuals are larger or less independent than their σ says."""
        return float(self.numbers[2])

    def weigh(self, inflation: float) -> None:
        """Let all data weigh as their residuals say."""
        self.numbers[2] = inflation

    def solve(self, start: np.ndarray, names: tuple[str, ...], turns: int, little: float = 0.0) -> Minimum | None:
        values = start.copy()
        for name in NAMES[10:]:
            if name not in names and name != "log_nearness":
                values[AT[name]] = 0.0
        index = [AT[n] for n in names]
        return least_squares(
            self.rest,
            values,
            self.steps,
            index,
            turns=turns,
            settled=1e-5,
            little=little,
            slopes=lambda v: self.slopes(v, index),
        )

    def modes(self, *starts: np.ndarray, deep: float = 30.0) -> list[Minimum]:
        """The minima with every effect free to which these starts lead, the deepest first, up to `deep` above it in χ²; with no
        such limit about where they are: those that count are gone to once it is known how little the data weigh."""
        little = 0.03 * self.least_inflation**2 if deep == np.inf else 0.0
        found = [m for m in (self.solve(s, NAMES, 10, little) for s in starts) if m is not None]
        apart: list[Minimum] = []
        for mode in sorted(found, key=lambda m: m.chi2):
            near = any((mode.values - m.values) @ m.normal @ (mode.values - m.values) < 4.0 for m in apart)
            if not apart or (not near and mode.chi2 < apart[0].chi2 + deep):
                apart.append(mode)
        return apart

    def along(self, mode: Minimum) -> list[Minimum]:
        """Where the valley that a mode lies in goes as the camera comes nearer or goes farther: the least with its nearness
        held. The same keystone is a large tilt from afar or a small one from near, so that the valley bends."""
        names = tuple(name for name in NAMES if name != "log_nearness")
        everything = list(range(len(NAMES)))
        found = []
        for nearness in _NEARNESSES:
            start = mode.values.copy()
            start[[AT["yaw"], AT["pitch"]]] *= np.exp(start[AT["log_nearness"]] - nearness)
            start[AT["log_nearness"]] = nearness
            least = self.solve(start, names, 10)
            if least is not None and least.chi2 < mode.chi2 + _LIKELY:
                slopes = self.slopes(least.values, everything)
                found.append(Minimum(least.values, least.rest, slopes.T @ slopes))
        return found

    def trim(self, values: np.ndarray) -> None:
        """Leave out strays, and let the lines weigh as they scatter."""
        n = self.t.size
        left = self.rest(values) * self.weaker
        size = np.hypot(left[:n], left[n : 2 * n])
        off = size > max(8.0, 6 * float(np.median(size)))
        if 0 < off.sum() < 0.1 * off.size:
            self.wx[off] = self.wy[off] = 0.0
        if self.m:
            # about the point where they meet themselves, or an arc that something else bends would outvote them
            own = values.copy()
            for _ in range(6):
                self.line_weight[:] = 1.0
                sets = own + 0.01 * np.eye(3, len(NAMES), -1)
                rest, *moved = self.rest(sets, np.zeros(3, np.int64))[:, 2 * self.n :][:, : self.m] * self.weaker
                spread = max(1.0, 1.4826 * float(np.median(np.abs(rest))))
                self.line_weight[:] = np.where(np.abs(rest) < 4 * spread, 1 / spread, 0.0)
                slopes = ((moved - rest) * self.line_weight / 0.01).T
                own[:2] -= np.linalg.lstsq(slopes, rest * self.line_weight, rcond=1e-6)[0]

    @property
    def least_inflation(self) -> float:
        """The inflation of residuals that are as large as their σ."""
        return float(np.sqrt(1.0 + self.bent**2 * self.t.size / 5))

    def inflation(self, values: np.ndarray) -> float:
        """How far the residuals exceed their σ, with their correlation from frame to frame.

        At least as if half of σ, or what the bob's looks allow if that is more, were no scatter but a bent error that returns
        with the place (a shadow's, a shading's, a pattern's that turns as often as the bob swings), such as a handful of
        points along the arc would have.
        """
        n = self.t.size
        left = self.rest(values) * self.weaker
        block = max(2, min(20, n // 12))
        whole = n // block * block
        found = self.least_inflation**2
        for r in (left[:n], left[n : 2 * n]):
            sums = r[:whole].reshape(-1, block).sum(axis=1)
            found = max(found, float(np.mean(r**2)), float(np.mean(sums**2)) / block)
        return float(np.sqrt(found))

    @np.errstate(all="ignore")  # a draw too far is told by its weight
    def sample(self, modes: list[Minimum]) -> tuple[np.ndarray, np.ndarray]:
        """Views (m, 19) with weights (m,) that stand for all that data and priors allow.

        Adaptive importance sampling: what bends the model is drawn from heavy-tailed bells, first about the minima, then
        about what the draws so far have found; what follows nearly linearly (pivot, length, motion) is put to its best for
        each draw, and scattered about it at the end.
        """
        rng = np.random.default_rng(0)
        bent = list(_BENDING)
        follows = [i for i in range(len(NAMES)) if i not in bent]
        values = modes[0].values
        jacobian = self.slopes(values, list(range(len(NAMES))))
        pull = -np.linalg.pinv(jacobian[:, follows])
        tied = pull @ jacobian[:, bent]
        bells = [_Bell(m.values[bent], np.linalg.inv(m.normal)[np.ix_(bent, bent)]) for m in modes]
        starts = [m.values for m in modes]
        draws, target, counts = np.zeros((0, len(NAMES))), np.zeros(0), []
        for turn in range(_ROUNDS):
            new = range(len(bells)) if turn == 0 else range(len(bells) - 1, len(bells))
            for k in new:
                count = _SAMPLES // len(new)
                v = np.tile(starts[min(k, len(starts) - 1)], (count, 1))
                v[:, bent] = bells[k].draw(rng, count)
                v[:, follows] += (v[:, bent] - starts[min(k, len(starts) - 1)][bent]) @ tied.T
                v[:, follows] += self.rest(v) @ pull.T
                left = self.rest(v)
                step = left @ pull.T
                v[:, follows] += step
                left += step @ jacobian[:, follows].T  # so short a step is a straight one
                draws = np.concatenate([draws, v])
                target = np.concatenate([target, -0.5 * np.sum(left**2, axis=1)])
                counts.append(count)
            target = np.where(np.isfinite(target), target, -np.inf)
            shares = np.log(np.array(counts)[:, None]) + np.array([b.log_density(draws[:, bent]) for b in bells])
            log_weight = target - np.logaddexp.reduce(shares, axis=0)
            if not np.isfinite(log_weight.max()):
                raise np.linalg.LinAlgError("no draw lies where the data allow one")
            weight = np.exp(log_weight - log_weight.max())
            if turn and 1 / np.sum((weight / weight.sum()) ** 2) > _ENOUGH:
                break
            soft, power = weight / weight.sum(), 1.0
            while 1 / np.sum(soft**2) < 3 * len(bent) and power > 1e-4:  # too few count: those near count too
                power /= 2
                soft = np.exp(power * (log_weight - log_weight.max()))
                soft /= soft.sum()
            middle = soft @ draws
            off = (draws - middle)[:, bent]
            spread = (off * soft[:, None]).T @ off
            bells.append(_Bell(middle[bent], spread))
            starts.append(middle)
        weight /= weight.sum()
        keep = weight > 1e-4
        v, weight = draws[keep], weight[keep] / weight[keep].sum()
        normal = modes[0].normal[np.ix_(follows, follows)]
        v[:, follows] += rng.multivariate_normal(
            np.zeros(len(follows)), np.linalg.inv(normal), len(v), check_valid="ignore"
        )
        return v, weight


class _Bell:
    """Student's t of 5 degrees of freedom about `middle` (k,) with the covariance's shape (k, k)."""

    def __init__(self, middle: np.ndarray, covariance: np.ndarray) -> None:
        self.middle = middle
        self.root = np.linalg.cholesky(covariance + 1e-9 * np.diag(np.diag(covariance)))
        self.unroot = np.linalg.inv(self.root)

    def draw(self, rng: np.random.Generator, count: int) -> np.ndarray:
        heavy = np.sqrt(5 / rng.chisquare(5, count))[:, None]
        return np.asarray(self.middle + heavy * rng.normal(size=(count, self.middle.size)) @ self.root.T)

    def log_density(self, places: np.ndarray) -> np.ndarray:
        size = np.sum(((places - self.middle) @ self.unroot.T) ** 2, axis=1)
        return np.asarray(-0.5 * (5 + self.middle.size) * np.log1p(size / 5) - np.sum(np.log(np.diag(self.root))))

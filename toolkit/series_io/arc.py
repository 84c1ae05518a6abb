"""θ from positions: the bob moves on a circle about the pivot; the circle gives the pivot where nobody marked it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said


@dataclass(frozen=True)
class Circle:
    """Centre, radius, their standard uncertainties and the scatter of the points about it, in the points' unit."""

    x: float
    y: float
    radius: float
    sigma_centre: float
    sigma_radius: float
    scatter: float


@dataclass(frozen=True)
class Swing:
    """θ in rad about a centre, its length in the points' unit, and what was decided."""

    theta_rad: np.ndarray
    x: float
    y: float
    length: float
    length_sigma: float
    scatter: float
    log: tuple[str, ...]
    warnings: tuple[str, ...]


def fit_circle(x: np.ndarray, y: np.ndarray) -> Circle:
    """Least-squares circle through (n,) points: Taubin's start is not needed, Gauss-Newton from Kåsa's solution.

    Raises JobError where the points do not bend (fewer than four, or all on a line).
    """
    if x.size < 4:
        raise JobError(f"{x.size} positions are too few for the arc of a pendulum; at least 4 are needed")
    x0, y0 = x.mean(), y.mean()
    u, v = x - x0, y - y0
    spread = float(np.hypot(u, v).max()) or 1.0
    u, v = u / spread, v / spread
    design = np.column_stack([2 * u, 2 * v, np.ones_like(u)])
    solution, _, rank, singular = np.linalg.lstsq(design, u * u + v * v, rcond=None)
    if rank < 3 or singular[-1] < 1e-9 * singular[0]:
        raise JobError("the positions lie on a line: the arc of a pendulum bends; check which columns are x and y")
    a, b = solution[:2]
    r = float(np.sqrt(max(solution[2] + a * a + b * b, 1e-12)))
    for _ in range(50):
        distance = np.hypot(u - a, v - b)
        jacobian = np.column_stack([-(u - a) / distance, -(v - b) / distance, -np.ones_like(u)])
        step = np.linalg.lstsq(jacobian, -(distance - r), rcond=None)[0]
        a, b, r = a + step[0], b + step[1], r + step[2]
        if np.abs(step).max() < 1e-12 * r:
            break
    distance = np.hypot(u - a, v - b)
    jacobian = np.column_stack([-(u - a) / distance, -(v - b) / distance, -np.ones_like(u)])
    scatter = float(np.sqrt(np.sum((distance - r) ** 2) / max(1, u.size - 3)))
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * scatter**2
    sigma = np.sqrt(np.abs(np.diag(covariance))) * spread
    numbers = (x0 + a * spread, y0 + b * spread, r * spread, np.hypot(*sigma[:2]), sigma[2], scatter * spread)
    return Circle(*map(float, numbers))


def swing_from_positions(
    x: np.ndarray, y_up: np.ndarray, origin: tuple[float, float] | None = None, unit: str = "px"
) -> Swing:
    """θ of a bob at (x, y_up), y upwards, NaN rows kept as NaN.

    About `origin` where the bob keeps its distance from it as well as from the fitted circle's centre, else about
    that centre. Raises JobError where the points lie on no arc about a point above them.
    """
    good = np.isfinite(x) & np.isfinite(y_up)
    log: list[str] = []
    warnings: list[str] = []
    about: tuple[float, float] | None = None
    scatter = length = length_sigma = 0.0
    circle: Circle | None
    try:
        circle = fit_circle(x[good], y_up[good])
    except JobError:
        if origin is None:
            raise
        circle = None
    if origin is not None:
        distance = np.hypot(x[good] - origin[0], y_up[good] - origin[1])
        length, scatter = float(distance.mean()), float(distance.std())
        if circle is None or scatter <= 1.6 * circle.scatter or circle.sigma_radius > 0.1 * circle.radius:
            about = origin
            apart = 0.0 if circle is None else abs(circle.radius - length)
            length_sigma = max(
                scatter / np.sqrt(good.sum()), apart if circle and circle.sigma_radius < 0.1 * circle.radius else 0.0
            )
            log.append(
                said(
                    "arc.origin",
                    "θ was taken about the origin of the coordinates; the bob's distance from it is {length:.4g} {unit} (rms "
                    "scatter {scatter:.2g}).",
                    length=length,
                    unit=unit,
                    scatter=scatter,
                )
            )
            if circle and length_sigma > 0.02 * length:
                warnings.append(
                    said(
                        "arc.disagrees",
                        "The arc's own centre gives a length of {radius:.4g} {unit} instead of {length:.4g}: check the origin, "
                        "tilt and distortion.",
                        radius=circle.radius,
                        unit=unit,
                        length=length,
                    )
                )
        else:
            warnings.append(
                said(
                    "arc.not_the_pivot",
                    "The origin of the coordinates is not the pivot (the distance from it varies by {scatter:.2g} {unit}); the "
                    "centre of the arc was taken.",
                    scatter=scatter,
                    unit=unit,
                )
            )
    if about is None:
        assert circle is not None
        about, length, length_sigma, scatter = (circle.x, circle.y), circle.radius, circle.sigma_radius, circle.scatter
        log.append(
            said(
                "arc.centre",
                "The pivot is the centre of a circle fitted to the positions: radius {radius:.5g} ± {radius_u:.2g} {unit}, rms "
                "scatter {scatter:.2g} {unit}.",
                radius=length,
                radius_u=length_sigma,
                unit=unit,
                scatter=scatter,
            )
        )
        if length_sigma > 0.1 * length:
            short = "The arc is too short to place the pivot well (radius ± {share:.0%}): all angles share that uncertainty."
            warnings.append(said("arc.short", short, share=length_sigma / length))
    if np.median(y_up[good]) > about[1]:
        raise JobError(
            "the bob hangs above its pivot in these positions; the vertical axis seems to point down: check the axes"
        )
    theta = np.arctan2(x - about[0], about[1] - y_up)
    theta[good] = np.unwrap(theta[good])
    return Swing(theta, about[0], about[1], length, length_sigma, scatter, tuple(log), tuple(warnings))

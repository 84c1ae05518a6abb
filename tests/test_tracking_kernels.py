"""The compiled loops of tracking: against plain NumPy and SciPy, on pictures laid out in any order, and without Numba once warm."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.ndimage import gaussian_filter, map_coordinates

from toolkit.motion.compiled import keeps_objects
from toolkit.tracking.begin.search import _edges
from toolkit.tracking.geometry.swing import Swing, solve_swing
from toolkit.tracking.geometry.view import NAMES, View
from toolkit.tracking.geometry.view_fit import Lines, _Problem
from toolkit.tracking.picture.background import Background
from toolkit.tracking.picture.plane import shrink
from toolkit.tracking.picture.repeat import alike
from toolkit.tracking.picture.stillness import Anchors
from toolkit.tracking.picture.string_line import measure_string
from toolkit.video import Frame

ROOT = Path(__file__).parents[1]


def test_motions_solved_at_once_are_those_that_scipy_finds():
    rng = np.random.default_rng(1)
    motions = np.array([0, 0, 500, 0, 18, 0.05, 0.1, 0.6, 0.3]) * rng.uniform(0.8, 1.2, (3, 9))
    t = np.sort(rng.uniform(0, 3, (3, 40)), axis=1)
    found = solve_swing(motions, t)
    for motion, times, (theta, rate) in zip(motions, t, found, strict=True):
        w2, gamma, beta = motion[4:7]

        def law(_: float, y: np.ndarray, w2=w2, gamma=gamma, beta=beta) -> list[float]:
            return [y[1], -w2 * np.sin(y[0]) - (2 * gamma + beta * abs(y[1])) * y[1]]

        truth = solve_ivp(law, (0, 3), motion[7:], t_eval=times, rtol=1e-10, atol=1e-12).y
        np.testing.assert_allclose([theta, rate], truth, atol=2e-5)
    np.testing.assert_array_equal(solve_swing(motions[1], t[1]), found[1])


def test_a_motion_that_no_frames_could_tell_is_no_number_and_takes_no_time():
    """A fit on its way nowhere may ask for one of a million turns a second: minutes, step by step."""
    ordinary = np.array([0, 0, 500, 0, 18, 0.05, 0.1, 0.6, 0.3])
    mad = np.array([[*ordinary[:8], 1e9], [*ordinary[:4], 1e17, *ordinary[5:]], [*ordinary[:8], np.inf]])
    t = np.linspace(0, 4, 200)
    first, *others = solve_swing(np.array([ordinary, *mad]), np.tile(t, (4, 1)))
    np.testing.assert_array_equal(first, solve_swing(ordinary, t))
    assert np.isfinite(first).all()
    assert np.isnan(others).all()
    hour = solve_swing(ordinary, np.arange(0, 3600, 0.5))
    assert np.isfinite(hour).all()


def test_a_swing_knows_its_acceleration_and_the_mean_place_over_an_exposure():
    swing = Swing(np.array([400.0, 20, 500, 0.02, 39, 0, 0, 1.1, 0.4]), np.zeros((9, 9)), 0.0, 0.0)
    t, exposure_s = np.linspace(0, 1.5, 20), 0.015
    instants = exposure_s * ((np.arange(400) + 0.5) / 400 - 0.5)
    mean = np.array([[p.mean() for p in swing.position(s + instants)] for s in t]).T
    off = swing.over_exposure(t, exposure_s)
    np.testing.assert_allclose(np.array(swing.position(t)) + off, mean, atol=2e-3)
    assert np.hypot(*off).max() > 0.1
    step = 1e-3
    back, at, forth = (np.array(swing.position(t + k * step)) for k in (-1, 0, 1))
    told = [
        swing.acceleration_at(*place, *speed)
        for place, speed in zip(at.T, np.transpose(swing.velocity(t)), strict=True)
    ]
    np.testing.assert_allclose(np.transpose(told), (forth - 2 * at + back) / step**2, atol=30.0)  # of 20 000 px/s²


def test_more_motions_than_are_integrated_side_by_side_and_a_few_times():
    rng = np.random.default_rng(7)
    motions = np.array([0, 0, 500, 0, 18, 0.05, 0.1, 2.9, 0.3]) * rng.uniform(0.9, 1.1, (11, 9))
    t = np.sort(rng.uniform(-1, 9, (11, 30)), axis=1)
    for motion, times, both in zip(motions, t, solve_swing(motions, t), strict=True):
        np.testing.assert_array_equal(solve_swing(motion, times), both)
        swing = Swing(motion, np.zeros((9, 9)), 0.25, 0.0)
        np.testing.assert_array_equal(swing.angles_at([*times[:3] + 0.25]), swing.angle(times[:3] + 0.25))


def _view(k1: float, readout: float = 0.0) -> View:
    values = {"pivot_x": 640, "pivot_y": 60, "length": 550, "vertical": 0.02, "omega2": 17.8, "factor": 1.01, "yaw": 0.12,
              "pitch": -0.07, "log_nearness": -0.7, "k1": k1, "sway_sin": 0.03, "sway_cos": -0.02, "readout": readout}  # fmt: skip
    v = np.array([values.get(name, 0.0) for name in NAMES], float)
    return View(v, np.zeros(0), np.zeros(0), np.zeros(0), (), (639.5, 359.5), 0.0, 1.0)


def test_a_camera_shows_what_its_geometry_says():
    view, t = _view(0.03), np.linspace(0, 20, 77)
    theta = 0.9 * np.cos(4.1 * t)
    sway = 0.03 * np.sin(np.sqrt(17.8) * t) - 0.02 * np.cos(np.sqrt(17.8) * t)
    bob = 550 * np.array([np.cos(sway) * np.sin(theta + 0.02), np.cos(sway) * np.cos(theta + 0.02), np.sin(sway)])
    (cy, sy), (cp, sp) = ((np.cos(a), np.sin(a)) for a in (0.12, -0.07))
    x, y, z = np.array([[1, 0, 0], [0, cp, sp], [0, -sp, cp]]) @ np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ bob
    near = 1 + np.exp(-0.7) / (2 * 639.5) * z
    x, y = (640 - 639.5 + x) / near, (60 - 359.5 + y) / near
    grow = 1 + 0.03 * (x**2 + y**2) / (639.5**2 + 359.5**2)
    seen = view.see(view.values, theta, t)
    np.testing.assert_allclose(seen, [639.5 + x * grow, 359.5 + y * grow], atol=1e-9)
    several = view.see(
        np.stack([view.values, _view(0.0).values])[..., None].swapaxes(0, 1), np.stack([theta, theta]), t
    )
    np.testing.assert_array_equal(np.array(several)[:, 0], seen)
    np.testing.assert_allclose(view.straight(view.values, *seen), [639.5 + x, 359.5 + y], atol=1e-3)


def _residuals(view: View, t: np.ndarray, places: tuple[np.ndarray, ...], lines: Lines | None) -> _Problem:
    return _Problem(view, t, *places, lines, (641.0, 58.0, 2.0), {"yaw": (0.1, 0.2)})


def test_residuals_are_what_places_and_lines_miss_over_their_uncertainties():
    view, rng = _view(0.0, readout=0.01), np.random.default_rng(8)
    v, t, when = view.values.copy(), np.sort(rng.uniform(0, 3, 20)), np.sort(rng.uniform(0, 3, 25))
    v[7:9] = 0.3, 0.2
    x, y, half = rng.uniform(300, 900, 20), rng.uniform(300, 700, 20), rng.uniform(50, 150, 25)
    sx, sy = rng.uniform(0.05, 0.2, (2, 20))
    direction, place, angle = rng.uniform(1e-3, 1e-2, 25), rng.uniform(0.1, 1, 25), rng.normal(0, 0.3, 25)
    points = rng.uniform(100, 700, (2, 25))
    problem = _residuals(view, t, (x, y, sx, sy), Lines(*points, angle, direction, place, half, when))
    problem.weigh(3.0)

    motion = v[:9] * [1, 1, 1, 1, 1, 1, 1, 1 / 1.01, 1 / 1.01]
    late = t + 0.01 * view.rows(x, y)
    px, py = view.see(v, 1.01 * solve_swing(motion, late)[0], late)
    reach = half / np.sqrt(3) * np.array([np.sin(angle), np.cos(angle)])
    pivot, a, b = np.array([[640.0], [60.0]]), points - reach, points + reach - [[640.0], [60.0]]
    turn = 1.01 * 0.01 * solve_swing(motion, when)[1] * 2 * reach[1] / (2 * 359.5)
    b = pivot + np.array([b[0] - turn * b[1], b[1] + turn * b[0]])
    along = (b - a) / np.linalg.norm(b - a, axis=0)
    away = along[1] * (pivot - a)[0] - along[0] * (pivot - a)[1]
    missed = away / np.sqrt((direction * np.linalg.norm(pivot - (a + b) / 2, axis=0)) ** 2 + place**2)
    expected = np.concatenate([(px - x) / sx / 3, (py - y) / sy / 3, missed / 3, [0.02 / 0.2, -1 / 2, 2 / 2]])
    np.testing.assert_allclose(problem.rest(v), expected, rtol=1e-4, atol=1e-4)

    several = np.stack([v, _view(0.03).values, v])
    np.testing.assert_allclose(problem.rest(several)[2], expected, rtol=1e-4, atol=1e-4)
    without = _residuals(view, t, (x, y, sx, sy), None).rest(v)
    np.testing.assert_allclose(without, np.concatenate([3 * expected[:40], expected[-3:]]), rtol=1e-4, atol=1e-4)


def test_slopes_are_differences_of_residuals():
    view, rng = _view(0.02, readout=0.01), np.random.default_rng(3)
    v, t = view.values.copy(), np.sort(rng.uniform(0, 3, 20))
    v[7:9] = 0.3, 0.2
    lines = Lines(*rng.uniform(100, 700, (2, 9)), *rng.uniform(0.01, 0.1, (3, 9)), np.full(9, 90.0), t[:9])
    problem = _residuals(view, t, tuple(rng.uniform(1, 700, (4, 20))), lines)
    found = problem.slopes(v, list(range(len(NAMES))))
    for i in range(len(NAMES)):
        step = np.eye(len(NAMES))[i] * 20 * problem.steps[i]
        expected = (problem.rest(v + step) - problem.rest(v - step)) / (40 * problem.steps[i])
        np.testing.assert_allclose(found[:, i], expected, rtol=1e-2, atol=1e-3 * np.abs(expected).max())


def test_pictures_alike_but_for_one_pixel_between_the_rows_looked_at_first():
    rng = np.random.default_rng(9)
    luma = rng.integers(20, 230, (300, 400)).astype(np.uint8)
    rounded, other, far = luma + 1, luma.copy(), luma.copy()
    other[20, 36] += 9
    far[4, 4] += 9
    one = Frame(0, 0.0, luma, lambda _: None)
    told = [alike(one, Frame(1, 0.1, picture, lambda _: None)) for picture in (luma, rounded, other, far)]
    assert told == [True, True, False, False]


def test_background_is_the_mean_of_what_neither_bob_nor_string_hides():
    rng = np.random.default_rng(2)
    back = Background((90, 120))
    total, count = np.zeros((90, 120)), np.zeros((90, 120))
    pivot, radius = (60.0, -200.0), 9.0
    for _ in range(12):
        x, y = rng.uniform(20, 100), rng.uniform(40, 70)
        x0, y0, x1, y1 = 3, 5, 117, 88
        piece = rng.uniform(0, 255, (y1 - y0, x1 - x0)).astype(np.float32)
        back.add(piece, (x0, y0, x1, y1), (x, y, radius), pivot, gain=1.25)
        rows, columns = np.mgrid[y0:y1, x0:x1]
        way = np.array([pivot[0] - x, pivot[1] - y]) / np.hypot(pivot[0] - x, pivot[1] - y)
        along = (columns - x) * way[0] + (rows - y) * way[1]
        across = np.abs((columns - x) * way[1] - (rows - y) * way[0])
        beside = across < 4 + 0.25 * np.maximum(0, 2 * radius - along)
        open_ = ~((np.hypot(columns - x, rows - y) < radius) | ((along > 0) & beside))
        total[y0:y1, x0:x1] += np.where(open_, piece / 1.25, 0)
        count[y0:y1, x0:x1] += open_
    np.testing.assert_array_equal(back.seen, count)
    np.testing.assert_allclose(back.mean, total / np.maximum(count, 1), atol=1e-3)


def test_many_pictures_taken_in_at_once_are_those_taken_in_one_by_one():
    rng = np.random.default_rng(8)
    one, other, box, pivot = Background((90, 120)), Background((90, 120)), (8, 5, 110, 88), (60.0, -200.0)
    pictures = list(rng.integers(0, 256, (12, 90, 120), dtype=np.uint8))
    shifts = [(int(dx), int(dy)) for dx, dy in rng.integers(-12, 13, (12, 2))]
    bobs = [(float(x), float(y), 9.0) for x, y in rng.uniform(20, 80, (12, 2))]
    for picture, (dx, dy), bob in zip(pictures, shifts, bobs, strict=True):
        a, b, c, d = max(8, -dx), max(5, -dy), min(110, 120 - dx), min(88, 90 - dy)
        one.add(picture[b + dy : d + dy, a + dx : c + dx].astype(np.float32), (a, b, c, d), bob, pivot)
    other.add_all(pictures, shifts, box, bobs, pivot)
    assert one.seen.max() == 12
    np.testing.assert_array_equal(other.seen, one.seen)
    np.testing.assert_allclose(other.mean, one.mean, atol=1e-3)


@pytest.mark.parametrize("factor", [2, 3, 5])
def test_a_small_picture_is_the_mean_of_squares(factor: int):
    picture = np.random.default_rng(9).integers(0, 256, (47, 73), dtype=np.uint8)
    rows, columns = 47 // factor, 73 // factor
    squares = picture[: rows * factor, : columns * factor].reshape(rows, factor, columns, factor)
    for same in (picture, np.asfortranarray(picture)):
        assert np.abs(shrink(same, factor) - squares.mean(axis=(1, 3))).max() <= 0.5 + 1e-4


def test_edges_are_where_the_picture_is_steep():
    cv2 = pytest.importorskip("cv2")
    picture = gaussian_filter(np.random.default_rng(10).normal(100, 60, (40, 55)), 1.0).astype(np.float32)
    gx, gy = (cv2.Sobel(picture, cv2.CV_32F, *way, scale=0.125) for way in ((1, 0), (0, 1)))
    slope = np.hypot(gx, gy)
    columns, rows, nx, ny, size = _edges(picture, np.arange(picture.size), 4.0)
    found = np.zeros(picture.shape, bool)
    found[rows.astype(int), columns.astype(int)] = True
    np.testing.assert_array_equal(found, slope > 4.0)
    np.testing.assert_allclose([nx * size, ny * size, size], [gx[found], gy[found], slope[found]], atol=1e-3)


@pytest.mark.parametrize("turns", range(4))
def test_pictures_turned_without_a_copy_give_what_their_copies_give(turns: int):
    rng = np.random.default_rng(3)
    wall = gaussian_filter(rng.normal(0, 1, (260, 260)), 2.0)
    wall = 128 + 40 * wall / wall.std()
    rows, columns = np.mgrid[0:240, 0:240].astype(float)
    still, moved = (
        map_coordinates(wall, [rows + 10 - d[1], columns + 10 - d[0]], order=3) for d in ((0, 0), (0.6, -0.35))
    )
    string = 60 * np.exp(-((columns - 120 - 0.1 * (rows - 230)) ** 2) / 4)
    first, second, line = (np.rot90(np.clip(p, 0, 255).astype(np.uint8), turns) for p in (still, moved, 180 - string))
    assert turns == 0 or not first.flags.c_contiguous

    anchors = Anchors(first, np.zeros(first.shape, bool))
    shift = anchors.shift(second)
    again = Anchors(first.copy(), np.zeros(first.shape, bool)).shift(second.copy())
    turned = np.linalg.matrix_power([[0, 1], [-1, 0]], turns) @ [0.6, -0.35]
    assert shift is not None
    assert shift == again
    np.testing.assert_allclose(shift[:2], turned, atol=0.03)

    def at(x: float, y: float) -> tuple[float, float]:
        for _ in range(turns):
            x, y = y, 239 - x
        return x, y

    found = measure_string(line, at(120.0, 230.0), at(101.0, 20.0), 12.0)
    assert found is not None
    assert found == measure_string(line.copy(), at(120.0, 230.0), at(101.0, 20.0), 12.0)
    ux, uy = np.subtract(at(120.0 - 0.1 * 230, 0.0), at(120.0, 230.0))
    assert abs(np.angle(np.exp(1j * (found.angle_rad - np.arctan2(-ux, -uy))))) < 2e-3


@pytest.mark.skipif(not keeps_objects, reason="here Numba's own cache is used")
def test_a_process_that_finds_all_compiled_tracks_without_numba():
    film = ROOT / "data" / "samples" / "pendulum.mp4"
    code = f"import sys; from toolkit import track; track({str(film)!r}, stop_s=2.0); print('numba' in sys.modules)"
    said = [
        subprocess.run(
            [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.strip()
        for _ in range(2)
    ]
    assert said[1] == "False"

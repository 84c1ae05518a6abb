"""The compiled loops of tracking: against plain NumPy and SciPy, on pictures laid out in any order, and without Numba once warm."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.ndimage import gaussian_filter, map_coordinates

from toolkit.motion.compiled import keeps_objects
from toolkit.tracking.background import Background
from toolkit.tracking.stillness import Anchors
from toolkit.tracking.string_line import measure_string
from toolkit.tracking.swing import solve_swing

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

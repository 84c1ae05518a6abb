"""One contract for all localisers, on discs drawn by plain supersampling."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import UsageError
from toolkit.trackers import load_tracker, tracker_names
from toolkit.trackers.localiser import Guess, Look, Patch

WALL, BOB, RADIUS, NOISE = 180.0, 60.0, 14.0, 2.0
# rms error allowed, px, on a plain disc with noise; the bound for such a disc is 0.005
ALLOWED = {"disc": 0.012, "edge": 0.02, "colour_moments": 0.03, "template": 0.06, "background": 0.2}


def draw(cx, cy, streak=(0.0, 0.0), size=56, over=8, rng=None):
    """A dark disc on a level wall, 8×8 samples a pixel, smeared along `streak`."""
    fine = (np.arange(size * over) + 0.5) / over - 0.5
    share = np.zeros((size, size))
    steps = np.linspace(-0.5, 0.5, 1 if streak == (0.0, 0.0) else 41)
    for u in steps:
        inside = (fine[None, :] - cx - u * streak[0]) ** 2 + (fine[:, None] - cy - u * streak[1]) ** 2 < RADIUS**2
        share += inside.reshape(size, over, size, over).mean(axis=(1, 3)) / steps.size
    image = WALL + (BOB - WALL) * share
    return (image + (0 if rng is None else rng.normal(0, NOISE, image.shape))).astype(np.float32)


def patch_of(image):
    return Patch(image, np.full_like(image, WALL), np.full_like(image, 40.0), 300, 500)


LOOK = Look(RADIUS, 0.32, BOB - WALL, NOISE)


def test_every_localiser_has_an_allowance():
    assert set(tracker_names()) == set(ALLOWED)


@pytest.mark.parametrize("name", tracker_names())
def test_finds_a_plain_disc(name):
    rng = np.random.default_rng(1)
    localiser = load_tracker(name)
    assert localiser.name == name
    assert localiser.summary
    errors, sigmas = [], []
    for _ in range(30):
        x, y = 28 + rng.uniform(-2, 2, 2)
        guess = Guess(300 + x + rng.uniform(-0.5, 0.5), 500 + y + rng.uniform(-0.5, 0.5))
        place = localiser.locate(patch_of(draw(x, y, rng=rng)), LOOK, guess)
        errors.append((place.x_px - 300 - x, place.y_px - 500 - y))
        sigmas.append((place.sigma_x_px, place.sigma_y_px))
        assert place.visible > 0.9
        assert place.contrast == pytest.approx(BOB - WALL, rel=0.1)
    assert np.sqrt(np.mean(np.square(errors))) < ALLOWED[name]
    assert np.all(np.array(sigmas) > 0)


@pytest.mark.parametrize("name", tracker_names())
def test_finds_nothing_on_a_bare_wall(name):
    rng = np.random.default_rng(2)
    wall = (WALL + rng.normal(0, NOISE, (56, 56))).astype(np.float32)
    place = load_tracker(name).locate(patch_of(wall), LOOK, Guess(328, 528))
    assert not np.isfinite(place.x_px) or abs(place.contrast) < 0.3 * abs(LOOK.contrast) or place.visible < 0.5


def test_disc_error_bars_are_true_and_blur_is_modelled():
    rng = np.random.default_rng(3)
    locate = load_tracker("disc").locate
    for streak in [(0.0, 0.0), (8.0, 3.0)]:
        pulls = []
        for _ in range(40):
            x, y = 28 + rng.uniform(-1, 1, 2)
            place = locate(patch_of(draw(x, y, streak, rng=rng)), LOOK, Guess(300 + x, 500 + y, *streak))
            pulls += [(place.x_px - 300 - x) / place.sigma_x_px, (place.y_px - 500 - y) / place.sigma_y_px]
        assert 0.7 < np.std(pulls) < 1.3
        assert abs(np.mean(pulls)) < 0.4


def test_a_half_hidden_bob_is_said_to_be():
    image = draw(28.0, 28.0)
    image[:, 30:] = 110.0
    place = load_tracker("disc").locate(patch_of(image), LOOK, Guess(328, 528))
    assert not np.isfinite(place.x_px) or place.visible < 0.85


def test_unknown_localiser():
    with pytest.raises(UsageError, match="disc"):
        load_tracker("disk")


def blurred_disc(cx, cy, sigma, size=56):
    """A disc whose edge is a normal distribution's integral."""
    from scipy.special import erf

    rows, columns = np.mgrid[:size, :size]
    share = 0.5 + 0.5 * erf((RADIUS - np.hypot(columns - cx, rows - cy)) / (sigma * np.sqrt(2)))
    return (WALL + (BOB - WALL) * share).astype(np.float32)


def test_disc_fit_reaches_the_bound():
    """Cramér–Rao for a disc, its edge's normal profile and independent noise: σ_x = (σ/C) √(2 s/(√π R))."""
    rng = np.random.default_rng(4)
    sigma = 0.8
    bound = NOISE / abs(BOB - WALL) * np.sqrt(2 * sigma / (np.sqrt(np.pi) * RADIUS))
    locate = load_tracker("disc").locate
    look = Look(RADIUS, sigma, BOB - WALL, NOISE)
    errors = {True: [], False: []}
    for _ in range(150):
        x, y = 28 + rng.uniform(-1, 1, 2)
        image = blurred_disc(x, y, sigma) + rng.normal(0, NOISE, (56, 56)).astype(np.float32)
        patch = patch_of(image)._replace(seen=np.full_like(image, 1e6))
        for even, found in errors.items():
            place = locate(patch, look._replace(even=even), Guess(300 + x + 0.2, 500 + y - 0.2))
            found += [place.x_px - 300 - x, place.y_px - 500 - y]
    rms = {even: np.sqrt(np.mean(np.square(found))) for even, found in errors.items()}
    assert 0.9 * bound < rms[True] < 1.25 * bound
    assert rms[True] < rms[False] < 1.3 * bound  # the outline alone takes a slope of the shade for a move


def test_what_is_drawn_on_the_bob_does_not_count_where_it_is_not_even():
    image = blurred_disc(28.0, 28.0, 0.8)
    image[22:31, 28:35] += 20.0  # a highlight off the middle, too weak to be told from noise pixel by pixel
    errors = []
    for even in (True, False):
        place = load_tracker("disc").locate(
            patch_of(image), Look(RADIUS, 0.8, BOB - WALL, NOISE, even=even), Guess(328, 528)
        )
        errors.append(abs(place.x_px - 328) + abs(place.y_px - 528))
    assert errors[1] < 0.002 < errors[0]


@pytest.mark.parametrize("streak", [(0.0, 0.0), (6.0, 2.0)])
def test_cover_is_the_mean_of_discs_along_the_streak(streak):
    """What the kernel says is covered, and how that grows with the radius, against an average over many instants."""
    from scipy.special import erf

    from toolkit.trackers._disc_kernel import H_PER_SIGMA, cover

    sigma = 0.9
    y, x = (a.ravel().astype(float) for a in np.mgrid[:56, :56])
    lists = [np.zeros(x.size) for _ in range(7)]
    share, rise = lists[:2]
    cover(x, y, np.array([28.3, 27.6, RADIUS, sigma * H_PER_SIGMA]), np.array(streak), *lists)

    def mean_share(radius):
        along = (np.arange(200) + 0.5) / 200 - 0.5
        return np.mean(
            [
                0.5
                + 0.5 * erf((radius - np.hypot(x - 28.3 - u * streak[0], y - 27.6 - u * streak[1])) / (sigma * 2**0.5))
                for u in along
            ],
            axis=0,
        )

    assert np.abs(share - mean_share(RADIUS)).max() < 0.004
    assert np.abs(rise - (mean_share(RADIUS + 1e-3) - mean_share(RADIUS - 1e-3)) / 2e-3).max() < 0.02

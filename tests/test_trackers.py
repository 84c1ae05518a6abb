"""One contract for all localisers, on discs drawn by plain supersampling."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import UsageError
from toolkit.trackers import load_tracker, tracker_names
from toolkit.trackers.disc import fit_disc
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


@pytest.mark.parametrize("length", [20.0, 34.0, 62.0])
def test_a_streak_is_found_from_far_along_it_and_its_error_bar_is_true(length):
    # the ends of a streak longer than the bob look another way than its outline seen from the streak's middle
    streak, off, seen = (length, 0.1 * length), [], []
    still = draw(70.0, 70.0, streak, size=140)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        patch = patch_of((still + rng.normal(0, NOISE, still.shape)).astype(np.float32))
        aside = 5.0 if seed % 2 else -5.0
        place = load_tracker("disc").locate(patch, LOOK, Guess(370.0 + aside, 570.0 + 0.1 * aside, *streak))
        off.append((place.x_px - 370) / place.sigma_x_px)
        seen.append(place.visible)
    assert min(seen) > 0.9
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.7


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


@pytest.mark.parametrize("soften", [1.0, 2.5])
@pytest.mark.parametrize("brighter", [True, False])
def test_a_disc_of_which_no_shade_and_no_noise_is_known_is_found_from_afar(brighter, soften):
    dark = blurred_disc(28.0, 28.0, 0.8)
    image = (2 * WALL - dark if brighter else dark) + np.random.default_rng(2).normal(0, NOISE, dark.shape)
    for off_x, off_y in ((0.5, -0.3), (-1.5, 1.0), (1.2 * soften, 1.2 * soften)):
        fit = fit_disc(
            patch_of(image.astype(np.float32)),
            Look(RADIUS, 0.8),
            Guess(328 + off_x, 528 + off_y),
            turns=12,
            soften=soften,
        )
        assert fit is not None
        assert np.hypot(fit[0] - 28, fit[1] - 28) < 0.1
        assert fit[9] == pytest.approx(WALL - BOB if brighter else BOB - WALL, rel=0.2)


@pytest.mark.parametrize("streak", [(0.0, 0.0), (6.0, 2.0), (11.0, -4.0)])
def test_the_disc_model_is_the_mean_of_discs_along_the_streak(streak):
    """Without noise, the fit of a disc averaged over many instants leaves next to nothing, and finds its radius and edge."""

    sigma = 0.9
    instants = (np.arange(200) + 0.5) / 200 - 0.5
    image = np.mean([blurred_disc(28.3 + u * streak[0], 27.6 + u * streak[1], sigma) for u in instants], axis=0)
    look = Look(RADIUS * 1.03, sigma * 1.1, BOB - WALL, 0.1)
    out = fit_disc(patch_of(image), look, Guess(328.4, 527.4, *streak), calibrate=True, turns=12)
    x, y, radius, edge, _, _, _, misfit, visible, contrast, gain, *_ = out
    np.testing.assert_allclose((x, y), (28.3, 27.6), atol=1e-3)
    np.testing.assert_allclose((radius, edge), (RADIUS, sigma), rtol=0.02)
    np.testing.assert_allclose((contrast, gain), (BOB - WALL, 1.0), rtol=2e-3)
    assert misfit < 0.003 * abs(BOB - WALL)
    assert visible == 1.0


def test_pictures_of_any_layout_give_the_same_place():

    image = blurred_disc(28.3, 27.6, 0.9)
    patch, look, guess = patch_of(image), Look(RADIUS, 0.9, BOB - WALL, 1.0), Guess(328.4, 527.4)
    wide = np.zeros((56, 80), np.float32)
    wide[:, 10:66] = image
    expected = fit_disc(patch, look, guess)
    for other in (np.asfortranarray(image), image.astype(float), wide[:, 10:66]):
        np.testing.assert_array_equal(fit_disc(patch._replace(image=other), look, guess), expected)


def painted(cx, cy, paint, sigma=0.8, size=56, over=4):
    """A disc with a soft edge whose own brightness is paint(u, v), u and v from −1 to 1 across it, blurred as its edge is."""
    from scipy.ndimage import gaussian_filter

    at = (np.arange(size * over) + 0.5) / over - 0.5
    u, v = np.meshgrid((at - cx) / RADIUS, (at - cy) / RADIUS)
    sharp = np.where(u * u + v * v < 1, paint(u, v), WALL)
    return gaussian_filter(sharp, sigma * over).reshape(size, over, size, over).mean(axis=(1, 3)).astype(np.float32)


# what is painted, and the rms error allowed, px
PAINTS = {
    "halves": (lambda u, v: np.where(0.6 * u + 0.8 * v > 0, 40.0, 110.0), 0.07),
    "upright stripes": (lambda u, v: np.where(np.sin(11 * u + 0.5) > 0, 40.0, 110.0), 0.03),
    "stripes on a ball": (
        lambda u, v: np.where(
            np.sin(3 * np.arctan2(u, np.sqrt(np.maximum(1 - u * u - v * v, 1e-6))) + 0.7) > 0, 40.0, 110.0
        ),
        0.13,
    ),
    "spot": (lambda u, v: np.where((u - 0.35) ** 2 + (v + 0.4) ** 2 < 0.1, 130.0, 40.0), 0.05),
}


@pytest.mark.parametrize("name", PAINTS)
def test_the_outline_is_found_whatever_is_painted_on_the_bob(name):
    """The centroid of what is dark is off by up to a pixel."""
    rng = np.random.default_rng(6)
    look, (paint, allowed) = Look(RADIUS, 0.8, -100.0, NOISE, even=False), PAINTS[name]
    errors = {"edge": [], "colour_moments": []}
    for _ in range(12):
        x, y = 28 + rng.uniform(-1, 1, 2)
        image = painted(x, y, paint) + rng.normal(0, NOISE, (56, 56)).astype(np.float32)
        guess = Guess(300 + x + rng.uniform(-1, 1), 500 + y + rng.uniform(-1, 1))
        for tracker, found in errors.items():
            place = load_tracker(tracker).locate(patch_of(image), look, guess)
            found.append((place.x_px - 300 - x, place.y_px - 500 - y))
    rms = {tracker: np.sqrt(np.mean(np.square(found))) for tracker, found in errors.items()}
    assert rms["edge"] < min(allowed, 0.6 * rms["colour_moments"])


def test_what_passes_behind_a_painted_bob_is_no_noise():
    """Something dark stands behind half of it and beside it, which the background that was learned does not show."""
    rng = np.random.default_rng(8)
    look, (paint, _), errors = Look(RADIUS, 0.8, -100.0, NOISE, even=False), PAINTS["halves"], []
    for _ in range(12):
        x, y = 28 + rng.uniform(-1, 1, 2)
        bare = painted(x, y, lambda u, v: 0 * u) / WALL
        passer = np.where(np.arange(56) < x - 2, -60.0, 0.0)
        image = (painted(x, y, paint) + bare * passer + rng.normal(0, NOISE, (56, 56))).astype(np.float32)
        place = load_tracker("edge").locate(patch_of(image), look, Guess(300.4 + x, 499.7 + y))
        errors.append((place.x_px - 300 - x, place.y_px - 500 - y))
        assert place.misfit < 2 * NOISE + 0.06 * 100
    assert np.sqrt(np.mean(np.square(errors))) < 0.15


def turned(phase):
    """Three dark and three bright stripes round a ball, turned about its upright axis."""

    def paint(u, v):
        longitude = np.arctan2(u, np.sqrt(np.maximum(1 - u * u - v * v, 1e-6)))
        return np.where(np.sin(3 * longitude + phase) > 0, 40.0, 110.0)

    return paint


def test_a_striped_ball_that_turns_does_not_draw_the_outline_with_it():
    """A stripe that comes or goes at the rim is foreshortened to less than a pixel; σ must allow for what it does."""
    rng = np.random.default_rng(9)
    look, errors, pulls = Look(RADIUS, 0.8, -100.0, NOISE, even=False), [], []
    for phase in np.arange(16) * np.pi / 8:
        x, y = 28 + rng.uniform(-1, 1, 2)
        image = painted(x, y, turned(phase)) + rng.normal(0, NOISE, (56, 56)).astype(np.float32)
        place = load_tracker("edge").locate(patch_of(image), look, Guess(300.4 + x, 499.7 + y))
        errors.append((place.x_px - 300 - x, place.y_px - 500 - y))
        pulls.append((errors[-1][0] / place.sigma_x_px, errors[-1][1] / place.sigma_y_px))
    assert np.sqrt(np.mean(np.square(errors), axis=0)) == pytest.approx((0, 0), abs=0.08)
    assert np.sqrt(np.mean(np.square(pulls))) < 2.5


def test_a_striped_bob_of_a_rendered_film_is_found_on_every_phase():
    """Exact truth of the renderer, whose stripes are as sharp as its pixels; the centroid is off by a pixel."""
    from toolkit import Scene
    from toolkit.render import stage

    scene = Scene.from_dict(
        {
            "pendulum": {"mass_kg": 0.1, "length_m": 0.5, "bob_radius_m": 0.1},
            "release": {"theta0_rad": 0.3},
            "camera": {
                "width_px": 160, "height_px": 120, "fps": 10, "duration_s": 1.5, "px_per_m": 150, "pivot_px": [80.3, 20.4], "seed": 4,
                "wall": {"colour_rgb": [200, 200, 200]}, "sensor_noise": {"read_sigma": 2.0}, "string": {"width_px": 0},
                "bob_look": {"look": "rotating_pattern", "colour_rgb": [60, 60, 60], "second_rgb": [235, 235, 235],
                             "strength": 0.5, "spin_rad_per_s": 1.5},
            },
        }
    )  # fmt: skip
    film = stage(scene)
    errors = []
    for k, frame in enumerate(film.frames()):
        x, y = film.truth.x_px[k], film.truth.y_px[k]
        image = frame[:, :, 1].astype(np.float32)
        patch = Patch(image, np.full_like(image, 200.0), np.full_like(image, 40.0), 0.0, 0.0)
        look = Look(float(film.truth.radius_px[k]), 0.58, -100.0, NOISE, even=False)
        place = load_tracker("edge").locate(patch, look, Guess(x + 0.4, y - 0.3))
        errors.append((place.x_px - x, place.y_px - y))
    assert len(errors) == 15
    assert np.sqrt(np.mean(np.square(errors), axis=0)) == pytest.approx((0, 0), abs=0.12)


@pytest.mark.parametrize("name", tracker_names())
def test_the_misfit_tells_what_the_localisers_idea_of_the_bob_leaves(name):
    """On a plain disc hardly more than the noise; on a bob in halves, the halves, but for the outline fit."""
    rng = np.random.default_rng(10)
    noise = rng.normal(0, NOISE, (56, 56)).astype(np.float32)
    look = Look(RADIUS, 0.8, -100.0, NOISE)
    place = load_tracker(name).locate(patch_of(blurred_disc(28.3, 27.8, 0.8) + noise), look, Guess(328, 528))
    assert 0.3 * NOISE < place.misfit < 3.5 * NOISE
    halves = painted(28.3, 27.8, PAINTS["halves"][0]) + noise
    place = load_tracker(name).locate(patch_of(halves), look._replace(even=False), Guess(328, 528))
    if name == "edge":
        assert place.misfit < 2 * NOISE
    else:
        assert not place.misfit < 3 * NOISE  # or nothing was found


@pytest.mark.parametrize(
    ("streak", "bend"), [((30.0, 0.0), (0.0, -2.5)), ((20.0, 12.0), (3.0, 2.0)), ((0.0, 0.0), (2.0, 0.0))]
)
def test_a_streak_that_the_string_and_gravity_bend_is_found_in_the_middle_of_its_light(streak, bend):
    """Without noise, of a disc averaged over many instants of a parabola. By a straight streak it is 0.3 px off where both its sides are hidden."""
    instants = (np.arange(200) + 0.5) / 200 - 0.5
    ways = [(u * streak[0] + u * u * bend[0], u * streak[1] + u * u * bend[1]) for u in instants]
    centre = np.array([48.3, 47.6])
    image = np.mean([blurred_disc(*(centre + way), 0.9, size=96) for way in ways], axis=0)
    middle = centre + np.mean(ways, axis=0)
    look = Look(RADIUS, 0.9, BOB - WALL, 0.5)
    guess = Guess(centre[0] + 300, centre[1] + 500, *streak, bend_x_px=bend[0], bend_y_px=bend[1])
    for string_rad, faces in ((np.nan, False), (-np.pi / 2, False), (-np.pi / 2, True)):
        place = load_tracker("disc").locate(patch_of(image), look, guess._replace(string_rad=string_rad, faces=faces))
        np.testing.assert_allclose((place.x_px - 300, place.y_px - 500), middle, atol=0.03)

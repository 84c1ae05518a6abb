"""From a scene to a video, and beside it the exact truth: where the bob's light really is on every frame.

A film is staged (`stage`: the scene's camera effects make a plan), every frame is exposed to light (`expose`), developed
(`develop`: noise, gamma, whole levels) and filmed. Truth is known before the first frame is drawn.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from toolkit.camera import check_parameters, load_effect
from toolkit.camera.optics import Optics
from toolkit.camera.shoot import Patch, Shoot, View
from toolkit.errors import UsageError
from toolkit.output import whole_folder
from toolkit.progress import Progress, silent
from toolkit.scene import Scene
from toolkit.trajectory import Trajectory

_STRING_POINTS = 17
_NOISE_BANK = 1 << 22


@dataclass(frozen=True)
class Truth:
    """Where the bob is on every frame of a rendered video.

    frame : (n,) decoded frames from 0.    t_s : (n,) mid-exposure time at the bob's row, scene time; equal to the time
    stamp unless the shutter rolls, a frame repeats the one before or stamps are wrong.    theta_rad : (n,) θ then.
    x_px, y_px : (n,) the middle of the bob's light in that frame's pixels, mean over the exposure (an even bob's that
    nothing hides): a lens or a near camera shows that beside the image of the ball's centre (`camera.outline`).
    visible : (n,) fraction of the bob's light that nothing hides and the picture holds.    stamp_s : (n,) the file's time stamps.
    radius_px : (n,) the bob's mean radius.    pivot_px : (n, 2) the pivot.
    """

    frame: np.ndarray
    t_s: np.ndarray
    theta_rad: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray
    visible: np.ndarray
    stamp_s: np.ndarray
    radius_px: np.ndarray
    pivot_px: np.ndarray
    trajectory: Trajectory
    meta: dict[str, Any] = field(default_factory=dict)

    def to_csv(self, path: str | Path) -> None:
        """Write `frame,t_s,theta_rad,x_px,y_px`; numbers read back to the last bit."""
        columns = zip(self.frame, self.t_s, self.theta_rad, self.x_px, self.y_px)
        rows = (f"{int(f)},{float(t)!r},{float(th)!r},{float(x)!r},{float(y)!r}\n" for f, t, th, x, y in columns)
        Path(path).write_text("frame,t_s,theta_rad,x_px,y_px\n" + "".join(rows), encoding="utf-8")


def truth_path(video_path: str | Path) -> Path:
    """The side-car of a rendered video: NAME.truth.csv beside it."""
    video_path = Path(video_path)
    return video_path.with_name(f"{video_path.stem if video_path.suffix else video_path.name}.truth.csv")


def render(scene: Scene, video_path: str | Path, progress: Progress = silent) -> Truth:
    """Film `scene` to `video_path` (.mp4, .mov, .mkv, .avi; no suffix: a folder of PNGs) and write its truth side-car.

    Both files appear whole or not at all. The same scene gives the same frames. Raises UsageError where the scene
    has no camera, length or bob radius, or where the file's kind cannot hold the film.
    """
    from toolkit.camera.film import Film

    video_path = Path(video_path)
    if video_path.suffix and video_path.is_dir():
        raise UsageError(f"{video_path} is a folder; give a file name, or a folder's name without a suffix")
    studio = stage(scene)
    shoot, truth = studio.shoot, studio.truth
    even = bool(np.all(np.abs(truth.stamp_s * float(shoot.fps) - np.round(truth.stamp_s * float(shoot.fps))) < 1e-6))
    with whole_folder(video_path.parent) as scratch:
        with Film(scratch / video_path.name, shoot.width_px, shoot.height_px, shoot.fps, shoot.codec, even) as film:
            for i, frame in enumerate(studio.frames()):
                film.write(frame, float(truth.stamp_s[i]))
                progress("rendering", (i + 1) / truth.frame.size)
        truth.to_csv(scratch / truth_path(video_path).name)
    return truth


def stage(scene: Scene) -> Studio:
    """Everything about the film except its frames. Raises UsageError as `render` does."""
    camera = scene.camera
    if camera is None:
        raise UsageError("the scene has no [camera]; add that section to render it")
    if scene.pendulum.length_m is None or scene.pendulum.bob_radius_m is None:
        raise UsageError("rendering needs length_m and bob_radius_m; give both in [pendulum]")
    fps = exact_frame_rate(camera.fps)
    count = max(1, round(camera.duration_s * fps))
    if count > 1_000_000:
        raise UsageError(f"{count} frames are too many; shorten duration_s or lower fps in [camera]")
    times = np.arange(count) / float(fps)
    shoot = Shoot(
        width_px=camera.width_px,
        height_px=camera.height_px,
        fps=fps,
        duration_s=camera.duration_s,
        px_per_m=camera.px_per_m,
        pivot_px=camera.pivot_px,
        length_m=scene.pendulum.length_m,
        radius_m=scene.pendulum.bob_radius_m,
        omega_g_rad_per_s=math.sqrt(scene.environment.gravity_m_per_s2 / scene.pendulum.length_m),
        seed=camera.seed,
        captured_s=times,
        stamped_s=times.copy(),
    )
    for name in sorted(camera.effects):
        values = check_parameters(name, camera.effects[name])
        load_effect(name).apply(shoot, values, _chance(shoot.seed, name))
    return Studio(scene, shoot)


def exact_frame_rate(fps: float) -> Fraction:
    """The rate as a fraction; 29.97, 59.94 and the like become their exact broadcast rates, N · 1000/1001."""
    broadcast = Fraction(round(fps * 1.001) * 1000, 1001)
    if abs(fps - round(fps)) > 1e-3 and abs(float(broadcast) - fps) < 0.006:
        return broadcast
    return Fraction(fps).limit_denominator(100_000)


def _chance(seed: int, name: str, number: int = 0) -> np.random.Generator:
    return np.random.default_rng([abs(int(seed)), int(seed) < 0, zlib.crc32(name.encode()), number])


class Exposure(NamedTuple):
    """The k moments that stand for one exposure: the images of the ball's centre (k, 2), its outlines (`cover_disc`), and
    when (k,) in s."""

    centres: np.ndarray
    shapes: np.ndarray
    when: np.ndarray
    rests: np.ndarray | None


class Studio:
    """A staged film: its plan (`shoot`), its `truth`, and the frames one by one."""

    def __init__(self, scene: Scene, shoot: Shoot) -> None:
        self.shoot = shoot
        self._theta = _Motion(scene, shoot)
        self._optics = Optics(shoot, self._theta)
        self._plan_exposures()
        self._backdrop: np.ndarray | None = None
        self._falloff: np.ndarray | None = None
        self._noise: np.ndarray | None = None

    # --- the exposures and the truth -----------------------------------------------------------------------------

    def _plan_exposures(self) -> None:
        from toolkit.camera.paint import edge_sigma

        shoot = self.shoot
        self.sigma_px = edge_sigma(shoot.edge_sigma_px)
        captured, self._take = np.unique(shoot.captured_s, return_inverse=True)  # a repeated frame is one exposure
        half = shoot.exposure_s / 2
        ends = [self._optics.see(np.ones(captured.size), captured + dt)[0] for dt in (-half, 0, half)]
        paths = np.hypot(*(ends[1] - ends[0]).T) + np.hypot(*(ends[2] - ends[1]).T)
        fewest = 8 if shoot.exposure_s > 0 else 1  # at a turning point the path is short but the mean still shifts
        self.exposures: list[Exposure] = []
        rows = []
        for t, path in zip(captured, paths):
            k = max(fewest, math.ceil(path / (0.8 * self.sigma_px)))
            moments = t + shoot.exposure_s * ((np.arange(k) + 0.5) / k - 0.5)
            centres, when = self._optics.see(np.ones(k), moments)
            shapes, rests, light, radii = self._optics.outlines(centres, when)
            self.exposures.append(Exposure(centres, shapes, when, rests))
            pivot = self._optics.see(np.zeros(1), np.array([t]))[0][0]
            rows.append((t + float(shoot.row_delay_s(light[:, 1].mean())), *light.mean(axis=0), radii.mean(), *pivot))
        t_s, x, y, radius, pivot_x, pivot_y = np.array(rows)[self._take].T
        theta = self._theta(t_s)
        self._views = [
            View(
                float(captured[i]),
                float(x[j]),
                float(y[j]),
                float(radius[j]),
                float(theta[j]),
                self._place(captured[i]),
            )
            for i, j in enumerate(np.searchsorted(self._take, np.arange(captured.size)))
        ]
        visible = np.array([self._visible(i) for i in range(captured.size)])
        self.truth = Truth(
            frame=np.arange(t_s.size),
            t_s=t_s,
            theta_rad=theta,
            x_px=x,
            y_px=y,
            visible=visible[self._take],
            stamp_s=shoot.stamped_s,
            radius_px=radius,
            pivot_px=np.stack([pivot_x, pivot_y], axis=-1),
            trajectory=self._theta.trajectory,
            meta={"fps": shoot.fps, "edge_sigma_px": self.sigma_px, "exposure_s": shoot.exposure_s},
        )

    def _place(self, t_s: float) -> Callable[[np.ndarray], np.ndarray]:
        return lambda points: self._optics.shaken(np.asarray(points, dtype=float), np.asarray(t_s))

    def _visible(self, number: int) -> float:
        """Fraction of the bob's light that reaches the picture: inside it and before nothing (front patches)."""
        shoot = self.shoot
        centres, shapes, _, rests = self.exposures[number]
        reach = self._views[number].radius_px + np.ptp(centres, axis=0).max() + 5 * self.sigma_px
        view = self._views[number]
        inside = reach <= view.x_px <= shoot.width_px - 1 - reach and reach <= view.y_px <= shoot.height_px - 1 - reach
        if inside and not shoot.front:
            return 1.0
        from toolkit.camera.paint import cover_disc

        x0, y0, alpha, _ = cover_disc(centres, shapes, self.sigma_px, rests=rests)
        whole = alpha.sum()
        for patch in (patch for front in shoot.front for patch in front(view)):
            height, width = patch.alpha.shape
            top, left = max(patch.y0, y0), max(patch.x0, x0)
            bottom, right = min(patch.y0 + height, y0 + alpha.shape[0]), min(patch.x0 + width, x0 + alpha.shape[1])
            if top < bottom and left < right:
                alpha[top - y0 : bottom - y0, left - x0 : right - x0] *= (
                    1 - patch.alpha[top - patch.y0 : bottom - patch.y0, left - patch.x0 : right - patch.x0]
                )
        seen = alpha[max(-y0, 0) : max(shoot.height_px - y0, 0), max(-x0, 0) : max(shoot.width_px - x0, 0)]
        return float(seen.sum() / whole)

    # --- light ---------------------------------------------------------------------------------------------------

    def _light(self, rgb: Any) -> np.ndarray:
        """Light (0–255) that gives these display levels."""
        level = np.asarray(rgb, dtype=np.float64)
        return level if self.shoot.gamma == 1 else 255 * (np.clip(level, 0, 255) / 255) ** self.shoot.gamma

    def _wall(self) -> np.ndarray:
        """(h, w, 3) float32 light of all that stands still, drawn once."""
        if self._backdrop is None:
            shoot = self.shoot
            image = np.empty((shoot.height_px, shoot.width_px, 3), np.float32)
            image[:] = shoot.wall_rgb
            for draw in shoot.backdrop:
                draw(image)
            if shoot.blur_backdrop_px:
                import cv2

                image = cv2.GaussianBlur(image, (0, 0), shoot.blur_backdrop_px)
            self._backdrop = np.ascontiguousarray(self._light(np.clip(image, 0, 255)), dtype=np.float32)
        return self._backdrop

    def expose(self, number: int) -> np.ndarray:
        """(h, w, 3) float32: the light of exposure `number`, 0–255, without noise."""
        from toolkit.camera.paint import cover_disc, lay, lay_line

        shoot, view = self.shoot, self._views[number]
        image = self._wall().copy()
        if shoot.shake:
            image = self._warped(image, view)
        for patch in (patch for behind in shoot.behind for patch in behind(view)):
            lay(image, patch, self._light(patch.rgb))
        if shoot.string_width_px > 0:
            along, half = np.linspace(0, 1, _STRING_POINTS), shoot.exposure_s / 2
            start, middle, end = (
                self._optics.see(along, np.full(along.size, view.t_s + dt))[0] for dt in (-half, 0, half)
            )
            lay_line(image, middle, end - start, shoot.string_width_px, self.sigma_px, self._light(shoot.string_rgb))
        centres, shapes, when, rests = self.exposures[number]
        colours = None
        if (look := shoot.look) is not None:
            thetas = self._theta(when)

            def colours(u: np.ndarray, v: np.ndarray, k: int) -> np.ndarray:
                return self._light(look(u, v, float(thetas[k]), float(when[k])))

        x0, y0, alpha, light = cover_disc(centres, shapes, self.sigma_px, colours, rests)
        lay(image, Patch(x0, y0, alpha, shoot.bob_rgb), self._light(shoot.bob_rgb) if light is None else light)
        for patch in (patch for front in shoot.front for patch in front(view)):
            lay(image, patch, self._light(patch.rgb))
        return self._gained(image, view)

    def _warped(self, image: np.ndarray, view: View) -> np.ndarray:
        import cv2

        corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        origin, right, down = view.place(corners)
        matrix = np.stack([right - origin, down - origin, origin], axis=1)
        return cv2.warpAffine(
            image, matrix, (image.shape[1], image.shape[0]), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101
        )

    def _gained(self, image: np.ndarray, view: View) -> np.ndarray:
        shoot = self.shoot
        if shoot.gain:
            moments = view.t_s + shoot.row_delay_s(np.arange(shoot.height_px))
            gain = np.prod([g(moments, shoot.exposure_s) for g in shoot.gain], axis=0)
            image *= gain.astype(np.float32)[:, None, None]
        if shoot.falloff:
            if self._falloff is None:
                x, y = np.arange(shoot.width_px), np.arange(shoot.height_px)[:, None]
                self._falloff = np.prod([f(x, y) for f in shoot.falloff], axis=0).astype(np.float32)[:, :, None]
            image *= self._falloff
        return image

    def develop(self, image: np.ndarray, number: int) -> np.ndarray:
        """(h, w, 3) uint8: light with the noise of exposure `number`, encoded and rounded to whole levels."""
        import cv2

        shoot = self.shoot
        if shoot.read_sigma or shoot.shot_sigma_at_white:
            if self._noise is None:  # one long run of white noise; every exposure takes a piece from a random place
                size = max(_NOISE_BANK, 3 * image.size // 2)
                self._noise = _chance(shoot.seed, "sensor_noise").standard_normal(size, dtype=np.float32)
            start = int(_chance(shoot.seed, "sensor_noise", number + 1).integers(0, self._noise.size - image.size))
            noise = self._noise[start : start + image.size].reshape(image.shape)
            if shoot.shot_sigma_at_white:
                spread = cv2.sqrt(np.maximum(image * (shoot.shot_sigma_at_white**2 / 255) + shoot.read_sigma**2, 0))
                noise = cv2.multiply(noise, spread)
            else:
                noise = cv2.multiply(noise, (shoot.read_sigma,) * 4)
        else:
            noise = None
        if shoot.gamma == 1:
            return cv2.add(image, np.zeros_like(image) if noise is None else noise, dtype=cv2.CV_8U)
        light = image if noise is None else cv2.add(image, noise)
        table = 255 * (np.arange(4096) / 4095) ** (1 / shoot.gamma)
        at = np.clip(light * np.float32(4095 / 255), 0, 4095)
        return np.round(table)[np.round(at).astype(np.uint16)].astype(np.uint8)

    def frames(self) -> Iterator[np.ndarray]:
        """Every frame of the film, (h, w, 3) uint8, red green blue."""
        last, frame = -1, np.empty(0)
        for number in self._take:
            if number != last:
                frame, last = self.develop(self.expose(int(number)), int(number)), number
            yield frame


class _Motion:
    """θ at any time from samples with θ̇: cubic Hermite, which at four samples a frame is good to 1e-9 rad."""

    def __init__(self, scene: Scene, shoot: Shoot) -> None:
        from toolkit.simulate import simulate

        self.step_s = 1 / max(4 * float(shoot.fps), 60 * shoot.omega_g_rad_per_s)
        last = float(shoot.captured_s.max()) + shoot.exposure_s + abs(shoot.readout_s)
        self.trajectory = simulate(scene, np.arange(math.ceil(last / self.step_s) + 2) * self.step_s)

    def __call__(self, t_s: np.ndarray) -> np.ndarray:
        """θ (…) in rad at t_s (…); before 0 the first interval's cubic goes on (an exposure begins before its middle)."""
        position = np.asarray(t_s) / self.step_s
        i = np.clip(np.floor(position).astype(int), 0, self.trajectory.t_s.size - 2)
        s, theta, omega = position - i, self.trajectory.theta_rad, self.trajectory.omega_rad_per_s * self.step_s
        rise = theta[i + 1] - theta[i]
        a, b = omega[i] - rise, rise - omega[i + 1]
        return theta[i] + s * (rise + (1 - s) * ((1 - s) * a + s * b))

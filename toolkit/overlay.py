"""The video with what was measured drawn on it: bob, path, pivot and string, and where the fitted model would be."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import JobError, UsageError
from toolkit.output import whole_file
from toolkit.progress import Progress, silent

if TYPE_CHECKING:
    from toolkit.track import Track

# red, green, blue; told apart with any colour vision by brightness as well (Okabe & Ito 2008)
_STATUS_RGB = {"ok": (0, 158, 115), "predicted": (240, 228, 66), "lost": (213, 94, 0)}
_PATH_RGB, _STRING_RGB, _MODEL_RGB = (86, 180, 233), (0, 114, 178), (204, 121, 167)
_LARGEST_PX = 1280  # longer sides are scaled down: the film is to be looked at
_TRAIL_S = 0.7
_SUBPIXEL_BITS = 4
_BAND = 20  # height of the caption, line thicknesses


def write_overlay(
    video_path: str | Path,
    track: Track,
    out_path: str | Path,
    theta_model_rad: np.ndarray | None = None,
    progress: Progress = silent,
) -> Path:
    """Draw `track` on its video and write H.264 (yuv420p, plays anywhere) to out_path, whole or not at all.

    theta_model_rad : a model's θ in rad, one a frame of the track or one a frame that was measured (the rows of
    theta.csv); its zero is put where it fits the track best. Frames that the track did not use are left out.
    The pivot may lie outside the picture. Raises UsageError if lengths differ or out_path is not a video's
    name, JobError if the video holds none of the track's frames.
    """
    import cv2

    from toolkit.camera.film import Film
    from toolkit.video import open_video

    out_path = Path(out_path)
    if not out_path.suffix:
        raise UsageError(f"{out_path} has no suffix; give a name that ends in .mp4")
    model = _model_px(track, theta_model_rad)
    video = open_video(video_path)
    row_of = {int(frame): row for row, frame in enumerate(track.frame)}
    scale = min(1.0, _LARGEST_PX / max(video.width_px, video.height_px))
    size = (_even(video.width_px * scale), _even(video.height_px * scale))
    rate = _rate(track.t_s)
    above = _bob_is_low(track, scale, size)
    written = 0
    with (
        whole_file(out_path) as scratch,
        Film(
            scratch,
            *size,
            rate,
            {"name": "h264", "crf": 23, "effort": "least"},
            even=out_path.suffix.lower() == ".avi",
        ) as film,
    ):
        last_stamp = -1.0
        for frame in video:
            row = row_of.get(frame.index)
            if row is None:
                continue
            picture = _fitted(frame.bgr, scale, size)
            _draw(picture, track, row, model, scale)
            _caption(picture, f"{track.t_s[row]:7.3f} s  frame {track.frame[row]}  {track.status[row]}", above)
            # stamps must grow, whatever the file's own did
            last_stamp = max(float(track.t_s[row] - track.t_s[0]), last_stamp + 1e-3)
            film.write(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), last_stamp)
            written += 1
            progress("overlay", written / len(row_of))
        if not written:
            raise JobError(f"{video_path} holds none of the frames of this track; give the video that was tracked")
    return out_path


def _even(side: float) -> int:
    return max(2, math.ceil(side / 2) * 2)


def _rate(t_s: np.ndarray) -> Fraction:
    steps = np.diff(t_s)
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 1 / 30
    return Fraction(min(max(1 / step, 1.0), 240.0)).limit_denominator(1001)


def _model_px(track: Track, theta_rad: np.ndarray | None) -> np.ndarray | None:
    """(n, 2) the model's position on every frame, NaN where there is none."""
    if theta_rad is None:
        return None
    theta = np.asarray(theta_rad, dtype=float)
    if theta.shape == (int(track.ok.sum()),):
        full = np.full(track.frame.size, np.nan)
        full[track.ok] = theta
        theta = full
    if theta.shape != track.frame.shape:
        raise UsageError(
            f"theta_model_rad must have one value a frame ({track.frame.size}) or a measured frame "
            f"({int(track.ok.sum())}), got shape {np.shape(theta_rad)}"
        )
    dx, dy = track.x_px - track.pivot_px[0], track.y_px - track.pivot_px[1]
    vertical = np.nanmedian(np.angle(np.exp(1j * (np.arctan2(dx, dy) - theta))))
    length = np.nanmedian(np.hypot(dx, dy))
    return np.array(track.pivot_px) + length * np.stack([np.sin(theta + vertical), np.cos(theta + vertical)], axis=1)


def _fitted(picture: np.ndarray, scale: float, size: tuple[int, int]) -> np.ndarray:
    """A copy scaled down to fit, its last row and column repeated where an even size needs it."""
    import cv2

    if scale < 1:
        to = (min(size[0], round(picture.shape[1] * scale)), min(size[1], round(picture.shape[0] * scale)))
        picture = cv2.resize(picture, to, interpolation=cv2.INTER_AREA)
    right, below = size[0] - picture.shape[1], size[1] - picture.shape[0]
    return cv2.copyMakeBorder(picture, 0, below, 0, right, cv2.BORDER_REPLICATE)


def _draw(picture: np.ndarray, track: Track, row: int, model: np.ndarray | None, scale: float) -> None:
    import cv2

    def at(points: Any) -> np.ndarray:
        # pixel centres scale as (p + ½) s − ½; far points are cut so that they fit OpenCV's integers
        scaled = (np.asarray(points, dtype=float) + 0.5) * scale - 0.5
        return np.round(np.clip(scaled, -1e5, 1e5) * 2**_SUBPIXEL_BITS).astype(np.int32)

    def line(points: Any, rgb: tuple[int, int, int], width: int) -> None:
        cv2.polylines(picture, [at(points).reshape(-1, 1, 2)], False, rgb[::-1], width, cv2.LINE_AA, _SUBPIXEL_BITS)

    def ring(centre: Any, radius: float, rgb: tuple[int, int, int], width: int) -> None:
        where = tuple(int(v) for v in at(centre))
        cv2.circle(picture, where, round(radius * 2**_SUBPIXEL_BITS), rgb[::-1], width, cv2.LINE_AA, _SUBPIXEL_BITS)

    thick = _thickness(picture.shape)
    pivot, bob = np.array(track.pivot_px), np.array([track.x_px[row], track.y_px[row]])
    status = str(track.status[row])
    radius = max(track.radius_px * scale, 3.0)
    first = int(np.searchsorted(track.t_s, track.t_s[row] - _TRAIL_S))
    trail = np.stack([track.x_px[first : row + 1], track.y_px[first : row + 1]], axis=1)
    trail = trail[np.all(np.isfinite(trail), axis=1)]
    if len(trail) > 1:
        line(trail, _PATH_RGB, thick)
    if np.all(np.isfinite(bob)):
        if np.all(np.isfinite(pivot)):
            line([pivot, bob], _STRING_RGB, thick)
        ring(bob, radius, _STATUS_RGB.get(status, _STATUS_RGB["lost"]), 2 * thick)
        ring(bob, 1.2 * thick, _STATUS_RGB.get(status, _STATUS_RGB["lost"]), -1)
    if np.all(np.isfinite(pivot)):
        ring(pivot, 3.0 * thick, _STRING_RGB, -1)
    if model is not None and np.all(np.isfinite(model[row])):
        x, y = model[row]
        arm = (radius + 5 * thick) / scale
        line([[x - arm, y], [x + arm, y]], _MODEL_RGB, 2 * thick)
        line([[x, y - arm], [x, y + arm]], _MODEL_RGB, 2 * thick)


def _thickness(size: tuple[int, ...]) -> int:
    """Of a line, px, in a picture of this size."""
    return max(1, round(max(size) / 640))


def _bob_is_low(track: Track, scale: float, size: tuple[int, int]) -> bool:
    """Whether a caption at the bottom would lie on the bob somewhere on its way, and one at the top would not."""
    band, radius = _BAND * _thickness(size), track.radius_px * scale
    return bool(
        np.nanmax(track.y_px) * scale + radius > size[1] - band and np.nanmin(track.y_px) * scale - radius > band
    )


def _caption(picture: np.ndarray, text: str, above: bool) -> None:
    import cv2

    thick = _thickness(picture.shape)
    band = _BAND * thick
    bottom = band if above else picture.shape[0]
    picture[bottom - band : bottom] = (picture[bottom - band : bottom] * 0.35).astype(np.uint8)  # readable on any wall
    place = (6 * thick, bottom - 6 * thick)
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45 * thick, (255, 255, 255), thick, cv2.LINE_AA)

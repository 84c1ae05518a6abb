"""A frame of the video with what was found on it: track, arc, pivot, string and bob."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.report.document import Figure
from toolkit.report.material import Material, thinned
from toolkit.report.style import BEST_MODEL, PAPER_MODEL

_WIDTH_PX = 720
_NAMES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


def frame(material: Material) -> Figure | None:
    """The frame of the widest swing, as JPEG inside SVG, with the measured geometry drawn over it."""
    track, video = material.analysis.track, material.analysis.video
    if track is None or video is None:
        return None
    ok = np.flatnonzero(track.ok)
    if ok.size == 0:
        return None
    early = ok[: max(1, min(ok.size, 200))]
    k = int(early[np.argmax(np.abs(track.x_px[early] - np.median(track.x_px[ok])))])
    picture = _picture(video, int(track.frame[k]))
    if picture is None:
        return None
    import cv2

    height, width = picture.shape[:2]
    scale = min(1.0, _WIDTH_PX / width)
    if scale < 1:
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    done, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 82])
    if not done:
        return None
    svg = _svg(track, k, ok, width, height, base64.b64encode(jpeg.tobytes()).decode("ascii"))
    data = {"frame": track.frame[ok], "t_s": track.t_s[ok], "x_px": track.x_px[ok], "y_px": track.y_px[ok]}
    return Figure("frame", material.words("caption.frame", frame=int(track.frame[k])), svg, data)


def _picture(video: Path, index: int) -> Any | None:
    from toolkit.video import open_video

    clip = open_video(video)
    try:
        for frame in clip:
            if frame.index >= index:
                return np.ascontiguousarray(frame.bgr)
    finally:
        close = getattr(clip, "close", None)
        if close:
            close()
    return None


def _svg(track: Any, k: int, ok: np.ndarray, width: int, height: int, jpeg: str) -> str:
    px, py = track.pivot_px
    x, y = float(track.x_px[k]), float(track.y_px[k])
    top = min(0.0, py - 12) if py > -2.5 * height else -0.15 * height  # a pivot above the picture is drawn above it
    bottom = float(height)
    unit = max(width, height) / 640
    some = ok[thinned(ok.size, 400)]
    dots = "".join(
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{1.1 * unit:.1f}"/>' for a, b in zip(track.x_px[some], track.y_px[some])
    )
    length = float(np.median(np.hypot(track.x_px[ok] - px, track.y_px[ok] - py)))
    angles = np.arctan2(track.x_px[ok] - px, track.y_px[ok] - py)
    low, high = float(angles.min()) - 0.03, float(angles.max()) + 0.03
    ends = [(px + length * np.sin(a), py + length * np.cos(a)) for a in (low, high)]
    large = 1 if high - low > np.pi else 0
    arc = f"M{ends[0][0]:.1f} {ends[0][1]:.1f}A{length:.1f} {length:.1f} 0 {large} 0 {ends[1][0]:.1f} {ends[1][1]:.1f}"
    cross = 7 * unit
    plus = f"M{px - cross:.1f} {py:.1f}H{px + cross:.1f}M{px:.1f} {py - cross:.1f}V{py + cross:.1f}"
    return "\n".join(
        [
            f'<svg {_NAMES} viewBox="0 {top:.1f} {width} {bottom - top:.1f}" width="{width}" height="{bottom - top:.1f}">',
            f'<image x="0" y="0" width="{width}" height="{height}" xlink:href="data:image/jpeg;base64,{jpeg}"/>',
            f'<path d="{arc}" fill="none" stroke="#ffffff" stroke-width="{1.2 * unit:.1f}" stroke-dasharray="{5 * unit:.1f} {4 * unit:.1f}"/>',
            f'<g fill="{PAPER_MODEL}">{dots}</g>',
            f'<line x1="{px:.1f}" y1="{py:.1f}" x2="{x:.1f}" y2="{y:.1f}" stroke="{BEST_MODEL}" stroke-width="{1.6 * unit:.1f}"/>',
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{float(track.radius_px):.1f}" fill="none" stroke="{BEST_MODEL}" stroke-width="{1.8 * unit:.1f}"/>',
            f'<path d="{plus}" stroke="{PAPER_MODEL}" stroke-width="{2.2 * unit:.1f}" fill="none"/>',
            "</svg>",
        ]
    )

"""Tracker's project files: .trk (XML) and .trz (a zip that holds one). Read without trusting them.

World coordinates, as Tracker has them: dx = px − xorigin, dy = py − yorigin,
x = (dx cos A − dy sin A)/xscale, y = −(dx sin A + dy cos A)/yscale.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from toolkit.errors import JobError
from toolkit.sentence import said
from toolkit.series import ThetaSeries
from toolkit.series_io.arc import swing_from_positions
from toolkit.series_io.columns import clean_series
from toolkit.series_io.series_format import Look, SeriesFormat, peek

_MAX_XML_BYTES = 100_000_000
_MAX_DEPTH = 100
_TO_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
_TO_KG = {"kg": 1.0, "g": 0.001, "mg": 1e-6, "lb": 0.45359237}
_BLANK_PX = 640.0, 480.0  # of the blank picture that Tracker shows where there is no video
_TRACKER = "org.opensourcephysics.cabrillo.tracker."


def _recognises(look: Look) -> bool:
    if look.path.suffix.lower() in (".trk", ".trz"):
        return True
    return "TrackerPanel" in look.text[:2000] and look.text.lstrip().startswith("<")


def read(path: Path) -> ThetaSeries:
    """θ of the point mass with the most points. Raises JobError where the file is damaged, hostile or has no track."""
    peek(path)
    root = parse_xml(_xml_of(path), path)
    panel = (
        root
        if root.get("class", "").endswith("TrackerPanel")
        else root.find(f".//object[@class='{_TRACKER}TrackerPanel']")
    )
    if panel is None:
        raise JobError(f"{path} is not a Tracker project (no TrackerPanel in it); save the tab in Tracker as .trk")
    version = _text(panel, "semantic_version") or said("series.unknown_version", "of unknown version")
    read = "Read the Tracker project {file} (Tracker {version})."
    log: list[str] = [said("series.tracker_project", read, file=path.name, version=version)]
    warnings: list[str] = []
    frames, px, py, mass, name = _point_mass(panel, path, log, warnings)
    times = _times(panel, frames, path)
    x, y = _world(panel, frames, px, py, path)
    unit = _text(panel, "length_unit") or "m"
    swing = swing_from_positions(x, y, origin=(0.0, 0.0), unit=unit)
    log.extend(swing.log)
    warnings.extend(swing.warnings)
    meta: dict[str, object] = {"format": "Tracker project", "track": name}
    if unit in _TO_METRES and _is_scaled(panel):
        meta["length_m"] = swing.length * _TO_METRES[unit]
        meta["length_sigma_m"] = swing.length_sigma * _TO_METRES[unit]
    else:
        warnings.append(
            said("series.no_scale", "The project has no scale, so it says nothing of the pendulum's length.")
        )
    mass_unit = _text(panel, "mass_unit") or "kg"
    if mass == 1.0:
        warnings.append(
            said(
                "series.default_mass",
                "The track's mass is Tracker's default of 1; it was not used. Give the bob's mass with --mass-kg.",
            )
        )
    elif mass and mass > 0 and mass_unit in _TO_KG:
        meta["mass_kg"] = mass * _TO_KG[mass_unit]
    meta["angle_scale_relative_u"] = swing.length_sigma / swing.length
    no_sigma = "The project gives no uncertainty of the positions; the fit estimates it from the residuals."
    log.append(said("series.no_sigma", no_sigma))
    return clean_series(times, swing.theta_rad, None, path=path, log=log, warnings=warnings, meta=meta)


def _xml_of(path: Path) -> bytes:
    if not zipfile.is_zipfile(path):
        if path.suffix.lower() == ".trz":
            raise JobError(f"{path} is not a zip archive as a .trz must be; save the project again in Tracker")
        return path.read_bytes()
    return member_of_zip(path, (".trk",), _MAX_XML_BYTES)


def member_of_zip(path: Path, suffixes: tuple[str, ...], limit: int, prefer: str = "") -> bytes:
    """The first member with one of the suffixes (one whose name holds `prefer` first), at most `limit` bytes of it.

    The limit holds for what comes out, whatever the archive claims. Raises JobError for a damaged archive, one
    without such a member, or a member that is too large.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            found = [i for i in archive.infolist() if i.filename.lower().endswith(suffixes) and not i.is_dir()]
            found = [
                i for i in found if not i.filename.rsplit("/", 1)[-1].startswith(".") and "__MACOSX" not in i.filename
            ]
            if not found:
                raise JobError(f"{path} holds no {' or '.join(suffixes)} file; export it again")
            found.sort(key=lambda i: (prefer.lower() not in i.filename.lower(), i.filename.count("/"), i.filename))
            with archive.open(found[0]) as member:
                data = member.read(limit + 1)
    except (zipfile.BadZipFile, EOFError, OSError, RuntimeError, NotImplementedError, ValueError) as error:
        raise JobError(f"{path} is a damaged or locked archive ({error}); export it again") from error
    if len(data) > limit:
        raise JobError(f"{path}: {found[0].filename} unpacks to more than {limit / 1e6:.0f} MB; it was not read")
    return data


def parse_xml(data: bytes, path: Path) -> Element:
    """The tree of an XML document without a document type: entities cannot be declared, so nothing can expand.

    Raises JobError for a document type, damaged XML, nesting deeper than 100, or more than 100 MB.
    """
    if len(data) > _MAX_XML_BYTES:
        raise JobError(f"{path} has {len(data) / 1e6:.0f} MB of XML, more than is read; it was not opened")
    builder = TreeBuilder()
    parser = expat.ParserCreate()
    parser.buffer_text = True
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _MAX_DEPTH:
            raise JobError(f"{path} nests its XML deeper than {_MAX_DEPTH} levels; it was not read")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise JobError(f"{path} declares a document type or entities, which Tracker never does; it was not read")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(data, True)
        return builder.close()
    except (expat.ExpatError, LookupError, ValueError, AssertionError) as error:
        raise JobError(f"{path} is damaged XML ({error}); save the project again in Tracker") from error


def _property(parent: Element, name: str) -> Element | None:
    return next((p for p in parent.findall("property") if p.get("name") == name), None)


def _text(parent: Element, name: str) -> str:
    found = _property(parent, name)
    return (found.text or "").strip() if found is not None else ""


def _number(parent: Element, name: str, path: Path, default: float | None = None) -> float:
    text = _text(parent, name)
    if not text and default is not None:
        return default
    try:
        value = float(text)
        if not np.isfinite(value):
            raise ValueError
        return value
    except ValueError:
        raise JobError(
            f"{path}: {name} is {text[:20]!r} where a number is expected; save the project again in Tracker"
        ) from None


def _object(parent: Element, name: str) -> Element | None:
    found = _property(parent, name)
    return found.find("object") if found is not None else None


def _indexed(parent: Element, name: str) -> list[tuple[int, Element]]:
    """[(index, object)] of a sparse array property, by rising index."""
    found = _property(parent, name)
    pairs = []
    for item in found.findall("property") if found is not None else []:
        inner, key = item.find("object"), (item.get("name") or "").strip("[]")
        if inner is not None and key.isdigit():
            pairs.append((int(key), inner))
    return sorted(pairs, key=lambda pair: pair[0])


def _point_mass(
    panel: Element, path: Path, log: list[str], warnings: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, str]:
    tracks = _property(panel, "tracks")
    masses = [
        o
        for item in (tracks.findall("property") if tracks is not None else [])
        if (o := item.find("object")) is not None and o.get("class", "").endswith("PointMass")
    ]
    found = [(o, _indexed(o, "framedata")) for o in masses]
    found = [(o, points) for o, points in found if len(points) >= 2]
    if not found:
        raise JobError(f"{path} holds no point mass with positions; track the bob in Tracker and save the project")
    track, points = max(found, key=lambda pair: (len(pair[1]), _spread(pair[1], path)))
    name = _text(track, "name") or "point mass"
    if len(found) > 1:
        several = "The project holds {count} point masses; {name!r}, with the most points, was used."
        warnings.append(said("series.point_masses", several, count=len(found), name=name))
    frames = np.array([index for index, _ in points], dtype=float)
    x = np.array([_number(o, "x", path) for _, o in points])
    y = np.array([_number(o, "y", path) for _, o in points])
    log.append(said("series.track", "Track {name!r}: {count} positions.", name=name, count=len(points)))
    return frames, x, y, _number(track, "mass", path, default=1.0), name


def _spread(points: list[tuple[int, Element]], path: Path) -> float:
    return float(np.std([_number(o, "x", path) for _, o in points]))


def _times(panel: Element, frames: np.ndarray, path: Path) -> np.ndarray:
    """Times in s: start time + (frame − first frame with a position)·delta_t; the clip before it is not part of the record."""
    clip, control = _object(panel, "videoclip"), _object(panel, "clipcontrol")
    if control is None or not _text(control, "delta_t"):
        raise JobError(f"{path} gives no time a frame (clipcontrol, delta_t); save the project with its video clip")
    step_ms = _number(control, "delta_t", path)
    if not step_ms > 0:
        raise JobError(f"{path}: the time a frame is {step_ms:g} ms; set the frame rate in Tracker")
    start_ms = _number(clip, "starttime", path, default=0.0) if clip is not None else 0.0
    return (start_ms + (frames - frames[0]) * step_ms) / 1000


def _is_scaled(panel: Element) -> bool:
    coords = _object(panel, "coords")
    steps = _indexed(coords, "framedata") if coords is not None else []
    return any(_text(o, "xscale") not in ("", "1.0", "1") for _, o in steps)


def _world(
    panel: Element, frames: np.ndarray, px: np.ndarray, py: np.ndarray, path: Path
) -> tuple[np.ndarray, np.ndarray]:
    """World x and y (up) of each point; the coordinate system of the last step at or before its frame."""
    coords = _object(panel, "coords")
    steps = _indexed(coords, "framedata") if coords is not None else []
    if not steps:
        raise JobError(f"{path} has no coordinate system; set the axes at the pivot in Tracker and save")
    keys = ("xorigin", "yorigin", "angle", "xscale", "yscale")
    defaults = {"angle": 0.0, "xscale": 1.0, "yscale": 1.0}
    table = np.array([[_number(o, key, path, defaults.get(key)) for key in keys] for _, o in steps])
    at = np.maximum(np.searchsorted([index for index, _ in steps], frames, side="right") - 1, 0)
    x0, y0, angle, scale_x, scale_y = table[at].T
    if np.any(scale_x * scale_y == 0):
        raise JobError(f"{path}: a scale of 0 px a unit; set the calibration stick in Tracker and save")
    a = np.radians(angle)
    dx, dy = px - x0, py - y0
    return (dx * np.cos(a) - dy * np.sin(a)) / scale_x, -(dx * np.sin(a) + dy * np.cos(a)) / scale_y


def write(series: ThetaSeries, path: Path) -> None:
    """A project that Tracker opens: one point mass on an arc about the origin, one step a sample, pixels to 1e-9.

    The length comes from `meta` where known, else it is 1 m; the arc lies within Tracker's blank picture. A .trk counts
    frames: raises JobError where the times do not lie on a grid to a hundredth of a step.
    """
    xml = _project(series).encode("utf-8")
    if path.suffix.lower() == ".trz":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            entry = zipfile.ZipInfo(path.stem + ".trk", date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, xml)
    else:
        path.write_bytes(xml)


def _project(series: ThetaSeries) -> str:
    frames, step_s, start_s = _frames(series.t_s)
    length = float(series.meta.get("length_m", 1.0))
    width, height = _BLANK_PX
    x0, y0 = width / 2, height / 2
    radius = y0 - 20.0
    scale = radius / length
    x = x0 + radius * np.sin(series.theta_rad)
    y = y0 + radius * np.cos(series.theta_rad)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f'<object class="{_TRACKER}TrackerPanel">']

    def prop(depth: int, name: str, kind: str, value: object) -> None:
        lines.append(f'{"    " * depth}<property name="{name}" type="{kind}">{value}</property>')

    def opened(depth: int, name: str, kind: str, of: str) -> None:
        lines.append(
            f'{"    " * depth}<property name="{name}" type="{kind}">'
            if kind == "object"
            else f'{"    " * depth}<property name="{name}" type="{kind}" class="{of}">'
        )
        if kind == "object":
            lines.append(f'{"    " * depth}<object class="{of}">')

    def closed(depth: int, kind: str = "object") -> None:
        if kind == "object":
            lines.append(f"{'    ' * depth}</object>")
        lines.append(f"{'    ' * depth}</property>")

    media = "org.opensourcephysics.media.core."
    prop(1, "semantic_version", "string", "5.1.5")
    prop(1, "width", "double", width)
    prop(1, "height", "double", height)
    prop(1, "magnification", "double", -1.0)
    opened(1, "videoclip", "object", media + "VideoClip")
    prop(2, "video_framecount", "int", int(frames[-1]) + 1)
    prop(2, "startframe", "int", 0)
    prop(2, "stepsize", "int", 1)
    prop(2, "stepcount", "int", int(frames[-1]) + 1)
    prop(2, "starttime", "double", repr(start_s * 1000))
    prop(2, "readout", "string", "frame")
    prop(2, "playallsteps", "boolean", "true")
    closed(1)
    opened(1, "clipcontrol", "object", media + "StepperClipControl")
    prop(2, "rate", "double", 1.0)
    prop(2, "delta_t", "double", repr(step_s * 1000))
    prop(2, "frame", "int", 0)
    closed(1)
    opened(1, "coords", "object", media + "ImageCoordSystem")
    for name in ("fixedorigin", "fixedangle", "fixedscale"):
        prop(2, name, "boolean", "true")
    prop(2, "locked", "boolean", "false")
    opened(2, "framedata", "array", f"[L{media}ImageCoordSystem$FrameData;")
    opened(3, "[0]", "object", media + "ImageCoordSystem$FrameData")
    for name, value in (("xorigin", x0), ("yorigin", y0), ("angle", 0.0), ("xscale", scale), ("yscale", scale)):
        prop(4, name, "double", value)
    closed(3)
    closed(2, "array")
    closed(1)
    prop(1, "length_unit", "string", "m")
    prop(1, "mass_unit", "string", "kg")
    prop(1, "units_visible", "boolean", "true")
    opened(1, "tracks", "collection", "java.util.ArrayList")
    opened(2, "item", "object", _TRACKER + "PointMass")
    prop(3, "mass", "double", float(series.meta.get("mass_kg", 1.0)))
    prop(3, "name", "string", "mass A")
    opened(3, "color", "object", "java.awt.Color")
    for part, level in (("red", 255), ("green", 0), ("blue", 0), ("alpha", 255)):
        prop(4, part, "int", level)
    closed(3)
    prop(3, "footprint", "string", "Footprint.Diamond")
    prop(3, "visible", "boolean", "true")  # Tracker takes a missing one as false
    prop(3, "trail", "boolean", "true")
    opened(3, "framedata", "array", f"[L{_TRACKER}PointMass$FrameData;")
    for frame, px, py in zip(frames, x.tolist(), y.tolist()):
        opened(4, f"[{frame}]", "object", _TRACKER + "PointMass$FrameData")
        prop(5, "x", "double", repr(px))
        prop(5, "y", "double", repr(py))
        closed(4)
    closed(3, "array")
    closed(2)
    closed(1, "collection")
    prop(1, "selectedtrack", "string", "mass A")
    lines.append("</object>\n")
    return "\n".join(lines)


def _frames(t_s: np.ndarray) -> tuple[list[int], float, float]:
    """Whole frame numbers, the time a frame in s, and the first time in s."""
    if t_s.size == 1:
        return [0], 1.0, float(t_s[0])
    step = float(np.median(np.diff(t_s)))
    frames = np.round((t_s - t_s[0]) / step)
    for _ in range(3):  # the step that fits all of them best, then the frames again
        step = float(np.dot(frames, t_s - t_s[0]) / np.dot(frames, frames))
        frames = np.round((t_s - t_s[0]) / step)
    off = float(np.max(np.abs(t_s - t_s[0] - frames * step)))
    if off > 0.01 * step or np.any(np.diff(frames) < 1):
        raise JobError(
            f"the times are not evenly spaced (off by {off * 1e3:.3g} ms of {step * 1e3:.4g} ms) and a Tracker project counts "
            "frames; write .csv or .txt instead"
        )
    return frames.astype(int).tolist(), step, float(t_s[0])


FORMAT = SeriesFormat(
    "tracker_trk",
    (".trk", ".trz"),
    "Tracker's project files, with pixel tracks, scale and axes",
    _recognises,
    read,
    write,
    order=5,
)

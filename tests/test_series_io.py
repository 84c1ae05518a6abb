"""Every format of θ(t): round trips, the real files, and what is refused."""

from __future__ import annotations

import io
import zipfile
from datetime import date

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolkit.errors import JobError, PendulabError, UsageError
from toolkit.series import ThetaSeries
from toolkit.series_io import format_names, load_format, read_series, write_series
from toolkit.series_io.arc import fit_circle, swing_from_positions
from toolkit.series_io.columns import understand


def swing(n=200, fps=60.0, amplitude=0.3, sigma=True) -> ThetaSeries:
    t = np.arange(n) / fps
    theta = amplitude * np.exp(-0.05 * t) * np.cos(4.3 * t)
    return ThetaSeries(t, theta, np.full(n, 1e-3) if sigma else None)


# -- round trips ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("amplitude", [0.01, 0.05, 0.3, 1.5])
@pytest.mark.parametrize(
    ("name", "precision", "keeps_sigma"),
    [
        ("a.csv", 0.0, True),
        ("a.tsv", 1e-10, True),
        ("a.txt", 1e-11, False),
        ("a.trk", 1e-12, False),
        ("a.trz", 1e-12, False),
        ("a.zip", 0.0, True),
    ],
)
def test_round_trip(tmp_path, name, precision, keeps_sigma, amplitude):
    series = swing(amplitude=amplitude)
    write_series(series, tmp_path / name)
    back = read_series(tmp_path / name)
    assert np.max(np.abs(back.t_s - series.t_s)) <= precision
    assert np.max(np.abs(back.theta_rad - series.theta_rad)) <= precision
    assert (back.sigma_theta_rad is not None) == keeps_sigma
    if keeps_sigma:
        assert np.max(np.abs(back.sigma_theta_rad - 1e-3)) <= max(precision, 1e-15)


@settings(max_examples=60, deadline=None)
@given(
    steps=st.lists(st.floats(1e-6, 10.0), min_size=4, max_size=40),
    data=st.data(),
)
def test_our_csv_keeps_every_bit(tmp_path_factory, steps, data):
    n = len(steps)
    finite = st.floats(-50, 50, allow_subnormal=False)
    theta = data.draw(st.lists(finite, min_size=n, max_size=n))
    sigma = data.draw(st.lists(st.floats(1e-12, 1.0), min_size=n, max_size=n))
    series = ThetaSeries(np.cumsum(steps), np.array(theta), np.array(sigma))
    path = tmp_path_factory.mktemp("csv") / "theta.csv"
    series.to_csv(path)
    back = read_series(path)
    for name in ("t_s", "theta_rad", "sigma_theta_rad"):
        assert np.array_equal(getattr(back, name), getattr(series, name))


def test_a_project_counts_frames_and_leaves_gaps(tmp_path):
    series = swing()
    keep = np.r_[0:50, 80:200]
    gappy = ThetaSeries(series.t_s[keep], series.theta_rad[keep])
    write_series(gappy, tmp_path / "a.trk")
    back = read_series(tmp_path / "a.trk")
    assert np.allclose(back.t_s, gappy.t_s, atol=1e-12)
    uneven = ThetaSeries(np.sort(np.random.default_rng(1).uniform(0, 3, 50)), np.linspace(-0.2, 0.2, 50))
    with pytest.raises(JobError, match="not evenly spaced"):
        write_series(uneven, tmp_path / "b.trk")
    assert not (tmp_path / "b.trk").exists()


def test_a_project_has_tracker_s_world_coordinates(tmp_path):
    """Read back by Tracker's own rule, written out here: x = (px − xorigin)/scale, y = −(py − yorigin)/scale."""
    import re

    series = ThetaSeries(np.arange(5) / 30, np.array([0.4, 0.2, 0.0, -0.2, -0.3]), meta={"length_m": 0.8})
    write_series(series, tmp_path / "a.trk")
    text = (tmp_path / "a.trk").read_text(encoding="utf-8")

    def numbers(name):
        return np.array([float(v) for v in re.findall(rf'name="{name}" type="double">([^<]*)<', text)])

    x = (numbers("x") - numbers("xorigin")) / numbers("xscale")
    y = -(numbers("y") - numbers("yorigin")) / numbers("yscale")
    assert np.allclose(np.hypot(x, y), 0.8)
    assert np.allclose(np.arctan2(x, -y), series.theta_rad)
    assert np.allclose(numbers("delta_t"), 1000 / 30)


def test_unknown_suffix_or_format(tmp_path):
    with pytest.raises(UsageError, match="suffix"):
        write_series(swing(), tmp_path / "a.docx")
    with pytest.raises(UsageError, match="unknown"):
        write_series(swing(), tmp_path / "a.csv", format="exel")
    with pytest.raises(UsageError, match="only read"):
        write_series(swing(), tmp_path / "a.csv", format="encoder_table")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", format_names())
def test_every_format_says_what_it_is(name):
    kind = load_format(name)
    assert kind.name == name
    assert kind.meaning
    assert (kind.write is None) == (kind.suffixes == ())


# -- units, delimiters, headers ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "quantity", "scale", "sigma"),
    [
        ("t_s", "t", 1.0, False),
        ("t (seconds)", "t", 1.0, False),
        ("Time [ms]", "t", 1e-3, False),
        ("tempo", "t", None, False),
        ("เวลา (วินาที)", "t", 1.0, False),
        ("θ (degrees)", "theta", np.pi / 180, False),
        ("theta_rad", "theta", 1.0, False),
        ("angle [deg]", "theta", np.pi / 180, False),
        ("Angle (°)", "theta", np.pi / 180, False),
        ("θ/mrad", "theta", 1e-3, False),
        ("มุม (องศา)", "theta", np.pi / 180, False),
        ("sigma_theta_rad", "theta", 1.0, True),
        ("uncertainty t (type b)", "t", None, True),
        ("uncertainty θ (type b, about +-1 degree)", "theta", np.pi / 180, True),
        ("Δθ (deg)", "theta", np.pi / 180, True),
        ("σ_t", "t", None, True),
        ("Period (seconds)", "", 1.0, False),
        ("omega_rad_per_s", "", 1.0, False),
        ("theta_model_rad", "", 1.0, False),
    ],
)
def test_column_names(name, quantity, scale, sigma):
    column = understand(name)
    assert (column.quantity, column.sigma) == (quantity, sigma)
    if quantity:
        assert column.scale == (None if scale is None else pytest.approx(scale))


def table(tmp_path, text, name="table.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_text(text, encoding=encoding)
    return path


T = np.arange(40) / 20
DEG = 25 * np.cos(4.4 * T)


@pytest.mark.parametrize(
    ("head", "form"),
    [
        ("t (s)\tθ (degrees)\n", "{t:.4f}\t{d:.5f}\n"),
        ("t (s);θ (degrees)\n", "{t:.4f};{d:.5f}\n"),
        ("t (s),angle [deg]\n", "{t:.4f},{d:.5f}\n"),
        ("time (s) theta (deg)\n", "{t:.4f} {d:.5f}\n"),
        ("# t_s theta_deg\n", "{t:.4f} {d:.5f}\n"),
        ("Run 7 of group 3\nt,theta\n(s),(deg)\n", "{t:.4f},{d:.5f}\n"),
        ("t (s),theta_rad\n", "{t:.4f},{r:.8f}\n"),
        ("Time (ms),theta (mrad)\n", "{ms:.2f},{mr:.5f}\n"),
        ("", "{t:.4f}\t{d:.5f}\n"),
        ("θ (deg),t (s)\n", "{d:.5f},{t:.4f}\n"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_plain_tables(tmp_path, head, form, encoding):
    rows = "".join(form.format(t=t, d=d, r=np.radians(d), ms=1e3 * t, mr=1e3 * np.radians(d)) for t, d in zip(T, DEG))
    series = read_series(table(tmp_path, head + rows, encoding=encoding))
    assert np.allclose(series.t_s, T, atol=1e-9)
    assert np.allclose(series.theta_rad, np.radians(DEG), atol=1e-6)


def test_decimal_commas(tmp_path):
    rows = "".join(f"{t:.4f};{d:.5f}\n".replace(".", ",") for t, d in zip(T, DEG))
    series = read_series(table(tmp_path, "t (s);theta (deg)\n" + rows))
    assert np.allclose(series.theta_rad, np.radians(DEG), atol=1e-6)
    assert any("decimal comma" in line for line in series.meta["log"])
    rows = "".join(f"{t:.4f},{d:.5f}\n".replace(".", ",").replace(",", ",") for t, d in zip(T, DEG))
    with pytest.raises(JobError, match="decimal comma"):
        read_series(table(tmp_path, "t (s),theta (deg)\n" + rows))


def test_units_by_size_are_told_or_refused(tmp_path):
    def of(scale):
        return read_series(table(tmp_path, "t,theta\n" + "".join(f"{t},{scale * d}\n" for t, d in zip(T, DEG))))

    degrees = of(1.0)
    assert np.allclose(degrees.theta_rad, np.radians(DEG))
    assert any("degrees were assumed" in w for w in degrees.meta["warnings"])
    radians = of(np.pi / 180)
    assert np.allclose(radians.theta_rad, np.radians(DEG))
    assert any("radians were assumed" in w for w in radians.meta["warnings"])
    with pytest.raises(JobError, match="degrees or radians"):
        of(0.1)


def test_sigma_of_time_is_carried_into_theta(tmp_path):
    rows = "".join(f"{t:.6f}\t{np.radians(d):.9f}\t0.01\t0.002\n" for t, d in zip(T, DEG))
    series = read_series(table(tmp_path, "X\tY\tX'\tY'\n" + rows))
    speed = np.gradient(np.radians(DEG), T)
    assert np.allclose(series.sigma_theta_rad, np.hypot(0.002, 0.01 * np.abs(speed)), rtol=1e-4)
    assert any("σ_t" in line for line in series.meta["log"])


# -- poor tables ------------------------------------------------------------------------------------------------------


def lines_of(tmp_path):
    swing().to_csv(tmp_path / "swing.csv")
    return (tmp_path / "swing.csv").read_text(encoding="utf-8").splitlines()


def test_missing_values_are_left_out_and_counted(tmp_path):
    lines = lines_of(tmp_path)
    lines[5] = lines[5].split(",")[0] + ",nan,0.001"
    lines[9] = lines[9].split(",")[0] + ",,0.001"
    del lines[100:150]
    series = read_series(table(tmp_path, "\n".join(lines)))
    assert len(series) == 200 - 2 - 50
    assert any(w.startswith("2 of 150 rows") for w in series.meta["warnings"])


def test_rows_out_of_place_are_sorted_and_repeats_averaged(tmp_path):
    lines = lines_of(tmp_path)
    lines[10], lines[11] = lines[11], lines[10]
    lines.insert(20, lines[20])
    series = read_series(table(tmp_path, "\n".join(lines)))
    assert np.array_equal(series.theta_rad, swing().theta_rad)
    assert sum("sorted" in w or "repeat" in w for w in series.meta["warnings"]) == 2


def test_two_runs_in_one_file_are_refused(tmp_path):
    lines = lines_of(tmp_path)
    with pytest.raises(JobError, match="time goes back from"):
        read_series(table(tmp_path, "\n".join(lines + lines[1:])))


def test_a_clock_with_too_few_digits_is_refused(tmp_path):
    rows = "".join(f"{t:.1f},{np.radians(d):.6f}\n" for t, d in zip(np.arange(40) / 60, DEG))
    with pytest.raises(JobError, match="repeat the time"):
        read_series(table(tmp_path, "t_s,theta_rad\n" + rows))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"\x00\x01\x02\x03" * 500, "not a t"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "not a t"),
        (b"t_s,theta_rad\n", "no"),
        (b"colour,price\nred,3\nblue,4\n", ""),
        (b"hello\nworld\n", "no table"),
        (b"t_s,theta_rad\n0,a\n1,b\n2,c\n3,d\n", ""),
        (b"t_s,theta_rad\n0,nan\n1,nan\n2,nan\n", ""),
        (b"t_s,theta_rad\n0,0.1\n", "1 points"),
        (b"Amplitude (radians)\tPeriod (seconds)\n1.4\t1.2\n1.3\t1.2\n", "no column of times"),
        (b"t (s),velocity (m/s)\n0,1\n1,2\n2,3\n3,1\n", "no column of angles"),
        (b"0 1 2 3 4\n1 2 3 4 5\n2 3 4 5 6\n", "without names"),
        (b"t_s,theta_rad\n0,0.1\n1,0.2,7,8\n2,0.3\n3,0.1\n", "line 3"),
        (b"PK\x03\x04 cut archive", "archive"),
        (b"<?xml version='1.0'?><object class='x.TrackerPanel'><property", "damaged XML"),
    ],
)
def test_bad_files_get_one_clear_line(tmp_path, content, said):
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(JobError) as caught:
        read_series(path)
    assert "bad.csv" in str(caught.value)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(JobError, match="check the file"):
        read_series(tmp_path / "none.csv")
    with pytest.raises(JobError, match="is a folder"):
        read_series(tmp_path)


@settings(max_examples=150, deadline=None)
@given(content=st.one_of(st.binary(max_size=300), st.text(max_size=300).map(lambda s: s.encode("utf-8", "ignore"))))
@pytest.mark.parametrize("name", ["a.csv", "a.trk", "a.trz", "a.zip"])
def test_any_bytes_give_a_series_or_one_line(tmp_path_factory, content, name):
    path = tmp_path_factory.mktemp("any") / name
    path.write_bytes(content)
    try:
        result = read_series(path)
    except PendulabError as error:
        result = str(error)
    assert isinstance(result, ThetaSeries) or "\n" not in result


# -- Tracker ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("delimiter", ["\t", ";", ","])
@pytest.mark.parametrize("multi", [False, True])
@pytest.mark.parametrize("columns", ["tθ", "txy", "tθr"])
def test_tracker_text(tmp_path, delimiter, multi, columns):
    theta = np.radians(DEG)
    all_columns = {"t": T, "x": 0.8 * np.sin(theta), "y": -0.8 * np.cos(theta), "θ": DEG, "θr": DEG - 90}
    names = {"tθ": ["t", "θ"], "txy": ["t", "x", "y"], "tθr": ["t", "θr"]}[columns]
    rows = [delimiter.join(f"{all_columns[n][i]:.9E}" for n in names) + delimiter for i in range(T.size)]
    rows[7] = f"{T[7]:.9E}" + delimiter * len(names)  # a step without a mark
    head = (["#multi:"] if multi else []) + [
        delimiter + "mass A" + delimiter * (len(names) - 1),
        delimiter.join(names) + delimiter,
    ]
    series = read_series(table(tmp_path, "\n".join(head + rows) + "\n", "tracker.txt"))
    kept = np.arange(T.size) != 7
    assert np.allclose(series.t_s, T[kept], atol=1e-8)
    assert np.allclose(series.theta_rad, theta[kept], atol=1e-6)
    if columns == "txy":
        assert series.meta["length_m"] == pytest.approx(0.8, rel=1e-5)


def test_tracker_text_with_decimal_commas_and_two_tracks(tmp_path):
    head = "#multi:\n\tclamp\t\tbob\t\nt\tx\ty\tx\ty\t\n"
    theta = np.radians(DEG)
    rows = "".join(
        "\t".join(f"{v:.6f}".replace(".", ",") for v in (t, 0.001, 0.0, 0.8 * np.sin(a), -0.8 * np.cos(a))) + "\t\n"
        for t, a in zip(T, theta)
    )
    series = read_series(table(tmp_path, head + rows, "tracker.txt"))
    assert np.allclose(series.theta_rad, theta, atol=1e-5)
    assert any("'bob'" in w for w in series.meta["warnings"])


def project(body: str, tail: str = "") -> str:
    return f'<?xml version="1.0"?>{tail}<object class="org.opensourcephysics.cabrillo.tracker.TrackerPanel">{body}</object>'


BOMB = (
    '<!DOCTYPE b [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;">]>'
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (project("<property name='x'>&c;</property>", BOMB), "document type"),
        (project("", '<!DOCTYPE x SYSTEM "file:///etc/passwd">'), "document type"),
        (project("")[:-12], "damaged XML"),
        (project(""), "no point mass"),
        ("<a>" * 500 + "</a>" * 500, "deeper"),
        ("<other/>", "not a Tracker project"),
        ("", "empty"),
    ],
)
def test_hostile_or_damaged_projects(tmp_path, text, said):
    with pytest.raises(JobError, match=said):
        read_series(table(tmp_path, text, "bad.trk"))


def test_a_cut_project_is_one_line(tmp_path):
    write_series(swing(), tmp_path / "a.trk")
    whole = (tmp_path / "a.trk").read_bytes()
    for part in (10, 200, len(whole) // 2, len(whole) - 5):
        (tmp_path / "cut.trk").write_bytes(whole[:part])
        with pytest.raises(JobError, match=r"cut\.trk"):
            read_series(tmp_path / "cut.trk")


def test_an_archive_that_unpacks_too_large_is_refused(tmp_path, monkeypatch):
    from toolkit.series_io import tracker_trk

    monkeypatch.setattr(tracker_trk, "_MAX_XML_BYTES", 1_000_000)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb.trk", b" " * 2_000_000)
    (tmp_path / "bomb.trz").write_bytes(buffer.getvalue())
    assert (tmp_path / "bomb.trz").stat().st_size < 10_000
    with pytest.raises(JobError, match="unpacks to more"):
        read_series(tmp_path / "bomb.trz")


# -- phyphox ----------------------------------------------------------------------------------------------------------


def test_phyphox_gyroscope_is_integrated(tmp_path):
    """A rate with the gyroscope's offset and an unknown start: θ comes back to a milliradian."""
    t = np.arange(3000) / 100 + 0.013
    theta = 0.25 * np.cos(3.1 * t)
    rate = -0.25 * 3.1 * np.sin(3.1 * t) + 0.004
    names = '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Absolute (rad/s)"\n'
    rows = "".join(f"{a:.9E},{0.001:.9E},{r:.9E},{-0.002:.9E},{abs(r):.9E}\n" for a, r in zip(t, rate))
    with zipfile.ZipFile(tmp_path / "Pendulum 2026-11-22.zip", "w") as archive:
        archive.writestr("meta/device.csv", '"property","value"\n"version","1.1"\n')
        archive.writestr("Raw Data.csv", names + rows)
    for path in (tmp_path / "Pendulum 2026-11-22.zip", table(tmp_path, names + rows, "raw.csv")):
        series = read_series(path)
        assert np.sqrt(np.mean((series.theta_rad - theta) ** 2)) < 1.5e-3


@pytest.mark.parametrize(("between", "point"), [(",", "."), ("\t", "."), (";", "."), ("\t", ","), (";", ",")])
def test_phyphox_in_each_of_its_csv_variants(tmp_path, between, point):
    """The five CSV exports that the app offers: quoted names, ten digits with an exponent, NaN for a missing cell, and a
    folder of metadata at the archive's end."""

    def shown(value):
        if np.isnan(value):
            return "NaN"
        digits, power = f"{value:.9E}".split("E")
        return f"{digits.replace('.', point)}E{int(power)}"

    t = 0.0049 + np.arange(2500) / 100
    rate = -0.3 * 2.9 * np.sin(2.9 * t)
    axes = [0.001 * np.sin(t), rate, np.full_like(t, -0.002), np.abs(rate)]
    axes[0][-1] = np.nan
    names = ["Time (s)", "Gyroscope x (rad/s)", "Gyroscope y (rad/s)", "Gyroscope z (rad/s)", "Absolute (rad/s)"]
    lines = [between.join(f'"{name}"' for name in names)]
    lines += [between.join(map(shown, row)) for row in zip(t, *axes)]
    event = ['"START"', shown(0.0), f"1763800000{point}123", '"2026-11-22 09:26:40.123 UTC+07:00"']
    title = ['"event"', '"experiment time"', '"system time"', '"system time text"']
    path = tmp_path / "Gyroscope 2026-11-22 09-26-40.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("Raw Data.csv", "\n".join([*lines, ""]))
        archive.writestr("meta/device.csv", f'"property"{between}"value"\n"version"{between}"1.2.0"\n')
        archive.writestr("meta/time.csv", f"{between.join(title)}\n{between.join(event)}\n")
    series = read_series(path)
    assert len(series) == t.size
    assert np.sqrt(np.mean((series.theta_rad - 0.3 * np.cos(2.9 * t)) ** 2)) < 1e-3
    assert series.meta["recorded_on"] == date(2026, 11, 22)
    raw = tmp_path / "raw.csv"
    raw.write_text("\n".join([*lines, ""]), encoding="utf-8")
    assert np.array_equal(read_series(raw).theta_rad, series.theta_rad)


def test_phyphox_without_a_gyroscope(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("Raw Data.csv", '"Time (s)","Sound pressure (dB)"\n0,1\n1,2\n2,3\n3,2\n')
    with pytest.raises(JobError, match="gyroscope"):
        read_series(tmp_path / "a.zip")


# -- positions --------------------------------------------------------------------------------------------------------


def test_circle_through_points_with_noise():
    rng = np.random.default_rng(3)
    angle = rng.uniform(-0.6, 0.6, 2000)
    x = 310 + 500 * np.sin(angle) + rng.normal(0, 0.5, angle.size)
    y = -40 - 500 * np.cos(angle) + rng.normal(0, 0.5, angle.size)
    circle = fit_circle(x, y)
    assert abs(circle.x - 310) < 4 * circle.sigma_centre
    assert abs(circle.radius - 500) < 4 * circle.sigma_radius < 2
    assert circle.scatter == pytest.approx(0.5, rel=0.1)


def test_a_wrong_origin_is_replaced_by_the_arc_s_centre():
    angle = np.linspace(-0.7, 0.7, 300)
    x, y = 0.3 + np.sin(angle), 0.2 - np.cos(angle)
    swing = swing_from_positions(x, y, origin=(0.0, 0.0), unit="m")
    assert np.allclose(swing.theta_rad, angle, atol=1e-9)
    assert any("not the pivot" in w for w in swing.warnings)


def test_points_on_a_line_are_no_pendulum():
    with pytest.raises(JobError, match="line"):
        swing_from_positions(np.linspace(0, 1, 50), np.linspace(0, 2, 50))


# -- the real recordings ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("file", "points", "low", "high"),
    [
        ("yyz/lab1_tracker.txt", 11133, -85.3, 85.9),
        ("yyz/lab2_tracker_one_length.txt", 3027, -18.9, 18.8),
        ("jlefebvre/q2_data.txt", 4502, -81.4, 78.4),
        ("jlefebvre/q4b_data1.txt", 152, -35.5, 37.9),
        ("jensen/pendulum_free_swing_data_02.txt", 4585, -111.7, 125.8),
        ("vinicius/posicoes.csv", 1560, -5.55, 7.48),
        ("dfki/sysid_data_measured.csv", 1170, -106.6, 181.1),
    ],
)
def test_real_series(shared_data, file, points, low, high):
    series = read_series(shared_data / file)
    assert len(series) == points
    assert np.degrees(series.theta_rad.min()) == pytest.approx(low, abs=0.06)
    assert np.degrees(series.theta_rad.max()) == pytest.approx(high, abs=0.06)
    assert series.meta["log"]


@pytest.mark.parametrize(
    "file", ["yyz/lab1_sorted_angle_vs_period.txt", "jlefebvre/q3_data.txt", "jlefebvre/q4a_data.txt"]
)
def test_tables_of_other_things_are_refused(shared_data, file):
    with pytest.raises(JobError):
        read_series(shared_data / file)


def test_real_projects(shared_data):
    files = sorted((shared_data / "jlefebvre").glob("*.trk"))
    assert len(files) == 10
    lengths = {}
    for file in files:
        series = read_series(file)
        assert len(series) >= 80
        lengths[file.stem] = series.meta["length_m"]
    stated = {f"pendulum_length{k}": inch * 0.0254 for k, inch in enumerate((44.75, 39.0, 34.25, 29.0, 25.25), 1)}
    for name, length in stated.items():  # the students' own tape measure, pivot to bob
        assert lengths[name] == pytest.approx(length, rel=0.04)


def test_the_project_and_its_export_agree(shared_data):
    """The students exported q2_data.txt from pendulum_fullPeriod.trk with Tracker itself."""
    ours = read_series(shared_data / "jlefebvre" / "pendulum_fullPeriod.trk")
    theirs = read_series(shared_data / "jlefebvre" / "q2_data.txt")
    assert len(ours) == len(theirs)
    assert np.max(np.abs(ours.theta_rad - theirs.theta_rad)) < 1e-4
    assert np.max(np.abs(ours.t_s - theirs.t_s)) < 0.04  # their times are frame/12 Hz by a rounded rate


def test_a_written_project_has_what_tracker_s_loaders_ask_for(tmp_path):
    """Tracker takes a missing boolean as false and a missing number as NaN: a track would be there and not be seen."""
    from xml.etree import ElementTree

    t = np.arange(50) / 25
    write_series(ThetaSeries(t, 0.4 * np.cos(5 * t), None, {"length_m": 0.4, "mass_kg": 0.1}), tmp_path / "swing.trk")
    panel = ElementTree.parse(tmp_path / "swing.trk").getroot()
    assert panel.get("class") == "org.opensourcephysics.cabrillo.tracker.TrackerPanel"

    def child(parent, name):
        return next(p for p in parent.findall("property") if p.get("name") == name)

    def names(parent):
        return {p.get("name") for p in parent.findall("property")}

    assert {"width", "height", "magnification", "videoclip", "clipcontrol", "coords", "tracks"} <= names(panel)
    assert {"startframe", "stepsize", "stepcount", "starttime"} <= names(child(panel, "videoclip").find("object"))
    assert {"rate", "delta_t", "frame"} <= names(child(panel, "clipcontrol").find("object"))
    coords = child(panel, "coords").find("object")
    assert {"fixedorigin", "fixedangle", "fixedscale", "locked", "framedata"} <= names(coords)
    mass = child(panel, "tracks").find("property/object")
    assert {"mass", "name", "color", "footprint", "visible", "trail", "framedata"} <= names(mass)
    assert child(mass, "visible").text == "true"
    steps = child(mass, "framedata")
    assert [p.get("name") for p in steps] == [f"[{k}]" for k in range(50)]
    assert all(names(p.find("object")) == {"x", "y"} for p in steps)
    kinds = {p.get("type") for p in panel.iter("property")}
    assert kinds <= {"string", "double", "int", "boolean", "object", "array", "collection"}

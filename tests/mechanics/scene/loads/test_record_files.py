"""Accelerograms from files: formats, columns, units, agencies; every record written here is synthetic."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.loads.record_files import read_accelerogram, read_accelerograms
from mechanics.scene.loads.record_formats import read_at2

ACCELERATION = 0.1 * np.sin(np.arange(12) / 2.0)  # [g]
TITLE = "PEER NGA STRONG MOTION DATABASE RECORD"
EVENT = "Synthetic test record, 1/1/2000, Nowhere, 090"
UNIT = "ACCELERATION TIME SERIES IN UNITS OF G"


def at2(path, steps="NPTS=     12, DT=   .0050 SEC", unit=UNIT, values=ACCELERATION, per_line=5):
    rows = [values[i : i + per_line] for i in range(0, len(values), per_line)]
    # Fortran's E15.7 without the leading zero, as the database writes it
    texts = ["".join(f"{value:15.7E}".replace("0.", " .").rjust(15) for value in row) for row in rows]
    path.write_text("\n".join([TITLE, EVENT, unit, steps, *texts]) + "\n")
    return path


def message_of(function, *arguments):
    with pytest.raises(SceneError) as caught:
        function(*arguments)
    return str(caught.value)


@pytest.mark.parametrize(
    "steps",
    [
        *("NPTS=     12, DT=   .0050 SEC", "NPTS=  12, DT= .00500 SEC,", "NPTS=12,DT=0.005SEC"),
        *("NPTS =   12 , DT =  5.0E-03 SEC", "npts= 12, dt= 0.005 sec"),
        *("     12    0.0050    NPTS, DT", "12 .005 NPTS, DT"),
    ],
)
def test_every_variant_of_the_header_is_understood(tmp_path, steps):
    found = read_at2(at2(tmp_path / "a.AT2", steps))
    assert found.dt == 0.005
    np.testing.assert_allclose(found.acceleration, 9.80665 * ACCELERATION, atol=1e-7)
    assert found.name == EVENT
    assert found.source.endswith("a.AT2")


@pytest.mark.parametrize("unit", ["ACCELERATION TIME HISTORY IN UNITS OF G", "Acceleration time series in g"])
def test_older_records_say_the_unit_in_other_words(tmp_path, unit):
    assert len(read_at2(at2(tmp_path / "a.at2", unit=unit))) == 12


def test_any_number_of_values_in_a_line_is_read(tmp_path):
    for per_line in (1, 8, 12):
        found = read_accelerogram(at2(tmp_path / "a.at2", per_line=per_line))
        np.testing.assert_allclose(found.acceleration, 9.80665 * ACCELERATION, atol=1e-7)


@pytest.mark.parametrize(
    ("changed", "line", "said"),
    [
        ({"steps": "12 values"}, 4, "no number of samples and step of time: '12 values'; write for example"),
        ({"steps": "NPTS= 12, DT= 0.0 SEC"}, 4, "no number of samples"),
        (
            {"unit": "VELOCITY TIME SERIES IN UNITS OF CM/S"},
            3,
            "not an acceleration in units of g: 'VELOCITY",
        ),
        ({"unit": "ACCELERATION IN CM/S/S"}, 3, "not an acceleration in units of g"),
        ({"values": ACCELERATION[:8]}, 6, "8 values, but NPTS = 12; the file is cut off"),
        ({"values": np.append(ACCELERATION, 0.5)}, 7, "more values than NPTS = 12"),
    ],
)
def test_a_malformed_record_is_refused_with_its_line(tmp_path, changed, line, said):
    path = at2(tmp_path / "bad.AT2", **changed)
    message = message_of(read_at2, path)
    assert message.startswith(f"{path}:{line}: ")
    assert said in message


@pytest.mark.parametrize("text", ["******", "0.1.2", "nan"])
def test_what_is_not_a_number_is_shown_with_its_line(tmp_path, text):
    path = at2(tmp_path / "bad.AT2")
    lines = path.read_text().splitlines()
    lines[5] = lines[5].replace(lines[5].split()[2], text)
    path.write_text("\n".join(lines))
    assert message_of(read_at2, path).startswith(f"{path}:6: {text!r} is not a number")


def test_a_file_that_is_too_short_is_refused(tmp_path):
    path = tmp_path / "short.AT2"
    path.write_text(f"{TITLE}\n{EVENT}\n")
    assert f"{path}:2: less than four lines" in message_of(read_at2, path)
    path.write_text("")
    assert f"{path}:1: less than four lines" in message_of(read_at2, path)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("g", 9.80665), ("m/s2", 1.0), ("cm/s2", 0.01), ("m/s²", 1.0), ("CM/SEC²", 0.01), ("m·s⁻²", 1.0)],
)
@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", "])
def test_a_table_is_read_in_its_unit(tmp_path, unit, factor, separator):
    rows = [f"{2.0 + 0.02 * i:.2f}{separator}{a:.9f}" for i, a in enumerate(ACCELERATION)]
    path = tmp_path / "record.csv"
    path.write_text("# synthetic\ntime" + separator + "acceleration\n\n" + "\n".join(rows) + "\n")
    found = read_accelerogram(path, unit)
    assert found.dt == pytest.approx(0.02)
    np.testing.assert_allclose(found.acceleration, factor * ACCELERATION, atol=1e-8)
    assert found.name == "record"


def test_a_table_needs_no_header_and_may_round_its_times(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(f"{i / 30:.3f},{a}" for i, a in enumerate(ACCELERATION)))
    assert read_accelerogram(path, "g").dt == pytest.approx(1 / 30, rel=1e-2)


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("time,a\n0.0,1.0\n0.1,x\n", 3, "'x' is not a number"),
        ("0.0,1.0\nagain,1\n", 2, "'again' is not a number"),
        ("0,1,2,3,4\n1,1,2,3,4\n", 1, "5 columns; give time, and one to three"),
        ("0.0,1.0\n0.1\n", 2, "1 columns"),
        ("0.0,1\n0.1,1\n0.3,1\n0.4,1\n", 3, "time 0.3 s is not at equal steps of 0.133333 s; resample"),
        ("0.1,1\n0.1,1\n0.1,1\n", 2, "time 0.1 s is not at equal steps of 0 s"),
        ("0.0,1\n0.1,inf\n", 2, "'inf' is not a number"),
    ],
)
def test_a_malformed_table_is_refused_with_its_line(tmp_path, text, line, said):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    message = message_of(read_accelerogram, path, "g")
    assert message.startswith(f"{path}:{line}: ")
    assert said in message


def test_a_table_without_rows_unit_or_file_is_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,a\n0.0,1.0\n")
    assert "1 rows of numbers" in message_of(read_accelerogram, path, "g")
    path.write_text("time,a\n0.0,1.0\n0.1,1.0\n")
    assert "the unit of the acceleration is not known; give g, m/s2, cm/s2, gal, mm/s2, %g" in message_of(
        read_accelerogram, path
    )
    assert "unknown unit 'furlong'" in message_of(read_accelerogram, path, "furlong")
    assert "no such file; check the path" in message_of(read_at2, tmp_path / "none.AT2")
    assert "cannot be read" in message_of(read_accelerogram, tmp_path, "g")


ROWS = "   0.000   0.114   0.245   0.394   0.558\n" * 20


@pytest.mark.parametrize(
    ("first", "name"),
    [
        ("Corrected accelerogram        CSMIP", "CSMIP"),
        ("UNCORRECTED ACCELEROGRAM DATA", "CSMIP"),
        ("Corrected acceleration    (Format v01.20 with 13 text lines) Src: x", "COSMOS"),
        ("Raw acceleration counts   (Format v01.00 with 13 text lines)", "COSMOS"),
        ("Corrected accelerogram   GNS", "GeoNet"),
    ],
)
def test_formats_of_agencies_are_named(tmp_path, first, name):
    path = tmp_path / "a.v2"
    path.write_text(first + "\ntext\n" + ROWS)
    with pytest.raises(SceneError, match=rf"in the format of {name}.*not read.*as CSV"):
        read_accelerogram(path, "m/s2")


GRAVITY = 9.80665
TIMES = 0.01 * np.arange(20)
VALUES = 0.2 * np.sin(np.arange(20))


def write(path, head, *columns):
    rows = zip(TIMES, *columns, strict=True)
    path.write_text(head + "".join("\t".join(f"{one:.6f}" for one in row) + "\n" for row in rows))
    return path


@pytest.mark.parametrize(
    "head",
    [
        "Station 2020\n\nTime [sec]\tAcceleration [g]\tVelocity [cm/sec]\tDisplacement [cm]\n",
        "t\tacc [g]\tvel\tdisp\n",
        "# from a programme\nZeit (s)\ta (g)\tb (cm/s)\tc (mm)\n",
    ],
)
def test_velocities_and_displacements_beside_an_acceleration_are_left_out(tmp_path, head):
    path = write(tmp_path / "station.txt", head, VALUES, 100.0 + VALUES, 200.0 + VALUES)
    (found,) = read_accelerograms(path)
    np.testing.assert_allclose(found.acceleration, GRAVITY * VALUES, atol=1e-5)


def test_a_table_without_an_acceleration_is_refused(tmp_path):
    path = write(tmp_path / "a.txt", "Time [s]\tVelocity [cm/s]\tDisplacement [cm]\n", VALUES, VALUES)
    with pytest.raises(SceneError, match=r"no acceleration among Time \[s\], Velocity"):
        read_accelerogram(path, "g")


@pytest.mark.parametrize(("unit", "size"), [("m/s2", 290.0), ("g", 6.0), ("m/s2", -50.0)])
def test_a_record_beyond_all_that_were_measured_is_questioned(tmp_path, unit, size):
    path = write(tmp_path / "a.txt", "", size * VALUES / np.abs(VALUES).max())
    with pytest.raises(SceneError, match=r"a peak of .* g, more than was ever recorded; correct the unit"):
        read_accelerogram(path, unit)


def test_the_strongest_record_is_taken(tmp_path):
    path = write(tmp_path / "a.txt", "", 40.22 * VALUES / np.abs(VALUES).max())
    assert np.abs(read_accelerogram(path, "m/s2").acceleration).max() == pytest.approx(40.22)


def test_a_gap_is_at_its_line(tmp_path):
    path = write(tmp_path / "a.txt", "t\ta [g]\n", VALUES)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:12] + lines[15:]))
    with pytest.raises(SceneError, match=r"a\.txt:13: time 0\.14 s is not at equal steps"):
        read_accelerogram(path)


def test_blanks_separate_numbers_with_decimal_commas(tmp_path):
    path = tmp_path / "a.txt"
    lines = [f"{t:.2f} {a:.3f}".replace(".", ",") for t, a in zip(TIMES, VALUES, strict=True)]
    path.write_text("\n".join(lines))
    np.testing.assert_allclose(read_accelerogram(path, "m/s2").acceleration, VALUES, atol=6e-4)

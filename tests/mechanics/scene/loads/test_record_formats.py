"""Records as databases publish them; those written here follow the published formats, with synthetic values."""

import re
from pathlib import Path

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.loads.record_files import read_accelerogram, read_accelerograms, read_station

VALUES = 12.5 * np.sin(np.arange(40) / 3.0)  # [cm/s²]
EAST, NORTH, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def esm(stream="HNE", unit="cm/s^2", values=VALUES, count=None, kind="ACCELERATION"):
    """The header of ESM and ITACA (DYNA 1.2), shortened."""
    keys = [
        *("EVENT_NAME: NOWHERE", "EVENT_ID: XX-2000-0001", "EVENT_DATE_YYYYMMDD: 20000101"),
        *("MAGNITUDE_W: 5.2", "NETWORK: XX", "STATION_CODE: ABC", "VS30_M/S:"),
        "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS: 20000101_010000.000",
        "SAMPLING_INTERVAL_S: 0.005000",
        f"NDATA: {len(values) if count is None else count}",
        f"STREAM: {stream}",
        f"UNITS: {unit}",
        "PGA_CM/S^2: 12.5",
        "LATE/NORMAL_TRIGGERED: NT",
        f"DATA_TYPE: {kind}",
        "USER1:",
    ]
    return "\n".join([*keys, *(f"{one:12.6f}" for one in values)]) + "\n"


def knet(direction="N-S"):
    """The header of K-NET: a key in 18 columns, then its value."""
    counts = np.round(VALUES * 8388608 / 2000).astype(int) + 4711
    lines = [
        ("Origin Time", "2000/01/01 01:00:00"),
        ("Lat.", "38.9"),
        ("Long.", "140.6"),
        ("Depth. (km)", "7"),
        ("Mag.", "5.9"),
        ("Station Code", "XXX001"),
        ("Station Lat.", "39.6"),
        ("Station Long.", "140.3"),
        ("Station Height(m)", "34"),
        ("Record Time", "2000/01/01 01:00:15"),
        ("Sampling Freq(Hz)", "100Hz"),
        ("Duration Time(s)", "0.4"),
        ("Dir.", direction),
        ("Scale Factor", "2000(gal)/8388608"),
        ("Max. Acc. (gal)", "12.5"),
        ("Last Correction", "2000/01/01 01:00:00"),
        ("Memo.", ""),
    ]
    head = [f"{key:18}{value}" for key, value in lines]
    rows = ["".join(f"{one:9d}" for one in counts[k : k + 8]) for k in range(0, len(counts), 8)]
    return "\n".join([*head, *rows]) + "\n"


def smc(kind="2 CORRECTED ACCELEROGRAM", inclination=90, azimuth=360):
    """SMC: 11 lines of text, 48 integers of ten characters, 50 reals of fifteen, comments, values of ten."""
    text = [kind, "*", "XX", "2000 01 01", "Moment Mag=5.2", "station = NOWHERE", *["*"] * 5]
    integers = [-32768] * 48
    integers[12], integers[13], integers[15], integers[16] = inclination, azimuth, 2, len(VALUES)
    reals = [1.7e38] * 50
    reals[1] = 200.0
    lines = text + ["".join(f"{one:10d}" for one in integers[k : k + 8]) for k in range(0, 48, 8)]
    lines += ["".join(f"{one:15.7E}" for one in reals[k : k + 5]) for k in range(0, 50, 5)]
    lines += ["| a comment", "| another"]
    lines += ["".join(f"{one:10.3E}" for one in VALUES[k : k + 8]) for k in range(0, len(VALUES), 8)]
    return "\n".join(lines) + "\n"


def write(path: Path, text: str, encoding="utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


def message_of(*arguments, **named):
    with pytest.raises(SceneError) as caught:
        read_accelerogram(*arguments, **named)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "dt", "direction", "away"),
    [
        (esm(), 0.005, EAST, 1e-8),
        (esm("N"), 0.005, NORTH, 1e-8),
        (esm("HNZ", "m/s^2", VALUES / 100), 0.005, UP, 1e-6),
        (esm().replace("\n", "\r\n"), 0.005, EAST, 1e-8),
        (knet(), 0.01, NORTH, 1e-5),
        (knet("5"), 0.01, EAST, 1e-5),
        (smc(), 0.005, NORTH, 1e-4),
        (smc("1 UNCORRECTED ACCELEROGRAM", 0, 0), 0.005, UP, 1e-4),
    ],
)
def test_the_format_unit_step_and_direction_are_those_of_the_file(tmp_path, text, dt, direction, away):
    found = read_accelerogram(write(tmp_path / "record.txt", text))
    expected = VALUES / 100
    if text.startswith("Origin"):
        expected = expected - expected.mean()
    assert found.dt == pytest.approx(dt)
    np.testing.assert_allclose(found.direction, direction, atol=1e-12)
    np.testing.assert_allclose(found.acceleration, expected, atol=away)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (esm(count=41), ":56: 40 values, but NDATA is 41; the file is cut off"),
        (esm(kind="VELOCITY"), ":15: the data are 'VELOCITY'; give the file of the acceleration"),
        (esm(unit="counts"), ":12: unknown unit 'counts'"),
        (esm().replace("0.000000", "0.0000x0", 1), ": '"),
        (knet().replace("Scale Factor", "Scale"), "no Scale Factor in the header"),
        (knet().replace("100Hz", "Hz"), ":11: no Sampling Freq in the header"),
        (smc("3 VELOCITY"), ":1: '3 VELOCITY' is not an acceleration"),
        (smc()[:-30], "is not a number"),
        ("\n".join(smc().splitlines()[:-2]), "the file is cut off"),
    ],
)
def test_a_damaged_record_is_refused_with_its_line(tmp_path, text, said):
    path = write(tmp_path / "record.txt", text)
    message = message_of(path)
    assert message.startswith(str(path))
    assert said in message


def table(columns, separator=";", mark=",", head=None, step=0.01):
    rows = [
        separator.join(f"{one:.6f}".replace(".", mark) for one in row) for row in zip(*columns, strict=True)
    ]
    return "\n".join(([head] if head else []) + rows) + "\n"


TIMES = 0.01 * np.arange(40)


@pytest.mark.parametrize(
    ("text", "given"),
    [
        (table([TIMES, VALUES]), {"unit": "cm/s2"}),
        (table([TIMES, VALUES], "\t", ","), {"unit": "cm/s2"}),
        (table([TIMES, VALUES], " ", ","), {"unit": "cm/s2"}),
        (table([TIMES, VALUES], ",", "."), {"unit": "cm/s2"}),
        (table([TIMES, VALUES], ";", ".", "t [s];a [cm/s2]"), {}),
        (table([TIMES, VALUES / 980.665], ";", ",", "Zeit;Beschleunigung (g)"), {}),
        (table([1000 * TIMES, VALUES], ";", ",", "t [ms];a [gal]"), {}),
        ("sep=;\n" + table([TIMES, VALUES]), {"unit": "cm/s2"}),
        ("# unit: cm/s^2\n" + table([TIMES, VALUES]), {}),
        ("A title\n" + table([TIMES, VALUES], ";", ",", '"time";"acc"'), {"unit": "cm/s2"}),
        ("﻿" + table([TIMES, VALUES], ";", ",", "t;a"), {"unit": "cm/s2"}),
        (table([VALUES]), {"unit": "cm/s2", "dt": 0.01}),
        (table([VALUES], ";", "."), {"unit": "cm/s2", "dt": 0.01}),
        (table([VALUES], ";", ".", "a [m/s2]").replace("a [m/s2]", "a [cm/s2]"), {"dt": 0.01}),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_tables_of_one_component(tmp_path, text, given, encoding):
    found = read_accelerogram(write(tmp_path / "a.csv", text, encoding), **given)
    assert found.dt == pytest.approx(0.01)
    np.testing.assert_allclose(found.acceleration, VALUES / 100, atol=2e-5)


@pytest.mark.parametrize("head", [None, "t;x;y;z", "time [s];E;N;Z", "t;acc_x;acc_y;acc_z", "t;a E;a N;a UP"])
@pytest.mark.parametrize("timed", [True, False])
def test_tables_of_three_components(tmp_path, head, timed):
    columns = [VALUES, 2 * VALUES, -VALUES]
    text = table(
        [TIMES, *columns] if timed else columns,
        head=head if timed or head is None else head.partition(";")[2],
    )
    path = write(tmp_path / "a.csv", text)
    given = {} if timed else {"dt": 0.01}
    found = read_accelerograms(path, "cm/s2", **given)
    assert [one.direction for one in found] == [EAST, NORTH, UP]
    np.testing.assert_allclose(
        read_accelerogram(path, "cm/s2", axis="y", **given).acceleration, VALUES / 50, atol=2e-8
    )


@pytest.mark.parametrize(
    ("text", "given", "said"),
    [
        (table([VALUES]), {"unit": "g"}, "the table has no times; give 'dt'"),
        (table([TIMES, VALUES]), {"unit": "g", "dt": 0.02}, "the times are 0.01 s apart, but dt = 0.02 s"),
        (
            table([TIMES, VALUES], head="t;a [g]"),
            {"unit": "cm/s2"},
            "the file states 'g', but unit = 'cm/s2'",
        ),
        (table([TIMES, VALUES, VALUES]), {"unit": "m/s2", "axis": "z"}, "2 components"),
        (table([TIMES, VALUES], ",", ","), {"unit": "g"}, "not at equal steps"),
        ("0;1\n1;2;3\n", {"unit": "g"}, ":2: 3 columns"),
        ("0;a\n1;2\n", {"unit": "g"}, ":1: 'a' is not a number"),
    ],
)
def test_a_table_that_does_not_say_enough_is_refused(tmp_path, text, given, said):
    assert said in message_of(write(tmp_path / "a.csv", text), **given)


def test_the_components_of_a_station_are_found(tmp_path):
    for stream, factor in (("HNE", 1.0), ("HNN", 2.0), ("HNZ", -1.0)):
        write(tmp_path / f"XX.ABC.00.{stream}.ASC", esm(stream, values=factor * VALUES))
    found = read_station(tmp_path / "XX.ABC.*.ASC")
    assert [one.direction for one in found] == [EAST, NORTH, UP]
    assert [round(one.peak / found[0].peak, 6) for one in found] == [1.0, 2.0, 1.0]
    with pytest.raises(SceneError, match="no such file"):
        read_station(tmp_path / "YY*.ASC")
    write(tmp_path / "XX.ABC.01.HNE.ASC", esm("HNE"))
    with pytest.raises(SceneError, match="not square to each other"):
        read_station(tmp_path / "XX.ABC.*.ASC")
    write(tmp_path / "one.ASC", esm("HN?"))
    with pytest.raises(SceneError, match=r"direction of .* is not stated"):
        read_station(tmp_path / "one.ASC")


def test_files_of_other_programs_are_read_through_obspy(tmp_path):
    """K-NET's own file, and SAC and MiniSEED, as obspy ships them for its tests."""
    obspy = pytest.importorskip("obspy")
    folder = Path(obspy.__file__).parent / "io"
    knet_file = folder / "nied/tests/data/test.knet"
    trace = obspy.read(str(knet_file))[0]
    values = trace.data * trace.stats.calib
    found = read_accelerogram(knet_file)
    np.testing.assert_allclose(found.acceleration, values - values.mean(), atol=1e-12)
    assert (found.dt, found.direction) == (0.01, EAST)
    for file in ("sac/tests/data/test.sac", "mseed/tests/data/test.mseed"):
        trace = obspy.read(str(folder / file))[0]
        found = read_accelerogram(folder / file, "cm/s2")
        assert found.dt == trace.stats.delta
        np.testing.assert_allclose(found.acceleration, 0.01 * trace.data)
    with pytest.raises(SceneError, match="the unit of the acceleration is not known"):
        read_accelerogram(folder / "sac/tests/data/test.sac")


def test_obspy_names_itself_where_it_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "obspy", None)
    path = tmp_path / "a.sac"
    path.write_bytes(b"\0" * 700)
    assert re.search(r"need the package obspy.*pip install 'moma-masonry\[records\]'", message_of(path, "g"))

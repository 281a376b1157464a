"""Records with other quantities beside the acceleration, and records in a wrong unit."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.loads.record_files import read_accelerogram, read_accelerograms

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

"""Records in formats of agencies that are not read are named for what they are."""

import pytest

from ground.errors import SceneError
from mechanics.scene.loads.record_files import read_accelerogram

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

"""Closed solids written as OBJ, with a head beside them, and read back."""

from dataclasses import replace

import numpy as np

from survey.formats.native.reader import read_head
from survey.formats.native.writer import write_head
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.formats.solids.obj_writer import write_obj
from survey.records.survey import SolidRecord
from synthetic.buildings.ribs import RibVaultShape, rib_vault


def test_solids_are_read_back_to_the_last_bit(tmp_path):
    vault = rib_vault(RibVaultShape(segments=4))
    head = replace(vault.building.survey.head, name="ribs (synthetic)")
    write_obj(vault.building.modelled, tmp_path / "ribs.obj")
    write_head(head, tmp_path / "head.moma")
    read = read_head(tmp_path / "head.moma")
    assert read.name == "ribs (synthetic)"
    np.testing.assert_array_equal(read.stations[0].position, head.stations[0].position)
    assert [(rule.kind, rule.depth, rule.source) for rule in read.depth_rules] == [
        (rule.kind, rule.depth, rule.source) for rule in head.depth_rules
    ]
    stream = open_survey(tmp_path / "ribs.obj", "solids", ReadingOptions(head=read))
    back = [one for one in stream.blocks if isinstance(one, SolidRecord)]
    assert len(back) == len(vault.building.modelled)
    for one, solid in zip(back, vault.building.modelled, strict=True):
        assert (one.code, one.kind) == (solid.code, solid.kind)
        assert {tuple(row) for row in one.vertices.tolist()} == {
            tuple(row) for row in solid.vertices.tolist()
        }
        assert sorted(map(len, one.faces)) == sorted(map(len, solid.faces))

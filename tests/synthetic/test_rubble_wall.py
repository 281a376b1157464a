"""The sample of rubble: its mask, the stones that come of it, and the scene that they make."""

import io
import json

import numpy as np
import pytest
from PIL import Image
from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from ground.errors import UsageError
from pipelines.ingest.ingest import ingest
from pipelines.ingest.outlined import mask_options
from pipelines.run.assemble import assemble
from pipelines.run.check import check_scene
from pipelines.scene.file import read_scene
from survey.formats.options import ReadingOptions
from synthetic.rubble_wall import DEPTH, SIZE, make_rubble_wall, mask_png
from synthetic.write import write_sample


def area(ring):
    x, y = np.transpose(ring)
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rubble")
    write_sample("rubble-wall", folder)
    options = mask_options(ReadingOptions(kind="rubble"), f"{SIZE[0]}x{SIZE[1]}", DEPTH)
    ingest([folder / "wall.png"], f"sqlite:///{folder}/a.db", "masks", options=options)
    return folder


@pytest.fixture(scope="module")
def assembly(place):
    with open_database(f"sqlite:///{place}/a.db", create=False) as database, database.session() as session:
        assert isinstance(session, Session)
        return assemble(read_scene(place / "rubble-wall.toml"), session)


def test_the_mask_is_the_stones():
    wall = make_rubble_wall()
    picture = Image.open(io.BytesIO(mask_png(wall)))
    assert "synthetic" in picture.text["Title"]
    white = float((np.asarray(picture) > 0).mean())
    assert white == pytest.approx(sum(map(area, wall.stones)) / (SIZE[0] * SIZE[1]), abs=0.002)
    assert mask_png(make_rubble_wall()) == mask_png(wall)


def test_grown_stones_are_the_cells_that_they_were_cut_from(assembly):
    wall = make_rubble_wall()
    (leaf,) = assembly.closing.leaves
    assert len(leaf.grown) == len(wall.cells) == 40
    for ring in leaf.grown.values():
        cell = min(wall.cells, key=lambda one: float(np.hypot(*(one.mean(axis=0) - ring.mean(axis=0)))))
        # where joints of other thickness meet, a medial line bends towards the thinner one
        assert area(ring) == pytest.approx(area(cell), rel=0.05)
    mean = np.average(list(wall.joints.values()))
    pairs = [value for stones, value in leaf.thickness.items() if len(stones) == 2]
    assert np.mean(pairs) == pytest.approx(mean, rel=0.04)


def test_the_scene_knows_thickness_and_density(assembly):
    (leaf,) = assembly.closing.leaves
    scene = assembly.scene
    assert scene.contact.thickness == dict(leaf.thickness)
    mass = 0.0
    for block in scene.blocks:
        share = leaf.stone_share[block.code]
        assert block.material.density == pytest.approx(2600.0 * share + 1800.0 * (1.0 - share))
        mass += block.material.density * DEPTH * area(leaf.grown[block.code])
    stone = leaf.stones_over_all
    assert mass == pytest.approx(
        SIZE[0] * SIZE[1] * DEPTH * (2600.0 * stone + 1800.0 * (1.0 - stone)), rel=1e-3
    )


def test_check_tells_the_shares_and_the_thickness(place):
    report = check_scene(place / "rubble-wall.toml", f"sqlite:///{place}/a.db")
    assert report.problems == ()
    assert report.simplification is None
    (leaf,) = report.joints.leaves
    assert (leaf.stones, leaf.width, leaf.height) == (40, *SIZE)
    assert 0.010 < leaf.thinnest < leaf.thickness < leaf.thickest < 0.026
    first, second = leaf.in_words()
    assert first == "leaf of 40 stones, 1.000 × 1.200 m: 81.5 % stone, 18.5 % mortar"
    assert second.startswith(f"mortar between {leaf.pairs} pairs of stones")
    truth = json.loads((place / "truth.json").read_text(encoding="utf-8"))
    assert len(truth["stones"]) == 40


def test_the_sample_has_no_options(tmp_path):
    with pytest.raises(UsageError, match="it has none"):
        write_sample("rubble-wall", tmp_path, small=True)

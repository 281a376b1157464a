"""Elevations: millimetres of paper at the stated scale, near stones over far ones, codes that stay text."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.shapes import BOX_FACES, box_corners
from pipelines.reports.page.elevation import elevation
from pipelines.reports.page.model import Model
from pipelines.reports.page.surfaces import stones_of

SVG = "{http://www.w3.org/2000/svg}"


def boxes(*places, codes=None, towards=(0.0, -1.0, 0.0)):
    shapes = [(box_corners(low, high), BOX_FACES) for low, high in places]
    mesh, _ = stones_of(codes or [f"S{k}" for k in range(len(places))], shapes)
    return Model("Boxes", mesh, towards=np.array(towards))


def outlines(drawn):
    root = ET.fromstring(str(drawn.svg))
    paths = root.find(f"{SVG}g").findall(f"{SVG}path")
    return [np.array([one.split() for one in path.get("d")[1:-1].split("L")], dtype=float) for path in paths]


def test_lengths_on_paper_are_those_of_the_scale():
    drawn = elevation(boxes(((0, 0, 0), (4, 1, 3))))
    assert drawn.scale == 25
    (face,) = outlines(drawn)
    np.testing.assert_allclose(np.ptp(face, axis=0), [4000 / 25, 3000 / 25], atol=0.02)
    assert "1 : 25" in drawn.svg
    assert ET.fromstring(str(drawn.svg)).get("width") == "164.0mm"


def test_a_given_scale_holds():
    (face,) = outlines(elevation(boxes(((0, 0, 0), (4, 1, 3))), scale=100))
    np.testing.assert_allclose(np.ptp(face, axis=0), [40, 30], atol=0.02)


def test_near_stones_are_drawn_after_far_ones():
    near, far = ((0, 0, 0), (1, 1, 1)), ((0, 5, 0), (3, 6, 1))
    first, last = outlines(elevation(boxes(near, far)))
    assert np.ptp(first[:, 0]) > np.ptp(last[:, 0])
    seen_from_behind = outlines(elevation(boxes(near, far, towards=(0.0, 1.0, 0.0))))
    assert np.ptp(seen_from_behind[0][:, 0]) < np.ptp(seen_from_behind[1][:, 0])


def test_codes_are_text():
    drawn = elevation(boxes(((0, 0, 0), (40, 1, 30)), codes=["<script>&"]), scale=200)
    texts = [one.text for one in ET.fromstring(str(drawn.svg)).iter(f"{SVG}text")]
    assert "<script>&" in texts


def test_what_cannot_be_drawn_is_none():
    model = boxes(((0, 0, 0), (1, 1, 1)))
    assert elevation(model, most=0) is None
    nothing = replace(model.stones, triangles=np.zeros((0, 3), dtype=np.int64))
    assert elevation(replace(model, stones=nothing)) is None


@pytest.mark.parametrize("towards", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (-1.0, -1.0, 0.2)])
def test_any_direction_has_an_elevation(towards):
    assert elevation(boxes(((0, 0, 0), (1, 2, 3)), towards=towards)).drawn >= 1

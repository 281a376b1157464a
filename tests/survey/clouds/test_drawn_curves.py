"""Curves of drawings by hand: single lines that close, labels and their stones, frames, and names by texts."""

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.clouds.outlines import dxf
from survey.clouds.outlines import dxf_entities as entities
from survey.clouds.outlines.dxf_entities import Curve, DrawnText

SQUARE = np.array([[0.0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]])


def piece(*places, layer="A", kind="LINE", handle="1F", label=None):
    return entities._Piece(np.array(places, float), layer, kind, handle, label)


SIDES = [piece(SQUARE[k], SQUARE[(k + 1) % 4], handle=f"{k}") for k in range(4)]


def area(ring):
    x, y = np.array(ring)[:, :2].T
    return abs(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 0, 3, 1)])
@pytest.mark.parametrize("turned", [(), (1,), (0, 3), (0, 1, 2, 3)])
def test_lines_in_any_order_and_direction_close_to_the_outline_that_they_draw(order, turned):
    some = [SIDES[k] for k in order]
    pieces = [
        piece(one.places[1], one.places[0], handle=one.handle) if int(one.handle) in turned else one
        for one in some
    ]
    (curve,), rest = entities._chained(pieces)
    assert rest == []
    assert area(curve.ring) == pytest.approx(12.0)
    assert len(curve.ring) == 4
    assert curve.where == f"4 LINE from {order[0]} on layer A"
    assert curve.chained


def test_a_polyline_of_several_corners_is_walked_from_its_nearer_end():
    open_side = piece([4.0, 3, 0], [2, 4, 0], [0, 3, 0], handle="9")
    other = piece([0.0, 3, 0], [0, 0, 0], [4, 0, 0], [4, 3, 0], handle="8")
    for pieces in ([open_side, other], [other, open_side]):
        (curve,), _ = entities._chained(pieces)
        assert area(curve.ring) == pytest.approx(14.0)
        assert len(curve.ring) == 5


def test_lines_that_leave_a_gap_or_branch_are_no_outline():
    assert entities._chained(SIDES[:3]) == ([], SIDES[:3])
    branch = piece([4.0, 3, 0], [9, 9, 0], handle="7")
    assert entities._chained([*SIDES, branch])[0] == []
    # ends that miss each other by a thousandth of a side or less meet
    near = piece([0.0, 3.0, 0.0], [0.0, 1e-3 * entities._CLOSE, 0.0], handle="3")
    assert len(entities._chained([*SIDES[:3], near])[0]) == 1


def test_lines_of_two_layers_or_labels_do_not_close():
    other = piece(*SIDES[3].places, layer="B", handle="3")
    assert entities._chained([*SIDES[:3], other])[0] == []
    labelled = piece(*SIDES[3].places, label=5, handle="3")
    assert entities._chained([*SIDES[:3], labelled])[0] == []
    apart = [piece(*(one.places + np.array([10.0, 0, 0])), handle=one.handle) for one in SIDES]
    assert len(entities._chained([*SIDES, *apart])[0]) == 2


def test_a_curve_is_closed_where_its_ends_meet():
    almost = np.vstack([SQUARE, [[0.0, 4 * 0.5 * entities._CLOSE, 0.0]]])
    open_ = np.vstack([SQUARE, [[0.0, 4 * 2.0 * entities._CLOSE, 0.0]]])
    assert entities._meets(almost)
    assert not entities._meets(open_)
    assert len(entities._opened(almost)) == 4
    assert entities._opened(open_) is open_
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]])
    assert entities._opened(triangle) is triangle


def test_boxes_lie_within_others_and_are_alike():
    outer = entities._box(SQUARE)
    assert outer.tolist() == [0.0, 0.0, 4.0, 3.0]
    assert entities._within(np.array([1.0, 1, 3, 2]), outer)
    assert not entities._within(np.array([1.0, 0, 3, 2]), outer)
    assert not entities._within(np.array([1.0, 1, 4, 2]), outer)
    most = 4.0 * entities._SAME_BOX
    assert entities._alike(outer + 0.9 * most, outer)
    assert not entities._alike(outer + np.array([0.0, 0.0, 0.0, 1.1 * most]), outer)


def text(words, *places, **values):
    return DrawnText(tuple(np.array([*place, 0.0]) for place in places), (words,) if words else (), values)


def test_the_text_next_to_the_end_of_a_leader_stands_where_its_arrow_points():
    texts = [text("A", (10, 10)), text("B", (0, 5), (20, 20))]
    tip, end = np.array([1.0, 1.0, 0.0]), np.array([19.0, 19.0, 0.0])
    moved = entities._led(texts, [(tip, end)])
    assert moved[0] is texts[0]
    assert [place[:2].tolist() for place in moved[1].places] == [[1.0, 1.0], [0.0, 5.0], [20.0, 20.0]]
    assert entities._led([], [(tip, end)]) == []


def curve(left, low, right, high, layer="0", **more):
    ring = np.array([[left, low, 0], [right, low, 0], [right, high, 0], [left, high, 0]], float)
    return Curve(ring, layer, f"curve on {layer}", **more)


def test_a_text_is_of_the_smallest_curve_around_it_and_counts_for_those_around_that():
    curves = [curve(0, 0, 10, 10), curve(1, 1, 4, 4), curve(20, 20, 21, 21)]
    inner, outer, nowhere = text("A", (2, 2)), text("B", (8, 8)), text("C", (15, 15))
    labels, around = dxf._labelled(curves, [inner, outer, nowhere])
    assert labels == {1: [inner], 0: [outer]}
    assert dict(around) == {0: 1}
    # of several places the first that lies in a curve counts
    led = text("D", (15, 15), (20.5, 20.5), (2, 2))
    assert dxf._labelled(curves, [led])[0] == {2: [led]}


def test_texts_and_outlines_in_an_upright_wall_are_seen_from_its_side():
    ring = np.array([[0.0, 5, 0], [4, 5, 0], [4, 5, 3], [0, 5, 3]])
    assert dxf._is_inside(np.array([2.0, 9.0, 1.0]), ring)
    assert not dxf._is_inside(np.array([2.0, 5.0, 4.0]), ring)
    assert dxf._area(ring) == pytest.approx(12.0)


def test_curves_of_labels_in_a_stone_are_symbols():
    stones = [curve(0, 0, 10, 10), curve(10, 0, 20, 10)]
    circle = {"block": "TAG"}
    symbols = [curve(4, 4, 5, 5, label=1, **circle), curve(14, 4, 15, 5, label=2, **circle)]
    assert dxf._without_symbols([*stones, *symbols]) == stones
    # labels that are the stones, each with its number, stay, and so do stones without any around them
    assert dxf._without_symbols(symbols) == symbols
    # one symbol that stands beside its stone goes with the others of its block
    beside = curve(30, 4, 31, 5, label=3, **circle)
    assert dxf._without_symbols([*stones, *symbols, beside]) == stones
    apart = [curve(30 + 2 * k, 4, 31 + 2 * k, 5, label=3 + k, **circle) for k in range(3)]
    assert dxf._without_symbols([*stones, *symbols, *apart]) == [*stones, *apart]


def outline(curve_, *texts, by_layer=False, number=7):
    return dxf._outline(number, curve_, texts, by_layer, {}, {}, "a.dxf")


def test_a_stone_is_named_by_its_text_its_layer_or_its_number():
    assert outline(curve(0, 0, 1, 1)).code == "S7"
    named = outline(curve(0, 0, 1, 1, "STONES"), text("Q 12", (0.5, 0.5)))
    assert (named.code[0], named.code[-2:], named.doubts) == ("Q", "12", ())
    assert named.said.notes["layer"] == "STONES"
    assert "layer" not in outline(curve(0, 0, 1, 1)).said.notes
    assert outline(curve(0, 0, 1, 1, "L3"), text("A", (0.5, 0.5)), by_layer=True).code == "L3"
    two = outline(curve(0, 0, 1, 1), text("A1", (0.5, 0.5)), text("A2", (0.6, 0.5)))
    assert two.code == "A1"
    assert two.doubts == (("texts", "2 texts inside: A1, A2"),)


def test_a_frame_around_many_stones_is_refused_with_the_layers_that_leave_it_out():
    frame = curve(0, 0, 50, 50, "FRAME")
    with pytest.raises(SurveyError, match="holds 9 texts of other outlines") as raised:
        dxf._refuse_frame(frame, 9, ["STONES", "ARCH", "STONES"], "a.dxf")
    assert "--layer STONES,ARCH" in raised.value.remedy
    with pytest.raises(SurveyError) as raised:
        dxf._refuse_frame(frame, 9, ["FRAME", "FRAME", "STONES"], "a.dxf")
    assert "put it on another layer" in raised.value.remedy


def test_layers_are_named_by_one_word_or_several():
    assert dxf._layers(" Quader, BOGEN ") == {"quader, bogen", "quader", "bogen"}
    assert dxf._layers(None) == frozenset()


def test_curves_of_single_lines_are_stones_where_they_hold_texts():
    texts = [text("A", (0.5, 0.5))]
    assert dxf._is_stone(0, {0: texts}, {0: 0}, texts)
    assert not dxf._is_stone(1, {0: texts}, {1: 0}, texts)
    assert dxf._is_stone(1, {}, {1: 0}, [])
    assert not dxf._is_stone(0, {0: texts}, {0: dxf._FRAMED}, texts)

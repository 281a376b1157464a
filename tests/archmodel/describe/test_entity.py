"""What `describe` tells of a stone: knowledge of its own and of its structures, relations, joints of the latest run."""

import json
from dataclasses import replace

import numpy as np

from archmodel.assertions.arrange import declare_members, declare_relation, declare_structure
from archmodel.assertions.declare import PropertyValue, declare_document, declare_material, declare_phase
from archmodel.assertions.statements import (
    Remark,
    say_depth,
    say_made_of,
    say_mason_mark,
    say_note,
    say_observation,
    say_of_phase,
    say_reference,
)
from archmodel.database.session import Database
from archmodel.describe.entity import describe
from archmodel.store.find_by_code import subjects
from archmodel.store.run_record import Columns
from archmodel.store.runs import store_run
from archmodel.tables.entries import new_entry
from tests.archmodel.stones import run_record


def know(database: Database) -> int:
    """All that can be said, of V3, its arch and the wall around; the number of the entry."""
    with database.session() as session:
        entry = new_entry(session, "declaration", "a test", author="T")
        declare_material(session, entry, "tuff", "soft", {"density": PropertyValue(1900.0, 50.0)})
        declare_material(session, entry, "limestone")
        declare_phase(session, entry, "1", 1200, 1210)
        declare_phase(session, entry, "2", 1240, None)
        declare_document(session, entry, "P1", "photograph", "The arch")
        declare_structure(session, entry, "wall", "WALL")
        declare_structure(session, entry, "arch", "ARCH", title="The arch", parent="WALL")
        stones = subjects(session, ["V1", "V2", "V3"]).entities
        declare_members(session, entry, "ARCH", stones, ordered=True)
        wall, arch, keystone = (
            subjects(session, structures=["WALL"]),
            subjects(session, structures=["ARCH"]),
            subjects(session, ["V3"]),
        )
        say_made_of(session, entry, wall, "limestone")
        say_made_of(session, entry, arch, "tuff", Remark("by colour"))
        say_of_phase(session, entry, wall, "1")
        say_of_phase(session, entry, keystone, "2")
        say_mason_mark(session, entry, keystone, "star", "left")
        say_observation(session, entry, arch, "crack", severity=2)
        say_reference(session, entry, wall, Remark(document="P1", locator="top"))
        say_depth(session, entry, keystone, 0.42, 0.01)
        say_note(session, entry, keystone, "tooling", Remark("fine"))
        declare_relation(session, entry, "rests_on", subjects(session, ["V3"]).entities, stones[:1])
        declare_relation(session, entry, "beside", keystone.entities, stones[1:2])
        return entry.id


def test_the_nearest_statement_goes_first_and_says_of_what_it_is(filled: Database) -> None:
    number = know(filled)
    with filled.session(read_only=True) as session:
        told, other = describe(session, "V3"), describe(session, "V1")
    said = told["knowledge"]
    by = {"entry": number, "action": "declaration", "author": "T", "source": "a test"}
    assert by.items() <= said["material"].items()  # type: ignore[index]
    material = {key: said["material"][key] for key in ("name", "description", "said_of", "text")}  # type: ignore[index]
    assert material == {
        "name": "tuff",
        "description": "soft",
        "said_of": "ARCH",
        "text": "by colour",
    }
    assert said["material"]["properties"] == {  # type: ignore[index]
        "density": {"value": 1900.0, "sigma": 50.0, "unit": "kg/m³", "source": "a test"}
    }
    assert said["phase"]["name"] == "2"  # type: ignore[index]
    assert "said_of" not in said["phase"]  # type: ignore[index]
    assert other["knowledge"]["phase"]["said_of"] == "WALL"  # type: ignore[index]
    lists = {
        name: [{key: one.get(key) for key in keys} for one in said[name]]  # type: ignore[index]
        for name, keys in {
            "marks": ("sign", "place"),
            "observations": ("type", "severity", "said_of"),
            "documents": ("document", "locator", "said_of"),
            "depth_evidence": ("value", "sigma"),
            "notes": ("key", "text"),
        }.items()
    }
    assert lists == {
        "marks": [{"sign": "star", "place": "left"}],
        "observations": [{"type": "crack", "severity": 2, "said_of": "ARCH"}],
        "documents": [{"document": "P1", "locator": "top", "said_of": "WALL"}],
        "depth_evidence": [{"value": 0.42, "sigma": 0.01}],
        "notes": [{"key": "tooling", "text": "fine"}],
    }
    assert json.loads(json.dumps(told, allow_nan=False)) == told


def test_structures_and_relations_are_seen_from_the_stone(filled: Database) -> None:
    number = know(filled)
    with filled.session(read_only=True) as session:
        keystone, springer, arch = (describe(session, code) for code in ("V3", "V1", "ARCH"))
        before = describe(session, "V3", number - 1)
    (member,) = keystone["structures"]  # type: ignore[misc]
    assert (member["code"], member["rank"], member["part_of"]) == ("ARCH", 3, ["WALL"])
    declared = {"declared": True, "area": None, "gap": None, "entry": number}
    assert keystone["relations"] == {
        "rests_on": [{"code": "V1"} | declared],
        "beside": [{"code": "V2"} | declared],
    }
    assert springer["relations"] == {"supports": [{"code": "V3"} | declared]}
    assert (arch["part_of"], arch["parts"], arch["members"]) == (["WALL"], [], ["V1", "V2", "V3"])
    assert arch["definition"] == "A curved row of wedge-shaped stones over an opening."
    assert arch["knowledge"]["material"]["name"] == "tuff"  # type: ignore[index]
    assert (before["structures"], before["relations"]) == ([], {})
    assert before["knowledge"]["material"] is None  # type: ignore[index]


def joint_columns(force: float) -> Columns:
    """One joint, between the two stones of a run."""
    given = {"second": 1, "nz": 1.0, "area": 0.06, "force_normal": force, "pressure_mean": np.nan}
    given |= {"pressure_max": 2e5, "kern": 0.5, "friction_use": 0.1, "width": np.nan}
    names = "first x y z nx ny parted force_shear slipping open gap opening sliding"
    return {name: np.array([value]) for name, value in (dict.fromkeys(names.split(), 0) | given).items()}


def test_the_joints_are_those_of_the_latest_run(filled: Database) -> None:
    with filled.session() as session:
        for force in (900.0, 1200.0):
            record = run_record({"V2": 4e5, "V3": None})
            store_run(session, replace(record, joints=joint_columns(force)))
        told = {code: describe(session, code)["joints"] for code in ("V2", "V3", "V1")}
    (joint,) = told["V3"]  # type: ignore[misc]
    assert (joint["neighbour"], joint["force_normal"], joint["pressure_max"]) == ("V2", 1200.0, 2e5)
    assert told["V2"][0]["neighbour"] == "V3"  # type: ignore[index]
    assert told["V1"] == []

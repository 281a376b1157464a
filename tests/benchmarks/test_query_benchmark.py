"""The building of the benchmark is what it says, every question of it has an answer, and its costs are told."""

import json
import math
import subprocess
import sys

import pytest
from sqlalchemy import func, select

from archmodel.database.session import open_database
from archmodel.tables.entities import Entity
from archmodel.tables.relations import Relation
from archmodel.tables.runs import ContactPoint, EntityResult, JointResult
from archmodel.tables.structures import Arch
from benchmarks import query
from benchmarks.query import COURSES, RUNS
from tests.paths import ROOT

STONES = 2000


def run(module, *words):
    command = [sys.executable, "-m", module, *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def building(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('db') / 'building.db'}"
    with open_database(url) as database:
        for step in query.STEPS.values():
            step(database, STONES)
        yield database


def test_the_building_has_all_that_it_says(building):
    with building.session(read_only=True) as session:

        def count(table, *conditions):
            return session.scalar(select(func.count()).select_from(table).where(*conditions))

        assert count(Entity) == STONES
        assert session.scalar(select(func.max(Entity.course))) >= COURSES
        assert count(EntityResult) == RUNS * STONES
        joints = count(JointResult)
        assert count(ContactPoint) == 4 * joints
        assert joints == count(Relation, Relation.kind.in_(("rests_on", "beside")))
        # in running bond, nearly each stone of 99 courses rests on two
        assert count(Relation, Relation.kind == "rests_on") > 1.8 * STONES * (COURSES - 1) / COURSES
        assert count(Arch) == STONES // 2000


@pytest.mark.parametrize("name", query.QUESTIONS)
def test_every_question_has_an_answer(building, name):
    with building.session(read_only=True) as session:
        assert query.QUESTIONS[name].ask(session, STONES) >= 0


def test_a_question_is_timed_and_its_plans_are_told(building):
    found = query.asked(str(building.engine.url), "kind", STONES)
    assert all(math.isfinite(found[key]) and found[key] > 0 for key in ("cold", "warm", "used"))
    assert any("ix_entity_kind_depth" in plan for plan in found["plans"])


@pytest.mark.slow
def test_the_benchmarks_run_and_print_every_row():
    rows = run("benchmarks.query", "--stones", 2000, "--json")
    per_database = len(query.STEPS) + len(query.QUESTIONS)
    assert len(rows) in (per_database, 2 * per_database)

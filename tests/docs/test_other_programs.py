"""docs/howto/other-programs.md is true: its commands run, their files come back, its table has every ending."""

import re

import pytest

from moma import moma_solve
from pipelines.record.export.export import ENDINGS
from tests.docs.pages import blocks, ran
from tests.moma.commands import answer
from tests.paths import ROOT
from tests.pipelines.record.export.test_compas_solve import CUBE, PLATE, block, model_of, problem_of
from tests.survey.formats.solids.test_lmgc90 import HEAD, body, polyhedron

PAGE = "docs/howto/other-programs.md"


@pytest.mark.slow
def test_the_commands_run_and_what_they_write_comes_back(place):
    pytest.importorskip("ezdxf")
    (place / "DATBOX").mkdir()
    bodies = HEAD + body(1, polyhedron((0.3, 0.2, 0.1)))
    (place / "DATBOX/BODIES.DAT").write_text(bodies, encoding="utf-8")
    ran(place, "".join(blocks(PAGE, "bash")))
    there, again = (
        {
            one["code"]: one["volume"]
            for one in answer(
                "query", "entity", "--columns", "code,volume", "--db", f"sqlite:///{place / name}"
            )
        }
        for name in ("exchange.db", "out/compas.db")
    )
    assert len(there) == 98
    assert again == pytest.approx(there, rel=1e-6)
    assert len(answer("query", "entity", "--db", f"sqlite:///{place / 'out/lmgc90.db'}")) == 1


def test_the_lines_of_python_solve_a_problem():
    names = {"problem": problem_of(), "model": model_of([block(PLATE, True), block(CUBE)], [(0, 1)])}
    (lines,) = blocks(PAGE, "python")
    exec(compile(lines, PAGE, "exec"), names)
    assert names["moma_solve"] is moma_solve
    assert names["results"]["data"]["metadata"]["outcome"] == "equilibrium"


def test_the_table_has_every_ending():
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    listed = re.findall(r"^\| (`\..*?) \|", text, re.MULTILINE)
    endings = {one for cell in listed for one in re.findall(r"`(\.[\w.]+)`", cell)}
    assert endings == {*ENDINGS, ".json", ".json.gz"}

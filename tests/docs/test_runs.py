"""docs/runs.md is true: its scene is run on the sample, its examples print what the page says."""

import contextlib
import io
import re

import pytest
from typer.testing import CliRunner

from archmodel.database.session import open_database
from archmodel.tables import runs, surveys
from archmodel.tables.base import Base
from moma.cli import app
from pipelines.ingest.ingest import ingest
from tests.paths import ROOT

PAGE = (ROOT / "docs" / "runs.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n((?:(?!```).)*)```\n\n```text\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """Return the names of the examples: the imports of the page, and a session on the sample after its run."""
    folder = tmp_path_factory.mktemp("runs")
    (scene,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    (command,) = re.findall(r"^    moma (run \S+ --meshes .*)$", PAGE, re.MULTILINE)
    (folder / command.split()[1]).write_text(scene, encoding="utf-8")
    url = f"sqlite:///{folder / 'moma.db'}"
    ingest([ROOT / "data/samples/window/window.moma"], url)
    with contextlib.chdir(folder):
        done = CliRunner().invoke(app, [*command.split(), "--db", url])
    assert done.exit_code == 0, done.output
    (imports,) = re.findall(r"```python\n(import .*?)\n\ndatabase = ", PAGE, re.DOTALL)
    names = {}
    exec(imports, names)
    with (
        contextlib.chdir(folder),
        open_database(url, create=False) as database,
        database.session(read_only=True) as session,
    ):
        yield names | {"session": session}


def test_the_examples_print_what_the_page_says(names):
    assert len(EXAMPLES) >= 5
    for code, answer in EXAMPLES:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(code, names)
        assert said.getvalue() == answer


def test_the_tables_of_the_page_are_those_of_the_program():
    rows = re.findall(r"^\| `(\w+)` \| `(\w+)\.(\w+)` \|", PAGE, re.MULTILINE)
    modules = {"runs": runs, "surveys": surveys}
    for table, module, name in rows:
        cls = getattr(modules[module], name)
        assert issubclass(cls, Base)
        assert cls.__tablename__ == table
    named = {table for table, _, _ in rows}
    of_runs = {name for name, table in Base.metadata.tables.items() if "run_id" in table.columns}
    assert of_runs | {"run"} == named

"""Standard output in any encoding, closed, or without a reader: no command fails for what it prints."""

import csv
import io
import json
import os
import subprocess
import sys

import pytest

from moma.cli.console import open_streams
from tests.moma.commands import prints
from tests.paths import ROOT

SAMPLE = ROOT / "data/samples/window"
COMMANDS = {
    "schema": ["schema"],
    "schema as JSON": ["schema", "--json"],
    "runs": ["runs"],
    "query": ["query", "voussoir"],
    "query as CSV": ["query", "voussoir", "--format", "csv"],
}


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('db') / 'window.db'}"
    prints("ingest", SAMPLE / "window.moma", "--db", url)
    return url


def moma(words, url, encoding="utf-8", **streams):
    """Run a command as a process of its own; return its exit code, and what it printed as bytes."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    done = subprocess.run(
        [sys.executable, "-m", "moma", *words, "--db", url], **streams, env=environment, cwd=ROOT, check=False
    )
    assert b"unexpected" not in (done.stderr or b"")
    return done.returncode, done.stdout


def written(text, encoding):
    """What a stream of an encoding makes of a text."""
    code = "import sys; from moma.cli.console import open_streams as o; o(); print(sys.argv[1])"
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    done = subprocess.run(
        [sys.executable, "-c", code, text], capture_output=True, env=environment, check=True
    )
    return done.stdout.decode(encoding).rstrip("\n")


@pytest.mark.parametrize(
    ("encoding", "expected"),
    [
        ("ascii", 'e 3 m2 - "x" <= 5 um um ? Muller'),
        ("latin-1", 'é 3 m² - "x" <= 5 µm um ? Müller'),
        ("cp1252", "é 3 m² – “x” <= 5 µm um ? Müller"),
        ("utf-8", "é 3 m² – “x” ≤ 5 µm μm 石 Müller"),
    ],
)
def test_characters_that_an_encoding_lacks_become_the_closest(encoding, expected):
    assert written("é 3 m² – “x” ≤ 5 µm μm 石 Müller", encoding) == expected


def test_a_table_in_latin_1_has_every_row(url):
    code, there = moma(COMMANDS["query"], url)
    again, plain = moma(COMMANDS["query"], url, "latin-1")
    assert (code, again) == (0, 0)
    assert plain.decode("latin-1") == there.decode().replace("─", "-")


def test_json_in_ascii_has_the_same_values(url):
    _, there = moma(["schema", "--json"], url)
    code, plain = moma(["schema", "--json"], url, "ascii")
    assert code == 0
    assert plain.isascii()
    assert not there.isascii()
    assert json.loads(plain) == json.loads(there)


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "ascii"])
@pytest.mark.parametrize("command", COMMANDS)
def test_commands_print_in_any_encoding(command, encoding, url):
    code, text = moma(COMMANDS[command], url, encoding)
    _, there = moma(COMMANDS[command], url)
    assert code == 0
    assert text.decode(encoding).count("\n") == there.decode().count("\n")
    if "CSV" in command:
        assert len(list(csv.reader(io.StringIO(text.decode(encoding))))) > 5


def test_a_closed_output_is_no_failure(url):
    code, _ = moma(
        COMMANDS["query"], url, stdout=None, stderr=None, preexec_fn=lambda: (os.close(1), os.close(2))
    )
    assert code == 0


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_closed_outputs_and_pipes_without_a_reader_are_no_failure(command, url):
    code, _ = moma(COMMANDS[command], url, stdout=None, preexec_fn=lambda: os.close(1))
    assert code == 0
    read, write = os.pipe()
    os.close(read)
    done = moma(COMMANDS[command], url, stdout=write)
    os.close(write)
    assert done[0] == 0


def test_a_pipe_without_a_reader_leaves_the_exit_code_of_a_failure(url):
    read, write = os.pipe()
    os.close(read)
    code, _ = moma(["show", "nobody"], url, stdout=write, stderr=write)
    os.close(write)
    assert code == 2


def test_streams_of_other_kinds_stay(monkeypatch):
    page = io.StringIO()
    monkeypatch.setattr(sys, "stdout", page)
    open_streams()
    assert sys.stdout is page


def test_a_line_of_progress_stands_in_a_file_before_the_command_ends(tmp_path):
    path = tmp_path / "log"
    program = (
        "from moma.cli.console import open_streams, say; from pathlib import Path; open_streams(); "
        f"say('step 3'); assert Path({str(path)!r}).read_text() == 'moma: step 3\\n'"
    )
    with path.open("w") as log:
        subprocess.run([sys.executable, "-c", program], stderr=log, cwd=ROOT, check=True)

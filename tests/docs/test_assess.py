"""The walk-throughs of the how-to on assessments: each command runs, and the verdicts shown are those printed."""

import re
import shlex

import pytest

from tests.moma.commands import prints
from tests.paths import ROOT

PAGE = "docs/howto/assess.md"


def section(title):
    """Return the moma commands of a section of the page, and the text that it shows."""
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    (part,) = [one for one in text.split("\n## ") if title in one.partition("\n")[0]]
    blocks = dict(re.findall(r"^```(bash|text)\n(.*?)^```$", part, re.MULTILINE | re.DOTALL))
    return [line.split(maxsplit=1)[1] for line in blocks["bash"].splitlines()], blocks["text"].strip()


def words_and_numbers(text):
    """Return a line without its numbers, and these."""
    return re.sub(r"[\d.]+", "#", text), [float(one) for one in re.findall(r"\d+\.\d+", text)]


def runs_as_shown(title, place, monkeypatch):
    """Run the commands of a section; return what each printed, after comparing the verdict with the one shown."""
    monkeypatch.chdir(place)
    commands, shown = section(title)
    printed = {line.split()[0]: prints(*shlex.split(line)) for line in commands}
    first = printed["assess"].splitlines()[0]
    words, numbers = words_and_numbers(first)
    expected, values = words_and_numbers(shown)
    assert words == expected
    # the load of other forces depends on rounding
    assert numbers == pytest.approx(values, rel=0.1)
    return printed


def test_the_walk_through_of_a_facade_ends_in_the_verdict_shown(place, monkeypatch):
    printed = runs_as_shown("A façade", place, monkeypatch)
    moved = re.findall(r"^[ABQ]\d\d\S*", printed["query"], re.MULTILINE)
    assert len(moved) >= 10
    assert sum(code.startswith("A") for code in moved) > 0.5 * len(moved)
    assert printed["assess"].count("    passed: ") == 2


@pytest.mark.slow
def test_the_walk_through_of_the_bay_ends_in_the_verdict_shown(place, monkeypatch):
    printed = runs_as_shown("The whole window bay", place, monkeypatch)
    assert "geometric factor of safety" in printed["assess"]
    assert "assessed" in printed["runs"]

"""Pages on paper: a checksum that a change breaks, contents, a title block, and words of other languages."""

import re
import string

import pytest

from ground.errors import MomaError, UsageError
from pipelines.reports.html import page_text, table_of
from pipelines.reports.page import paper
from pipelines.reports.page.inline import module_text
from pipelines.reports.page.languages import catalogues
from pipelines.reports.page.paper import appraise_page, check_sum, print_pdf
from tests.moma.commands import answer, fails, prints
from tests.paths import ROOT
from tests.pipelines.reports.pages.models import wall_model

VALUES = {
    "name": "A <b> tower",
    "lead": "2 stones.",
    "warnings": (),
    "version": "1.2",
}
NOTHING = table_of("row", (), dict)


@pytest.fixture(scope="module")
def text():
    kinds = table_of("row", [{"kind": "header", "stones": "2"}], dict)
    stones = table_of("row", [{"stone": "A"}], dict)
    return page_text("view.html", wall_model(4), kinds=kinds, stones=stones, **VALUES)


def test_a_changed_page_does_not_have_its_checksum(text):
    assert check_sum(text) is True
    assert check_sum(text.replace("2 stones", "3 stones")) is False
    assert check_sum("<p>no page of ours</p>") is None


def test_contents_name_every_heading(text):
    titles = re.findall(r"<h2>(.*?)</h2>", text)
    assert titles == ["Kinds", "Stones", "Elevation to scale"]
    for number, title in enumerate(titles, start=1):
        assert f'<li><a href="#part-{number}">{title}</a></li>' in text
        assert f'<a id="part-{number}"></a><h2>{title}</h2>' in text


def test_the_title_block_has_room_for_the_author_or_names_him(text, monkeypatch):
    assert "<tr><th>Building</th><td>A &lt;b&gt; tower</td></tr>" in text
    assert "<tr><th>Author</th><td>&nbsp;</td></tr>" in text
    monkeypatch.setenv("MOMA_AUTHOR", "M. <i>Mason</i>")
    named = page_text("view.html", kinds=NOTHING, stones=NOTHING, **VALUES)
    assert "<tr><th>Author</th><td>M. &lt;i&gt;Mason&lt;/i&gt;</td></tr>" in named


def test_the_command_tells_whether_a_page_is_as_it_was_written(text, tmp_path):
    page = tmp_path / "report.html"
    page.write_text(text, encoding="utf-8")
    assert "as it was written" in prints("report", tmp_path)
    page.write_text(text + " ", encoding="utf-8")
    assert answer("report", tmp_path) == {"page": str(page), "as_written": False, "pdf": None}
    assert "cannot be read" in fails(2, "report", tmp_path / "nothing")
    with pytest.raises(UsageError):
        appraise_page(tmp_path)


def test_without_a_browser_the_error_says_how_to_print(tmp_path, monkeypatch):
    monkeypatch.setattr(paper.shutil, "which", lambda name: None)
    monkeypatch.setattr(paper, "_PLACES", ())
    with pytest.raises(MomaError, match=r"no Chromium.*print it there to PDF"):
        print_pdf(tmp_path / "report.html", tmp_path / "report.pdf")


def test_every_language_has_the_same_words_and_places_for_what_varies():
    others = {tag: one["words"] for tag, one in catalogues().items() if tag != "en"}
    assert set(others) == {"de", "fr", "it"}
    english = set(others["de"])
    assert len(english) > 250
    for tag, words in others.items():
        assert set(words) == english, tag
        for text, told in words.items():
            assert told.strip(), (tag, text)
            assert told.count("{}") == text.count("{}"), (tag, text)


def test_the_words_of_the_viewer_and_the_headings_of_the_templates_are_in_the_catalogues():
    """Fixed texts that stand in the modules as labels, and headings without values."""
    words = set(catalogues()["de"]["words"])
    panel, viewer = module_text("panel.js"), module_text("viewer.js")
    asked = set(re.findall(r'group\("([^"]+)"', panel)) | set(re.findall(r'labelled\("([^"]+)"', panel))
    asked |= set(re.findall(r'say\("([^"]+)"\)', panel + viewer)) | set(
        re.findall(r'button\("([^"]+)"', viewer)
    )
    for page in (ROOT / "pipelines/reports/templates").glob("*.html"):
        asked |= set(re.findall(r"<h2>([^{<]+)</h2>", page.read_text(encoding="utf-8")))
    asked = {one for one in asked if one.strip(string.punctuation + string.digits) and one != "PNG"}
    assert asked - words == set()

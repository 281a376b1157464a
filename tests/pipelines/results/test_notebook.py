"""Reports of runs in notebooks: headline, cautions, and the page in a frame."""

import re
from html import unescape
from html.parser import HTMLParser

from pipelines.run.run import RunReport

SUMMARY = {"headline": "it stands <as surveyed>", "cautions": ["η > 1e-3 & more"]}


class Frames(HTMLParser):
    """The documents within frames of a page."""

    def __init__(self):
        super().__init__()
        self.pages = []

    def handle_starttag(self, tag, attributes):
        if tag == "iframe":
            self.pages.append(dict(attributes))


def test_a_report_shows_headline_cautions_and_its_page(tmp_path):
    page = '<!doctype html><p title="a &amp; b">it\'s "here"</p><script>run("1")</script>'
    (tmp_path / "report.html").write_text(page, encoding="utf-8")
    shown = RunReport(tmp_path, SUMMARY, ("a <warning>",), 1)._repr_html_()
    assert shown.startswith("<p><strong>It stands &lt;as surveyed&gt;</strong></p>")
    assert [unescape(one) for one in re.findall("<li>(.*?)</li>", shown)] == [
        "η > 1e-3 & more",
        "a <warning>",
    ]
    frames = Frames()
    frames.feed(shown)
    (frame,) = frames.pages
    assert frame["srcdoc"] == page
    assert frame["sandbox"] == "allow-scripts"


def test_a_report_whose_page_is_gone_says_so(tmp_path):
    shown = RunReport(tmp_path / "gone", SUMMARY | {"cautions": []}, (), 1)._repr_html_()
    assert "<iframe" not in shown
    assert "<ul>" not in shown
    assert "There is no page in" in shown

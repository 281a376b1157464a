"""docs/howto/page.md is true: its commands run and leave what it names."""

import pytest

from tests.docs.pages import blocks, ran

PAGE = "docs/howto/page.md"


@pytest.mark.filterwarnings("default")
def test_the_commands_leave_the_pages_that_the_page_names(place):
    said = ran(place, "".join(blocks(PAGE, "bash")))
    out = place / "out/page"
    assert {path.name for path in out.iterdir()} == {
        "window.html",
        "window.svg",
        "arch.html",
        "run",
        "both.html",
    }
    assert "1 : 50" in said[next(line for line in said if "--elevation" in line)]
    assert "as it was written" in said["moma report out/page/run"]
    assert (out / "both.html").read_text(encoding="utf-8").count('class="moma-viewer"') == 2
    assert (out / "arch.html").stat().st_size < (out / "window.html").stat().st_size

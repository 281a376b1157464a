"""The page that corrects outlines, in a browser: edits, undo, saving, doubts, hostile texts, speed."""

import numpy as np
import pytest

from pipelines.reports.outlines.page import PageDoubt, editor_html
from tests.pipelines.reports.pages.browser import browsing

pytestmark = pytest.mark.slow

HOSTILE = '</script><script>alert(1)</script><img src=x onerror="alert(2)">'
PIXEL = 0.01


def stones(columns, rows, size=(60, 30), joint=4):
    """Outlines in metres of stones in courses, above each other."""
    out = []
    for row in range(rows):
        for column in range(columns):
            low = np.array([column * size[0] + joint / 2, row * size[1] + joint / 2]) * PIXEL
            high = low + (np.array(size) - joint) * PIXEL
            ring = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
            said = {"kind": "header", "course": row + 1, "score": 0.95, "evidence": "proposed from image"}
            out.append(
                {"code": f"C{row + 1:02d}-{column + 1:02d}", "ring": np.round(ring, 5).tolist(), "said": said}
            )
    return out


def page_of(path, many, doubts=(), shape=(120, 240), title="Outlines of a wall"):
    matrix, origin = np.diag([PIXEL, -PIXEL]), np.array([0.5 * PIXEL, (shape[0] - 0.5) * PIXEL])
    pixels = np.full((*shape, 3), 150, np.uint8)
    path.write_text(
        editor_html(title, pixels, matrix, origin, many, doubts, [("Courses", "4")]), encoding="utf-8"
    )
    return path


@pytest.fixture(scope="module")
def browser():
    with browsing() as found:
        yield found


EDITS = """() => {
    let seed = 12345; const chance = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
    const page = window.momaOutlines, pick = () => Math.floor(chance() * page.stones().length);
    const first = page.text(), counts = {};
    let done = 0;
    for (let tries = 0; done < 100 && tries < 3000; tries++) {
        const before = page.stones(), k = pick(), kind = Math.floor(chance() * 6), ring = before[k].ring;
        const across = ring.map((p) => p[0]), x0 = Math.min(...across), x1 = Math.max(...across);
        const middle = ring.reduce((s, p) => s + p[1], 0) / ring.length, small = () => 3 * chance();
        if (kind === 0) { page.select([k, pick()]); page.join(); }
        if (kind === 1) {
            const x = x0 + (x1 - x0) * (0.3 + 0.4 * chance());
            page.select([k]);
            page.split([x, middle - 500], [x + 2, middle + 500]);
        }
        if (kind === 2) {
            page.select([k]);
            page.moveCorner(k, Math.floor(chance() * ring.length), [ring[0][0] + small(), ring[0][1] + small()]);
        }
        if (kind === 3) {
            const x = 500 * chance(), y = 500 * chance();
            page.draw([[x, y], [x + 20, y], [x + 20, y + 10], [x, y + 10]]);
        }
        if (kind === 4 && before.length > 4) { page.select([k]); page.remove(); }
        if (kind === 5) { page.select([k]); page.setSaid("kind", ["quoin", "jamb", "sill"][Math.floor(3 * chance())]); }
        if (page.stones() !== before) { done++; counts[kind] = (counts[kind] || 0) + 1; }
    }
    const changed = page.text();
    for (let k = 0; k < done; k++) page.undo();
    const back = page.text();
    for (let k = 0; k < done; k++) page.redo();
    return [done, counts, changed !== first, back === first, page.text() === changed];
}"""


def test_a_hundred_random_edits_are_undone_to_the_same_bytes(browser, tmp_path):
    with browser.page(page_of(tmp_path / "outlines.html", stones(4, 4))) as page:
        done, counts, changed, undone, redone = page.evaluate(EDITS)
    assert done == 100
    assert len(counts) == 6  # join, split, move, draw, delete, kind
    assert (changed, undone, redone) == (True, True, True)


def test_two_stones_become_one_with_the_joint_between_and_part_again(browser, tmp_path):
    with browser.page(page_of(tmp_path / "outlines.html", stones(4, 4))) as page:
        page.evaluate("() => { momaOutlines.select([0, 1]); momaOutlines.join(); }")
        ring = page.evaluate("momaOutlines.stones().at(-1).ring")
        assert np.ptp(np.array(ring), axis=0) == pytest.approx([116.0, 26.0], abs=0.01)
        page.evaluate("() => momaOutlines.split([60, -50], [60, 500])")
        parts = page.evaluate("momaOutlines.stones().slice(-2).map((one) => one.ring)")
        assert [np.ptp(np.array(one), axis=0)[0] for one in parts] == pytest.approx([58.0, 58.0], abs=0.01)
        codes = page.evaluate("momaOutlines.stones().map((one) => one.code)")
        assert len(codes) == len(set(codes)) == 16


def test_a_save_that_fails_loses_nothing_and_one_that_succeeds_is_stated(browser, tmp_path):
    with browser.page(page_of(tmp_path / "outlines.html", stones(4, 4))) as page:
        page.evaluate("() => { momaOutlines.select([3]); momaOutlines.remove(); }")
        before = page.evaluate("momaOutlines.text()")
        page.evaluate("() => { momaOutlines.real = momaOutlines.download; }")
        page.evaluate("() => { momaOutlines.download = () => { throw new Error('disk full'); }; }")
        page.keyboard.press("Control+s")
        assert "disk full" in page.text_content("#doubt")
        assert "not saved" in page.text_content("#state")
        assert page.evaluate("momaOutlines.text()") == before
        page.evaluate("() => { momaOutlines.download = momaOutlines.real; }")
        with page.expect_download() as waiting:
            page.click("#save")
        assert waiting.value.path().read_text(encoding="utf-8") == before
        assert "not saved" not in page.text_content("#state")


def test_keys_and_mouse_lead_through_doubts_and_correct(browser, tmp_path):
    doubts = [
        PageDoubt(("C01-01", "C01-02"), "a joint?", 0.2, 0.6, 0.15),
        PageDoubt(("C02-01", "C02-02"), "no joint?", 0.9, 0.6, 0.45),
    ]
    with browser.page(page_of(tmp_path / "outlines.html", stones(4, 4), doubts)) as page:
        page.keyboard.press("n")
        assert "no joint? (2 open)" in page.text_content("#doubt")  # the most doubtful first
        page.keyboard.press("j")
        assert page.text_content("#state").startswith("15 stones")
        page.keyboard.press("n")
        assert "a joint? (1 open)" in page.text_content("#doubt")
        page.keyboard.press("y")
        assert "No doubts are left" in page.text_content("#doubt")
        page.keyboard.press("Control+z")
        assert page.text_content("#state").startswith("16 stones")
        box = page.locator("canvas").bounding_box()
        page.keyboard.press("0")
        page.mouse.click(box["x"] + box["width"] / 2 + 20, box["y"] + box["height"] / 2 + 20)
        assert page.input_value("#code").startswith("C0")
        page.keyboard.press("Delete")
        assert page.text_content("#state").startswith("15 stones")


def test_hostile_codes_are_shown_as_text(browser, tmp_path):
    many = stones(2, 2)
    many[0] |= {"code": HOSTILE, "said": {"kind": HOSTILE, "score": 0.4}}
    doubts = [PageDoubt((HOSTILE,), HOSTILE, 1.0, 0.1, 0.1)]
    with browser.page(page_of(tmp_path / "outlines.html", many, doubts, title=HOSTILE)) as page:
        assert page.text_content("#title") == HOSTILE
        page.keyboard.press("n")
        assert HOSTILE in page.text_content("#doubt")
        assert page.input_value("#code") == HOSTILE
        assert page.evaluate("document.images.length") == 0


def test_five_thousand_outlines_move_at_thirty_frames_a_second(browser, tmp_path):
    path = page_of(tmp_path / "outlines.html", stones(100, 50), shape=(1500, 6000))
    with browser.page(path) as page:
        cost = page.evaluate(
            """() => { const start = performance.now();
            for (let k = 0; k < 20; k++) { momaOutlines.view(k, k, 0.2); momaOutlines.paint(); }
            return (performance.now() - start) / 20; }"""
        )
    assert cost < 33.0  # ms

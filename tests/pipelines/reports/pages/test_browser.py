"""Pages in a real browser: no network, right stones under the mouse, keyboard, links, other languages, inert texts."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.shapes import BOX_FACES, box_corners
from pipelines.reports.html import table_of, write_page
from pipelines.reports.page.model import Column, Event, Model
from pipelines.reports.page.paper import print_pdf
from pipelines.reports.page.scenes import run_model
from pipelines.reports.page.surfaces import stones_of
from pipelines.reports.run import write_report
from pipelines.reports.view import write_comparison_view, write_view
from pipelines.results.stone_values import stone_results
from pipelines.results.summary import summarise
from tests.pipelines.reports.pages.browser import browsing
from tests.pipelines.reports.pages.models import wall_model

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
VIEWER = "document.querySelector('.moma-viewer').viewer"


@pytest.fixture(scope="module")
def browser():
    with browsing() as found:
        yield found


@pytest.fixture(scope="module")
def window(sample_database, tmp_path_factory):
    """The page of the sample's database."""
    path = tmp_path_factory.mktemp("view") / "view.html"
    write_view(f"sqlite:///{sample_database}", path)
    return path


def page_of(model, path):
    write_page(
        path,
        "view.html",
        model,
        name=model.title,
        lead="",
        warnings=(),
        version="1",
        kinds=table_of("row", (), dict),
        stones=table_of("row", (), dict),
    )
    return path


def hit(vertices, triangles, owner, origins, way):
    """The stone that each ray (n, 3) meets first, or -1, and whether it comes near an edge (Möller and Trumbore)."""
    found, near = np.full(len(origins), -1), np.zeros(len(origins), dtype=bool)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    across = np.cross(way, c - a)
    size = np.einsum("ij,ij->i", b - a, across)
    for ray, origin in enumerate(origins):
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", origin - a, across) / size
            q = np.cross(origin - a, b - a)
            v = (q @ way) / size
            t = np.einsum("ij,ij->i", c - a, q) / size
        slack = 0.01
        close = (u > -slack) & (v > -slack) & (u + v < 1 + slack) & np.isfinite(t)
        inside = (u > slack) & (v > slack) & (u + v < 1 - slack) & close
        if close.any():
            first = np.flatnonzero(close)[t[close].argmin()]
            rivals = np.flatnonzero(close & (t < t[first] + 0.01))
            found[ray] = owner[triangles[first, 0]]
            near[ray] = not inside[first] and len(set(owner[triangles[rivals, 0]].tolist())) > 0
    return found, near


def test_stones_clicked_at_random_are_those_that_a_ray_meets(browser, window):
    """200 clicks, half of them in perspective, compared with rays traced by other means."""
    random = np.random.default_rng(7)
    right = asked = 0
    with browser.page(window) as page:
        page.evaluate("document.querySelector('.moma-viewer').scrollIntoView()")
        head = page.evaluate(
            f"(() => {{ const m = {VIEWER}.model; return {{codes: m.codes, vertices: [...m.vertices], "
            "triangles: [...m.triangles], owner: [...m.owner]}; })()"
        )
        vertices = np.array(head["vertices"]).reshape(-1, 3)
        triangles, owner = np.array(head["triangles"]).reshape(-1, 3), np.array(head["owner"])
        box = page.locator(".moma-viewer canvas").bounding_box()
        for ortho in (True, False):
            page.evaluate(
                f"(() => {{ const v = {VIEWER}; v.camera.state.ortho = {str(ortho).lower()}; "
                "v.camera.orbit(0.3, 0.1); v.fit(); })()"
            )
            matrix = (
                np.array(page.evaluate(f"[...{VIEWER}.camera.matrix({box['width'] / box['height']})]"))
                .reshape(4, 4)
                .T
            )
            back = np.linalg.inv(matrix)
            goal = asked + 100
            while asked < goal:
                x, y = random.integers(5, int(box["width"]) - 5), random.integers(5, int(box["height"]) - 5)
                clip = [(x + 0.5) / box["width"] * 2 - 1, 1 - (y + 0.5) / box["height"] * 2]
                ends = [back @ [*clip, depth, 1.0] for depth in (-1.0, 1.0)]
                near, far = (end[:3] / end[3] for end in ends)
                (stone,), (doubtful,) = hit(vertices, triangles, owner, near[None], far - near)
                if stone < 0 or doubtful:
                    continue  # the background, or within a hundredth of an edge
                page.mouse.click(box["x"] + int(x), box["y"] + int(y))
                told = page.locator(".stone h3").text_content()
                asked, right = asked + 1, right + (told == head["codes"][stone])
    assert (right, asked) == (200, 200)


def test_what_rounding_leaves_of_zero_has_no_scale_of_a_metre(browser, tmp_path):
    values = np.array([-6e-17, 0.0, 3e-17])
    model = replace(
        wall_model(3),
        columns=(Column("way", "way", "m", values, "Results"),),
        colour="way",
        fields=(),
        motion=None,
    )
    with browser.page(page_of(model, tmp_path / "page.html")) as page:
        assert page.locator(".legend .ends").text_content() == "00"
        assert page.locator(".legend b").first.text_content() == "way [m]"


def test_the_page_of_a_run_shows_its_last_instant_its_legend_and_its_unit(browser, mixed, tmp_path):
    stones = stone_results(mixed)
    model = run_model(mixed, stones, np.array([0.0, -1.0, 0.0]), np.zeros(3))
    summary = summarise(mixed, version="1.2", seconds={})
    write_report(tmp_path / "report.html", mixed, summary, stones, [], model=model)
    with browser.page(tmp_path / "report.html") as page:
        legend = page.locator(".legend").text_content()
        assert "Von Mises stress [MPa]" in legend
        assert "0" in legend
        assert "2" in legend
        slider = page.locator("input[aria-label=Time]")
        slider.evaluate("one => { one.value = one.max; one.dispatchEvent(new Event('input')); }")
        state = page.evaluate(f"({{instant: {VIEWER}.state.instant, last: {VIEWER}.stage.instants - 1}})")
        assert state["instant"] == state["last"]
        page.locator("select[aria-label='Colour by']").select_option("displacement")
        page.wait_for_function("document.querySelector('.legend').textContent.includes('mm')")
        largest = page.evaluate(f"[...{VIEWER}.stage.displacements({VIEWER}.state)]")
        assert max(largest) == pytest.approx(5e-3, rel=1e-3)
        page.locator("input[aria-label=To]").fill("0.001")
        page.locator("input[aria-label=To]").press("Enter")
        page.wait_for_function("document.querySelector('.ends').textContent.endsWith('1')")


def test_everything_is_reached_by_keyboard(browser, window):
    with browser.page(window) as page:
        for _ in range(60):
            page.keyboard.press("Tab")
            if page.evaluate("document.activeElement.tagName") == "CANVAS":
                break
        assert page.evaluate("document.activeElement.tagName") == "CANVAS"
        before = page.evaluate(f"({{...{VIEWER}.camera.state}})")
        page.keyboard.press("n")
        first = page.locator(".stone h3").text_content()
        assert page.locator("[role=status]").text_content().startswith(first)
        page.keyboard.press("n")
        assert page.locator(".stone h3").text_content() != first
        for key in ("ArrowLeft", "Shift+ArrowUp", "+", "h", "o"):
            page.keyboard.press(key)
        after = page.evaluate(f"({{...{VIEWER}.camera.state}})")
        assert all(after[name] != before[name] for name in ("yaw", "height", "ortho", "target"))
        assert len(page.evaluate(f"{VIEWER}.state.hidden")) == 1
        page.keyboard.press("a")
        assert page.evaluate(f"{VIEWER}.state.hidden") == []
        page.keyboard.press("/")
        page.keyboard.type("keystone")
        page.keyboard.press("Enter")
        assert page.locator(".stone h3").text_content() == "V4"
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")  # isolates what was found
        assert page.evaluate(f"{VIEWER}.model.codes.length - {VIEWER}.state.hidden.length") == 1


def test_a_link_opens_the_view_that_it_was_made_of(browser, window):
    with browser.page(window) as page:
        page.evaluate(
            f"(() => {{ const v = {VIEWER}; v.look('Back'); v.select(v.stage.number.get('V4'), true); "
            "v.colourBy('depth'); v.camera.zoom(0.5); "
            "v.change({section: {axis: 'z', at: 0.25, flip: true}, hidden: [0, 1]}); })()"
        )
        state = page.evaluate(f"{VIEWER}.hash()")
    with browser.page(window, f"#{state}") as page:
        assert page.evaluate(f"{VIEWER}.hash()") == state
        assert page.locator(".stone h3").text_content() == "V4"
    for wrong in ("#view=%7B", "#view=%7B%22camera%22%3A1%2C%22instant%22%3A%22x%22%7D", "#%ff"):
        with browser.page(window, wrong) as page:
            assert page.locator(".moma-viewer canvas").count() == 1


def test_a_picture_of_the_view_is_saved(browser, window):
    from PIL import Image

    with browser.page(window) as page:
        with page.expect_download() as waiting:
            page.get_by_role("button", name="PNG").click()
        picture = Image.open(waiting.value.path())
        assert waiting.value.suggested_filename.endswith(".png")
        assert picture.width > 600
        colours = picture.convert("RGB").resize((60, 40)).getcolors(2400)
        assert len(colours) > 30


def hostile_model():
    texts = [
        "<script>window.hacked = 1</script>",
        '"onload="window.hacked = 1',
        "<img src=x onerror=window.hacked=1>",
    ]
    shapes = [(box_corners((k, 0, 0), (k + 0.9, 1, 1)), BOX_FACES) for k in range(3)]
    mesh, _ = stones_of(texts, shapes)
    columns = [
        Column("kind", texts[0], None, texts, texts[1]),
        Column("note", texts[2], texts[2], np.arange(3.0)),
    ]
    events = [Event(k, texts[0], texts[1], texts[2]) for k in range(3)]
    return Model(texts[0], mesh, columns, events=events, colour="kind", notes=texts)


def test_codes_and_notes_that_look_like_script_are_inert(browser, tmp_path):
    with browser.page(page_of(hostile_model(), tmp_path / "hostile.html")) as page:
        for number in range(3):
            page.evaluate(f"{VIEWER}.select({number}, true)")
        page.locator("input[type=search]").fill("script")
        page.locator("select[aria-label='Colour by']").select_option("note")
        page.wait_for_timeout(200)
        assert page.evaluate("window.hacked") is None
        assert page.locator(".moma-viewer img, .moma-viewer script").count() == 0
        assert "<img src=x" in page.locator(".stone").text_content()


def test_without_webgl_the_tables_and_the_elevation_remain(browser, window):
    no = "HTMLCanvasElement.prototype.getContext = () => null;"
    with browser.page(window, script=no) as page:
        assert "No 3D view" in page.locator(".moma-viewer").text_content()
        assert page.locator("svg.elevation").count() == 1
        assert page.get_by_text("W02-05").count() >= 1


def test_a_page_speaks_four_languages_and_their_numbers(browser, window):
    with browser.page(window) as page:
        menu = page.locator("select.language")
        assert menu.locator("option").all_text_contents() == ["English", "Deutsch", "Français", "Italiano"]
        for tag, words, number in (
            ("de", "Maßstäbliche Ansicht", "0,45"),
            ("fr", "Élévation", "0,45"),
            ("en", "Elevation", "0.45"),
        ):
            menu.select_option(tag)
            assert words in page.locator("body").text_content()
            assert number in page.locator("td.number").all_text_contents()
            assert page.evaluate("document.documentElement.lang") == tag
    with browser.page(window, "#lang=it") as page:
        assert "Colora per" in page.locator(".panel").text_content()
        assert page.evaluate(f"{VIEWER}.hash()").startswith("lang=it&view=")


def test_two_pages_are_shown_side_by_side_with_one_camera_and_one_time(browser, tmp_path):
    pages = [page_of(wall_model(9, instants=count), tmp_path / f"{count}.html") for count in (5, 9)]
    write_comparison_view(pages, tmp_path / "both.html")
    with browser.page(tmp_path / "both.html") as page:
        viewers = "[...document.querySelectorAll('.moma-viewer')].map(one => one.viewer)"
        page.evaluate(
            f"(() => {{ const [a] = {viewers}; a.camera.orbit(0.4, 0.2); a.change({{instant: 2}}); }})()"
        )
        told = page.evaluate(f"{viewers}.map(one => [one.state.instant, one.camera.state.yaw])")
        assert [one[0] for one in told] == [2, 4]
        assert told[0][1] == told[1][1]


def test_the_page_prints_to_a4_with_numbers_and_its_view(browser, window, tmp_path):
    print_pdf(window, tmp_path / "view.pdf", "fr")
    data = (tmp_path / "view.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert b"/MediaBox [0 0 594.95996 841.91998]" in data or b"/MediaBox [0 0 595" in data
    with browser.page(window) as page:
        page.emulate_media(media="print")
        page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
        assert page.locator("img.printed").is_visible()
        assert not page.locator(".moma-viewer .stage").is_visible()
        wide = page.locator("svg.elevation").bounding_box()["width"]
        millimetres = float(page.locator("svg.elevation").get_attribute("width").removesuffix("mm"))
        assert wide == pytest.approx(millimetres / 25.4 * 96, abs=1.0)


def test_views_look_as_they_did(browser, window, tmp_path):
    """A coarse picture of the canvas beside the one that was looked at; another driver may draw edges otherwise."""
    from PIL import Image

    from tests.paths import ROOT

    references = ROOT / "tests/pipelines/reports/pages/references"
    made = {
        "window": window,
        "wall": page_of(replace(wall_model(30), colour="course"), tmp_path / "wall.html"),
    }
    for name, path in made.items():
        with browser.page(path) as page:
            page.wait_for_timeout(600)
            shot = Image.open(io.BytesIO(page.locator(".moma-viewer .stage").screenshot())).convert("RGB")
        small = np.asarray(shot.resize((160, 110)), dtype=float)
        reference = np.asarray(
            Image.open(references / f"{name}.png").convert("RGB").resize((160, 110)), dtype=float
        )
        assert np.abs(small - reference).mean() < 8.0, name


def test_frames_follow_each_other_while_a_wall_of_a_thousand_stones_turns(browser, tmp_path):
    """Printed; the bound is one that a busy processor without graphics keeps."""
    with browser.page(page_of(wall_model(1000, instants=10), tmp_path / "wall.html")) as page:
        times = page.evaluate(
            f"(async () => {{ const v = {VIEWER}; await v.turn(20); return v.turn(40); }})()"
        )
        print(json.dumps({"median": float(np.median(times)), "p90": float(np.quantile(times, 0.9))}))
        assert np.median(times) < 600.0

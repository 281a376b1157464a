"""Pages on the screen of a telephone: what is wider than it scrolls within itself."""

from importlib.util import find_spec

import numpy as np
import pytest

from archmodel.database.session import open_database
from pipelines.reports.assessment import write_assessment
from pipelines.reports.movement import write_comparison
from pipelines.reports.page.scenes import run_model
from pipelines.reports.pushover import write_pushover
from pipelines.reports.run import write_report
from pipelines.reports.view import write_comparison_view, write_view
from pipelines.results.stone_values import stone_results
from pipelines.results.summary import summarise
from tests.moma.commands import prints
from tests.paths import ROOT
from tests.pipelines.orient.test_orient import project
from tests.pipelines.reports.pages.browser import browsing
from tests.pipelines.reports.summaries import INPUTS, VERSIONS, assessed, pushed
from tests.pipelines.reports.test_assessment import PIXEL

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default", "ignore::DeprecationWarning", "ignore:.*httpx.*"),
]
WIDTH = 390  # of a usual telephone, in pixels
LONG = "wall_of_the_north_aisle_second_campaign_with_all_stones_of_the_arcade.toml"


@pytest.fixture(scope="module")
def browser():
    with browsing() as found:
        yield found


@pytest.fixture(scope="module")
def view(sample_database, tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "view.html"
    write_view(f"sqlite:///{sample_database}", path)
    return path


def fits(browser, path, wait="html[data-ready]"):
    """Whether a page is as wide as the screen, and every picture is seen whole."""
    with browser.page(path, wait=wait) as page:
        page.set_viewport_size({"width": WIDTH, "height": 844})
        assert page.evaluate("document.documentElement.scrollWidth") == WIDTH
        for right in page.evaluate(
            "[...document.querySelectorAll('figure > img, figure > svg')].map(e => e.getBoundingClientRect().right)"
        ):
            assert right <= WIDTH


def test_the_report_of_a_run_fits(browser, mixed, tmp_path):
    (tmp_path / "von_mises.png").write_bytes(PIXEL)
    summary = summarise(mixed, version="1.2", seconds={"solve": 1.0}) | {
        "inputs": INPUTS,
        "versions": VERSIONS,
    }
    stones = stone_results(mixed)
    model = run_model(mixed, stones, np.array([0.0, -1.0, 0.0]), np.zeros(3))
    write_report(tmp_path / "report.html", mixed, summary, stones, [f"no such file: {LONG}"], model=model)
    fits(browser, tmp_path / "report.html")


def test_reports_of_assessments_loading_tests_and_comparisons_fit(browser, tmp_path):
    for name in ("curve", "peak", "end", "mechanism-1", "beds-1"):
        (tmp_path / f"{name}.png").write_bytes(PIXEL)
    slope = {"measured": 1e-3, "simulated": 1e-3, "sigma": 1e-4}
    course = {"facade": "facade 1", "zone": LONG, "course": 3, "slope": slope}
    compared = assessed(
        chi2=10.0,
        dof=8,
        chi2_still=20.0,
        walls=[],
        outcome="settled",
        courses=[course | {"measured": 1e-3, "simulated": 1e-3, "sigma": 1e-4}],
    )
    write_assessment(tmp_path / "a.html", assessed(scene=LONG))
    write_pushover(tmp_path / "p.html", pushed(scene=LONG))
    write_comparison(tmp_path / "c.html", compared, None)
    for name in "apc":
        fits(browser, tmp_path / f"{name}.html", "body")


def test_views_fit_and_so_do_two_beside_each_other(browser, view, tmp_path):
    fits(browser, view)
    write_comparison_view([view, view], tmp_path / "both.html")
    fits(browser, tmp_path / "both.html")


def test_the_report_of_a_survey_fits(browser, tmp_path):
    prints("survey-report", ROOT / "data/samples/window/window.moma", "--out", tmp_path / "out")
    fits(browser, tmp_path / "out/report.html")


def test_the_report_of_photographs_fits(browser, tmp_path):
    prints("orient", project(tmp_path), "--out", tmp_path / "out")
    fits(browser, tmp_path / "out/report.html", "body")


@pytest.mark.skipif(find_spec("fastapi") is None, reason="no server is installed")
def test_pages_of_the_server_fit(browser, sample_database, tmp_path):
    from tests.pipelines.reports.serve.test_serve import HTML, client_of

    where = "/query?kind=entity&columns=code,kind,depth,length,height,volume,rms,depth_source,remarks"
    with open_database(f"sqlite:///{sample_database}", create=False) as database:
        client = client_of(database)
        for number, address in enumerate(("/", where, "/entity/V4", "/runs", "/schema", "/no-such-page")):
            path = tmp_path / f"{number}.html"
            path.write_text(client.get(address, headers=HTML).text, encoding="utf-8")
            fits(browser, path, "body")

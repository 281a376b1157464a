"""A real browser: Chromium, headless, as Debian installs it, driven by Playwright."""

import os
import shutil
from contextlib import contextmanager

import pytest


class Browsing:
    """One page at a time, with what it asked of the network and said on its console."""

    def __init__(self, browser):
        self._browser = browser

    @contextmanager
    def page(self, path, fragment="", wait="html[data-ready]", script=None, **options):
        """Open a file; it must ask for nothing else, and have no error. `wait` is a selector of its end."""
        context = self._browser.new_context(viewport={"width": 1200, "height": 900}, **options)
        page = context.new_page()
        if script:
            page.add_init_script(script)
        asked, said = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda one: said.append(one.text) if one.type == "error" else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("dialog", lambda dialog: (said.append(f"dialog {dialog.message}"), dialog.dismiss()))
        page.goto(path.absolute().as_uri() + fragment)
        page.wait_for_selector(wait, state="attached", timeout=60_000)
        try:
            yield page
            own = ("data:", "blob:")
            assert [one for one in asked[1:] if not one.startswith(own)] == []
            assert said == []
        finally:
            context.close()


@contextmanager
def browsing():
    """A browser; tests are skipped where there is none."""
    sync_api = pytest.importorskip("playwright.sync_api")
    path = next(
        (
            found
            for name in ("chromium", "chromium-browser", "google-chrome")
            if (found := shutil.which(name))
        ),
        None,
    )
    if path is None:
        pytest.skip("no Chromium is installed")
    flags = ["--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
    flags += ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=flags)
        try:
            yield Browsing(browser)
        finally:
            browser.close()

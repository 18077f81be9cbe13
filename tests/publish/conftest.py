"""Chromium, and the pages in it, for the tests of what levelhead publishes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from urllib.parse import urljoin

import pytest
from tests.reference.folder_server import serve_folder
from tests.reference.page import PATIENCE, WEB


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed (extra levelhead[test])"
    )
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("there is no Chromium here (apt install chromium): the page was not looked at")
    with playwright.sync_playwright() as one:
        running = one.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        yield running
        running.close()


@pytest.fixture
def look(browser):
    """Opens a page; fails on errors in its console and on requests to anywhere but its own host."""
    pages, wrong = [], []

    def opened(url: str, ready: str = "body[data-ready]", width: int = 900, height: int = 700):
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(1000.0 * PATIENCE)
        own = (urljoin(url, "/"), "blob:")
        page.on("request", lambda request: None if request.url.startswith(own) else wrong.append(request.url))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda line: wrong.append(line.text) if line.type == "error" else None)
        pages.append(page)
        page.goto(url)
        page.wait_for_selector(ready, state="attached")
        return page

    yield opened
    for page in pages:
        page.close()
    assert [words for words in wrong if "ERR_CONNECTION" not in words and "ERR_INCOMPLETE" not in words] == []


@pytest.fixture(scope="session")
def try_pages(tmp_path_factory):
    """Address of the pages that run in the browser alone."""
    release = os.environ.get("PYODIDE_DIST") or WEB.parent / "build" / "pyodide"
    if not any(Path(release).glob("numpy-*")) or not (WEB / "node_modules").is_dir():
        pytest.skip("there is no NumPy for Pyodide: make page build/pyodide, or set PYODIDE_DIST")
    folder = tmp_path_factory.mktemp("site") / "try"
    command = [sys.executable, str(WEB / "try_page.py"), str(folder), "ESKF", "Mahony"]
    subprocess.run(command, env=os.environ | {"PYODIDE_DIST": str(release)}, check=True)
    with serve_folder(folder) as url:
        yield url

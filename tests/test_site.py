"""The built site in a browser: it can be searched, fits a phone, and requests nothing from other
hosts.

`make lint` and `make docs` build it.
"""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

SITE = Path(__file__).parents[1] / "site"
PAGES = ("index", "start", "science/model", "environments/curling-end", "effects/curl", "app")

pytestmark = pytest.mark.skipif(
    not (SITE / "index.html").is_file(), reason="the site is built by `make docs`"
)


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    handler = functools.partial(_Quiet, directory=str(SITE))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()


def open_page(browser: Any, width: int) -> tuple[Any, list[str]]:
    page = browser.new_page(viewport={"width": width, "height": 844})
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    return page, asked


def test_search_finds_a_page_by_a_word_that_only_it_has(browser: Any, address: str) -> None:
    page, asked = open_page(browser, 1280)
    page.goto(address)
    page.fill("input.sidebar-search", "homography")
    page.keyboard.press("Enter")
    page.wait_for_selector("ul.search li a")
    found = [link.inner_text() for link in page.query_selector_all("ul.search li > a")]
    assert "The paper" in found
    assert all(url.startswith(address) for url in asked)
    page.close()


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("name", PAGES)
def test_a_page_fits_its_window(browser: Any, address: str, name: str, width: int) -> None:
    page, asked = open_page(browser, width)
    page.goto(f"{address}/{name}.html")
    wide = page.evaluate("document.documentElement.scrollWidth")
    assert wide <= width
    assert all(url.startswith(address) for url in asked)
    assert page.evaluate("[...document.images].every(i => i.complete && i.naturalWidth > 0)")
    page.close()

"""Screenshots for docs/app.md: every screen of the app on a made-up evening.

    python scripts/app_pictures.py docs/pictures/app

Fills a club in a temporary folder, serves it, and takes a picture of each screen at laptop size in
the light theme, and of some at phone size in the dark theme. Needs Chromium or Chrome.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

LAPTOP, PHONE = (1366, 768), (390, 844)
QUALITY = 65
"""JPEG quality of the pictures."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
SCREENS = {
    "practice": "practice",
    "rink": "rink",
    "throws": "throws",
    "throw-film": "throws/1/38#beside=39",
    "ice": "ice",
    "throw": "throw",
    "hand-or-ice": "hand-or-ice",
    "athletes": "athletes",
    "stones": "stones",
}
"""Address of each picture's screen, by the name of the picture."""
ON_A_PHONE = ("rink", "throw", "hand-or-ice")
PATIENCE = 600_000
"""Timeouts for the made-up evening, and for a screen that is computed first [ms]."""


def main() -> None:
    options = argparse.ArgumentParser(prog="app_pictures", description="pictures of docs/app.md")
    options.add_argument("folder", type=Path, help="where the pictures are written")
    folder: Path = options.parse_args().folder
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        sys.exit("no Chromium or Chrome on this machine")
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as club:
        words = [sys.executable, "-m", "curling", "app", club, "--demo", "--no-browser"]
        app = subprocess.Popen([*words, "--port", "0"], stdout=subprocess.PIPE, text=True)
        try:
            assert app.stdout is not None
            address = app.stdout.readline().strip()
            if not address:
                sys.exit("the app has not started")
            take_all(program, address, folder)
        finally:
            app.terminate()
            app.wait()


def take_all(program: str, address: str, folder: Path) -> None:
    """Take a picture of every screen."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        for size, names in ((LAPTOP, SCREENS), (PHONE, ON_A_PHONE)):
            where = browser.new_context(
                viewport={"width": size[0], "height": size[1]},
                color_scheme="light" if size is LAPTOP else "dark",
            )
            page = where.new_page()
            page.set_default_timeout(PATIENCE)
            page.goto(address)
            page.get_by_text("Making up an evening: done").wait_for()
            for name in names:
                ending = "" if size is LAPTOP else "-phone"
                take(page, address + SCREENS[name], folder / f"{name}{ending}.jpg")
            where.close()
        browser.close()


def take(page: Any, address: str, picture: Path) -> None:
    """Take a picture of the top of a screen, once it has loaded."""
    page.goto("about:blank")
    page.goto(address, wait_until="load")
    page.locator("ul[data-jobs]").wait_for(state="detached")  # until it is worked out
    aim = page.get_by_role("button", name="Aim at the button")
    if aim.count():
        aim.click()
        page.locator("#result").wait_for()
    if page.locator("#time").count():  # in the middle of the throw
        page.locator("#curve polyline").wait_for()
        page.locator("#time").evaluate(
            "(it) => { it.value = (Number(it.min) + Number(it.max)) / 2;"
            " it.dispatchEvent(new Event('input')); }"
        )
    page.wait_for_timeout(1500)
    page.screenshot(path=picture, type="jpeg", quality=QUALITY)
    print(picture.name, re.sub(r"/[\w-]{20,}/", "/…/", page.url))


if __name__ == "__main__":
    main()

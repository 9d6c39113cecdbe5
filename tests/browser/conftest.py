"""A browser for pages: Chromium or Chrome, without a screen; WebGL is drawn in software."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

_FLAGS = [
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
]


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Return a browser, or skip where there is none; `CHROME` says where it is."""
    chrome = os.environ.get("CHROME") or shutil.which("chromium") or shutil.which("google-chrome")
    if not chrome:
        pytest.skip("there is no chromium and no google-chrome, and CHROME does not say where one is")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=chrome, args=_FLAGS)
        yield opened
        opened.close()


@pytest.fixture
def show(browser: Any) -> Iterator[Callable[..., Any]]:
    """Return a function that opens a file; at the end nothing may have been asked of a network, and nothing failed."""
    problems: list[str] = []
    contexts = []

    def opened(file: Path, link: str = "t=0", width: int = 1000, height: int = 700) -> Any:
        context = browser.new_context(viewport={"width": width, "height": height}, reduced_motion="reduce")
        contexts.append(context)
        tab = context.new_page()
        tab.on("console", lambda said: problems.append(said.text) if said.type in ("error", "warning") else None)
        tab.on("pageerror", lambda error: problems.append(str(error)))
        local = ("file:", "blob:", "data:")
        tab.on("request", lambda asked: None if asked.url.startswith(local) else problems.append(asked.url))
        tab.goto(f"file://{file}#{link}")
        tab.wait_for_selector("html[data-mode=live], html[data-mode=recorded]")
        return tab

    yield opened
    for one in contexts:
        one.close()
    assert problems == []

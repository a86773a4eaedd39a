"""Browser tests that every HTML page must pass."""

import base64
from collections.abc import Callable

import pytest

Show = Callable[[], None]

WIDTHS = (1280, 400)
"""Widths of a laptop's and a phone's screen (pixels)."""

# JavaScript: the tables that need scrolling, which a wide screen must not have. Wide matrices are exempt.
BEYOND = """
    const all = [...document.querySelectorAll(".scroll:not(:has(.matrix))")];
    return all.filter((each) => each.scrollWidth > each.clientWidth).map((each) => each.ariaLabel);
"""

WIDE_PLOTS = """
    const plots = [...document.querySelectorAll(".plot")].filter((plot) => plot.querySelector("svg"));
    const fits = (plot) => plot.clientWidth > 0 && plot.querySelector("svg").clientWidth <= plot.clientWidth;
    return plots.filter((plot) => plot.getClientRects().length && !fits(plot)).map((plot) => plot.id);
"""


class PageChecks:
    """Tests of the page that a module's fixture ``show`` opens on the emulated screen."""

    @pytest.mark.parametrize("scheme", ["light", "dark"])
    @pytest.mark.parametrize("width", WIDTHS)
    def test_there_are_no_barriers(self, browser, screen, show, width, scheme):
        screen(width, scheme)
        show()
        channels = browser.run("return getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")
        assert (min(channels) > 128) == (scheme == "light")
        assert browser.barriers() == []

    @pytest.mark.parametrize("width", WIDTHS)
    def test_nothing_is_wider_than_the_screen(self, browser, screen, show, width):
        screen(width)
        show()
        assert browser.run("return document.documentElement.scrollWidth") <= width
        assert width < WIDTHS[0] or browser.run(BEYOND) == []

    def test_on_paper_it_is_light_without_controls_and_plots_fit(self, browser, screen, show):
        screen(WIDTHS[0], "dark")
        show()
        browser.media(media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        assert browser.run("return getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert browser.run("return getComputedStyle(document.getElementById('toolbar')).display") == "none"
        assert browser.run(WIDE_PLOTS) == []
        browser.media(media="", features=[])
        printed = browser.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
        assert base64.b64decode(printed["data"]).startswith(b"%PDF")

    def test_it_opens_quietly(self, browser, show):
        browser.console()
        show()
        assert browser.console() == []
        assert browser.run("return document.getElementById('trouble')?.hidden ?? true")

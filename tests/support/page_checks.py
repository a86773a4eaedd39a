"""What holds of every page in the browser, whatever it shows."""

import base64
from collections.abc import Callable

import pytest

Show = Callable[[], None]

WIDTHS = (1280, 400)
"""Of a laptop and of a telephone, pixels."""

# On a wide screen no table goes on beyond its edge either, but for matrices, which open in a place of their own.
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
    """Of the page that a module's fixture ``show`` opens, which shows it on whatever screen there is."""

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

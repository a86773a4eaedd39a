"""Pages in a browser: every module has a fixture ``page``, the path of its page."""

import pytest


@pytest.fixture
def opened(browser, page):
    browser.open(page)
    return browser


@pytest.fixture
def show(browser, page):
    return lambda: browser.open(page)

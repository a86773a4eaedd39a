import pytest


@pytest.fixture
def opened(browser, page):
    browser.open(page)
    return browser


@pytest.fixture
def show(browser, page):
    return lambda: browser.open(page)

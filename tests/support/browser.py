"""Headless Chromium, driven through chromedriver; a test is skipped if either is not installed."""

import json
import shutil
import time

import pytest
from bag_readers import NPM
from waiting import wait_until

AXE = NPM / "node_modules" / "axe-core" / "axe.min.js"
"""The axe-core script, which checks pages for accessibility barriers."""

SETTLED = """
    if (!document.getElementById("library")) return true;
    window.report?.drawAll();
    return Boolean(window.own);
"""
"""JavaScript: draw all plots, also those out of sight, and return whether all are drawn. True without plots."""

HINT = "make test-viewers installs it"
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1400,1000",
)


class Browser:
    """A browser with its own profile; it opens pages from files."""

    def __init__(self, profile):
        webdriver = pytest.importorskip("selenium.webdriver", reason=f"no selenium; {HINT}")
        service = pytest.importorskip("selenium.webdriver.chrome.service")
        chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        driver = shutil.which("chromedriver")
        if not chromium or not driver:
            pytest.skip(f"no {'chromium' if not chromium else 'chromedriver'}; {HINT}")
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=service.Service(driver))
        self.driver.set_script_timeout(600)

    def open(self, page):
        """Open a page from a file and return the seconds until every plot is drawn."""
        self.console()
        self.driver.get("about:blank")  # a page at the same address, but for its settings, would not be loaded anew
        start = time.monotonic()
        self.driver.get(page.as_uri())
        self.settle()
        return time.monotonic() - start

    def settle(self):
        """Wait until all plots are drawn."""
        self.wait(SETTLED)

    def wait(self, script):
        """Wait until JavaScript returns a true value, as long as the browser makes progress."""
        wait_until(lambda: self.run(script), [self.driver.service.process.pid], pause=lambda _: time.sleep(0.05))

    def run(self, script, *arguments):
        """Run JavaScript in the page and return its result."""
        return self.driver.execute_script(script, *arguments)

    def click(self, selector):
        """Click on the first matching element and wait until the plots have been redrawn."""
        element = self.driver.find_element("css selector", selector)
        # At the edge of the window another element may cover it.
        self.run("arguments[0].scrollIntoView({ block: 'center', behavior: 'instant' })", element)
        element.click()
        self.settle()

    def press(self, key):
        """Press a key on the page, wherever the focus is."""
        self.run("document.activeElement.blur()")
        self.driver.find_element("css selector", "body").send_keys(key)

    def screen(self, width, scheme="light"):
        """Emulate a screen of this width (pixels) and a preference for a colour scheme."""
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": features})

    def picture(self, path):
        """Save a picture of the screen without scroll bars."""
        self.driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})
        self.settle()
        self.driver.save_screenshot(str(path))
        self.driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": False})

    def barriers(self):
        """Return rule and place of every barrier that axe-core finds, with all collapsed parts of the page expanded."""
        if not AXE.is_file():
            pytest.skip(f"no axe-core; {HINT}")
        self.run("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        self.run(AXE.read_text(encoding="utf-8"))
        found = self.driver.execute_async_script(
            "axe.run({resultTypes: ['violations']}).then((found) => arguments[0](found.violations))"
        )
        return [f"{rule['id']}: {node['target']}" for rule in found for node in rule["nodes"]]

    def console(self):
        """Return the messages of the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def requests(self):
        """Return the addresses that the page has requested since the last call."""
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        return [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]

    def media(self, **settings):
        """Emulate a medium ("print") or media features ("prefers-color-scheme")."""
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", settings)
        self.settle()

"""Headless Chromium, driven through chromedriver, as far as both are installed."""

import json
import shutil
import time

import pytest
from bag_readers import NPM
from waiting import wait_until

AXE = NPM / "node_modules" / "axe-core" / "axe.min.js"
"""What checks pages for barriers."""

SETTLED = """
    if (!document.getElementById("library")) return true;
    window.report?.drawAll();
    return Boolean(window.own);
"""
"""Whether everything is drawn, on a page that draws plots; what is out of sight is drawn now."""

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
    """A browser with a profile of its own; pages are opened from files."""

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
        """Open a report; return the seconds until every plot was drawn."""
        self.console()
        start = time.monotonic()
        self.driver.get(page.as_uri())
        self.settle()
        return time.monotonic() - start

    def settle(self):
        """Wait until nothing is left to draw."""
        self.wait(SETTLED)

    def wait(self, script):
        """Wait until JavaScript returns something true, as long as the browser works on it."""
        wait_until(lambda: self.run(script), [self.driver.service.process.pid], pause=lambda _: time.sleep(0.05))

    def run(self, script, *arguments):
        """Run JavaScript in the page and return its result."""
        return self.driver.execute_script(script, *arguments)

    def click(self, selector):
        """Click on the first element and wait until the plots have followed."""
        self.driver.find_element("css selector", selector).click()
        self.settle()

    def press(self, key):
        """Press a key on the page itself, whatever has had the focus."""
        self.run("document.activeElement.blur()")
        self.driver.find_element("css selector", "body").send_keys(key)

    def screen(self, width, scheme="light"):
        """Emulate a screen of a width, in pixels, of someone who prefers a colour scheme."""
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": features})

    def picture(self, path):
        """Save what the screen shows, without scroll bars."""
        self.driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": True})
        self.settle()
        self.driver.save_screenshot(str(path))
        self.driver.execute_cdp_cmd("Emulation.setScrollbarsHidden", {"hidden": False})

    def barriers(self):
        """Return what axe-core finds wrong with the page, everything on it unfolded: rule and place."""
        if not AXE.is_file():
            pytest.skip(f"no axe-core; {HINT}")
        self.run("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        self.run(AXE.read_text(encoding="utf-8"))
        found = self.driver.execute_async_script(
            "axe.run({resultTypes: ['violations']}).then((found) => arguments[0](found.violations))"
        )
        return [f"{rule['id']}: {node['target']}" for rule in found for node in rule["nodes"]]

    def console(self):
        """Return what the console received since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def requests(self):
        """Return the addresses that were asked for since the last call."""
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        return [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]

    def media(self, **settings):
        """Emulate a medium ("print") or features of one ("prefers-color-scheme")."""
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", settings)
        self.settle()

"""A headless Chromium that reaches this machine alone, and the pages of `nbdtree view` in it. For Python with selenium."""
import json
import pathlib

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

FLAGS = [
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--no-first-run",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",  # WebGL without a graphics card
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--disable-background-networking", "--disable-component-update",
]


class Browser:
    def __init__(self, width=1280, height=800):
        options = Options()
        for flag in FLAGS:
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.driver.set_script_timeout(1800)
        self.resize(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.driver.quit()

    def resize(self, width, height):
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def open(self, page):
        """Opens a page, a file or an address, and waits until it shows its first frame. Forgets the log of earlier pages."""
        self.driver.get_log("browser")
        self.driver.get_log("performance")
        self.driver.get(page if str(page).startswith("http:") else pathlib.Path(page).resolve().as_uri())
        self.driver.execute_async_script("const done = arguments[0]; nbdtree.ready.then(() => done(), () => done());")

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def frame_is_drawn(self):
        """Waits until what was asked for is on the canvas."""
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()));")

    def seek(self, frame):
        self.run("nbdtree.seek(arguments[0])", frame)
        self.frame_is_drawn()

    def screenshot(self):
        """The window as the bytes of a PNG."""
        self.frame_is_drawn()
        return self.driver.get_screenshot_as_png()

    def complaints(self):
        """What the page wrote to the console as warning or error."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("WARNING", "SEVERE")]

    def requests(self):
        """Addresses that the page asked for since open(), without itself."""
        messages = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        addresses = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
        return [address for address in addresses[1:] if not address.startswith(("data:", "blob:"))]

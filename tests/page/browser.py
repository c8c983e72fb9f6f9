"""A page in Chromium, as the stories look at it."""

from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

PATIENCE_S = 30
# What a page may not write to the console.
LOUD = ("SEVERE",)


class Page:
    """A page in a browser."""

    def __init__(self, url: str, profile: str) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for flag in (
            "headless=new",
            "no-sandbox",
            "disable-gpu",
            "disable-quic",
            "no-first-run",
            "disable-background-networking",
            "disable-component-update",
            "disable-sync",
            "window-size=1400,900",
            f"user-data-dir={profile}",
        ):
            options.add_argument(f"--{flag}")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = webdriver.ChromeService(executable_path="/usr/bin/chromedriver")
        self.browser = webdriver.Chrome(options=options, service=service)
        self.browser.get(url)

    def find(self, selector: str):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def rows(self, name: str) -> list:
        return self.browser.find_elements(By.CSS_SELECTOR, f"#{name} li")

    def sought(self, words: str) -> None:
        """Seeks words in the list of zones."""
        find = self.find("#zones-find")
        find.clear()
        find.send_keys(words)

    def until(self, what: str, test) -> None:
        """Waits until something holds; what it waited for is told where it never does."""
        WebDriverWait(self.browser, PATIENCE_S, poll_frequency=0.05).until(lambda _: test(), what)

    def text(self, selector: str) -> str:
        return self.find(selector).text

    def complaints(self) -> list[str]:
        loud = [entry["message"] for entry in self.browser.get_log("browser") if entry["level"] in LOUD]
        # A browser writes down every refusal, also those that a story asks for.
        return [message for message in loud if "status of 412" not in message and "status of 404" not in message]

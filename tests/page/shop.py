"""The shop window in Chromium: what a customer orders and follows, at the registry of a demo."""

import os
import pathlib
import queue
import re
import signal
import subprocess
import tempfile
import threading
import time

from browser import Page
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

RATE = 20
# A flight of minutes, in accelerated time, on a machine that does other work.
DELIVERED_WITHIN_S = 180
START_S = 60
END_S = 30
# Away from each other, with pads.
PICKUP, DROP = "379", "450"
WITHOUT_PADS_TEXT = "has no pads"


class Demo:
    """`skyway demo` as a process, with the lines that it writes for people."""

    def __init__(self, binary: pathlib.Path) -> None:
        free = "127.0.0.1:0"
        command = [str(binary), "demo", f"--listen={free}", f"--admin-listen={free}", f"--rate={RATE}", "--drones=3"]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SKYWAY_")}
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment
        )
        self.told: list[str] = []
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self) -> "Demo":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(END_S) == 0, "\n".join(self.told)

    def _read(self) -> None:
        for line in self.process.stderr:
            self._lines.put(line.rstrip("\n"))

    def line(self, pattern: str, within_s: float) -> re.Match:
        """The next line that has a pattern, or one that had it before."""
        give_up = time.monotonic() + within_s
        for line in self.told:
            if found := re.search(pattern, line):
                return found
        while time.monotonic() < give_up:
            try:
                line = self._lines.get(timeout=0.2)
            except queue.Empty:
                continue
            self.told.append(line)
            if found := re.search(pattern, line):
                return found
        raise AssertionError(f"no line has {pattern!r}:\n" + "\n".join(self.told))


def press(page: Page, *keys: str) -> None:
    ActionChains(page.browser).send_keys(*keys).perform()


def focused(page: Page) -> str:
    element = page.browser.switch_to.active_element
    return element.get_attribute("aria-label") or element.text


def fill(page: Page, name: str, text: str) -> None:
    field = page.find(f"#{name}")
    field.clear()
    field.send_keys(text)


def until_offered(page: Page) -> None:
    page.until("an offer is there", lambda: page.find("#offers-step").is_displayed() and page.rows("offers"))


def a_node_without_pads_is_refused_where_it_is_written(demo: Demo, page: Page) -> None:
    page.until("the network is there", lambda: len(page.browser.find_elements(By.CSS_SELECTOR, "#nodes option")) > 100)
    bare = page.browser.execute_script(
        """return fetch("/v1/networks/sydney").then((answer) => answer.json()).then(({ features }) =>
             String(features.find(({ properties }) => properties.kind === "node" && properties.pads === 0).id));"""
    )
    fill(page, "source", bare)
    page.until("the field says so", lambda: WITHOUT_PADS_TEXT in page.text("#source-name"))
    assert not page.browser.execute_script('return document.getElementById("search").checkValidity()')


def what_nobody_carries_is_passed_over_with_its_reason(demo: Demo, page: Page) -> None:
    fill(page, "source", PICKUP)
    fill(page, "destination", DROP)
    fill(page, "payload", "40")
    page.find("#search-now").click()
    page.until("it is passed over", lambda: "payload" in page.text("#passed-over"))
    assert page.text("#offers-title") == "No offer"


def a_click_on_the_map_chooses_an_end(demo: Demo, page: Page) -> None:
    page.find("#choose-destination").click()
    before = page.find("#destination").get_attribute("value")
    page.find("#view").send_keys(Keys.ENTER)
    page.until("the drop is another", lambda: page.find("#destination").get_attribute("value") != before)
    pressed = page.find("#choose-source").get_attribute("aria-pressed")
    assert pressed == "true", "the next click is the pickup's"


def a_delivery_is_ordered_by_keyboard(demo: Demo, page: Page) -> None:
    fill(page, "source", PICKUP)
    fill(page, "payload", "0.5")
    fill(page, "destination", DROP)
    press(page, Keys.ENTER)
    until_offered(page)
    press(page, Keys.TAB)
    assert focused(page).startswith("Quote for"), focused(page)
    press(page, Keys.ENTER)
    page.until("there is a quote", lambda: page.find("#quote-step").is_displayed())
    assert re.fullmatch(r"AUD \d+\.\d\d", page.text("#quote-price")), page.text("#quote-price")
    press(page, Keys.TAB)
    press(page, "story")
    press(page, Keys.TAB, Keys.TAB)
    assert focused(page) == "Order", focused(page)
    press(page, Keys.ENTER)
    page.until("it is ordered", lambda: page.find("#delivery-step").is_displayed())
    page.until("the focus is at the delivery", lambda: focused(page).startswith("Delivery "))


def it_is_followed_until_it_is_delivered(demo: Demo, page: Page) -> None:
    page.until("its drone is seen", lambda: "harbour:" in page.text("#delivery-facts") and "Place" in page.text("#delivery-facts"))
    # Who comes back by the address follows the same delivery.
    title = page.text("#delivery-title")
    page.browser.refresh()
    page.until("it is followed again", lambda: page.text("#delivery-title") == title)
    give_up = time.monotonic() + DELIVERED_WITHIN_S
    while page.text("#standing") != "delivered":
        assert time.monotonic() < give_up, page.text("#delivery-step")
        time.sleep(0.5)
    assert "Handed over" in page.text("#delivery-facts")
    assert page.text("#history").count("delivered") == 1
    assert "delivered" in page.text("#announcer") or "delivered" in page.find("#announcer").get_attribute("textContent")
    # A webhook tells the id alone; the customer's own number for it is on the page.
    assert "story" in page.text("#delivery-facts")
    ordered = title.removeprefix("Delivery ")
    demo.line(f"delivered to you: {re.escape(ordered)}$", START_S)


def one_for_later_is_cancelled_before_its_drone_takes_off(demo: Demo, page: Page) -> None:
    ordered = page.browser.execute_async_script(
        """const [source, destination, done] = arguments;
           const ask = async (path, body) => (await fetch(path, body && { method: "POST", body: JSON.stringify(body),
             headers: { "Content-Type": "application/json", "Idempotency-Key": "for-later" } })).json();
           const { time } = await ask("/v1/clock");
           const start_time = new Date(Date.parse(time) + 3600000).toISOString();
           done(await ask("/v1/deliveries", { network: "sydney", source, destination, payload_kg: 0.5, start_time }));""",
        PICKUP,
        DROP,
    )
    page.browser.get(f"{page.browser.current_url.split('#')[0]}#delivery={ordered['id']}")
    page.browser.refresh()
    page.until("it is followed", lambda: page.find("#cancel").is_displayed() and ordered["id"] in page.text("#delivery-title"))
    page.find("#cancel").click()
    page.find("#cancel-now").click()
    page.until("it is cancelled", lambda: page.text("#standing") == "cancelled")
    page.until("it is over", lambda: not page.find("#cancel").is_displayed())
    assert len(page.browser.find_elements(By.CSS_SELECTOR, "#mine tbody tr")) == 2


STORIES = (
    a_node_without_pads_is_refused_where_it_is_written,
    what_nobody_carries_is_passed_over_with_its_reason,
    a_click_on_the_map_chooses_an_end,
    a_delivery_is_ordered_by_keyboard,
    it_is_followed_until_it_is_delivered,
    one_for_later_is_cancelled_before_its_drone_takes_off,
)


def tell(binary: pathlib.Path) -> int:
    """Tells all stories; gives how many there are."""
    with Demo(binary) as demo, tempfile.TemporaryDirectory(prefix="skyway-shop-") as profile:
        url = demo.line(r"(http://\S+)\s+the shop window", START_S)[1]
        page = Page(url, profile)
        try:
            for story in STORIES:
                story(demo, page)
                print(f"ok  {story.__name__.replace('_', ' ')}")
            complaints = page.complaints()
            assert not complaints, complaints
        finally:
            page.browser.quit()
    return len(STORIES)

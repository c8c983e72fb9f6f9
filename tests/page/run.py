"""The pages in Chromium: what an operator sees and lifts, against an edge of its own; what a customer orders, at a demo.

    run.py SKYWAY    where SKYWAY is the program
"""

import pathlib
import sys
import tempfile
import time

import requests
import shop
from browser import PATIENCE_S, Page
from selenium.webdriver.common.by import By

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
from edge_process import EdgeProcess  # noqa: E402

# More than the page once read of the list of plans, ended ones first.
ENDED_PLANS = 1100
# From nodes with one pad each, and to others: a pad has room for one drone.
FLOWN = (("379", "450"), ("361", "420"), ("348", "406"))
# More than a list of the page shows at first.
ZONES = 120
SHOWN_AT_FIRST = 50
CENTRE = (151.2086, -33.8660)


class Edge:
    """What the stories ask of the edge beside the page."""

    def __init__(self, process: EdgeProcess) -> None:
        self.process = process
        self.url = f"http://127.0.0.1:{process.port}"
        self.session = requests.Session()

    def ask(self, method: str, path: str, **how) -> requests.Response:
        answer = self.session.request(method, self.url + path, timeout=PATIENCE_S, **how)
        assert answer.ok, f"{method} {path}: {answer.status_code} {answer.text[:300]}"
        return answer

    def compose(self, name: str, **more: str) -> None:
        self.ask("POST", "/v1/plans", json={"source": "379", "destination": "450", "id": name} | more)

    def put_zone(self, name: str, radius_m: float, until: str | None = None, **headers: str) -> None:
        feature = {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": CENTRE},
            "properties": {"radius_m": radius_m, "name": name},
        }
        if until:
            feature["properties"]["windows"] = [{"from": "2020-01-01T00:00:00Z", "until": until}]
        self.ask("PUT", f"/v1/zones/{name}", json=feature, headers=headers)

    def has_zone(self, name: str) -> bool:
        return self.session.get(f"{self.url}/v1/zones/{name}", timeout=PATIENCE_S).status_code == 200


def plans_flown_are_counted_beside_many_that_are_over(edge: Edge, page: Page) -> None:
    def counts() -> str:
        return page.text("#counts").replace("\n", " ")

    page.until("the plans flown are counted", lambda: f"{len(FLOWN)} plans flown" in counts())


def what_events_tell_of_plans_breaks_no_stream(edge: Edge, page: Page) -> None:
    page.browser.execute_script("""
        const abort = AbortController.prototype.abort;
        window.broken = [];
        AbortController.prototype.abort = function (reason) {
            window.broken.push(String(reason));
            return abort.call(this, reason);
        };
    """)
    edge.compose("told-by-an-event")
    page.until("it is told", lambda: "told-by-an-event" in page.text("#events"))
    edge.ask("DELETE", "/v1/plans/told-by-an-event")
    page.until("its end is told", lambda: page.text("#events").count("told-by-an-event") >= 2)
    assert page.browser.execute_script("return window.broken") == []


def zones_beyond_the_first_are_found_and_lifted(edge: Edge, page: Page) -> None:
    page.until("the first zones are listed", lambda: len(page.rows("zones")) == SHOWN_AT_FIRST)
    assert f"{ZONES - SHOWN_AT_FIRST} of {ZONES}" in page.text("#zones-more"), page.text("#zones-more")
    page.find("#zones-more").click()
    page.until("more are listed", lambda: len(page.rows("zones")) == 2 * SHOWN_AT_FIRST)
    last = f"zone-{ZONES - 1:03}"
    page.find("#zones-find").send_keys(last)
    page.until("one is found", lambda: len(page.rows("zones")) == 1)
    page.find("#zones button").click()
    page.until("what opens is named", lambda: "segment" in page.text("#lift-effect"))
    page.find("#lift-now").click()
    page.until("it is lifted", lambda: not edge.has_zone(last))
    page.sought(" ")


def a_click_alone_lifts_nothing(edge: Edge, page: Page) -> None:
    name = "zone-000"
    page.find(f'[aria-label="Lift zone {name}"]').click()
    page.until("it asks", lambda: "segment" in page.text("#lift-effect"))
    page.find("#lift-cancel").click()
    page.until("the question is gone", lambda: not page.find("#lift").is_displayed())
    assert edge.has_zone(name)
    focused = page.browser.switch_to.active_element.get_attribute("aria-label")
    assert focused == f"Lift zone {name}", f"the focus is at {focused}"


def what_was_seen_is_lifted_and_nothing_newer(edge: Edge, page: Page) -> None:
    name = "zone-001"
    page.find(f'[aria-label="Lift zone {name}"]').click()
    page.until("it asks", lambda: "segment" in page.text("#lift-effect"))
    edge.put_zone(name, 200, **{"If-Match": edge.ask("GET", f"/v1/zones/{name}").headers["etag"]})
    page.find("#lift-now").click()
    page.until("it says that the zone has changed", lambda: "has changed" in page.text("#lift-effect"))
    assert edge.has_zone(name)
    page.find("#lift-cancel").click()
    page.find(f'[aria-label="Lift zone {name}"]').click()
    page.until("the version that is shown now can be lifted", lambda: page.find("#lift-now").is_enabled())
    page.find("#lift-now").click()
    page.until("it is lifted", lambda: not edge.has_zone(name))


def what_is_lifted_and_not_stored_is_not_asked_again(edge: Edge, page: Page) -> None:
    page.browser.execute_script("""
        const fetched = window.fetch;
        window.fetch = (path, how) => {
            if (how.method !== "DELETE" || path.includes("?")) return fetched(path, how);
            window.fetch = fetched;
            return Promise.resolve(new Response('{"code": "not_durable", "enforced": true}', { status: 507 }));
        };
    """)
    page.find('[aria-label="Lift zone zone-002"]').click()
    page.until("it asks", lambda: page.find("#lift-now").is_enabled())
    page.find("#lift-now").click()
    page.until("the question is gone", lambda: not page.find("#lift").is_displayed())
    assert "lifted, but not stored" in page.text("#notice"), page.text("#notice")


def rows_stay_where_they_are(edge: Edge, page: Page) -> None:
    gone = '[aria-label="Lift zone zone-001"]'
    page.until("what was lifted is gone", lambda: not page.browser.find_elements(By.CSS_SELECTOR, gone))
    rows = page.rows("zones")
    edge.put_zone("a-new-one", 30)
    page.until("the new one counts", lambda: "a-new-one" in page.browser.execute_script("return document.body.textContent"))
    # An element that was taken out and made anew would be stale.
    assert all(row.is_displayed() for row in rows[:10])
    again = page.rows("zones")
    assert [row.id for row in again[: len(rows)]] == [row.id for row in rows]


def wind_batteries_and_pads_are_seen(edge: Edge, page: Page) -> None:
    wind = {"from": "2020-01-01T00:00:00Z", "until": "2100-01-01T00:00:00Z", "speed_mps": 4.25, "from_deg": 225}
    edge.ask("PUT", "/v1/weather", json={"wind": [wind]})
    page.until("the wind is told", lambda: "4.3 m/s from SW" in page.text("#wind-now").replace("4.2 ", "4.3 "))
    place = edge.ask("GET", "/v1/nodes/450").json()["location"]
    position = {"drone_id": "z-0", "location": place, "battery_fraction": 0.12, "airborne": False}
    edge.ask("POST", "/v1/telemetry", json={"positions": [position]})
    page.until("the battery is told", lambda: "12 %" in page.text("#drones"))
    edge.ask("POST", "/v1/plans/z-0/complete", json={"location": place})
    page.until("its pad is taken", lambda: " 0 pads taken" not in f" {page.text('#counts')}".replace("\n", " "))


def an_edge_that_hangs_is_told_and_its_clock_goes_on(edge: Edge, page: Page) -> None:
    page.until("it is live", lambda: page.text("#connection") == "live")
    edge.process.hang(True)
    try:
        page.until("the connection is lost", lambda: page.text("#connection") == "reconnecting")
        shown = page.text("#clock-time")
        page.until("the clock goes on", lambda: page.text("#clock-time") > shown)
    finally:
        edge.process.hang(False)
    page.until("it is live again", lambda: page.text("#connection") == "live")


def an_end_on_another_day_has_its_date(edge: Edge, page: Page) -> None:
    edge.put_zone("for-long", 30, until="2100-01-01T10:30:00Z")
    page.sought("for-long")
    page.until("its end is told", lambda: ", until 2100-01-01 10:30:00" in page.text("#zones"))
    page.sought(" ")


def what_could_not_be_read_once_is_read_again(edge: Edge, page: Page) -> None:
    page.browser.execute_script("""
        const fetched = window.fetch;
        window.fetch = (path, how) => {
            if (!path.startsWith("/v1/closures/")) return fetched(path, how);
            window.fetch = fetched;
            return Promise.reject(new TypeError("cut"));
        };
    """)
    edge.put_zone("cut-off", 30)
    page.sought("cut-off")
    page.until("its closure is known", lambda: [row.text[:17] for row in page.rows("zones")] == ["cut-off: in force"])
    page.sought(" ")


STORIES = (
    plans_flown_are_counted_beside_many_that_are_over,
    what_events_tell_of_plans_breaks_no_stream,
    zones_beyond_the_first_are_found_and_lifted,
    a_click_alone_lifts_nothing,
    what_was_seen_is_lifted_and_nothing_newer,
    what_is_lifted_and_not_stored_is_not_asked_again,
    rows_stay_where_they_are,
    wind_batteries_and_pads_are_seen,
    an_edge_that_hangs_is_told_and_its_clock_goes_on,
    an_end_on_another_day_has_its_date,
    what_could_not_be_read_once_is_read_again,
)


def prepare(edge: Edge) -> None:
    # Ids in front of those of the plans flown: they come first in the list.
    for number in range(ENDED_PLANS):
        edge.compose(f"a-{number:04}")
        edge.ask("DELETE", f"/v1/plans/a-{number:04}")
    for number, (source, destination) in enumerate(FLOWN):
        edge.compose(f"z-{number}", drone_id=f"z-{number}", source=source, destination=destination)
    for number in range(ZONES):
        edge.put_zone(f"zone-{number:03}", 20)


def tell(binary: pathlib.Path) -> int:
    """Tells the stories of the edge's page; gives how many there are."""
    flown = ("--set", "flight.airframe=phantom3")
    with EdgeProcess(binary, *flown) as process, tempfile.TemporaryDirectory(prefix="skyway-page-") as profile:
        edge = Edge(process)
        prepare(edge)
        page = Page(edge.url, profile)
        try:
            for story in STORIES:
                story(edge, page)
                print(f"ok  {story.__name__.replace('_', ' ')}")
            complaints = page.complaints()
            assert not complaints, complaints
        finally:
            page.browser.quit()
    return len(STORIES)


def main() -> None:
    binary = pathlib.Path(sys.argv[1])
    began = time.monotonic()
    count = tell(binary) + shop.tell(binary)
    print(f"{count} stories in {time.monotonic() - began:.0f} s")
    print(f"{count} passed, 0 failed")


if __name__ == "__main__":
    main()

// One delivery: how it stands, what has happened to it, and where its drone is.

import { Problem, follow, read } from "./api.js";
import { clockTime, readClock, when } from "./clock.js";
import { nodeName } from "./network.js";
import { money, showFacts } from "./offers.js";
import { make, words } from "./words.js";

const $ = (id) => document.getElementById(id);
const RETRY_MIN_MS = 500;
const RETRY_MAX_MS = 5000;
const FINAL = new Set(["delivered", "diverted", "returned", "failed", "cancelled"]);
/** Before its drone takes off a delivery can be called off. */
const ON_GROUND = new Set(["created", "scheduled", "assigned"]);
const LOOKS = { delivered: "good", in_flight: "info", picking_up: "info", assigned: "info", diverted: "bad", failed: "bad", returned: "bad" };
const TOLD = {
  created: "ordered, waits for a drone",
  scheduled: "its flight is planned",
  assigned: "a drone is assigned",
  picking_up: "the drone flies to the pickup",
  in_flight: "on its way to you",
  holding: "the drone waits until its way opens",
  returning: "on its way back",
  delivered: "delivered",
  diverted: "landed elsewhere",
  returned: "back where it came from",
  failed: "could not be delivered",
  cancelled: "cancelled",
};

/** A status in words, and the class of the word. */
export function standingOf(status) {
  return [TOLD[status] ?? words(status), LOOKS[status] ?? ""];
}

/** Whether nothing follows a status. */
export function isFinal(status) {
  return FINAL.has(status);
}

function connection(state, text) {
  $("connection").dataset.state = state;
  $("connection").textContent = text;
}

function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

function instant(text) {
  const element = make("time", "quiet", clockTime(text));
  element.dateTime = text;
  return element;
}

/** A delivery that is followed until nothing follows, or until another one is. */
export class Tracking {
  /** `heard` is called with every delivery that was read, `unauthorized` gives a promise of a token. */
  constructor(delivery, network, map, { heard, unauthorized }) {
    this.id = delivery.id;
    this.delivery = delivery;
    this.network = network;
    this.map = map;
    this.heard = heard;
    this.unauthorized = unauthorized;
    this.stop = new AbortController();
    this.told = null;
    this.place = null;
    map.forget();
    $("delivery-said").textContent = "";
    this.show(false);
  }

  get path() {
    return `/v1/deliveries/${encodeURIComponent(this.id)}`;
  }

  /** Follows it, over as many streams as it takes. */
  async run() {
    let wait = RETRY_MIN_MS;
    while (!this.stop.signal.aborted) {
      const began = performance.now();
      try {
        await this.readAgain();
        if (isFinal(this.delivery.status)) break;
        await follow(`${this.path}/track`, "", this.stop.signal, () => connection("live", "live"), (event) => this.take(event));
      } catch (problem) {
        if (this.stop.signal.aborted) return;
        if (problem instanceof Problem && problem.status === 401) await this.unauthorized();
        else if (problem instanceof Problem && problem.status === 404) {
          $("delivery-said").textContent = "There is no such delivery, or it is somebody else's.";
          break;
        }
      }
      if (performance.now() - began > RETRY_MAX_MS) wait = RETRY_MIN_MS;
      connection("lost", "reconnecting");
      await pause(wait);
      wait = Math.min(wait * 2, RETRY_MAX_MS);
    }
    if (!this.stop.signal.aborted) connection("waiting", "over");
  }

  /** Follows it no more. */
  end() {
    this.stop.abort();
  }

  take({ kind, data }) {
    if (kind !== "track") return;
    const track = JSON.parse(data);
    if (track.place) this.map.move([track.place.lon, track.place.lat]);
    const told = `${track.status} ${track.expected_at}`;
    this.place = track.place ?? this.place;
    if (told === this.told) {
      this.showFacts();
      this.showStanding();
      return;
    }
    this.told = told;
    // The track tells how it stands; why, and since when, the delivery itself. Where it cannot be read, the next track asks again.
    this.readAgain().catch(() => { this.told = null; });
  }

  async readAgain() {
    await readClock();
    const delivery = await read(this.path);
    if (this.stop.signal.aborted) return;
    const isNews = this.delivery.status !== delivery.status;
    this.delivery = delivery;
    // The last place was told a little before the parcel was handed over.
    if (isNews && delivery.proof?.lon !== undefined) this.map.move([delivery.proof.lon, delivery.proof.lat]);
    this.show(isNews);
    this.heard(delivery);
  }

  /** How it stands, and how long it still takes. */
  showStanding() {
    const { status, expected_at: expected, reason } = this.delivery;
    const [text, look] = standingOf(status);
    $("standing").textContent = text;
    $("standing").className = look;
    $("expected").textContent = expected && !isFinal(status) ? `expected ${when(expected)}` : "";
    $("delivery-reason").textContent = reason ?? "";
    $("cancel").hidden = !ON_GROUND.has(status);
  }

  show(isNews) {
    const { status, history, recompositions } = this.delivery;
    $("delivery-step").hidden = false;
    $("delivery-title").textContent = `Delivery ${this.id}`;
    this.showStanding();
    this.showFacts();
    $("history").replaceChildren(...history.map((change, place) => {
      const [word] = standingOf(change.status);
      const line = make("li", "", make("span", "", word), " ", instant(change.at), change.reason ? make("p", "quiet", change.reason) : null);
      if (place === history.length - 1) line.setAttribute("aria-current", "step");
      return line;
    }));
    $("recomposed").hidden = recompositions.length === 0;
    $("recompositions").replaceChildren(...recompositions.map((change) => {
      const causes = change.causes?.length ? change.causes.join(", ") : "the wind, or the drone itself";
      return make("li", "", make("span", "", `${words(change.outcome)} (version ${change.plan_version})`), " ", instant(change.at),
        make("p", "quiet", `because of ${causes}; expected ${clockTime(change.expected_at)} since`));
    }));
    if (isNews) $("announcer").textContent = `Delivery ${this.id}: ${standingOf(status)[0]}`;
  }

  showFacts() {
    const { source, destination, payload_kg: payload, price, promised_at: promised, reference, allocation, proof } = this.delivery;
    const place = this.place;
    const battery = place?.battery_fraction === undefined ? "" : `, battery ${Math.round(place.battery_fraction * 100)} %`;
    showFacts($("delivery-facts"), [
      ["From", nodeName(this.network, String(source))],
      ["To", nodeName(this.network, String(destination))],
      ["Payload", `${payload} kg`],
      ["Price", price && money(price)],
      ["Promised", promised && clockTime(promised)],
      ["Your number", reference],
      ["Drone", allocation && `${allocation.drone_id}: ${allocation.explanation}`],
      ["Place", place && !proof && `${place.lat.toFixed(5)}, ${place.lon.toFixed(5)} at ${clockTime(place.at)}${battery}`],
      ["Handed over", proof && clockTime(proof.at)],
    ]);
  }
}

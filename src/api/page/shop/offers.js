// What is offered, what was passed over, and a quote that runs out.

import { clockTime, duration, now, when } from "./clock.js";
import { counted, make, metres } from "./words.js";

const $ = (id) => document.getElementById(id);
const SOON_MS = 60000;

/** An amount of money: the decimal number as it was told. */
export function money({ amount, currency }) {
  return `${currency} ${amount}`;
}

function percent(fraction) {
  return `${Math.round(fraction * 1000) / 10} %`;
}

function reliability({ promised_on_time_fraction: promised, measured_on_time: measured }) {
  const said = promised === undefined ? "in time: nothing promised" : `in time: ${percent(promised)} promised`;
  if (!measured?.of) return `${said}, nothing measured yet`;
  return `${said}, ${percent(measured.fraction)} measured (${measured.count} of ${measured.of}; 95 % interval ${percent(measured.low_fraction)} to ${percent(measured.high_fraction)})`;
}

/** Fills a list of terms and facts; what is absent is left out. */
export function showFacts(list, facts) {
  const told = facts.filter(([, fact]) => fact);
  list.replaceChildren(...told.flatMap(([term, fact]) => [make("dt", "", term), make("dd", "", String(fact))]));
}

function offerLine(offer, quote) {
  const button = make("button", "", "Quote");
  button.type = "button";
  button.setAttribute("aria-label", `Quote for ${offer.name}`);
  button.addEventListener("click", () => quote(offer, button));
  return make("li", "",
    make("p", "row", make("strong", "", offer.name), make("span", "price", money(offer.price))),
    make("p", "", `Arrives ${when(offer.arrives_at)}, picked up ${when(offer.pickup_at)}`),
    make("p", "quiet", `by ${offer.provider}, ${metres(offer.length_m)}, ${counted(offer.drones, "drone")} at hand; ${reliability(offer)}`),
    make("ul", "reasons", ...offer.reasons.map((reason) => make("li", "", reason))),
    button);
}

/** Shows what a search has found; `quote` is called with the offer that is to be priced. */
export function showOffers({ offers, passed_over: passed }, quote) {
  $("offers-step").hidden = false;
  $("offers-title").textContent = offers.length ? counted(offers.length, "offer") : "No offer";
  $("offers").replaceChildren(...offers.map((offer) => offerLine(offer, quote)));
  $("passed").hidden = passed.length === 0;
  $("passed").open = offers.length === 0;
  $("passed-title").textContent = `${counted(passed.length, "service")} passed over`;
  $("passed-over").replaceChildren(...passed.map(({ service_id: service, code, text }) =>
    make("li", "", make("strong", "", service), `: ${text} `, make("span", "quiet", code))));
  $("offers-title").focus();
}

/** A quote on the page, until it is accepted, overtaken or over. */
export class ShownQuote {
  constructor(quote, offer) {
    this.quote = quote;
    $("quote-step").hidden = false;
    $("quote-price").textContent = money(quote.price);
    $("quote-said").textContent = "";
    showFacts($("quote-facts"), [
      ["Service", offer.name],
      ["Flown by", quote.provider],
      ["Pickup", when(quote.pickup_at)],
      ["Arrival", when(quote.arrives_at)],
      ["Way", metres(quote.length_m)],
      ["Composed at", quote.edge],
      ["Quote", `${quote.id}, until ${clockTime(quote.expires_at)}`],
    ]);
    this.tick();
    $("quote-title").focus();
  }

  /** How long it still holds, in milliseconds of the registry's time. */
  get left() {
    return Date.parse(this.quote.expires_at) - (now() ?? 0);
  }

  /** Tells how long it still holds; true once it is over. */
  tick() {
    const left = this.left;
    const isOver = left <= 0;
    $("quote-left").textContent = isOver ? "no longer" : duration(left);
    $("quote-left").dataset.state = isOver ? "over" : left < SOON_MS ? "soon" : "good";
    $("order-now").disabled = isOver;
    $("quote-again").hidden = !isOver;
    return isOver;
  }
}

// The shop window: a customer searches, has a price told, orders, and follows what was ordered.

import { Problem, read, readPages, request, useToken } from "./api.js";
import { clockTime, now, rateShown, readClock } from "./clock.js";
import { Map2D } from "./map.js";
import { hasPads, nodeName, placeOf, readNetwork } from "./network.js";
import { ShownQuote, money, showOffers } from "./offers.js";
import { Tracking, isFinal, standingOf } from "./tracking.js";
import { keepingFocus, make } from "./words.js";

const $ = (id) => document.getElementById(id);
const DELIVERIES_MAX = 50;
const RETRY_MS = 2000;
/** Who orders where nobody asks for a token. */
const NAMELESS = "local";
const ENDS = ["source", "destination"];

let network = null;
let searched = null;
let quote = null;
let offer = null;
let tracking = null;
let isNameless = true;
let next = "source";
const mine = new Map();

const map = new Map2D((id) => {
  setEnd(next, id);
  choose(next === "source" ? "destination" : "source");
});

function notice(text) {
  $("notice").textContent = text ?? "";
  $("notice").hidden = !text;
}

function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

let givenToken = null;
/** The reader is asked for a token once, however many requests wait for it. */
function tokenGiven() {
  givenToken ??= new Promise((resolve) => {
    $("token-form").hidden = false;
    $("token").focus();
    $("token-form").onsubmit = (event) => {
      event.preventDefault();
      useToken($("token").value.trim());
      isNameless = false;
      $("token").value = "";
      $("token-form").hidden = true;
      givenToken = null;
      resolve();
    };
  });
  return givenToken;
}

/** Does something that asks the registry, again with a token where one is needed. */
async function asked(work) {
  for (;;) {
    try {
      const done = await work();
      notice(null);
      return done;
    } catch (problem) {
      if (!(problem instanceof Problem) || problem.status !== 401) throw problem;
      notice("This registry asks for a token.");
      await tokenGiven();
    }
  }
}

/** Says below a step what went wrong. */
function say(step, problem) {
  const text = problem instanceof Problem ? problem.message : "The registry cannot be reached; try again.";
  $(`${step}-said`).textContent = text;
}

/** Which end the next node on the map becomes. */
function choose(end) {
  next = end;
  for (const name of ENDS) $(`choose-${name}`).setAttribute("aria-pressed", String(name === end));
}

function setEnd(end, id) {
  $(end).value = id;
  checkEnd(end);
}

/** Holds the id in a field against the network, and tells its name. */
function checkEnd(end) {
  const id = $(end).value.trim();
  const isKnown = network !== null && placeOf(network, id) !== undefined;
  const fault = !id ? "" : !isKnown ? `the network has no node ${id}` : hasPads(network, id) ? "" : `node ${id} has no pads`;
  $(end).setCustomValidity(fault);
  $(`${end}-name`).textContent = fault || (isKnown ? nodeName(network, id) : "");
  map.ends = { ...map.ends, [end]: fault ? "" : id };
}

async function takeNetwork(id) {
  network = await asked(() => readNetwork(id));
  map.setNetwork(network);
  const options = network.ids.flatMap((node, place) => (network.pads[place] ? [option(node, network.names[place])] : []));
  $("nodes").replaceChildren(...options);
  for (const end of ENDS) if ($(end).value) checkEnd(end);
}

function option(value, label) {
  const element = make("option", "", label);
  element.value = value;
  return element;
}

/** What is looked for, as the fields have it. */
function wanted() {
  const within = $("within").valueAsNumber;
  const byWhen = Number.isFinite(within) ? new Date(now() + within * 60000).toISOString() : undefined;
  return {
    source: $("source").value.trim(),
    destination: $("destination").value.trim(),
    payload_kg: $("payload").valueAsNumber,
    arrive_by: byWhen,
  };
}

$("search").addEventListener("submit", async (event) => {
  event.preventDefault();
  $("search-said").textContent = "Searching…";
  try {
    await asked(readClock);
    searched = wanted();
    const body = { ...searched, network: network.id, rank_by: $("rank").value };
    const found = await asked(async () => (await request("POST", "/v1/services:search", { body })).json());
    $("search-said").textContent = "";
    $("quote-step").hidden = true;
    quote = null;
    showOffers(found, priced);
  } catch (problem) {
    say("search", problem);
  }
});

/** Has the exact price of an offer told. */
async function priced(chosen, button) {
  if (button) button.disabled = true;
  $("search-said").textContent = "An edge composes the flight…";
  try {
    const body = { ...searched, service_id: chosen.service_id };
    const told = await asked(async () => (await request("POST", "/v1/quotes", { body })).json());
    $("search-said").textContent = "";
    offer = chosen;
    quote = new ShownQuote(told, chosen);
  } catch (problem) {
    say("search", problem);
  }
  if (button) button.disabled = false;
}

$("quote-again").addEventListener("click", () => priced(offer, null));

$("quote-step").addEventListener("submit", async (event) => {
  event.preventDefault();
  $("order-now").disabled = true;
  const name = $("recipient").value.trim();
  const body = {
    quote_id: quote.quote.id,
    reference: $("reference").value.trim() || undefined,
    recipient: name ? { name } : undefined,
  };
  try {
    // The same quote is not ordered twice, however often it is sent.
    const headers = { "Idempotency-Key": `quote-${quote.quote.id}` };
    const delivery = await asked(async () => (await request("POST", "/v1/deliveries", { body, headers })).json());
    quote = null;
    $("quote-step").hidden = true;
    $("offers-step").hidden = true;
    heard(delivery);
    track(delivery.id);
    $("delivery-title").focus();
  } catch (problem) {
    $("order-now").disabled = false;
    say("quote", problem);
  }
});

/** Follows a delivery from now on, instead of any other. */
async function track(id) {
  tracking?.end();
  history.replaceState(null, "", `#delivery=${encodeURIComponent(id)}`);
  try {
    const delivery = mine.get(id) ?? await asked(() => read(`/v1/deliveries/${encodeURIComponent(id)}`));
    if (delivery.network !== network.id) {
      $("network").value = delivery.network;
      await takeNetwork(delivery.network);
    }
    for (const end of ENDS) setEnd(end, String(delivery[end]));
    tracking = new Tracking(delivery, network, map, { heard, unauthorized: tokenGiven });
    tracking.run();
  } catch (problem) {
    notice(`Delivery ${id} is not followed: ${problem.message}`);
  }
}

/** Takes a delivery as it was read last. */
function heard(delivery) {
  mine.set(delivery.id, delivery);
  showMine();
}

function showMine() {
  const newest = [...mine.values()].sort((one, other) => other.created_at.localeCompare(one.created_at)).slice(0, DELIVERIES_MAX);
  $("mine-empty").hidden = newest.length > 0;
  $("mine").hidden = newest.length === 0;
  keepingFocus($("mine").tBodies[0], newest.map((delivery) => {
    const [text, look] = standingOf(delivery.status);
    const button = make("button", "", "Follow");
    button.type = "button";
    button.dataset.id = delivery.id;
    button.setAttribute("aria-label", `Follow delivery ${delivery.id}`);
    button.addEventListener("click", () => track(delivery.id));
    return make("tr", "", make("td", "", clockTime(delivery.created_at).slice(0, 5)), make("td", "", `${delivery.source} – ${delivery.destination}`),
      make("td", `told ${look}`, text), make("td", "", delivery.price ? money(delivery.price) : "–"), make("td", "", button));
  }));
}

async function readMine() {
  const isMine = ({ customer }) => !isNameless || customer === NAMELESS;
  const take = (page) => page.deliveries.filter(isMine).forEach((delivery) => mine.set(delivery.id, delivery));
  await asked(() => readPages("/v1/deliveries?", "deliveries", 1000, take));
  showMine();
}

$("cancel").addEventListener("click", () => $("cancel-question").showModal());
$("cancel-not").addEventListener("click", () => $("cancel-question").close());
$("cancel-now").addEventListener("click", async () => {
  $("cancel-question").close();
  try {
    const path = `/v1/deliveries/${encodeURIComponent(tracking.id)}/cancel`;
    await asked(() => request("POST", path, { body: {} }));
    await tracking.readAgain();
  } catch (problem) {
    say("delivery", problem);
  }
});

for (const end of ENDS) {
  $(end).addEventListener("input", () => checkEnd(end));
  $(end).addEventListener("focus", () => choose(end));
  $(`choose-${end}`).addEventListener("click", () => choose(end));
}
$("network").addEventListener("change", () => takeNetwork($("network").value));

setInterval(() => {
  if (now() === null) return;
  $("clock-time").textContent = clockTime(now());
  $("clock-rate").textContent = rateShown() === null ? "" : `simulated, × ${rateShown()}`;
  if (quote?.tick() && $("quote-said").textContent === "") $("quote-said").textContent = "The quote has run out.";
}, 500);

async function begin() {
  await asked(readClock);
  const { networks } = await asked(() => read("/v1/networks"));
  $("network").replaceChildren(...networks.map(({ id }) => option(id, id)));
  if (networks.length === 0) {
    notice("The registry has no network yet.");
    return;
  }
  await takeNetwork(networks[0].id);
  await readMine();
  const linked = /^#delivery=(.+)$/.exec(location.hash)?.[1];
  const running = [...mine.values()].find(({ status }) => !isFinal(status))?.id;
  const shown = linked ? decodeURIComponent(linked) : running;
  if (shown) track(shown);
}

async function beginAtLast() {
  for (;;) {
    try {
      await begin();
      return;
    } catch (problem) {
      notice(problem instanceof Problem ? `The registry refuses: ${problem.message}` : "The registry cannot be reached; it is asked again.");
      await pause(RETRY_MS);
    }
  }
}

beginAtLast();

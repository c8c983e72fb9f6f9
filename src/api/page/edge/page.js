// The live page: reads the lists, follows the events, polls the drones, and draws what changed.

import { showAirspace } from "./airspace.js";
import { Problem, follow, read, readPages, useToken, whenUnauthorized } from "./api.js";
import { drawGround, readInks } from "./canvas.js";
import { Circle } from "./circle.js";
import { drawTraffic, placesOf } from "./drawing.js";
import { extraOf, notice, sentence, showChosen, showClock, showCounts, showDrones, showEvents, showRecompositions, showStamp, showWind } from "./panels.js";
import { LINES_MAX, POLL_MS, addRecomposition, apply, clearLists, edgeTime, setClock, setClosure, setDrones, setNetwork, setPlan, setPlanCounts, setStamp, setWeather, setZone, world } from "./world.js";
import { View } from "./view.js";

const $ = (id) => document.getElementById(id);
const LISTED_MAX = 5000;
const COUNT_EVERY_POLLS = 4;
const CLOCK_EVERY_POLLS = 60;
/** An edge that takes longer over a poll hangs, or the network is cut. */
const POLL_WITHIN_MS = 10000;
const RETRY_MIN_MS = 500;
const RETRY_MAX_MS = 5000;
const ANNOUNCE_EVERY_MS = 4000;

const stillness = matchMedia("(prefers-reduced-motion: reduce)");
const darkness = matchMedia("(prefers-color-scheme: dark)");
const details = new Map();
let chosen = null;
let lastEventId = "";
let stream = new AbortController();
let isReadingDetail = false;
let isDirty = true;

const circle = new Circle(() => { isDirty = true; });
const view = new View($("view"), () => { world.changed.add("view"); }, (place) => {
  if (circle.isOpen) circle.place(place);
});

function pause(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

function connection(state, text) {
  $("connection").dataset.state = state;
  $("connection").textContent = text;
}

/** Notes a gap in the list of events, where it is seen. */
function noteGap(text) {
  const at = new Date(edgeTime() ?? Date.now()).toISOString();
  world.events = [{ kind: "gap", at, data: { text } }, ...world.events].slice(0, LINES_MAX);
  world.changed.add("events");
}

async function readNetwork() {
  const network = await read("/v1/network?format=compact");
  const known = world.network;
  const isSame = known && known.name === network.name && known.ids.length === network.ids.length && known.segments.length === network.segments.length
    && known.topology_revision === network.topology_revision;
  // An edge that has started again mostly has the same network: the reader's view of it stays.
  if (isSame) return;
  setNetwork(network);
  view.setNetwork(network);
  circle.setView(view, network);
  $("attribution").textContent = network.attribution;
}

async function readLists() {
  await readNetwork();
  const answers = await read(`/v1/recompositions?page_size=${LINES_MAX}`);
  clearLists();
  world.leftOut = {
    plans: await readPages("/v1/plans?ended=false&", "plans", LISTED_MAX, (page) => {
      world.planCounts = page.counts;
      page.plans.forEach(setPlan);
    }),
    zones: await readPages("/v1/zones?", "features", LISTED_MAX, (page) => page.features.forEach((zone, place) => setZone(zone, page.etags[place]))),
    closures: await readPages("/v1/closures?", "closures", LISTED_MAX, (page) => page.closures.forEach(setClosure)),
  };
  setWeather(await read("/v1/weather"));
  setClock(await read("/v1/clock"));
  world.recompositions = [];
  answers.recompositions.reverse().forEach(addRecomposition);
  setStamp(answers);
  if (!chosen && world.recompositions.length) choose(world.recompositions[0]);
  world.changed.add("zones").add("drones").add("recompositions");
}

async function take(message) {
  if (message.kind === "gone") throw new Problem(410, JSON.parse(message.data));
  if (message.id) lastEventId = message.id;
  const event = JSON.parse(message.data);
  apply(event);
  announce(event);
  if (event.kind === "recomposed" && $("follow").checked) choose(event.data);
  // The event tells the zone; whether it is in force by the edge's clock, its closure tells.
  if (event.kind === "network_changed") await readLists();
  if (event.kind === "zone_put") await readClosure(String(event.data.zone.id));
}

async function readClosure(id) {
  try {
    setClosure(await read(`/v1/closures/${encodeURIComponent(id)}`));
  } catch (problem) {
    if (!(problem instanceof Problem) || problem.status !== 404) throw problem;
  }
}

/** One stream of events, from its start to its end; where it does not resume another, the lists are read once it is open. */
async function followOnce() {
  const stop = new AbortController();
  stream = stop;
  const early = [];
  let lists = null;
  let failed = null;
  const fail = (problem) => {
    failed = problem;
    // No later event tells what was not read, so the next stream begins with the lists; it may have begun.
    lastEventId = "";
    stream.abort(problem);
  };
  const taken = (message) => {
    if (lists) early.push(message);
    else if (!failed) take(message).catch(fail);
  };
  const opened = () => {
    connection("live", "live");
    notice(null);
    if (lastEventId) return;
    lists = readLists().then(() => {
      lists = null;
      for (const message of early.splice(0)) taken(message);
    }, fail);
  };
  try {
    await follow("/v1/events", lastEventId, stop.signal, opened, taken);
  } catch (problem) {
    throw failed ?? problem;
  }
}

async function followForever() {
  let wait = RETRY_MIN_MS;
  for (;;) {
    const began = performance.now();
    try {
      await followOnce();
      noteGap("the stream of events ended; reconnecting");
    } catch (problem) {
      if (problem instanceof Problem && problem.status === 410) {
        lastEventId = "";
        wait = RETRY_MIN_MS;
        noteGap("events were missed; the lists are read again");
      } else if (problem instanceof Problem && problem.status === 401) {
        connection("lost", "needs a token");
        await tokenGiven();
      } else {
        if ($("connection").dataset.state === "live") noteGap("the connection was lost; reconnecting");
        notice(problem instanceof Problem ? `The edge refuses: ${problem.message}` : "The edge cannot be reached. The picture is as it was last.");
      }
    }
    connection("lost", "reconnecting");
    if (performance.now() - began > RETRY_MAX_MS) wait = RETRY_MIN_MS;
    await pause(wait);
    wait = Math.min(wait * 2, RETRY_MAX_MS);
  }
}

async function pollForever() {
  for (let polls = 0; ; polls += 1) {
    await pause(POLL_MS);
    if (document.hidden || !world.network) continue;
    try {
      setDrones(await read("/v1/drones?page_size=1000", POLL_WITHIN_MS));
      if (polls % COUNT_EVERY_POLLS === 0) setPlanCounts((await read("/v1/plans?page_size=1", POLL_WITHIN_MS)).counts);
      if (polls % CLOCK_EVERY_POLLS === 0) setClock(await read("/v1/clock", POLL_WITHIN_MS));
    } catch (problem) {
      // The stream of the same edge is lost, too, though it may not know yet: it tells the reader, and connects again.
      if (!(problem instanceof Problem)) stream.abort(problem);
      await pause(RETRY_MIN_MS);
    }
  }
}

function tokenGiven() {
  return new Promise((resolve) => {
    $("token-form").hidden = false;
    $("token-form").onsubmit = (event) => {
      event.preventDefault();
      useToken($("token").value.trim());
      $("token").value = "";
      $("token-form").hidden = true;
      resolve();
    };
  });
}

function choose(summary) {
  chosen = summary;
  showChosen(chosen, details.get(chosen.id));
  world.changed.add("recompositions");
}

/** Reads what is not known yet of the newest answers, one at a time; what falls off the list is not read. */
async function readDetail() {
  if (isReadingDetail || document.hidden) return;
  const unknown = [chosen, ...world.recompositions].find((answer) => answer && !details.has(answer.id));
  if (!unknown) return;
  isReadingDetail = true;
  try {
    const record = await read(`/v1/recompositions/${encodeURIComponent(unknown.id)}`);
    const stated = record.settled_report.location;
    const location = Array.isArray(stated) ? stated.slice(0, 2) : placesOf([stated?.node ?? unknown.old_path[0]])[0];
    details.set(unknown.id, { answer: record.answer, extra_m: extraOf(unknown, location, view) });
  } catch {
    details.set(unknown.id, undefined);
  }
  while (details.size > 2 * LINES_MAX) details.delete(details.keys().next().value);
  isReadingDetail = false;
  if (chosen?.id === unknown.id) showChosen(chosen, details.get(chosen.id));
  world.changed.add("recompositions");
}

let announcedAt = -ANNOUNCE_EVERY_MS;
/** Tells those who do not see the map, not more often than they can listen. */
function announce(event) {
  const now = performance.now();
  if (now - announcedAt < ANNOUNCE_EVERY_MS) return;
  announcedAt = now;
  $("announcer").textContent = sentence(event);
}

const PANELS = {
  network: showStamp,
  stamp: showStamp,
  events: showEvents,
  drones: () => { showDrones(view); showCounts(); },
  zones: () => { showAirspace(); showCounts(); },
  recompositions: () => showRecompositions(chosen?.id, details, choose),
};

let panelsAt = 0;
function frame(now) {
  requestAnimationFrame(frame);
  if (world.changed.has("view") || world.changed.has("network")) {
    world.changed.delete("view");
    drawGround($("ground"), view, world.network);
    isDirty = true;
  }
  if (isDirty || world.drones.size > 0 || world.changed.size > 0) {
    drawTraffic($("traffic"), view, { chosen, draft: circle.isOpen ? circle.draft : null, still: stillness.matches });
    isDirty = false;
  }
  // Words need not change as often as pictures.
  if (now - panelsAt < 250) return;
  panelsAt = now;
  for (const name of [...world.changed]) PANELS[name]?.();
  if (world.changed.size > 0) isDirty = true;
  world.changed.clear();
  showClock();
  showWind();
  readDetail();
}

$("zoom-in").addEventListener("click", () => view.zoom(1.35));
$("zoom-out").addEventListener("click", () => view.zoom(1 / 1.35));
$("fit").addEventListener("click", () => view.fit());
darkness.addEventListener("change", () => { readInks(); world.changed.add("view"); });
whenUnauthorized(() => notice("This edge asks for a token."));
if (matchMedia("(max-width: 820px)").matches) document.querySelector(".legend").open = false;
readInks();
requestAnimationFrame(frame);
followForever();
pollForever();

// What this page knows of the edge: lists read once, then kept by events. All of it is bounded.

/** At most this many lines in a list. */
export const LINES_MAX = 50;
const DRONES_MAX = 1000;
const POLL_MS = 500;

/** The state; `changed` names what a panel has to draw again. */
export const world = {
  network: null,
  drones: new Map(),
  dronesLeftOut: false,
  plans: new Map(),
  planCounts: null,
  leftOut: { plans: false, zones: false, closures: false },
  zones: new Map(),
  etags: new Map(),
  closures: new Map(),
  inForce: new Set(),
  wind: [],
  padsTaken: new Map(),
  recompositions: [],
  events: [],
  stamp: null,
  clock: null,
  changed: new Set(),
};

export function setNetwork(compact) {
  const index = new Map(compact.ids.map((id, place) => [id, place]));
  const endsAt = (place) => [2 * place, 2 * place + 1].map((end) => compact.ids[compact.segments[end]]);
  const segmentEnds = new Map((compact.segment_ids ?? []).map((id, place) => [id, endsAt(place)]));
  world.network = { ...compact, index, segmentEnds };
  world.changed.add("network");
}

/** The index of a node, or undefined. */
export function nodeAt(id) {
  return world.network?.index.get(id);
}

export function setStamp(answer) {
  if (!answer?.revision) return;
  const { revision, freshness, clock } = answer;
  world.stamp = { revision, freshness, clock };
  world.changed.add("stamp");
}

/** Takes the answer of `GET /v1/clock`. */
export function setClock({ time, rate }) {
  world.clock = { shown: Date.parse(time), at: performance.now(), rate };
}

/** Takes an instant that the edge told: its time is at least this. */
export function heardInstant(text) {
  const shown = Date.parse(text);
  if (world.clock && shown > edgeTime()) world.clock = { ...world.clock, shown, at: performance.now() };
}

/** The edge's time in milliseconds, run on as fast as its clock passes; `null` before the clock was read. */
export function edgeTime() {
  const clock = world.clock;
  return clock && clock.shown + (performance.now() - clock.at) * clock.rate;
}

/** Takes the answer of `GET /v1/drones`. */
export function setDrones(answer) {
  const now = performance.now();
  const seen = new Set();
  for (const drone of answer.drones.slice(0, DRONES_MAX)) {
    seen.add(drone.id);
    heardInstant(drone.seen_at);
    const before = world.drones.get(drone.id);
    const moved = !before || before.seen_at !== drone.seen_at;
    // A drone is drawn on its way from where it was drawn last to where it was seen last.
    const from = moved ? (before ? drawnAt(before, now) : drone.location) : before.from;
    world.drones.set(drone.id, { ...drone, from, at: moved ? now : before.at });
  }
  for (const id of world.drones.keys()) if (!seen.has(id)) world.drones.delete(id);
  world.dronesLeftOut = Boolean(answer.next_page_token);
  world.padsTaken = padsTaken();
  setStamp(answer);
  world.changed.add("drones");
}

/** How many pads of each node are taken now: by drones that stand there, and by plans. */
function padsTaken() {
  const taken = new Map();
  const standing = new Set();
  const take = (node) => taken.set(node, (taken.get(node) ?? 0) + 1);
  for (const drone of world.drones.values()) {
    if (!drone.stands_at) continue;
    standing.add(drone.id);
    take(drone.stands_at);
  }
  const now = edgeTime() ?? 0;
  for (const plan of world.plans.values()) {
    const stop = plan.reported.stops.find(({ from, until }) => from <= now && now < until);
    if (stop && !standing.has(plan.drone_id)) take(stop.node);
  }
  return taken;
}

/** Takes the answer of `GET /v1/weather`, or its event. */
export function setWeather({ wind }) {
  world.wind = wind;
}

/** The wind now as it is stated: of the whole network, and how many areas have another. */
export function windNow() {
  const now = edgeTime() ?? 0;
  const counts = world.wind.filter(({ from, until }) => Date.parse(from) <= now && now < Date.parse(until));
  return { everywhere: counts.find(({ area }) => !area) ?? null, areas: counts.filter(({ area }) => area).length };
}

/** Where to draw a drone now. */
export function drawnAt(drone, now) {
  const part = Math.min((now - drone.at) / (POLL_MS * 1.2), 1);
  return drone.from.map((from, axis) => from + (drone.location[axis] - from) * part);
}

export { POLL_MS };

function brief(version) {
  if (!version) return null;
  const nodes = version.nodes ?? version.path.nodes;
  const { outcome, length_m, arrives_at, flight } = version;
  const stops = (flight?.stops ?? []).map(({ node, lands_at, takes_off_at }) => ({ node, from: Date.parse(lands_at), until: Date.parse(takes_off_at) }));
  return { version: version.version, outcome, nodes, length_m, arrives_at, stops, battery_at_arrival: flight?.battery_at_arrival_fraction ?? null };
}

/** Takes how many plans the edge has in each state: it may have more than are drawn. */
export function setPlanCounts(counts) {
  world.planCounts = counts;
  world.changed.add("drones");
}

/** Takes a plan, of a list or of an event. */
export function setPlan(plan) {
  world.changed.add("drones");
  if (plan.state === "ended") {
    world.plans.delete(plan.id);
    return;
  }
  world.plans.set(plan.id, {
    id: plan.id,
    state: plan.state,
    drone_id: plan.drone_id,
    affected: plan.flags.includes("affected"),
    silent: plan.flags.includes("silent"),
    reported: brief(plan.reported),
    wanted: brief(plan.wanted),
  });
}

/** Takes a zone with its version, which a later write names. */
export function setZone(zone, etag) {
  world.zones.set(String(zone.id), zone);
  world.etags.set(String(zone.id), etag);
  world.changed.add("zones");
}

export function setClosure(closure) {
  if (closure.cause !== "zone") world.closures.set(closure.id, closure);
  if (closure.in_force) world.inForce.add(closure.id);
  else world.inForce.delete(closure.id);
  world.changed.add("zones");
}

/** Forgets what lists and events tell, before they are read again. The clock goes on until it is read, however long that takes. */
export function clearLists() {
  for (const kept of [world.plans, world.zones, world.etags, world.closures, world.inForce]) kept.clear();
}

/** Puts an answer on top of the list. */
export function addRecomposition(summary) {
  const others = world.recompositions.filter((other) => other.id !== summary.id);
  world.recompositions = [summary, ...others].slice(0, LINES_MAX);
  world.changed.add("recompositions");
}

/** `coming`, `active` or `over`: how a zone stands. */
export function standing(zone) {
  if (world.inForce.has(String(zone.id))) return "active";
  const windows = zone.properties?.windows ?? [];
  const now = edgeTime() ?? 0;
  const over = windows.length > 0 && windows.every((window) => window.until && Date.parse(window.until) <= now);
  return over ? "over" : "coming";
}

/** Takes an event of the stream; gives true when what it tells is to be seen at once. */
export function apply(event) {
  const { kind, data, at, revision } = event;
  heardInstant(at);
  if (world.stamp) world.stamp.revision = revision;
  world.changed.add("stamp").add("events");
  world.events = [event, ...world.events].slice(0, LINES_MAX);
  if (data.plan) setPlan(data.plan);
  if (kind === "recomposed") addRecomposition(data);
  if (kind === "zone_put") setZone(data.zone, data.etag);
  if (kind === "zone_deleted") {
    world.zones.delete(data.zone_id);
    world.etags.delete(data.zone_id);
    world.inForce.delete(data.zone_id);
    world.changed.add("zones");
  }
  if (kind === "weather_put") setWeather(data);
  if (kind === "closure_put") setClosure(data.closure);
  if (kind === "closure_ended") {
    world.closures.delete(data.closure_id);
    world.inForce.delete(data.closure_id);
    world.changed.add("zones");
  }
  if (kind === "windows_turned") {
    for (const id of data.began) world.inForce.add(id);
    for (const id of data.ended) world.inForce.delete(id);
    world.changed.add("zones");
  }
}

// The lists beside the map: every fact of the picture in words.

import { BATTERY_LOW, placesOf } from "./drawing.js";
import { counted, hours, keepingFocus, make, metres, words } from "./words.js";
import { LINES_MAX, edgeTime, standing, windNow, world } from "./world.js";

const $ = (id) => document.getElementById(id);

/** Says something for a while above the map; nothing clears it. */
export function notice(text) {
  $("notice").textContent = text ?? "";
  $("notice").hidden = !text;
}

export function extra(length) {
  if (length === null || length === undefined) return "";
  const rounded = Math.round(length);
  return `${rounded < 0 ? "−" : "+"}${Math.abs(rounded).toLocaleString("en")} m`;
}

const OUTCOME_LOOKS = { rerouted: "good", unaffected: "info", hold: "info", diverted: "bad", no_route: "bad" };

function lengthBetween(view, places) {
  let length = 0;
  for (let place = 1; place < places.length; place += 1) {
    const [from, to] = [view.metres(places[place - 1]), view.metres(places[place])];
    length += Math.hypot(to[0] - from[0], to[1] - from[1]);
  }
  return length;
}

/**
 * How much longer the new way is than the old one from where the drone was, or null.
 *
 * Both are measured here, so that what they share cancels out; the network's own lengths differ a little.
 */
export function extraOf(summary, location, view) {
  if (summary.outcome !== "rerouted" || !location) return null;
  const length = (nodes) => lengthBetween(view, [location, ...placesOf(nodes)]);
  return length(summary.path.nodes) - length(summary.old_path.slice(1));
}

export function showStamp() {
  const { stamp, network } = world;
  if (network) $("network-name").textContent = `${network.name} · ${network.ids.length} nodes, ${network.segments.length / 2} segments`;
  if (!stamp) return;
  $("revision").textContent = stamp.revision;
  $("freshness").textContent = stamp.freshness;
  $("clock-kind").textContent = stamp.clock === "real" ? stamp.clock : `clock: ${stamp.clock}`;
  $("clock-kind").dataset.kind = stamp.clock;
}

export function showClock() {
  const time = edgeTime();
  if (time === null) return;
  $("clock-time").textContent = `${new Date(time).toISOString().slice(0, 19).replace("T", " ")} UTC`;
  const rate = world.clock?.rate;
  const isSimulated = world.stamp?.clock === "simulated" && rate;
  $("clock-rate").textContent = isSimulated ? `× ${rate.toPrecision(2)}` : "";
}

const QUARTERS = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];

export function showWind() {
  const { everywhere, areas } = windNow();
  const from = everywhere && QUARTERS[Math.round(everywhere.from_deg / 45) % 8];
  const whole = everywhere ? `${everywhere.speed_mps.toFixed(1)} m/s from ${from}` : "none stated";
  $("wind-now").textContent = areas ? `${whole}, ${counted(areas, "area")} apart` : whole;
  $("wind-arrow").hidden = !everywhere;
  // The arrow points where the wind blows to.
  if (everywhere) $("wind-arrow").style.transform = `rotate(${(everywhere.from_deg + 180) % 360}deg)`;
}

/** A battery in words, and the class of the word. */
function chargeOf(fraction) {
  if (fraction === null || fraction === undefined) return ["–", ""];
  return [`${Math.round(fraction * 100)} %`, fraction < BATTERY_LOW ? "bad" : ""];
}

export function showCounts() {
  const plans = [...world.plans.values()];
  const affected = plans.filter((plan) => plan.affected).length;
  const flown = world.planCounts ? world.planCounts.accepted + world.planCounts.activated + world.planCounts.nonconforming + world.planCounts.contingent : plans.length;
  const counts = [
    [world.drones.size + (world.dronesLeftOut ? "+" : ""), "drones"],
    [flown, "plans flown"],
    [affected, "affected"],
    [plans.filter((plan) => plan.silent || plan.state === "nonconforming").length, "off plan or silent"],
    [[...world.zones.values()].filter((zone) => standing(zone) === "active").length, "zones in force"],
    [world.closures.size, "closures"],
    [[...world.padsTaken.values()].reduce((sum, taken) => sum + taken, 0), "pads taken"],
  ];
  $("counts").replaceChildren(...counts.map(([count, name]) => make("li", "", make("b", "", String(count)), name)));
}

/** Draws the answers; `details` has what was read of some of them. */
export function showRecompositions(chosenId, details, choose) {
  $("recompositions-empty").hidden = world.recompositions.length > 0;
  const lines = world.recompositions.map((answer) => {
    const detail = details.get(answer.id);
    const leg = answer.leg ? `leg ${answer.leg[0]} → ${answer.leg[1]}` : "no leg";
    const first = make("span", "row",
      make("span", "", make("span", OUTCOME_LOOKS[answer.outcome] ?? "", words(answer.outcome)), ` ${answer.drone_id ?? "anonymous"}`),
      make("span", "", extra(detail?.extra_m)));
    const second = make("span", "row quiet",
      make("span", "", `${words(answer.failure)}, ${leg}${answer.dry_run ? ", dry run" : ""}`),
      make("time", "", hours(answer.answered_at)));
    const button = make("button", "", first, second);
    button.type = "button";
    button.dataset.id = answer.id;
    button.setAttribute("aria-pressed", String(answer.id === chosenId));
    button.addEventListener("click", () => choose(answer));
    return make("li", "", button);
  });
  keepingFocus($("recompositions"), lines);
}

/** Draws what is known of the chosen answer. */
export function showChosen(summary, detail) {
  const box = $("chosen");
  box.hidden = !summary;
  if (!summary) return;
  const path = summary.path.nodes.length ? summary.path.nodes.join(" → ") : "no path";
  const lines = [
    make("p", "", make("span", OUTCOME_LOOKS[summary.outcome] ?? "", words(summary.outcome)), ` ${summary.id}`),
    make("p", "", `Remaining ${metres(summary.remaining_length_m)}${detail?.extra_m !== undefined && detail.extra_m !== null ? `, ${extra(detail.extra_m)} against the old path` : ""}`),
    make("p", "quiet", `Was ${summary.old_path.join(" → ")}`),
    make("p", "quiet", `Now ${path}`),
  ];
  if (detail) {
    const { strategy_used, stage, searches, settled_nodes, publication } = detail.answer;
    const published = `${words(publication.state)}${publication.reason ? ` (${words(publication.reason)})` : ""}`;
    lines.push(make("p", "quiet", `${words(strategy_used)}, ${stage}; ${counted(searches, "search")} settled ${counted(settled_nodes, "node")}; closure: ${published}`));
    for (const warning of detail.answer.warnings) lines.push(make("p", "quiet", `Warning: ${warning.message}`));
  }
  box.replaceChildren(...lines);
}

/** What an event says, in one line. */
export function sentence({ kind, data }) {
  const plan = data.plan;
  const flyer = plan ? (plan.drone_id ?? plan.id) : "";
  switch (kind) {
    case "recomposed": return `${data.drone_id ?? "someone"} reported a failure (${words(data.failure)}): ${words(data.outcome)}`;
    case "zone_put": return `zone ${data.zone.properties?.name ?? data.zone.id} is put`;
    case "zone_deleted": return `zone ${data.zone_id} is lifted`;
    case "closure_put": return `${data.closure.id} is closed`;
    case "closure_ended": return `${data.closure_id} is open again (${words(data.why)})`;
    case "windows_turned": return [data.began.length ? `begins: ${data.began.join(", ")}` : "", data.ended.length ? `ends: ${data.ended.join(", ")}` : ""].filter(Boolean).join("; ");
    case "plan_composed": return `${flyer} has a plan of ${metres(plan.reported.length_m)}`;
    case "plan_affected": return plan.wanted ? `${flyer} is affected; wanted: ${metres(plan.wanted.length_m)}` : `${flyer} is affected and has no way on`;
    case "plan_offered": return `${flyer} is offered a better way: ${metres(plan.wanted?.length_m ?? plan.reported.length_m)}`;
    case "plan_relieved": return plan.affected_by.length ? `${flyer} is past ${data.causes.join(", ")}` : `${flyer} flies on as planned`;
    case "plan_acknowledged": return `${flyer} took version ${plan.reported.version} over`;
    case "plan_unacknowledged": return `${flyer} has not acknowledged in time`;
    case "plan_declined": return `${flyer} does not take a version over`;
    case "plan_nonconforming": return `${flyer} is elsewhere than its plan has it`;
    case "plan_conforming": return `${flyer} is where its plan has it again`;
    case "plan_contingent": return `nothing is heard of ${flyer}`;
    case "plan_overdue": return `${flyer} has not landed in time`;
    case "plan_ended": return `${flyer} is done with its plan: ${words(plan.ended_as)}`;
    case "proposal_made": return `an operator is to decide on ${data.proposal.id} (${words(data.proposal.reason)})`;
    case "proposal_decided": return `${data.proposal_id}: ${words(data.decision)}`;
    case "hold_made": return `${data.hold.closure_count} removals wait for an operator`;
    case "hold_decided": return `${data.hold_id}: ${words(data.decision)}`;
    case "weather_put": return `the weather is stated anew: ${counted(data.wind.length, "wind")}`;
    case "clock_stepped": return `the clock has stepped by ${Math.round(data.apart_s)} s; nothing opens by it until it is confirmed`;
    case "clock_settled": return `the clock is believed again (${words(data.why)})`;
    case "network_changed": return `the network is now ${data.name}: ${counted(data.nodes, "node")}, ${counted(data.segments, "segment")}`;
    case "alarm_raised": return `alarm (${words(data.alarm.kind)}): ${data.alarm.message}`;
    case "alarm_acknowledged": return `alarm acknowledged by ${data.alarm.acknowledged_by}: ${data.alarm.message}`;
    case "alarm_ended": return `alarm over (${words(data.alarm.kind)}): ${data.alarm.message}`;
    case "replanned": return `${data.closure_id} meets ${counted(data.plan_count, "plan")}, and all are told`;
    case "gap": return data.text;
    default: return words(kind);
  }
}

export function showEvents() {
  $("events-empty").hidden = world.events.length > 0;
  $("events").replaceChildren(...world.events.map((event) =>
    make("li", event.kind === "gap" ? "bad" : "", make("span", "row", make("span", "", sentence(event)), make("time", "quiet", hours(event.at))))));
}

/** How a drone stands, and the class of the word. */
function stateOf(drone, plan, now) {
  if (now - Date.parse(drone.seen_at) > 60000) return ["not heard lately", "bad"];
  if (!plan) return ["without a plan", "quiet"];
  if (plan.silent) return ["silent", "bad"];
  if (plan.state === "nonconforming") return ["off its plan", "bad"];
  return plan.affected ? ["affected", "bad"] : ["in flight", "info"];
}

export function showDrones(view) {
  const drones = [...world.drones.values()].slice(0, LINES_MAX);
  $("drones-empty").hidden = drones.length > 0;
  $("drones").hidden = drones.length === 0;
  const now = edgeTime() ?? 0;
  const rows = drones.map((drone) => {
    const plan = world.plans.get(drone.plan_id);
    const [state, look] = stateOf(drone, plan, now);
    const [charge, low] = chargeOf(drone.battery_fraction);
    const [atEnd, lowAtEnd] = chargeOf(plan?.reported.battery_at_arrival);
    const end = plan?.reported.nodes.at(-1);
    const left = end === undefined ? null : lengthBetween(view, [drone.location, ...placesOf([end])]);
    return make("tr", "", make("td", "", drone.id), make("td", look, state), make("td", "", String(end ?? "–")), make("td", "", metres(left)), make("td", low, charge), make("td", lowAtEnd, atEnd));
  });
  $("drones").tBodies[0].replaceChildren(...rows);
}

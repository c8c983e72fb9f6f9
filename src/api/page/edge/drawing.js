// The traffic above the ground, drawn as things move.

import { ink, line, sheet } from "./canvas.js";
import { drawnAt, nodeAt, standing, world } from "./world.js";

/** A battery below this, the reserve of most flights, is drawn as an alarm. */
export const BATTERY_LOW = 0.2;
const hatches = new Map();

/** Fills the rings of nodes by how many of their pads are taken. */
function drawPads(context, view) {
  const radius = Math.min(Math.max(view.pixelsPerMetre * 5, 2.5), 5);
  context.fillStyle = ink.pad;
  for (const [node, taken] of world.padsTaken) {
    const place = nodeAt(node);
    const pads = place === undefined ? 0 : world.network.pads[place];
    if (!pads) continue;
    const [x, y] = view.pixels(world.network.coordinates.slice(2 * place, 2 * place + 2));
    const share = Math.min(taken / pads, 1);
    context.beginPath();
    context.moveTo(x, y);
    context.arc(x, y, radius, -Math.PI / 2, (2 * share - 0.5) * Math.PI);
    context.fill();
  }
}

/** A bar under a drone: what is left in its battery. */
function drawBattery(context, [x, y], fraction) {
  if (fraction === null || fraction === undefined) return;
  context.fillStyle = ink.halo;
  context.fillRect(x - 9, y + 12, 18, 5);
  context.fillStyle = fraction < BATTERY_LOW ? ink.failed : ink.new;
  context.fillRect(x - 8, y + 13, 16 * fraction, 3);
}

/** Coordinates of nodes, those that this network does not have left out. */
export function placesOf(nodes) {
  const places = [];
  for (const id of nodes) {
    const place = nodeAt(id);
    if (place !== undefined) places.push(world.network.coordinates.slice(2 * place, 2 * place + 2));
  }
  return places;
}

/** A pattern of slanted lines. */
function hatch(context, colour, spacing) {
  const name = `${colour} ${spacing}`;
  if (!hatches.has(name)) {
    const tile = document.createElement("canvas");
    tile.width = tile.height = spacing;
    const pen = tile.getContext("2d");
    pen.strokeStyle = colour;
    pen.lineWidth = 1.4;
    pen.globalAlpha = 0.75;
    pen.beginPath();
    for (const offset of [-spacing, 0, spacing]) {
      pen.moveTo(offset - 1, spacing + 1);
      pen.lineTo(offset + spacing + 1, -1);
    }
    pen.stroke();
    hatches.set(name, context.createPattern(tile, "repeat"));
  }
  return hatches.get(name);
}

/** Traces the outline of a zone. */
function trace(context, view, zone) {
  const { type, coordinates } = zone.geometry ?? {};
  context.beginPath();
  if (type === "Point") {
    const [x, y] = view.pixels(coordinates);
    context.arc(x, y, (zone.properties?.radius_m ?? 0) * view.pixelsPerMetre, 0, 2 * Math.PI);
    return;
  }
  const polygons = type === "MultiPolygon" ? coordinates : type === "Polygon" ? [coordinates] : [];
  for (const ring of polygons.flat()) {
    ring.forEach((place, index) => {
      const [x, y] = view.pixels(place);
      if (index === 0) context.moveTo(x, y);
      else context.lineTo(x, y);
    });
    context.closePath();
  }
}

/** How each standing of a zone looks: by pattern as well as by colour. */
const ZONE_LOOKS = {
  active: { colour: "zone", spacing: 7, dash: [] },
  coming: { colour: "zone", spacing: 14, dash: [7, 5] },
  over: { colour: "over", spacing: 0, dash: [2, 5] },
  draft: { colour: "plan", spacing: 10, dash: [4, 4] },
};

function drawZone(context, view, zone, look) {
  trace(context, view, zone);
  const colour = ink[look.colour];
  if (look.spacing) {
    context.fillStyle = hatch(context, colour, look.spacing);
    context.fill("evenodd");
  }
  context.setLineDash(look.dash);
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.stroke();
  context.setLineDash([]);
}

/** The ends of a segment by its id, as stated or `A-B`. */
function endsOf(segment) {
  const network = world.network;
  if (!network.segmentEnds.has(segment)) {
    const cuts = [...segment.matchAll(/-/g)].map((match) => [segment.slice(0, match.index), segment.slice(match.index + 1)]);
    const ends = cuts.find(([from, to]) => nodeAt(from) !== undefined && nodeAt(to) !== undefined);
    network.segmentEnds.set(segment, ends ?? null);
  }
  return network.segmentEnds.get(segment);
}

function drawClosures(context, view) {
  for (const closure of world.closures.values()) {
    if (!world.inForce.has(closure.id)) continue;
    for (const segment of closure.segments) {
      const ends = endsOf(segment);
      if (ends) line(context, view, placesOf(ends), { colour: ink.failed, width: 3.5, dash: [1, 5] });
    }
    for (const place of placesOf([...closure.nodes, ...closure.pads])) {
      const [x, y] = view.pixels(place);
      context.strokeStyle = ink.failed;
      context.lineWidth = 2;
      context.strokeRect(x - 6, y - 6, 12, 12);
    }
  }
}

function cross(context, [x, y]) {
  for (const [colour, width] of [[ink.halo, 6], [ink.failed, 3]]) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    context.moveTo(x - 7, y - 7);
    context.lineTo(x + 7, y + 7);
    context.moveTo(x + 7, y - 7);
    context.lineTo(x - 7, y + 7);
    context.stroke();
  }
}

function drawChosen(context, view, chosen) {
  line(context, view, placesOf(chosen.old_path), { colour: ink.old, width: 3, dash: [6, 6], halo: true });
  line(context, view, placesOf(chosen.path.nodes), { colour: ink.new, width: 4.5, halo: true });
  const leg = placesOf(chosen.leg ?? []);
  if (leg.length === 2) cross(context, view.pixels([(leg[0][0] + leg[1][0]) / 2, (leg[0][1] + leg[1][1]) / 2]));
}

/** Draws a drone: an arrow in flight, a diamond when affected, off its plan or silent, a square without a plan. */
function drawDrone(context, view, drone, place, withName) {
  const [x, y] = view.pixels(place);
  const plan = world.plans.get(drone.plan_id);
  const troubled = plan && (plan.affected || plan.silent || plan.state === "nonconforming");
  context.save();
  context.translate(x, y);
  context.beginPath();
  if (troubled) {
    for (const [east, south] of [[0, -9], [9, 0], [0, 9], [-9, 0]]) context.lineTo(east, south);
  } else if (plan) {
    context.rotate(((drone.heading_deg ?? 0) * Math.PI) / 180);
    for (const [east, south] of [[0, -10], [6.5, 8], [0, 4.5], [-6.5, 8]]) context.lineTo(east, south);
  } else {
    context.rect(-5, -5, 10, 10);
  }
  context.closePath();
  context.lineWidth = 4;
  context.strokeStyle = ink.halo;
  context.stroke();
  context.fillStyle = troubled ? ink.failed : ink.drone;
  if (plan) context.fill();
  else {
    context.lineWidth = 2;
    context.strokeStyle = ink.drone;
    context.stroke();
  }
  context.restore();
  if (!withName) return;
  drawBattery(context, [x, y], drone.battery_fraction);
  context.font = "11px system-ui, 'DejaVu Sans', sans-serif";
  context.lineWidth = 3;
  context.strokeStyle = ink.halo;
  context.fillStyle = ink.ink;
  context.strokeText(drone.id, x + 11, y - 8);
  context.fillText(drone.id, x + 11, y - 8);
}

/** Draws all that moves or changes. `still` leaves drones where they were seen last. */
export function drawTraffic(canvas, view, { chosen, draft, still }) {
  const context = sheet(canvas, view);
  if (!world.network) return;
  for (const zone of world.zones.values()) drawZone(context, view, zone, ZONE_LOOKS[standing(zone)]);
  drawClosures(context, view);
  drawPads(context, view);
  for (const plan of world.plans.values()) {
    line(context, view, placesOf(plan.reported.nodes), { colour: ink.plan, width: 2 });
    if (plan.wanted) line(context, view, placesOf(plan.wanted.nodes), { colour: ink.proposed, width: 3, dash: [8, 5] });
  }
  if (chosen) drawChosen(context, view, chosen);
  if (draft) drawZone(context, view, draft, ZONE_LOOKS.draft);
  const now = performance.now();
  const withName = world.drones.size <= 60;
  for (const drone of world.drones.values()) {
    drawDrone(context, view, drone, still ? drone.location : drawnAt(drone, now), withName);
  }
}

// The map: pickup and drop to choose, and the drone that is followed.

import { drawGround, ink, line, readInks, sheet } from "./canvas.js";
import { placeOf } from "./network.js";
import { View } from "./view.js";

const $ = (id) => document.getElementById(id);
const REACH_PX = 24;
/** From one place to the next a drone is drawn for at most so long, in the reader's time. */
const GLIDE_MS = 1000;
const TRAIL_MAX = 2000;
const stillness = matchMedia("(prefers-reduced-motion: reduce)");
const darkness = matchMedia("(prefers-color-scheme: dark)");

export class Map2D {
  /** `chosen` is called with the id of a node that was clicked or entered. */
  constructor(chosen) {
    this.network = null;
    this.ends = { source: "", destination: "" };
    this.trail = [];
    this.from = null;
    this.at = 0;
    this.isGroundStale = true;
    this.chosen = chosen;
    this.view = new View($("view"), () => { this.isGroundStale = true; }, (place) => this.take(this.view.pixels(place), REACH_PX));
    $("view").addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.take([this.view.width / 2, this.view.height / 2], Infinity);
    });
    $("zoom-in").addEventListener("click", () => this.view.zoom(1.35));
    $("zoom-out").addEventListener("click", () => this.view.zoom(1 / 1.35));
    $("fit").addEventListener("click", () => this.view.fit());
    darkness.addEventListener("change", () => { readInks(); this.isGroundStale = true; });
    readInks();
    requestAnimationFrame(() => this.frame());
  }

  setNetwork(network) {
    this.network = network;
    this.view.setNetwork(network);
    $("attribution").textContent = network.attribution;
    this.forget();
  }

  /** Forgets the drone that was followed. */
  forget() {
    this.trail = [];
    this.from = null;
  }

  /** Takes where the drone was last. */
  move(place) {
    this.from = this.shown() ?? place;
    this.at = performance.now();
    this.trail = [...this.trail, place].slice(-TRAIL_MAX);
  }

  /** Where the drone is drawn now: on its way from where it was drawn last to where it was last. */
  shown() {
    const last = this.trail.at(-1);
    if (!last || stillness.matches || !this.from) return last;
    const part = Math.min((performance.now() - this.at) / GLIDE_MS, 1);
    return last.map((to, axis) => this.from[axis] + (to - this.from[axis]) * part);
  }

  /** Takes the nearest node with pads to a pixel, if one is near enough. */
  take([x, y], reach) {
    if (!this.network) return;
    const { ids, pads, coordinates } = this.network;
    let [nearest, least] = [null, reach];
    ids.forEach((id, node) => {
      if (!pads[node]) return;
      const [east, south] = this.view.pixels([coordinates[2 * node], coordinates[2 * node + 1]]);
      const distance = Math.hypot(east - x, south - y);
      if (distance < least) [nearest, least] = [id, distance];
    });
    if (nearest !== null) this.chosen(nearest);
  }

  frame() {
    requestAnimationFrame(() => this.frame());
    if (!this.network) return;
    if (this.isGroundStale) drawGround($("ground"), this.view, this.network);
    this.isGroundStale = false;
    const context = sheet($("traffic"), this.view);
    const ends = [placeOf(this.network, this.ends.source), placeOf(this.network, this.ends.destination)];
    if (ends.every(Boolean)) line(context, this.view, ends, { colour: ink.plan, width: 2, dash: [3, 6] });
    const drone = this.shown();
    line(context, this.view, drone ? [...this.trail.slice(0, -1), drone] : [], { colour: ink.new, width: 3, halo: true });
    if (ends[0]) this.mark(context, ends[0], "P", ink.plan);
    if (ends[1]) this.mark(context, ends[1], "D", ink.failed);
    if (drone) this.drone(context, drone);
    if (document.activeElement === $("view")) this.crosshair(context);
  }

  /** An end of the delivery, as a ring with a letter: by shape as well as by colour. */
  mark(context, place, letter, colour) {
    const [x, y] = this.view.pixels(place);
    context.beginPath();
    context.arc(x, y, 11, 0, 2 * Math.PI);
    context.fillStyle = ink.paper;
    context.fill();
    context.lineWidth = 3;
    context.strokeStyle = colour;
    context.stroke();
    context.fillStyle = ink.ink;
    context.font = "bold 12px system-ui, 'DejaVu Sans', sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(letter, x, y + 0.5);
  }

  drone(context, place) {
    const [x, y] = this.view.pixels(place);
    context.beginPath();
    for (const [east, south] of [[0, -10], [9, 0], [0, 10], [-9, 0]]) context.lineTo(x + east, y + south);
    context.closePath();
    context.lineWidth = 4;
    context.strokeStyle = ink.halo;
    context.stroke();
    context.fillStyle = ink.drone;
    context.fill();
  }

  /** The middle, which Enter takes. */
  crosshair(context) {
    const [x, y] = [this.view.width / 2, this.view.height / 2];
    for (const [colour, width] of [[ink.halo, 4], [ink.ink, 1.5]]) {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.beginPath();
      context.moveTo(x - 12, y);
      context.lineTo(x + 12, y);
      context.moveTo(x, y - 12);
      context.lineTo(x, y + 12);
      context.stroke();
    }
  }
}

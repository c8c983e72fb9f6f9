// Drawing on a canvas: its colours, the network, and lines over it.

const INKS = ["segment", "node", "pad", "plan", "proposed", "old", "new", "failed", "zone", "over", "drone", "halo", "ink", "paper"];
/** The colours of the page, by name. */
export let ink = {};

/** Reads the colours of the page; to be called again when the scheme changes. */
export function readInks() {
  const style = getComputedStyle(document.documentElement);
  ink = Object.fromEntries(INKS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** A canvas as large as its view, cleared. */
export function sheet(canvas, view) {
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [Math.round(view.width * scale), Math.round(view.height * scale)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, view.width, view.height);
  context.lineJoin = context.lineCap = "round";
  return context;
}

/** Draws the network, which changes only with the view. */
export function drawGround(canvas, view, network) {
  const context = sheet(canvas, view);
  if (!network) return;
  const { coordinates, segments, pads } = network;
  const at = [];
  for (let place = 0; place < coordinates.length; place += 2) at.push(view.pixels([coordinates[place], coordinates[place + 1]]));
  network.drawn = at;
  const crowded = segments.length > 20000;
  context.strokeStyle = ink.segment;
  context.globalAlpha = crowded ? 0.35 : 0.7;
  context.lineWidth = Math.min(Math.max(view.pixelsPerMetre * 1.2, 0.5), 1.6);
  context.beginPath();
  for (let end = 0; end < segments.length; end += 2) {
    const [from, to] = [at[segments[end]], at[segments[end + 1]]];
    context.moveTo(from[0], from[1]);
    context.lineTo(to[0], to[1]);
  }
  context.stroke();
  context.globalAlpha = 1;
  const radius = Math.min(Math.max(view.pixelsPerMetre * 5, 1), 5);
  for (let node = 0; node < at.length; node += 1) {
    const hasPads = pads[node] > 0 && radius > 1.5;
    context.beginPath();
    context.arc(at[node][0], at[node][1], hasPads ? radius : radius * 0.7, 0, 2 * Math.PI);
    context.fillStyle = hasPads ? ink.paper : ink.node;
    context.fill();
    if (!hasPads) continue;
    context.strokeStyle = ink.pad;
    context.lineWidth = 1.2;
    context.stroke();
  }
}

/** Draws a line through places. */
export function line(context, view, places, style) {
  if (places.length < 2) return;
  context.beginPath();
  places.forEach((place, index) => {
    const [x, y] = view.pixels(place);
    if (index === 0) context.moveTo(x, y);
    else context.lineTo(x, y);
  });
  if (style.halo) {
    context.setLineDash([]);
    context.strokeStyle = ink.halo;
    context.lineWidth = style.width + 3;
    context.stroke();
  }
  context.setLineDash(style.dash ?? []);
  context.strokeStyle = style.colour;
  context.lineWidth = style.width;
  context.stroke();
  context.setLineDash([]);
}

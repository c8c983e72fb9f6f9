// Where the map looks: from coordinates to metres to pixels, and how mouse, keyboard and fingers move it.

const METRES_PER_DEGREE = (Math.PI / 180) * 6371008.8;
const ZOOM_STEP = 1.35;
const CLICK_SLACK_PX = 4;

export class View {
  /** `moved` is called after every change, `clicked` with the coordinates of a click. */
  constructor(element, moved, clicked) {
    this.element = element;
    this.moved = moved;
    this.clicked = clicked;
    this.origin = [0, 0];
    this.stretch = [1, 1];
    this.centre = [0, 0];
    this.pixelsPerMetre = 1;
    this.bounds = null;
    this.fingers = new Map();
    element.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("keydown", (event) => this.key(event));
    element.addEventListener("pointerdown", (event) => this.press(event));
    element.addEventListener("pointermove", (event) => this.drag(event));
    element.addEventListener("pointerup", (event) => this.release(event));
    element.addEventListener("pointercancel", (event) => this.release(event));
    new ResizeObserver(() => this.moved()).observe(element);
  }

  /** Fixes the frame for a network; coordinates are degrees or metres. */
  setNetwork(network) {
    const { coordinates, geographic } = network;
    let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let place = 0; place < coordinates.length; place += 2) {
      west = Math.min(west, coordinates[place]);
      east = Math.max(east, coordinates[place]);
      south = Math.min(south, coordinates[place + 1]);
      north = Math.max(north, coordinates[place + 1]);
    }
    if (west > east) [west, south, east, north] = [0, 0, 1, 1];
    this.origin = [(west + east) / 2, (south + north) / 2];
    const narrowing = Math.cos((this.origin[1] * Math.PI) / 180);
    this.stretch = geographic ? [METRES_PER_DEGREE * narrowing, METRES_PER_DEGREE] : [1, 1];
    this.bounds = [this.metres([west, south]), this.metres([east, north])];
    this.fit();
  }

  /** Metres east and north of the middle of the network. */
  metres([first, second]) {
    return [(first - this.origin[0]) * this.stretch[0], (second - this.origin[1]) * this.stretch[1]];
  }

  pixels(place) {
    const [east, north] = this.metres(place);
    return [
      this.width / 2 + (east - this.centre[0]) * this.pixelsPerMetre,
      this.height / 2 - (north - this.centre[1]) * this.pixelsPerMetre,
    ];
  }

  /** The coordinates under a pixel. */
  place([x, y]) {
    const east = this.centre[0] + (x - this.width / 2) / this.pixelsPerMetre;
    const north = this.centre[1] - (y - this.height / 2) / this.pixelsPerMetre;
    return [this.origin[0] + east / this.stretch[0], this.origin[1] + north / this.stretch[1]];
  }

  get width() {
    return this.element.clientWidth;
  }

  get height() {
    return this.element.clientHeight;
  }

  fit() {
    if (!this.bounds) return;
    const [[west, south], [east, north]] = this.bounds;
    this.centre = [(west + east) / 2, (south + north) / 2];
    const scale = Math.min((this.width - 60) / (east - west || 1), (this.height - 70) / (north - south || 1));
    this.pixelsPerMetre = Math.max(scale, 1e-6);
    this.moved();
  }

  zoom(factor, [x, y] = [this.width / 2, this.height / 2]) {
    const scale = Math.min(Math.max(this.pixelsPerMetre * factor, 1e-6), 50);
    const keep = 1 / this.pixelsPerMetre - 1 / scale;
    this.centre[0] += (x - this.width / 2) * keep;
    this.centre[1] -= (y - this.height / 2) * keep;
    this.pixelsPerMetre = scale;
    this.moved();
  }

  pan(x, y) {
    this.centre[0] -= x / this.pixelsPerMetre;
    this.centre[1] += y / this.pixelsPerMetre;
    this.moved();
  }

  wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY / 400), [event.offsetX, event.offsetY]);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = Math.min(this.width, this.height) / 8;
    const moves = {
      ArrowLeft: () => this.pan(step, 0),
      ArrowRight: () => this.pan(-step, 0),
      ArrowUp: () => this.pan(0, step),
      ArrowDown: () => this.pan(0, -step),
      "+": () => this.zoom(ZOOM_STEP),
      "=": () => this.zoom(ZOOM_STEP),
      "-": () => this.zoom(1 / ZOOM_STEP),
      0: () => this.fit(),
    };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    move();
  }

  press(event) {
    this.element.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.travelled = this.fingers.size > 1 ? Infinity : 0;
    this.element.classList.add("dragging");
  }

  drag(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    const [x, y] = [now[0] - before[0], now[1] - before[1]];
    this.travelled += Math.hypot(x, y);
    this.fingers.set(event.pointerId, now);
    const other = [...this.fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (!other) {
      this.pan(x, y);
      return;
    }
    const spread = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
    this.zoom(spread(now) / spread(before), other);
  }

  release(event) {
    const place = this.fingers.get(event.pointerId);
    this.fingers.delete(event.pointerId);
    if (this.fingers.size === 0) this.element.classList.remove("dragging");
    const isClick = event.type === "pointerup" && place && this.travelled < CLICK_SLACK_PX;
    if (isClick) this.clicked(this.place(place));
  }
}

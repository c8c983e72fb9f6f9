// The form that closes a circle: placed on the map, previewed at every change, posted, and lifted again.

import { request } from "./api.js";
import { notice } from "./panels.js";
import { counted, metres, words } from "./words.js";
import { edgeTime, setStamp } from "./world.js";

const $ = (id) => document.getElementById(id);
const PREVIEW_AFTER_MS = 250;

export class Circle {
  /** `changed` is called when the draft on the map is another. */
  constructor(changed) {
    this.changed = changed;
    this.draft = null;
    this.previews = 0;
    this.form = $("circle-form");
    this.form.addEventListener("input", () => this.update());
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.post();
    });
    $("circle-cancel").addEventListener("click", () => this.close());
    $("close-circle").addEventListener("click", () => (this.isOpen ? this.close() : this.open()));
    this.form.addEventListener("keydown", (event) => event.key === "Escape" && this.close());
  }

  get isOpen() {
    return !this.form.hidden;
  }

  /** Names the coordinates of the network, and starts in the middle of the map. */
  setView(view, network) {
    this.view = view;
    if (network.geographic) return;
    $("first-name").textContent = "X, m";
    $("second-name").textContent = "Y, m";
  }

  open() {
    if (!this.view) return;
    this.show(true);
    this.place(this.view.place([this.view.width / 2, this.view.height / 2]));
    $("circle-radius").focus();
  }

  close() {
    this.show(false);
    this.draft = null;
    this.previews += 1;
    this.changed();
    $("close-circle").focus();
  }

  show(isOpen) {
    this.form.hidden = !isOpen;
    $("close-circle").setAttribute("aria-expanded", String(isOpen));
    $("view").classList.toggle("placing", isOpen);
  }

  /** Puts the centre somewhere. */
  place([first, second]) {
    const digits = $("first-name").textContent === "Longitude" ? 6 : 1;
    $("circle-first").value = first.toFixed(digits);
    $("circle-second").value = second.toFixed(digits);
    this.update();
  }

  feature() {
    const number = (id) => $(id).valueAsNumber;
    const numbers = [number("circle-first"), number("circle-second"), number("circle-radius"), number("circle-minutes")];
    if (!numbers.every(Number.isFinite)) return null;
    const [first, second, radius_m, minutes] = numbers;
    const now = edgeTime();
    const properties = { radius_m, reason: $("circle-reason").value || "closed from the live page" };
    if (now === null) return null;
    // A little earlier, as the edge's clock is known here only by what it told last.
    const from = new Date(now - 5000).toISOString();
    const until = new Date(now + minutes * 60000).toISOString();
    properties.windows = [{ from, until }];
    return { type: "Feature", geometry: { type: "Point", coordinates: [first, second] }, properties };
  }

  update() {
    this.draft = this.feature();
    this.changed();
    $("circle-post").disabled = true;
    if (!this.draft) {
      $("circle-effect").textContent = edgeTime() === null ? "The edge's time is not known yet." : "Every field needs a number.";
      return;
    }
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.preview(), PREVIEW_AFTER_MS);
  }

  async preview() {
    this.previews += 1;
    const preview = this.previews;
    try {
      const response = await request("POST", "/v1/zones:preview", { body: this.draft });
      const answer = await response.json();
      if (preview !== this.previews) return;
      $("circle-effect").textContent = effectText(answer.effect);
      $("circle-post").disabled = false;
    } catch (problem) {
      if (preview === this.previews) $("circle-effect").textContent = `Not possible: ${problem.message}`;
    }
  }

  async post() {
    const draft = this.feature();
    if (!draft) return;
    $("circle-post").disabled = true;
    try {
      const response = await request("POST", "/v1/zones", { body: draft });
      const answer = await response.json();
      setStamp(answer);
      this.close();
    } catch (problem) {
      if (problem.enforced) {
        this.close();
        notice("The circle is closed, but not stored yet: it may be open again if the edge restarts before its disk takes that.");
      } else {
        $("circle-effect").textContent = `Not posted: ${problem.message}`;
      }
    }
  }
}

function effectText(effect) {
  const plans = effect.plans.slice(0, 4).map((plan) => {
    const longer = plan.extra_m === null ? "" : ` ${plan.extra_m >= 0 ? "+" : ""}${metres(plan.extra_m)}`;
    return `${plan.drone_id ?? plan.plan_id} ${words(plan.outcome)}${longer}`;
  });
  const more = effect.plan_count > plans.length ? `, and ${effect.plan_count - plans.length} more` : "";
  const met = effect.plan_count ? ` and meets ${counted(effect.plan_count, "plan")}: ${plans.join(", ")}${more}` : " and meets no plan";
  return `Closes ${counted(effect.segment_count, "segment")} and ${counted(effect.node_count, "node")}${met}.`;
}

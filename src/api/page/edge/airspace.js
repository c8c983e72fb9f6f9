// The lists of zones and closures, patched in place, and the question before a zone is lifted.

import { Problem, request } from "./api.js";
import { notice } from "./panels.js";
import { counted, dated, make, words } from "./words.js";
import { LINES_MAX, edgeTime, setZone, standing, world } from "./world.js";

const $ = (id) => document.getElementById(id);
const STANDING = { active: "in force", coming: "to come", over: "over" };

/** A list whose rows stay where they are while what they say changes: no row moves under a pointer. */
class PatchedList {
  /** `build` makes a row once, `tell` says what it shows now. */
  constructor(name, build, tell) {
    this.list = $(name);
    this.empty = $(`${name}-empty`);
    this.more = $(`${name}-more`);
    this.left = $(`${name}-left`);
    this.find = $(`${name}-find`);
    this.build = build;
    this.tell = tell;
    this.rows = new Map();
    this.shown = LINES_MAX;
    this.entries = [];
    this.more.addEventListener("click", () => {
      this.shown += LINES_MAX;
      this.show(this.entries);
    });
    this.find.addEventListener("input", () => this.show(this.entries));
  }

  /** Shows entries `[id, value]`: those whose text has the words sought, as many as are asked for. */
  show(entries, hasMore = this.hasMore) {
    this.entries = entries;
    this.hasMore = hasMore;
    const sought = this.find.value.trim().toLowerCase();
    const told = entries.map(([id, value]) => [id, this.tell(value)]);
    const found = sought ? told.filter(([, text]) => text.toLowerCase().includes(sought)) : told;
    const visible = found.slice(0, this.shown);
    const ids = new Set(visible.map(([id]) => id));
    for (const [id, row] of this.rows) {
      if (ids.has(id)) continue;
      row.element.remove();
      this.rows.delete(id);
    }
    let after = null;
    for (const [id, text] of visible) {
      const row = this.rows.get(id) ?? this.add(id);
      if (row.text.textContent !== text) row.text.textContent = text;
      const place = after ? after.nextElementSibling : this.list.firstElementChild;
      if (place !== row.element) this.list.insertBefore(row.element, place);
      after = row.element;
    }
    this.empty.hidden = entries.length > 0;
    this.find.parentElement.hidden = entries.length <= LINES_MAX && !sought;
    this.more.hidden = found.length <= this.shown;
    this.left.hidden = !hasMore;
    this.more.textContent = `Show more (${found.length - visible.length} of ${found.length} are not shown)`;
  }

  add(id) {
    const text = make("span", "");
    const element = make("li", "", text, ...this.build(id));
    const row = { element, text };
    this.rows.set(id, row);
    return row;
  }
}

function zoneText(zone) {
  const until = zone.properties?.windows?.at(-1)?.until;
  const reason = zone.properties?.reason;
  const name = zone.properties?.name ?? zone.id;
  return `${name}: ${STANDING[standing(zone)]}${until ? `, until ${dated(until, edgeTime())}` : ""}${reason ? ` (${reason})` : ""}`;
}

function closureText(closure) {
  const who = closure.reported_by ? ` by ${closure.reported_by}` : "";
  const until = closure.until ? `, until ${dated(closure.until, edgeTime())}` : "";
  return `${closure.id}: ${words(closure.reason ?? closure.cause)}${who}${until}`;
}

/** Asks before a zone is lifted, says what opens, and lifts the version that was shown. */
class LiftQuestion {
  constructor() {
    this.dialog = $("lift");
    $("lift-cancel").addEventListener("click", () => this.dialog.close());
    $("lift-now").addEventListener("click", () => this.lift());
    this.dialog.addEventListener("close", () => this.asker?.isConnected && this.asker.focus());
  }

  async ask(id, asker) {
    this.id = id;
    this.asker = asker;
    // The version that the reader has seen: a newer one is not lifted by this question.
    this.etag = world.etags.get(id);
    const zone = world.zones.get(id);
    $("lift-title").textContent = `Lift zone ${zone?.properties?.name ?? id}?`;
    this.say("Asking the edge what opens…", true);
    this.dialog.showModal();
    $("lift-cancel").focus();
    try {
      const answer = await this.delete("?validate_only=true");
      const { segment_count, node_count } = answer.effect;
      this.say(`It closes ${counted(segment_count, "segment")} and ${counted(node_count, "node")}; what nothing else closes opens at once.`, false);
    } catch (problem) {
      await this.fail(problem);
    }
  }

  async lift() {
    $("lift-now").disabled = true;
    try {
      await this.delete("");
      this.dialog.close();
    } catch (problem) {
      if (!problem.enforced) return this.fail(problem);
      this.dialog.close();
      notice("The zone is lifted, but not stored yet: it may stand again if the edge restarts before its disk takes that.");
    }
  }

  async delete(query) {
    const headers = { "If-Match": this.etag ?? "" };
    const response = await request("DELETE", `/v1/zones/${encodeURIComponent(this.id)}${query}`, { headers });
    return response.json();
  }

  async fail(problem) {
    if (!(problem instanceof Problem) || problem.status !== 412) {
      this.say(`Not lifted: ${problem.message}`, true);
      return;
    }
    this.say("Not lifted: the zone has changed since it was shown. Close this, look at it again, and lift it then.", true);
    try {
      const response = await request("GET", `/v1/zones/${encodeURIComponent(this.id)}`);
      setZone(await response.json(), response.headers.get("ETag"));
    } catch {
      // It is gone meanwhile, which the stream of events tells.
    }
  }

  say(text, isBlocked) {
    $("lift-effect").textContent = text;
    $("lift-now").disabled = isBlocked;
  }
}

const question = new LiftQuestion();
const zones = new PatchedList("zones", (id) => {
  const button = make("button", "", "Lift…");
  button.type = "button";
  button.setAttribute("aria-label", `Lift zone ${id}`);
  button.addEventListener("click", () => question.ask(id, button));
  return [button];
}, zoneText);
const closures = new PatchedList("closures", () => [], closureText);

export function showAirspace() {
  zones.show([...world.zones], world.leftOut.zones);
  closures.show([...world.closures], world.leftOut.closures);
}

// The registry's time: quotes and arrivals are in it, and it may pass faster than that of the reader.

import { read } from "./api.js";

const READ_EVERY_MS = 30000;
let reading = null;

/** Reads the clock, if it was not read lately. */
export async function readClock() {
  if (reading && performance.now() - reading.at < READ_EVERY_MS) return;
  const { kind, time, rate } = await read("/v1/clock");
  reading = { kind, rate, shown: Date.parse(time), at: performance.now() };
}

/** Now, in milliseconds; `null` before the clock was read. */
export function now() {
  return reading && reading.shown + (performance.now() - reading.at) * reading.rate;
}

/** How many times faster it passes than the machine's; `null` where it is the machine's. */
export function rateShown() {
  return reading && reading.kind !== "real" ? reading.rate : null;
}

/** A time of the day for people, where they are. */
export function clockTime(instant) {
  return new Date(instant).toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short" });
}

/** A length of time, to the minute or, where it is short, to the second. */
export function duration(milliseconds) {
  const seconds = Math.max(Math.round(milliseconds / 1000), 0);
  if (seconds < 120) return `${seconds} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 120 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** When something is: how long until then, or since, and the time of the day. */
export function when(instant) {
  const at = Date.parse(instant);
  const left = now() === null ? null : at - now();
  if (left === null) return clockTime(at);
  return `${left >= 0 ? `in ${duration(left)}` : `${duration(-left)} ago`}, ${clockTime(at)}`;
}

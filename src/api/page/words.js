// What is told in words: elements made of text, counts, lengths and times.

/** Makes an element with classes and contents; text is never read as markup. */
export function make(name, classes, ...contents) {
  const element = document.createElement(name);
  if (classes) element.className = classes;
  element.append(...contents.filter((content) => content !== null));
  return element;
}

/** Hours, minutes and seconds of an instant, UTC. */
export function hours(instant) {
  return new Date(instant).toISOString().slice(11, 19);
}

/** The hours of an instant, and its date where that is another one than now; UTC. */
export function dated(instant, now) {
  const day = (time) => new Date(time).toISOString().slice(0, 10);
  return now !== null && day(instant) === day(now) ? hours(instant) : `${day(instant)} ${hours(instant)}`;
}

/** A count with its noun. */
export function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? "" : noun.endsWith("ch") ? "es" : "s"}`;
}

export function metres(length) {
  if (length === null || length === undefined) return "–";
  return `${Math.round(length).toLocaleString("en")} m`;
}

export function words(name) {
  return String(name).replaceAll("_", " ");
}

/** Replaces the lines of a list; who has the focus keeps it. */
export function keepingFocus(list, lines) {
  const focused = list.contains(document.activeElement) ? document.activeElement.dataset.id : null;
  list.replaceChildren(...lines);
  if (focused === null) return;
  const again = [...list.querySelectorAll("[data-id]")].find((element) => element.dataset.id === focused);
  again?.focus({ preventScroll: true });
}

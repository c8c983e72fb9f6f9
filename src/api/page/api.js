// Requests to the daemon behind a page, and its streams of events. The token, where one is needed, lives in this module alone.

/** Streams say something every 15 s: one that is silent for so long is lost, and so is a request without an answer. */
const SILENCE_MAX_MS = 45000;

let token = "";
let onUnauthorized = () => {};

/** Uses a bearer token from now on. */
export function useToken(text) {
  token = text;
}

/** Has `listener` called whenever a token is asked for. */
export function whenUnauthorized(listener) {
  onUnauthorized = listener;
}

/** An answer that is a problem: `status`, stable `code`, a message for people, and whether what was asked for is so all the same. */
export class Problem extends Error {
  constructor(status, document) {
    const faults = (document?.errors ?? []).map((fault) => `${fault.pointer}: ${fault.message}`);
    const said = [document?.detail ?? document?.title ?? `the answer was ${status}`, ...faults];
    super(said.join("; "));
    this.status = status;
    this.code = document?.code ?? "";
    this.enforced = document?.enforced === true;
  }
}

/** Sends a request; throws `Problem` for any answer that is none of success. */
export async function request(method, path, { body, headers = {}, signal } = {}) {
  const sent = { ...headers };
  if (token) sent.Authorization = `Bearer ${token}`;
  if (body !== undefined) sent["Content-Type"] = "application/json";
  const text = body === undefined ? undefined : JSON.stringify(body);
  // Browsers keep a 410 for ever unless told not to, and would answer the next request with it.
  const response = await fetch(path, { method, headers: sent, body: text, signal, cache: "no-store" });
  if (response.ok) return response;
  if (response.status === 401) onUnauthorized();
  const document = await response.json().catch(() => null);
  throw new Problem(response.status, document);
}

/** Reads a JSON document; throws where it is not there in time. */
export async function read(path, withinMs = SILENCE_MAX_MS) {
  return (await request("GET", path, { signal: AbortSignal.timeout(withinMs) })).json();
}

/** Reads a list page by page, until `take` has been given `most` entries; tells whether there are more. */
export async function readPages(path, key, most, take) {
  let count = 0;
  let next = "";
  do {
    const page = await read(`${path}page_size=200${next && `&page_token=${encodeURIComponent(next)}`}`);
    count += page[key].length;
    take(page);
    next = page.next_page_token ?? "";
  } while (next && count < most);
  return Boolean(next);
}

/**
 * Follows a stream of events after `lastId` until the stream ends, and calls `take` with each; throws where it falls silent.
 *
 * `EventSource` cannot send a token, so the stream is read from an ordinary request.
 */
export async function follow(path, lastId, signal, opened, take) {
  const headers = { Accept: "text/event-stream" };
  if (lastId) headers["Last-Event-ID"] = lastId;
  const silence = new AbortController();
  let timer = 0;
  const heard = () => {
    clearTimeout(timer);
    timer = setTimeout(() => silence.abort(new Error("the stream is silent")), SILENCE_MAX_MS);
  };
  heard();
  try {
    const response = await request("GET", path, { headers, signal: AbortSignal.any([signal, silence.signal]) });
    opened();
    const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      heard();
      const blocks = (rest + value).replaceAll("\r\n", "\n").split("\n\n");
      rest = blocks.pop();
      for (const block of blocks) {
        const event = parse(block);
        if (event) take(event);
      }
    }
  } finally {
    clearTimeout(timer);
  }
}

/** One event of a stream, `null` for a comment. */
function parse(block) {
  const event = { id: "", kind: "message", data: "" };
  for (const line of block.split("\n")) {
    const [, field, value] = /^(\w*):? ?(.*)$/.exec(line) ?? [];
    if (field === "id") event.id = value;
    if (field === "event") event.kind = value;
    if (field === "data") event.data += event.data ? `\n${value}` : value;
  }
  return event.data ? event : null;
}

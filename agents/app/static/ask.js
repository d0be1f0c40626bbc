// How the pages' scripts talk to the server: with the token, in JSON, and with one kind of error.

const SOON = 1000; // until what is being worked out is asked for again [ms]
/** What the page knows by a name: its token, or the root of the addresses. */
export const meta = (name) => document.querySelector(`meta[name="${name}"]`).content;

/** The address of a path in the app, such as "throws/3". */
export const at = (path) => meta("root") + path.replace(/^\//, "");

/** Ask the server; gives the document it answers with. Throws an Error in plain words. */
export async function ask(path, { method = "GET", json, body, keepalive = false } = {}) {
  const headers = { Accept: "application/json" };
  if (method !== "GET") headers["X-CSRF-Token"] = meta("csrf");
  if (json !== undefined) {
    headers["Content-Type"] = "application/json";
    body = JSON.stringify(json);
  }
  let response, document;
  do {
    if (document) await new Promise((done) => setTimeout(done, SOON));
    try {
      response = await fetch(at(path), { method, headers, body, keepalive });
    } catch {
      throw Object.assign(new Error("The app does not answer. Is it still running?"), { away: true });
    }
    const kind = response.headers.get("Content-Type") ?? "";
    document = kind.includes("json") ? await response.json() : null;
  } while (response.status === 503 && document?.coming);
  if (!response.ok) {
    const problem = document?.problem ?? `The app answered with ${response.status}.`;
    throw Object.assign(new Error(problem), { status: response.status, document });
  }
  return document;
}

/** An element of the page with attributes and children; text stays text. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

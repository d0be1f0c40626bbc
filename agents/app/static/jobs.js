// Long work on a page: a line for each piece, with how far it is and what can be done about it.

import { ask, at, element } from "./ask.js";

const PATIENCE = 2000; // between two tries while the app does not answer [ms]

const isOpen = (job) => job.state === "waiting" || job.state === "running";

/** A line about a piece of work; `complain` is called with what goes wrong. */
export function jobLine(job, complain) {
  const words = [job.what, job.state === "running" ? job.says : job.state, job.left]
    .filter(Boolean).join(": ");
  const line = element("li", { "data-state": job.state }, element("span", {}, words));
  if (job.state === "running") {
    const bar = element("progress", { max: 1, "aria-label": job.what });
    if (job.share > 0) bar.setAttribute("value", job.share);
    line.append(bar);
  }
  if (job.problem) line.append(element("p", { class: "problem small" }, job.problem));
  const button = (text, path) => {
    const made = element("button", { type: "button", class: "plain" }, text);
    made.addEventListener("click", () => {
      made.disabled = true;
      ask(path, { method: "POST" }).catch((error) => complain(error.message));
    });
    line.append(made);
  };
  if (isOpen(job)) button(job.kind === "record" ? "Stop the camera" : "Cancel", `practice/work/${job.id}/cancel`);
  else if (job.state !== "done") button("Try again", `practice/work/${job.id}/again`);
  return line;
}

/** Listen to events; where the browser has given up, because the app was away for long, begin again. */
export function listen(path, show) {
  const events = new EventSource(at(path));
  events.addEventListener("message", (event) => show(JSON.parse(event.data), events));
  events.addEventListener("error", () => {
    if (events.readyState === EventSource.CLOSED) setTimeout(() => listen(path, show), PATIENCE);
  });
}

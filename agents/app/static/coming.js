// Work that this page waits for: how far it is, and then the page itself.

import { element } from "./ask.js";
import { jobLine, listen } from "./jobs.js";

const list = document.getElementById("coming");
const complain = (text) => list.append(element("li", { class: "problem" }, text));

listen(`practice/work/events?jobs=${list.dataset.jobs}`, (jobs, events) => {
  list.replaceChildren(...jobs.map((job) => jobLine(job, complain)));
  if (jobs.every((job) => job.state === "done")) {
    events.close();
    location.reload();
  }
});

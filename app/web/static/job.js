// Follows a job until it has ended, then shows where its result is.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const box = document.getElementById("job");
  if (!box) return;
  const of = (id) => document.getElementById(id);
  const show = (job) => {
    box.dataset.state = job.state;
    of("job-state").textContent = job.state;
    of("job-what").textContent = job.what;
    const bar = of("job-progress");
    if (job.total) { bar.max = job.total; bar.value = job.done; of("job-count").textContent = `${job.done} of ${job.total}`; }
    else if (job.state === "running") bar.removeAttribute("value");
    if (job.error) { of("job-error").textContent = job.error; of("job-error").hidden = false; }
    const ended = ["done", "failed", "stopped"].includes(job.state);
    if (ended) { bar.hidden = true; if (of("job-stop")) of("job-stop").hidden = true; }
    if (job.state === "done" && job.address) {
      const link = of("job-result");
      link.href = job.address; link.hidden = false;
      of("job-words").textContent = job.words || "";
    }
    return ended;
  };
  const follow = async () => {
    try {
      const answer = await fetch(`/api/jobs/${box.dataset.job}`);
      if (answer.ok && show(await answer.json())) return;
    } catch (error) { of("job-what").textContent = "the server does not answer; waiting for it"; }
    setTimeout(follow, 500);
  };
  if (!["done", "failed", "stopped"].includes(box.dataset.state)) follow();
});

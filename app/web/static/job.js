// Follows a job until it has ended: the page is fetched again, and its part on the job takes the place of the old one.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const box = document.getElementById("job");
  if (!box) return;
  const ended = () => ["done", "failed", "stopped"].includes(box.dataset.state);
  const show = (text) => {
    const fresh = new DOMParser().parseFromString(text, "text/html").getElementById("job");
    if (!fresh) { location.reload(); return; }  // the page shows the result in the place of the job
    box.replaceChildren(...fresh.childNodes);
    box.dataset.state = fresh.dataset.state;
    if (ended() && document.getElementById("job-stop")) document.getElementById("job-stop").hidden = true;
  };
  const follow = async () => {
    try {
      const answer = await fetch(location.href);
      if (answer.ok) show(await answer.text());
    } catch (error) { document.getElementById("job-what").textContent = "The server does not answer; this page waits for it."; }
    if (!ended()) setTimeout(follow, 700);
  };
  if (!ended()) setTimeout(follow, 300);
});

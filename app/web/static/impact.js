// Zooming into a channel fetches that window: every sample of it, once they fit.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  document.querySelectorAll("[data-channel]").forEach((element) => {
    const said = element.closest("figure").querySelector(".shown");
    let waiting = null, asked = 0;
    const fetchWindow = async (from, to) => {
      const number = ++asked;
      const query = new URLSearchParams({ points: element.dataset.points });
      if (from !== null) { query.set("start_s", from); query.set("stop_s", to); }
      said.textContent = "Fetching…";
      try {
        const found = await pyroshock.asked(`/api/channels/${element.dataset.channel}?${query}`);
        if (number !== asked) return;  // a later zoom is on its way
        element.chart.replace(0, found.time_s.map((t) => t * 1e3), found.values.map((value) => value === null ? null : value * Number(element.dataset.scale)));
        element.dataset.samples = found.time_s.length;
        element.dataset.exact = String(!found.decimated);
        said.textContent = found.decimated
          ? `Extremes of ${(found.stop - found.first).toLocaleString()} samples; zoom in for every sample.`
          : `Every sample is shown (${found.time_s.length.toLocaleString()}).`;
      } catch (error) { said.textContent = `Not fetched: ${error.message}`; }
    };
    element.addEventListener("zoomed", ({ detail }) => {
      clearTimeout(waiting);
      const window = detail ? detail.map((t) => t / 1e3) : [null, null];
      waiting = setTimeout(() => fetchWindow(...window), 100);
    });
    element.dataset.zoomable = "yes";
  });
});
// The keys k and j go to the previous and the next impact, but not while something is typed.
document.addEventListener("keydown", (event) => {
  if (event.target.closest("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey) return;
  const link = document.getElementById({ k: "previous", j: "next" }[event.key] || "");
  if (link) link.click();
});

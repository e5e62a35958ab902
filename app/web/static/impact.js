// The record of an impact: zooming fetches the samples of the window, and keys go to the contact, to
// the whole record, and to the impacts before and after.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const figure = document.getElementById("channels"),
    stack = figure && figure.querySelector(".plot").chart,
    facts = stack && JSON.parse(document.getElementById("channels-facts").textContent);
  const typed = (event) =>
    event.target.closest("input, select, textarea") ||
    event.ctrlKey ||
    event.metaKey ||
    event.altKey;
  const neighbours = { k: "previous", j: "next" };

  if (stack) {
    const status = figure.querySelector(".shown"),
      time = figure.querySelector(".time"),
      points = Number(figure.dataset.points);
    const words = (value) => pyroshockAxes.words(value, 7);
    // What each channel holds: the whole record as extremes, and one window more finely.
    const held = stack.charts.map((chart, i) => {
      const [own] = chart.figure.series,
        view = chart.firstView().x;
      chart.element.dataset.channel = facts.channels[i].key;
      chart.element.dataset.exact = String(facts.channels[i].exact);
      const outline = own.x.map((t, k) => [t, own.y[k]]);
      Object.assign(own, { bucket: facts.channels[i].bucket });
      if (view && facts.channels[i].exact) own.fine = view;
      return { outline, exact: facts.channels[i].exact, view };
    });
    const tell = () => {
      const decimated = held.filter(({ exact }) => !exact).length;
      status.textContent = decimated
        ? `Extremes of the samples are shown in ${decimated} of ${held.length} channels; zoom in for every sample.`
        : "Every sample is shown.";
    };

    const fetched = async (i, view) => {
      const channel = facts.channels[i],
        query = new URLSearchParams({ points });
      if (view) {
        query.set("start_s", view[0] / 1e3);
        query.set("stop_s", view[1] / 1e3);
      }
      return pyroshock.asked(`/api/channels/${channel.key}?${query}`);
    };
    // The window's own samples, and beside them the extremes of the whole record.
    const put = (i, view, answer) => {
      const chart = stack.charts[i],
        [own] = chart.figure.series,
        { scale } = facts.channels[i],
        times = answer.time_s.map((t) => t * 1e3),
        ends = view || chart.figure.x.limits;
      const beside = held[i].outline.filter(([t]) => t < ends[0] || t > ends[1]),
        before = beside.filter(([t]) => t < ends[0]),
        after = beside.filter(([t]) => t > ends[1]);
      const values = answer.values.map((value) => (value === null ? null : value * scale));
      // samples of a bucket as the server counts them (bucket_length in signals.py), in ms
      const samples = Math.ceil((answer.stop - answer.first) / Math.floor((points - 2) / 2)),
        bucket = answer.decimated ? (1e3 * samples) / answer.sampling_rate_hz : 0;
      Object.assign(own, {
        fine: answer.decimated ? null : ends,
        bucket: bucket || facts.channels[i].bucket,
      });
      Object.assign(held[i], { exact: !answer.decimated, view: ends });
      chart.replace(
        0,
        [...before.map(([t]) => t), ...times, ...after.map(([t]) => t)],
        [...before.map(([, y]) => y), ...values, ...after.map(([, y]) => y)],
      );
      chart.element.dataset.exact = String(!answer.decimated);
      chart.element.dataset.samples = times.length;
    };
    const covers = ({ exact, view }, wanted) =>
      exact && view && view[0] <= wanted[0] && view[1] >= wanted[1];
    let asked = 0,
      waiting = null;
    const load = async (view) => {
      const number = (asked += 1),
        wanted = view || stack.charts[0].figure.x.limits;
      const missing = held.map((_, i) => i).filter((i) => !covers(held[i], wanted));
      figure.dataset.loaded = "no";
      if (missing.length) status.textContent = "Fetching samples…";
      try {
        const answers = await Promise.all(missing.map((i) => fetched(i, view)));
        if (number !== asked) return; // a later zoom is on its way
        missing.forEach((i, k) => put(i, view, answers[k]));
        tell();
      } catch (error) {
        status.textContent = `The samples were not fetched: ${error.message}`;
      }
      figure.dataset.loaded = "yes";
    };
    stack.charts[0].element.addEventListener("zoomed", ({ detail }) => {
      clearTimeout(waiting);
      figure.dataset.loaded = "no";
      waiting = setTimeout(() => load(detail), 100);
    });
    tell();
    figure.dataset.loaded = "yes";

    // Where the cursor is, in words; its values stand in the charts, and here for who does not see.
    stack.charts.forEach((chart) =>
      chart.element.addEventListener("pointed", ({ detail }) => {
        if (chart.element.following) return;
        if (detail === null) {
          time.textContent = "";
          return;
        }
        const since = facts.contact_ms ? detail - facts.contact_ms[0] : null;
        time.textContent =
          `Cursor at ${words(detail)} ms` +
          (since === null ? "" : `, ${words(Math.abs(since))} ms ${since < 0 ? "before" : "after"} the contact begins`);
        if (chart.canvas.matches(":focus"))
          stack.status.textContent = stack.charts
            .map((own, i) => `${facts.channels[i].name} ${own.valuesAt(detail).map(({ text }) => text).join(", ")}`)
            .join("; ");
      }),
    );

    const show = { w: () => stack.everything(), c: () => stack.home() };
    document.querySelectorAll("[data-show]").forEach((button) =>
      button.addEventListener("click", () => show[button.dataset.show]()),
    );
    document.querySelectorAll("[data-view]").forEach((button) =>
      button.addEventListener("click", () => {
        stack.zoom({ x: button.dataset.view.split("~").map(Number) });
        figure.scrollIntoView({ block: "nearest" });
      }),
    );
    document.addEventListener("keydown", (event) => {
      if (typed(event) || !show[event.key]) return;
      show[event.key]();
    });
    figure.dataset.zoomable = "yes";
  }

  document.addEventListener("keydown", (event) => {
    if (typed(event)) return;
    const link = document.getElementById(neighbours[event.key] || "");
    if (link) link.click();
  });
});

// Draws every [data-figure] from the JSON beside it, keeps linked charts in step, and the address with
// what they show.
"use strict";
const pyroshock = (() => {
  const { csvOf, save, savePng } = pyroshockFiles;
  const chartsOf = (chart) => chart.charts || [chart];
  // Buttons below a chart, which the keyboard reaches.
  const tools = (element) => {
    const box = element.closest("figure");
    if (!box || box.querySelector(".chart-tools")) return;
    const row = document.createElement("div"),
      name = `pyroshock-${box.id || "chart"}`,
      chart = element.chart,
      blob = (content, type) => new Blob([content], { type });
    row.className = "chart-tools no-print";
    row.setAttribute("role", "group");
    row.setAttribute("aria-label", "View and save this chart");
    [
      ["Zoom in", () => chart.zoomBy(0.5)],
      ["Zoom out", () => chart.zoomBy(2)],
      ["Everything", () => chart.everything()],
      ["PNG", () => savePng(name, chart.markup())],
      ["SVG", () => save(`${name}.svg`, blob(chart.markup(), "image/svg+xml"))],
      ["CSV", () => save(`${name}.csv`, blob(csvOf(chartsOf(chart)), "text/csv"))],
    ].forEach(([words, act]) => {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "second";
      button.textContent = words;
      button.addEventListener("click", act);
      row.append(button);
    });
    box.append(row);
  };
  // Charts of one group show the same stretch of x and the same curves, and have one cursor: what one
  // does, the others follow.
  const link = (element) => {
    const group = element.dataset.link;
    if (!group) return;
    const others = (aspect, act) => {
      if (element.following) return;
      document.querySelectorAll(`[data-link="${CSS.escape(group)}"]`).forEach((other) => {
        if (other === element || !other.chart || other.chart.charts) return;
        other.following = aspect;
        act(other.chart);
        other.following = "";
      });
    };
    const follow = {
      zoomed: (chart, ends) => chart.zoom({ x: ends }),
      pointed: (chart, x) => chart.follow(x),
      switched: (chart, names) => chart.hide(names),
    };
    Object.entries(follow).forEach(([event, act]) =>
      element.addEventListener(event, ({ detail }) =>
        others(event, (chart) => act(chart, detail)),
      ),
    );
  };
  // The address holds what each chart is zoomed to and which curves are hidden, so that a link shows
  // what is seen: `spectra.x=100~2000&spectra.hide=shot+2`, by the id of the chart.
  const EVERYTHING = "all";
  const held = () =>
    new URLSearchParams(location.hash.includes("=") ? location.hash.slice(1) : "");
  const hold = (id, chart) => {
    const address = held(),
      first = chart.firstView(),
      { following } = chart.element; // what it follows stands in the address at the chart that leads
    const words = (ends) =>
      ends ? ends.map((end) => Number(end.toPrecision(7))).join("~") : EVERYTHING;
    ["x", "y"].forEach((key) => {
      const view = words(chart.view[key]);
      if (key === "x" && following === "switched") return;
      if ((key === "x" && following === "zoomed") || view === words(first[key]))
        address.delete(`${id}.${key}`);
      else address.set(`${id}.${key}`, view);
    });
    if (following !== "zoomed") address.delete(`${id}.hide`);
    const usual = chart.hiddenAtFirst(),
      names = [...chart.hidden];
    const differs = names.length !== usual.size || names.some((name) => !usual.has(name));
    if (differs && !following)
      (names.length ? names : [""]).forEach((name) => address.append(`${id}.hide`, name));
    const text = address.toString();
    history.replaceState(
      history.state,
      "",
      text ? `#${text}` : location.pathname + location.search,
    );
  };
  // What an address cannot mean (an old link, a typed one) is passed over: the usual view is shown.
  const restore = (id, chart) => {
    const address = held(),
      view = {};
    ["x", "y"].forEach((key) => {
      if (address.get(`${id}.${key}`) === EVERYTHING) view[key] = null;
      const ends = (address.get(`${id}.${key}`) || "").split("~").map(Number);
      if (ends.length === 2 && ends.every(Number.isFinite) && ends[0] < ends[1]) view[key] = ends;
    });
    if (address.has(`${id}.hide`))
      chart.hide(address.getAll(`${id}.hide`).filter((name) => chart.figure.legend.includes(name)));
    if (Object.keys(view).length) chart.zoom(view);
  };
  // The name of each chart of a figure in the address: the figure's own, in a stack followed by the
  // place from the second on.
  const named = (box, chart) =>
    chartsOf(chart).map((own, i) => [i ? `${box.id}-${i + 1}` : box.id, own]);
  const watch = (element) => {
    const box = element.closest("figure");
    if (!box || !box.id) return;
    named(box, element.chart).forEach(([id, chart]) =>
      chart.element.addEventListener("viewed", () => hold(id, chart)),
    );
  };
  const draw = (element, figure) => {
    const fresh = !element.chart;
    if (fresh) element.chart = new (figure.rows ? PyroshockStack : PyroshockChart)(element);
    element.chart.show(figure);
    if (!fresh) return;
    tools(element);
    chartsOf(element.chart).forEach((chart) => link(chart.element));
    watch(element);
  };
  const drawAll = () =>
    document.querySelectorAll("[data-figure]").forEach((element) => {
      const source = document.getElementById(element.dataset.figure);
      if (source && source.textContent.trim()) draw(element, JSON.parse(source.textContent));
      else element.dataset.drawn = "none";
    });
  document.addEventListener("DOMContentLoaded", drawAll);
  // Whoever listens to zooms has begun to by then.
  window.addEventListener("load", () =>
    document.querySelectorAll("figure[id] [data-figure]").forEach((element) => {
      if (element.chart)
        named(element.closest("figure"), element.chart).forEach(([id, chart]) =>
          restore(id, chart),
        );
    }),
  );
  // A write as a script sends it, with the token that the page carries.
  const token = () => (document.querySelector('input[name="csrf"]') || {}).value || "";
  const asked = async (address, body) => {
    // an error is JSON for a script that says that it is one, and a page for everybody else
    const own = { "X-Pyroshock-Form": "1" };
    const answer = await fetch(
      address,
      body === undefined
        ? { headers: own }
        : {
            method: "POST",
            headers: { ...own, "Content-Type": "application/json", "X-CSRF-Token": token() },
            body: JSON.stringify(body),
          },
    );
    const said = await answer.json();
    if (!answer.ok)
      throw new Error((said.faults && said.faults[0].message) || said.detail || answer.statusText);
    return said;
  };
  return { draw, asked, token };
})();

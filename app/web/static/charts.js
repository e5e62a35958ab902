// Draws every [data-figure] from the JSON beside it, saves charts as files, and keeps linked
// charts in step.
"use strict";
const pyroshock = (() => {
  // What is shown, as a table. Texts that a spreadsheet would take for formulas get an apostrophe,
  // as in the files that the server writes.
  const guarded = (text) =>
    /^'*[=+\-@\t\r\n＝＋－＠]./s.test(text) &&
    !/^[-+]?(\d+([.,]\d*)?|[.,]\d+)(e[-+]?\d+)?$/i.test(text)
      ? `'${text}`
      : text;
  const quote = (text) => `"${guarded(String(text)).replaceAll('"', '""')}"`;
  const cellOf = (value) =>
    typeof value === "number" ? value : value === null || value === undefined ? "" : quote(value);
  // The columns of each kind of series: axis, what is beside its heading, numbers.
  const COLUMNS = {
    line: (own) => [
      ["x", "", own.x],
      ["y", "", own.y],
    ],
    points: (own) => [
      ["x", "", own.x],
      ["x", ", from", own.x_low],
      ["x", ", to", own.x_high],
      ["y", "", own.y],
      ["y", ", from", own.y_low],
      ["y", ", to", own.y_high],
    ],
    steps: (own) => [
      ["x", ", from", own.edges.slice(0, -1)],
      ["x", ", to", own.edges.slice(1)],
      ["y", "", own.values],
    ],
    bars: (own) => [
      [own.horizontal ? "y" : "x", "", own.position],
      ...[
        ["", own.end],
        [", begin", own.base],
        [", from", own.low],
        [", to", own.high],
      ].map(([part, numbers]) => [own.horizontal ? "x" : "y", part, numbers]),
    ],
    boxes: (own) => [
      ["x", "", own.samples.flatMap((values, i) => values.map(() => own.position[i]))],
      ["y", "", own.samples.flat()],
    ],
    band: (own) => [
      ["x", "", own.x],
      ["y", ", from", own.low],
      ["y", ", to", own.high],
    ],
  };
  const csvOf = (figure) => {
    const map = figure.series.find((own) => own.kind === "heat");
    if (map)
      return [
        ["", ...figure.x.categories],
        ...map.values.map((row, i) => [figure.y.categories[i], ...row]),
      ]
        .map((row) => row.map(cellOf).join(","))
        .join("\n");
    const columns = figure.series
      .filter((own) => !own.silent)
      .flatMap((own, place) =>
        COLUMNS[own.kind](own)
          .filter(([, , numbers]) => numbers)
          .map(([key, part, numbers]) => {
            const { categories, heading } = figure[key],
              shown = (value) =>
                categories.length && value !== null ? categories[Math.round(value)] : value;
            return [
              `${own.detail || own.name || `curve ${place + 1}`}: ${heading}${part}`,
              ...numbers.map(shown),
            ];
          }),
      );
    const length = Math.max(0, ...columns.map((column) => column.length));
    return Array.from({ length }, (_, row) =>
      columns.map((column) => cellOf(column[row])).join(","),
    ).join("\n");
  };
  const save = (name, content) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(content);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const savePng = (name, chart) => {
    const picture = new Image(),
      address = URL.createObjectURL(new Blob([chart.markup()], { type: "image/svg+xml" }));
    picture.addEventListener("load", () => {
      const canvas = document.createElement("canvas");
      canvas.width = 2 * picture.naturalWidth;
      canvas.height = 2 * picture.naturalHeight;
      canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
      URL.revokeObjectURL(address);
      canvas.toBlob((content) => save(`${name}.png`, content), "image/png");
    });
    picture.src = address;
  };
  // Buttons below a chart, which the keyboard reaches.
  const tools = (element) => {
    const box = element.closest("figure");
    if (!box || box.querySelector(".chart-tools")) return;
    const row = document.createElement("div"),
      name = `pyroshock-${box.id || "chart"}`,
      chart = element.chart;
    row.className = "chart-tools no-print";
    row.setAttribute("role", "group");
    row.setAttribute("aria-label", "View and save this chart");
    [
      ["Zoom in", () => chart.zoomBy(0.5)],
      ["Zoom out", () => chart.zoomBy(2)],
      ["Everything", () => chart.zoom({ x: null, y: null })],
      ["PNG", () => savePng(name, chart)],
      ["SVG", () => save(`${name}.svg`, new Blob([chart.markup()], { type: "image/svg+xml" }))],
      ["CSV", () => save(`${name}.csv`, new Blob([csvOf(chart.figure)], { type: "text/csv" }))],
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
  // Charts of one group show the same stretch: what one is zoomed to, the others follow.
  const link = (element) => {
    const group = element.dataset.link;
    if (!group) return;
    element.addEventListener("zoomed", (event) =>
      document.querySelectorAll(`[data-link="${group}"]`).forEach((other) => {
        if (element.following || other === element || !other.chart) return;
        other.following = true;
        other.chart.zoom({ x: event.detail });
        other.following = false;
      }),
    );
  };
  // The address holds what each chart is zoomed to and which curves are hidden, so that a link shows
  // what is seen: `spectra.x=100~2000&spectra.hide=shot+2`, by the id of the chart.
  const held = () =>
    new URLSearchParams(location.hash.includes("=") ? location.hash.slice(1) : "");
  const hold = (id, chart) => {
    const address = held();
    ["x", "y"].forEach((key) => {
      const ends = chart.view[key];
      if (ends)
        address.set(`${id}.${key}`, ends.map((end) => Number(end.toPrecision(7))).join("~"));
      else address.delete(`${id}.${key}`);
    });
    address.delete(`${id}.hide`);
    const usual = chart.hiddenAtFirst(),
      names = [...chart.hidden];
    if (names.length !== usual.size || names.some((name) => !usual.has(name)))
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
      const ends = (address.get(`${id}.${key}`) || "").split("~").map(Number);
      if (ends.length === 2 && ends.every(Number.isFinite) && ends[0] < ends[1]) view[key] = ends;
    });
    if (address.has(`${id}.hide`))
      chart.hide(address.getAll(`${id}.hide`).filter((name) => chart.figure.legend.includes(name)));
    if (Object.keys(view).length) chart.zoom(view);
  };
  const draw = (element, figure) => {
    if (!element.chart) {
      element.chart = new PyroshockChart(element);
      tools(element);
      link(element);
      const box = element.closest("figure");
      if (box && box.id) element.addEventListener("viewed", () => hold(box.id, element.chart));
    }
    element.chart.show(figure);
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
      if (element.chart) restore(element.closest("figure").id, element.chart);
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

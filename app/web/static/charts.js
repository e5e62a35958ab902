// Draws every [data-figure] from the JSON beside it, in the colours of the page, and anew when those change.
"use strict";
const pyroshock = (() => {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  // Colours in our figures are names of the page's: "c0", "quiet"; "c0/0.2" is one that lets through.
  const resolved = (value) => {
    if (Array.isArray(value)) return value.map(resolved);
    if (typeof value !== "string") return value;
    const [name, opacity] = value.split("/");
    const found = colour("--" + name);
    if (!found) return value;
    if (!opacity) return found;
    const [r, g, b] = [1, 3, 5].map((i) => parseInt(found.slice(i, i + 2), 16));
    return `rgba(${r},${g},${b},${opacity})`;
  };
  const coloured = (node) => {
    if (Array.isArray(node)) return node.length && typeof node[0] === "object" ? node.map(coloured) : node;
    if (node === null || typeof node !== "object") return node;
    return Object.fromEntries(Object.entries(node).map(([key, value]) =>
      [key, /color(scale)?$/.test(key) ? resolved(value) : coloured(value)]));
  };
  const themed = (layout) => {
    // Only words may need more than the usual margin: measuring it takes as long as drawing.
    const axis = (given) => ({ gridcolor: "rule", zerolinecolor: "rule", linecolor: "quiet", automargin: given.type === "category" });
    const axes = Object.fromEntries(Object.keys({ xaxis: 0, yaxis: 0, ...layout })
      .filter((key) => /^[xy]axis\d*$/.test(key)).map((key) => [key, { ...axis(layout[key] || {}), ...(layout[key] || {}) }]));
    return coloured({ paper_bgcolor: "card", plot_bgcolor: "card", font: { color: "ink", size: 13, family: "system-ui, sans-serif" },
      margin: { l: 76, r: 16, t: 16, b: 52 }, hoverlabel: { bgcolor: "card", font: { color: "ink" } },
      legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", traceorder: "normal", maxheight: 0.9 }, hovermode: "closest", ...layout, ...axes });
  };
  // A legend of many lines takes its height from no curve.
  const spacious = (element, figure) => {
    const names = figure.data.filter((trace) => trace.showlegend !== false && trace.name).map((trace) => trace.name.length);
    if (names.length < 2 || (figure.layout || {}).showlegend === false) return;
    const key = `${names} ${element.clientWidth}`;
    if (element.legendOf === key) return;
    element.legendOf = key;
    const across = Math.max(1, Math.floor((element.clientWidth - 90) / (48 + 7 * Math.max(...names))));
    element.style.minHeight = "";
    const usual = parseFloat(getComputedStyle(element).minHeight);
    element.style.minHeight = `${usual + 19 * (Math.ceil(names.length / across) - 1)}px`;
  };
  // What is shown, as a table: a column of x and of y for each curve, headed as axes and legend are.
  // Texts that a spreadsheet would take for formulas get an apostrophe, as in the files that the server writes.
  const guarded = (text) => /^'*[=+\-@\t\r\n＝＋－＠]./s.test(text) && !/^[-+]?(\d+([.,]\d*)?|[.,]\d+)(e[-+]?\d+)?$/i.test(text) ? `'${text}` : text;
  const quote = (text) => `"${guarded(String(text)).replaceAll('"', '""')}"`;
  const cellOf = (value) => typeof value === "number" ? value : value === null || value === undefined ? "" : quote(value);
  const csvOf = (element) => {
    const layout = element.figure.layout || {};
    const title = (axis) => ((layout[axis] || {}).title || {}).text || axis;
    const map = element.data.find((trace) => trace.type === "heatmap");
    if (map) return [["", ...map.x], ...map.z.map((row, place) => [map.y[place], ...row])]
      .map((row) => row.map(cellOf).join(",")).join("\n");
    const curves = element.data.filter((trace) => trace.x && trace.y && trace.hoverinfo !== "skip");
    const columns = curves.flatMap((trace, place) => {
      const name = trace.name || `curve ${place + 1}`, [x, y] = ["x", "y"].map((key) => (trace[key + "axis"] || key).replace(/^([xy])/, "$1axis"));
      return [[`${name}: ${title(x)}`, ...trace.x], [`${name}: ${title(y)}`, ...trace.y]];
    });
    const length = Math.max(0, ...columns.map((column) => column.length));
    return Array.from({ length }, (_, row) => columns.map((column) => cellOf(column[row])).join(",")).join("\n");
  };
  const save = (name, content) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([content], { type: "text/csv" })); link.download = name; link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  // Buttons below a chart, which the keyboard reaches; plotly's own bar is for the mouse alone.
  const tools = (element) => {
    const box = element.closest("figure");
    if (!box || box.querySelector(".chart-tools")) return;
    const row = document.createElement("div"), name = `pyroshock-${box.id || "chart"}`;
    row.className = "chart-tools no-print"; row.setAttribute("role", "group"); row.setAttribute("aria-label", "Save this chart");
    const size = () => ({ filename: name, width: element.clientWidth, height: element.clientHeight });
    [["PNG", () => Plotly.downloadImage(element, { ...size(), format: "png", scale: 2 })],
     ["SVG", () => Plotly.downloadImage(element, { ...size(), format: "svg" })],
     ["CSV", () => save(`${name}.csv`, csvOf(element))]].forEach(([words, act]) => {
      const button = document.createElement("button");
      button.type = "button"; button.className = "second"; button.textContent = words; button.addEventListener("click", act);
      row.append(button);
    });
    box.append(row);
  };
  // Charts of one group show the same stretch: what one is zoomed to, the others follow.
  const link = (element) => {
    const group = element.dataset.link;
    if (!group || element.linked || !element.on) return;
    element.linked = true;
    element.on("plotly_relayout", (event) => {
      const [from, to] = [event["xaxis.range[0]"], event["xaxis.range[1]"]];
      if (element.following || (from === undefined && !event["xaxis.autorange"])) return;
      document.querySelectorAll(`[data-link="${group}"]`).forEach((other) => {
        if (other === element || !other.on) return;
        other.following = true;
        Plotly.relayout(other, from === undefined ? { "xaxis.autorange": true } : { "xaxis.range": [from, to] })
          .then(() => { other.following = false; });
      });
    });
  };
  // No control of a chart leads elsewhere: plotly.js offers to upload the chart to its maker unless that is switched off.
  const CONFIG = { responsive: true, displaylogo: false, scrollZoom: false, showSendToCloud: false, plotlyServerURL: "",
    topojsonURL: "/static/", modeBarButtonsToRemove: ["lasso2d", "select2d", "toImage", "sendChartToCloud"] };
  const draw = (element, figure) => {
    element.figure = figure;
    spacious(element, figure);
    return Plotly.react(element, coloured(figure.data), themed(figure.layout || {}), CONFIG)
      .then(() => { element.dataset.drawn = "yes"; tools(element); link(element); return element; });
  };
  const all = () => document.querySelectorAll("[data-figure]");
  const drawAll = () => all().forEach((element) => {
    const source = document.getElementById(element.dataset.figure);
    if (source && source.textContent.trim()) draw(element, JSON.parse(source.textContent));
  });
  const begin = () => {
    drawAll();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
      document.querySelectorAll(".plot").forEach((element) => element.figure && draw(element, element.figure)));
  };
  document.addEventListener("DOMContentLoaded", begin);
  // A write as a script sends it, with the token that the page carries.
  const token = () => (document.querySelector('input[name="csrf"]') || {}).value || "";
  const asked = async (address, body) => {
    // an error is JSON for a script that says that it is one, and a page for everybody else
    const own = { "X-Pyroshock-Form": "1" };
    const answer = await fetch(address, body === undefined ? { headers: own } :
      { method: "POST", headers: { ...own, "Content-Type": "application/json", "X-CSRF-Token": token() }, body: JSON.stringify(body) });
    const said = await answer.json();
    if (!answer.ok) throw new Error((said.faults && said.faults[0].message) || said.detail || answer.statusText);
    return said;
  };
  return { draw, asked, token, colour };
})();

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
      [key, /color$/.test(key) ? resolved(value) : coloured(value)]));
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
  const draw = (element, figure) => {
    element.figure = figure;
    spacious(element, figure);
    return Plotly.react(element, coloured(figure.data), themed(figure.layout || {}),
      { responsive: true, displaylogo: false, scrollZoom: false, modeBarButtonsToRemove: ["lasso2d", "select2d"] })
      .then(() => { element.dataset.drawn = "yes"; return element; });
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
    const answer = await fetch(address, body === undefined ? {} :
      { method: "POST", headers: { "Content-Type": "application/json", "X-CSRF-Token": token() }, body: JSON.stringify(body) });
    const said = await answer.json();
    if (!answer.ok) throw new Error(said.detail || answer.statusText);
    return said;
  };
  return { draw, asked, token, colour };
})();

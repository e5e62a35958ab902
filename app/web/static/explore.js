// A rectangle drawn on the chart selects rows: the server lists them, and the address holds them.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const form = document.getElementById("explore-form"),
    tools = document.getElementById("brush"),
    mode = document.getElementById("brush-mode"),
    list = document.getElementById("selection");
  // The chart follows a menu as soon as it is changed; texts wait for their button.
  form.addEventListener("change", (event) => {
    if (!event.target.matches("select, input[type=checkbox]")) return;
    // quantities belong to the rows that they are of
    if (event.target.id === "subject")
      form.querySelectorAll("#x, #y, #colour").forEach((menu) => { menu.value = ""; });
    form.requestSubmit();
  });
  const plot = document.querySelector("#explored .plot");
  if (!tools || !plot || !plot.chart) return;
  const { chart } = plot,
    scale = { x: Number(tools.dataset.scaleX), y: Number(tools.dataset.scaleY) },
    axes = tools.dataset.oneAxis ? ["x"] : ["x", "y"];
  const ends = (text) => {
    const numbers = (text || "").split(":").map(Number);
    return text && numbers.length === 2 && numbers.every(Number.isFinite) ? numbers : null;
  };
  // What is selected, in SI, null for all of an axis.
  const selected = { x: ends(tools.dataset.selectX), y: ends(tools.dataset.selectY) };
  const mark = document.createElement("div");
  mark.className = "brush";
  mark.hidden = true;
  chart.canvas.append(mark);

  const place = (x1, y1, x2, y2) => {
    Object.assign(mark.style, {
      left: `${x1}px`, top: `${y1}px`,
      width: `${Math.max(1, x2 - x1)}px`, height: `${Math.max(1, y2 - y1)}px`,
    });
    mark.hidden = false;
  };
  const within = (value, low, high) => Math.max(low, Math.min(high, value));
  // The rectangle of the selection, where the view shows some of it.
  const show = () => {
    if (!selected.x && !selected.y) { mark.hidden = true; return; }
    const { frame, sx, sy } = chart;
    const stretch = (key, axis, low, high) => {
      if (!selected[key]) return [low, high];
      const pixels = selected[key].map((value) => axis.at(value * scale[key])).map((value) =>
        within(Number.isFinite(value) ? value : low, low, high));
      return pixels.sort((a, b) => a - b);
    };
    const [x1, x2] = stretch("x", sx, frame.left, frame.right),
      [y1, y2] = stretch("y", sy, frame.top, frame.bottom);
    place(x1, y1, x2, y2);
  };

  const touch = matchMedia("(pointer: coarse)").matches;
  let selecting = !touch;
  const setMode = (on) => {
    selecting = on;
    mode.setAttribute("aria-pressed", String(on));
    mode.textContent = on ? "Dragging selects rows" : "Select rows by dragging";
    plot.classList.toggle("selecting", on);
  };
  mode.addEventListener("click", () => setMode(!selecting));
  setMode(selecting);
  tools.hidden = false;

  let requests = 0;
  const fetchRows = async () => {
    const address = new URLSearchParams(location.search);
    ["x", "y"].forEach((key) => {
      if (selected[key]) address.set(`select_${key}`, selected[key].join(":"));
      else address.delete(`select_${key}`);
    });
    const number = requests += 1;
    history.replaceState(history.state, "", `${location.pathname}?${address}${location.hash}`);
    // the form that saves a view, and the one that selects by numbers, have what is shown
    document.querySelectorAll("#save-view, #select-form").forEach((other) =>
      ["x", "y"].forEach((key) => {
        const name = `select_${key}`;
        let field = other.elements.namedItem(name);
        if (!field && other.id === "save-view") {
          field = document.createElement("input");
          field.type = "hidden";
          field.name = name;
          other.append(field);
        }
        if (field) field.value = selected[key] ? selected[key].join(":") : "";
      }));
    list.setAttribute("aria-busy", "true");
    try {
      const answer = await fetch(`/explore/selection?${address}`);
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      if (number !== requests) return; // a newer rectangle was drawn
      if (!answer.ok) throw new Error(page.querySelector("main")?.textContent.trim() || answer.statusText);
      list.replaceChildren(...page.body.childNodes);
    } catch (error) {
      if (number !== requests) return;
      const line = document.createElement("p");
      line.className = "error";
      line.textContent = `The selected rows cannot be listed: ${error.message}`;
      list.replaceChildren(line);
    }
    list.removeAttribute("aria-busy");
    list.dataset.answers = String(number);
  };

  // The chart zooms by dragging: while rows are selected, it does not hear of it.
  let start = null;
  const at = (event) => {
    const box = chart.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const rectangle = ([x0, y0], [x, y]) => {
    const { frame } = chart;
    const [x1, x2] = [x0, x].map((value) => within(value, frame.left, frame.right)).sort((a, b) => a - b);
    const [y1, y2] = axes.length === 1
      ? [frame.top, frame.bottom]
      : [y0, y].map((value) => within(value, frame.top, frame.bottom)).sort((a, b) => a - b);
    return [x1, y1, x2, y2];
  };
  const mine = (event) => selecting && chart.canvas.contains(event.target);
  plot.addEventListener("pointerdown", (event) => {
    if (!mine(event) || event.button || event.shiftKey) return;
    event.stopPropagation();
    start = at(event);
    chart.canvas.setPointerCapture(event.pointerId);
  }, true);
  plot.addEventListener("pointermove", (event) => {
    if (!start) return;
    event.stopPropagation();
    chart.hideTip();
    place(...rectangle(start, at(event)));
  }, true);
  plot.addEventListener("pointerup", (event) => {
    if (!start) return;
    event.stopPropagation();
    const corners = rectangle(start, at(event)), far = (a, b) => b - a > 3;
    start = null;
    const [x1, y1, x2, y2] = corners;
    if (!far(x1, x2) || (axes.length > 1 && !far(y1, y2))) { show(); return; } // a click
    const between = (axis, key, a, b) =>
      [axis.back(a) / scale[key], axis.back(b) / scale[key]].sort((low, high) => low - high);
    selected.x = between(chart.sx, "x", x1, x2);
    selected.y = axes.length > 1 ? between(chart.sy, "y", y1, y2) : null;
    show();
    fetchRows();
  }, true);
  plot.addEventListener("pointercancel", () => { start = null; show(); }, true);
  list.addEventListener("click", (event) => {
    if (!event.target.closest("#clear-selection")) return;
    event.preventDefault();
    selected.x = selected.y = null;
    show();
    fetchRows();
  });
  plot.addEventListener("viewed", show);
  new ResizeObserver(show).observe(plot);
  show();
});

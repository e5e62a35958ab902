// A chart of a figure: its layout, legend and cursor; zoom and view by mouse and by keys.
"use strict";
const PyroshockChart = (() => {
  const {
    DASHES,
    KINDS,
    area,
    dots,
    finite,
    html,
    node,
    paint,
    point,
    rectangle,
    resolve,
    scaleOf,
    shades,
    stroke,
    ticksOf,
    words,
  } = pyroshockMarks;
  // Widths and heights in px: of a letter, about the axes, of the scale of colours. From further
  // away than REACH the cursor reads nothing.
  const CHARACTER = 6.7,
    TOP = 12,
    RIGHT = 16,
    COLOUR_BAR = 46,
    REACH = 40;
  const KEYS =
    "Plus and minus zoom, 0 shows everything, arrows move the cursor, with Shift the view.";
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const longest = (ticks) => Math.max(0, ...ticks.map(([, name]) => name.length));
  let charts = 0;

  return class {
    constructor(element) {
      this.element = element;
      this.number = charts += 1;
      this.hidden = new Set();
      this.view = { x: null, y: null };
      this.legend = html("div", "legend");
      this.canvas = html("div", "canvas");
      this.tip = html("div", "chart-tip");
      this.tip.setAttribute("role", "status");
      this.tip.hidden = true;
      this.legend.setAttribute("role", "group");
      this.legend.setAttribute("aria-label", "Curves that are shown");
      this.canvas.tabIndex = 0;
      this.canvas.setAttribute("role", "group");
      this.canvas.setAttribute("aria-roledescription", "chart");
      this.canvas.append(this.tip);
      element.replaceChildren(this.legend, this.canvas);
      this.listen();
      new ResizeObserver(
        () => this.figure && element.clientWidth !== this.width && this.paint(),
      ).observe(element);
      dark.addEventListener("change", () => this.figure && this.paint());
    }

    // A new figure; what was zoomed to and hidden stays where the names are the same.
    show(figure) {
      const names = (one) => JSON.stringify([one.legend, one.x.heading, one.y.heading]);
      if (!this.figure || names(this.figure) !== names(figure)) {
        this.figure = figure;
        this.hidden = this.hiddenAtFirst();
        this.view = { x: null, y: null };
      }
      this.figure = figure;
      this.element.data = figure.series;
      this.canvas.setAttribute("aria-label", `${figure.description} ${KEYS}`);
      this.paintLegend();
      this.paint();
      this.element.dataset.drawn = "yes";
    }

    // Entries of the legend of which the figure hides every series until they are chosen.
    hiddenAtFirst() {
      const { series } = this.figure,
        visible = new Set(series.filter((own) => !own.hidden).map((own) => own.name));
      return new Set(
        series.filter((own) => own.name && !visible.has(own.name)).map((own) => own.name),
      );
    }
    // Shows the entries of the legend but for these names.
    hide(names) {
      this.hidden = new Set(names);
      this.pressed();
    }
    shown() {
      return this.figure.series.filter((own) => !this.hidden.has(own.name));
    }
    limits(key) {
      return this.view[key] || this.figure[key].limits;
    }
    get range() {
      return { x: [...this.limits("x")], y: [...this.limits("y")] };
    }

    // Zoom to ends of the axes, null for everything. Whoever listens is told of another stretch of x
    // ("zoomed"), and of any other view, entries of the legend included ("viewed").
    zoom(view) {
      this.view = { ...this.view, ...view };
      this.paint();
      this.element.dispatchEvent(new CustomEvent("viewed"));
      if ("x" in view)
        this.element.dispatchEvent(new CustomEvent("zoomed", { detail: this.view.x }));
    }

    // About the middle; a factor below one shows less.
    zoomBy(factor) {
      this.zoom(
        Object.fromEntries(
          ["x", "y"]
            .filter((key) => !this.figure[key].hidden)
            .map((key) => [key, this.moved(key, 0.5 - factor / 2, 0.5 + factor / 2)]),
        ),
      );
    }
    panBy(shares) {
      this.zoom(
        Object.fromEntries(
          Object.entries(shares).map(([key, share]) => [key, this.moved(key, share, 1 + share)]),
        ),
      );
    }
    moved(key, from, to) {
      const scale = scaleOf({ ...this.figure[key], reversed: false }, 0, 1, this.limits(key));
      return [scale.back(from), scale.back(to)];
    }

    // Other numbers for one series, as when a record is fetched more finely.
    replace(index, x, y) {
      Object.assign(this.figure.series[index], { x, y, labels: [] });
      this.paint();
    }

    paintLegend() {
      const entries = this.figure.legend;
      this.legend.hidden = !entries.length;
      this.legend.replaceChildren(
        ...entries.map((name) => {
          const button = html("button", "entry");
          button.type = "button";
          button.setAttribute("aria-pressed", String(!this.hidden.has(name)));
          button.append(this.swatch(name), name);
          button.addEventListener("click", () => {
            if (!this.hidden.delete(name)) this.hidden.add(name);
            this.pressed();
          });
          button.addEventListener("dblclick", () => {
            this.hidden = new Set(entries.filter((other) => other !== name));
            this.pressed();
          });
          return button;
        }),
      );
    }

    pressed() {
      [...this.legend.children].forEach((button, i) =>
        button.setAttribute("aria-pressed", String(!this.hidden.has(this.figure.legend[i]))),
      );
      this.paint();
      this.element.dispatchEvent(new CustomEvent("viewed"));
    }

    swatch(name, x = 0, y = 0) {
      const has = (kinds) =>
        this.figure.series.filter((own) => own.name === name && kinds.includes(own.kind)).pop();
      const line = has(["line", "steps"]) || this.figure.lines.find((own) => own.name === name),
        fill =
          has(["band", "bars", "boxes"]) || this.figure.regions.find((own) => own.name === name),
        dot = has(["points"]);
      const parts = [
        fill
          ? node("rect", {
              x: 0,
              y: 2,
              width: 20,
              height: 8,
              fill: paint(fill.role),
              "fill-opacity": Math.max(fill.opacity, 0.3),
            })
          : null,
        line
          ? node("path", {
              d: "M0 6H20",
              stroke: paint(line.role),
              "stroke-width": Math.max(1.5, line.width || 2),
              "stroke-opacity": line.opacity,
              "stroke-dasharray": DASHES[line.dash],
            })
          : null,
        dot ? dots(dot, [10], [6], { at: Number }, { at: Number }, 8, dot.filled) : null,
      ];
      return node(
        "svg",
        { class: "swatch", width: 20, height: 12, x, y, "aria-hidden": "true" },
        ...parts,
      );
    }

    paint() {
      const { element, figure, canvas } = this,
        width = element.clientWidth;
      if (!width) return; // it is hidden; the observer of its size paints it later
      this.width = width;
      const height = figure.height || parseFloat(getComputedStyle(element).minHeight) || 320;
      this.drawing = this.drawn(width, height);
      const previous = canvas.querySelector(".drawing");
      if (previous) previous.replaceWith(this.drawing);
      else canvas.prepend(this.drawing);
      this.hideTip();
    }

    drawn(width, height) {
      const { figure } = this,
        heat = figure.series.find((own) => own.kind === "heat"),
        { x: xAxis, y: yAxis } = figure;
      const yTicks = ticksOf(yAxis, ...this.limits("y"), Math.max(2, height / 55));
      const yWords = Math.min(longest(yTicks) * CHARACTER, width * 0.4);
      const left = yAxis.hidden ? 12 : 14 + yWords + (yAxis.heading ? 20 : 0);
      let xTicks = ticksOf(xAxis, ...this.limits("x"), Math.max(2, (width - left) / 90));
      const slot = (width - left - RIGHT) / Math.max(1, xTicks.length),
        turned = xAxis.categories.length > 0 && longest(xTicks) * CHARACTER > slot - 6;
      if (turned && slot < 9) xTicks = xTicks.filter((_, i) => i % Math.ceil(9 / slot) === 0);
      const xWords = turned ? Math.min(longest(xTicks) * CHARACTER, height * 0.4) : 12;
      const bottom = xAxis.hidden ? 12 : 12 + xWords + (xAxis.heading ? 20 : 0),
        top = TOP + (heat ? COLOUR_BAR : 0);
      const frame = { left, right: width - RIGHT, top, bottom: height - bottom };
      const sx = scaleOf(xAxis, frame.left, frame.right, this.limits("x")),
        sy = scaleOf(yAxis, frame.bottom, frame.top, this.limits("y"));
      Object.assign(this, { frame, sx, sy });
      const grid = [],
        names = [],
        ySlot = (frame.bottom - frame.top) / Math.max(1, yTicks.length),
        sparse = Math.ceil(11 / ySlot);
      const cut = (name, room) =>
        name.length * CHARACTER > room + 1
          ? `${name.slice(0, Math.max(1, Math.floor(room / CHARACTER) - 1))}…`
          : name;
      const label = (attributes, name) =>
        node("text", { "font-size": 12, fill: paint("quiet"), ...attributes }, name);
      yTicks.forEach(([value, name], i) => {
        const y = sy.at(value);
        if (y < frame.top - 1 || y > frame.bottom + 1 || (yAxis.categories.length && i % sparse))
          return;
        if (!heat) grid.push(`M${point(frame.left, y)}H${frame.right}`);
        names.push(label({ x: frame.left - 6, y: y + 4, "text-anchor": "end" }, cut(name, yWords)));
      });
      xTicks.forEach(([value, name]) => {
        const x = sx.at(value);
        if (x < frame.left - 1 || x > frame.right + 1) return;
        if (!heat && !xAxis.categories.length) grid.push(`M${point(x, frame.top)}V${frame.bottom}`);
        names.push(
          turned
            ? label(
                {
                  transform: `translate(${(x + 4).toFixed(1)} ${frame.bottom + 6}) rotate(-90)`,
                  "text-anchor": "end",
                },
                cut(name, xWords),
              )
            : label({ x: x.toFixed(1), y: frame.bottom + 16, "text-anchor": "middle" }, name),
        );
      });
      const title = { fill: paint("ink"), "font-size": 13, "text-anchor": "middle" };
      if (xAxis.heading && !xAxis.hidden)
        names.push(
          label({ ...title, x: (frame.left + frame.right) / 2, y: height - 6 }, xAxis.heading),
        );
      if (yAxis.heading && !yAxis.hidden)
        names.push(
          label(
            { ...title, transform: `translate(14 ${(frame.top + frame.bottom) / 2}) rotate(-90)` },
            yAxis.heading,
          ),
        );
      const clip = `clip-${this.number}`,
        marks = node("g", { "clip-path": `url(#${clip})` });
      const across = (own, at) =>
        own.along === "x"
          ? `M${point(sx.at(at), frame.top)}V${frame.bottom}`
          : `M${point(frame.left, sy.at(at))}H${frame.right}`;
      figure.regions
        .filter((own) => !this.hidden.has(own.name))
        .forEach((own) =>
          marks.append(
            area(
              own,
              own.along === "x"
                ? rectangle(sx.at(own.start), frame.top, sx.at(own.stop), frame.bottom)
                : rectangle(frame.left, sy.at(own.start), frame.right, sy.at(own.stop)),
            ),
          ),
        );
      this.shown().forEach((own) =>
        marks.append(...KINDS[own.kind].draw(own, sx, sy).filter(Boolean)),
      );
      figure.lines
        .filter((own) => !this.hidden.has(own.name))
        .forEach((own) => marks.append(stroke(own, across(own, own.at))));
      figure.labels.forEach((own) =>
        marks.append(
          label(
            {
              x: sx.at(own.x).toFixed(1),
              y: (sy.at(own.y) + (own.above === null ? 4 : own.above ? -5 : 14)).toFixed(1),
              "text-anchor": own.anchor,
              fill: paint(own.role),
              "paint-order": "stroke",
              stroke: paint("card"),
              "stroke-width": 3,
              "stroke-opacity": 0.8,
            },
            own.text,
          ),
        ),
      );
      return node(
        "svg",
        {
          class: "drawing",
          width,
          height,
          viewBox: `0 0 ${width} ${height}`,
          "font-family": "system-ui, sans-serif",
          "aria-hidden": "true",
        },
        node(
          "defs",
          {},
          node(
            "clipPath",
            { id: clip },
            node("rect", {
              x: frame.left,
              y: frame.top,
              width: Math.max(0, frame.right - frame.left),
              height: Math.max(0, frame.bottom - frame.top),
            }),
          ),
        ),
        node("path", { d: grid.join(""), stroke: paint("rule"), "stroke-width": 1, fill: "none" }),
        marks,
        node("rect", {
          x: frame.left,
          y: frame.top,
          width: Math.max(0, frame.right - frame.left),
          height: Math.max(0, frame.bottom - frame.top),
          fill: "none",
          stroke: paint("rule"),
        }),
        heat ? this.colourBar(heat, frame, label) : null,
        ...names,
      );
    }

    colourBar(heat, frame, label) {
      const shade = shades(heat),
        scale = scaleOf(heat.colour, frame.left, frame.right, heat.limits),
        stops = 24,
        step = (frame.right - frame.left) / stops;
      const cells = Array.from({ length: stops }, (_, i) =>
        node("rect", {
          x: frame.left + i * step,
          y: TOP + 16,
          width: step + 0.5,
          height: 9,
          fill: shade(scale.back(frame.left + (i + 0.5) * step)),
        }),
      );
      const ticks = ticksOf(heat.colour, ...heat.limits, 6).map(([value, name]) =>
        label({ x: scale.at(value), y: TOP + 38, "text-anchor": "middle" }, name),
      );
      return node(
        "g",
        {},
        label({ x: frame.left, y: TOP + 9, fill: paint("ink") }, heat.colour.heading),
        ...cells,
        ...ticks,
      );
    }

    // The drawing as a file of its own: with a background, the legend, and colours as numbers.
    markup() {
      const { width, drawing, figure } = this,
        height = Number(drawing.getAttribute("height")),
        across = Math.max(
          1,
          Math.floor(
            (width - 20) /
              (40 + CHARACTER * Math.max(1, ...figure.legend.map((name) => name.length))),
          ),
        );
      const entries = figure.legend.filter((name) => !this.hidden.has(name)),
        rows = Math.ceil(entries.length / across),
        room = rows * 18 + (rows ? 6 : 0);
      const legend = entries.flatMap((name, i) => {
        const x = 10 + (i % across) * ((width - 20) / across),
          y = 4 + Math.floor(i / across) * 18;
        return [
          this.swatch(name, x, y),
          node("text", { x: x + 26, y: y + 10, "font-size": 12, fill: paint("ink") }, name),
        ];
      });
      const inner = drawing.cloneNode(true);
      inner.setAttribute("y", room);
      const outer = node(
        "svg",
        {
          width,
          height: height + room,
          viewBox: `0 0 ${width} ${height + room}`,
          "font-family": "sans-serif",
        },
        node("title", {}, figure.title),
        node("rect", { width, height: height + room, fill: paint("card") }),
        ...legend,
        inner,
      );
      return new XMLSerializer()
        .serializeToString(outer)
        .replace(/var\(--([\w-]+)\)/g, (_, role) => resolve(role));
    }

    // What the cursor reads, in pixels: the nearest point, or in a column one of every curve.
    readings(px, py) {
      const { sx, sy, frame } = this,
        inside = (x, y) =>
          x >= frame.left - 1 &&
          x <= frame.right + 1 &&
          y >= frame.top - 1 &&
          y <= frame.bottom + 1;
      const nearest = this.shown()
        .filter((own) => !own.silent)
        .map((own) => {
          let hit = null;
          if (own.kind === "heat") {
            const [i, j] = [Math.round(sy.back(py)), Math.round(sx.back(px))],
              value = (own.values[i] || [])[j];
            return value === undefined
              ? null
              : {
                  own,
                  x: j,
                  y: i,
                  at: [px, py],
                  distance: 0,
                  label: `${own.colour.heading} ${words(value)}`,
                };
          }
          const column = this.figure.cursor === "column";
          KINDS[own.kind].read(own).forEach(([x, y, label]) => {
            const at = [sx.at(x), sy.at(y)];
            if (!at.every(Number.isFinite) || !inside(...at)) return;
            const distance = column
              ? Math.abs(at[0] - px)
              : Math.hypot(at[0] - px, (at[1] - py) * (own.kind === "bars" ? 0.1 : 1));
            if (!hit || distance < hit.distance) hit = { own, x, y, at, distance, label };
          });
          return hit;
        })
        .filter(Boolean);
      if (this.figure.cursor === "column") return nearest.filter((hit) => hit.distance < REACH);
      const best = nearest.reduce(
        (least, hit) => (least && least.distance <= hit.distance ? least : hit),
        null,
      );
      return best && best.distance < REACH ? [best] : [];
    }

    showTip(hits) {
      if (!hits.length) {
        this.hideTip();
        return;
      }
      const value = (key, number) => {
        const axis = this.figure[key];
        return axis.categories.length
          ? axis.categories[Math.round(number)] || ""
          : `${words(number)}${axis.unit === "1" ? "" : ` ${axis.unit}`}`;
      };
      const spoken = (hit) => {
        const numbers = [
          ["x", hit.x],
          ["y", hit.y],
        ]
          .filter(([key]) => !this.figure[key].hidden)
          .map(([key, number]) => value(key, number));
        return [hit.own.detail || hit.own.name, numbers.join(", "), hit.label || ""]
          .filter(Boolean)
          .join(": ");
      };
      this.tip.replaceChildren(...hits.map((hit) => html("div", "", spoken(hit))));
      this.tip.hidden = false;
      const [x, y] = hits[0].at,
        box = this.tip.getBoundingClientRect();
      this.tip.style.left = `${Math.max(0, Math.min(this.width - box.width, x + 12))}px`;
      this.tip.style.top = `${Math.max(0, y - box.height - 10)}px`;
      this.cursor && this.cursor.remove();
      this.cursor = node(
        "g",
        { class: "cursor" },
        ...hits
          .filter((hit) => hit.own.kind !== "heat")
          .map((hit) =>
            node("circle", {
              cx: hit.at[0],
              cy: hit.at[1],
              r: 5,
              fill: paint(hit.own.role),
              stroke: paint("card"),
              "stroke-width": 1.5,
            }),
          ),
      );
      this.drawing.append(this.cursor);
    }

    hideTip() {
      this.tip.hidden = true;
      if (this.cursor) this.cursor.remove();
    }

    listen() {
      const { canvas } = this,
        place = (event) => {
          const box = canvas.getBoundingClientRect();
          return [event.clientX - box.left, event.clientY - box.top];
        };
      let start = null,
        box = null;
      canvas.addEventListener("pointerdown", (event) => {
        if (event.button || !this.figure || event.pointerType === "touch") return;
        start = { at: place(event), pan: event.shiftKey, range: this.range };
        canvas.setPointerCapture(event.pointerId);
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!this.figure || !this.frame) return;
        const [x, y] = place(event);
        if (!start) {
          this.showTip(this.readings(x, y));
          return;
        }
        this.hideTip();
        const { frame } = this,
          [x0, y0] = start.at;
        if (start.pan) {
          const wide = frame.right - frame.left,
            high = frame.bottom - frame.top,
            turn = (key) => (this.figure[key].reversed ? -1 : 1);
          this.view = { x: start.range.x, y: start.range.y };
          this.view = {
            x: this.moved("x", (turn("x") * (x0 - x)) / wide, 1 + (turn("x") * (x0 - x)) / wide),
            y: this.moved("y", (turn("y") * (y - y0)) / high, 1 + (turn("y") * (y - y0)) / high),
          };
          this.paint();
          return;
        }
        if (box) box.remove();
        const ends = this.boxed(start.at, [x, y]);
        box = node("rect", {
          x: ends.x1,
          y: ends.y1,
          width: ends.x2 - ends.x1,
          height: ends.y2 - ends.y1,
          fill: paint("accent"),
          "fill-opacity": 0.15,
          stroke: paint("accent"),
        });
        this.drawing.append(box);
      });
      const end = (event) => {
        if (!start) return;
        const { at, pan } = start,
          to = place(event);
        start = null;
        if (box) {
          box.remove();
          box = null;
        }
        if (pan) {
          this.zoom({ x: this.view.x, y: this.view.y });
          return;
        }
        const ends = this.boxed(at, to),
          view = {};
        const between = (scale, a, b) =>
          [scale.back(a), scale.back(b)].sort((one, other) => one - other);
        if (ends.wide) view.x = between(this.sx, ends.x1, ends.x2);
        if (ends.high) view.y = between(this.sy, ends.y1, ends.y2);
        if (ends.wide || ends.high) this.zoom(view);
      };
      canvas.addEventListener("pointerup", end);
      canvas.addEventListener("pointercancel", () => {
        start = null;
        if (box) box.remove();
      });
      canvas.addEventListener("pointerleave", () => !start && this.hideTip());
      canvas.addEventListener("dblclick", () => this.figure && this.zoom({ x: null, y: null }));
      canvas.addEventListener(
        "keydown",
        (event) =>
          this.figure && !event.ctrlKey && !event.metaKey && !event.altKey && this.key(event),
      );
      canvas.addEventListener("blur", () => this.hideTip());
    }

    // The part that a drag marks: a flat or a narrow one spans the other axis.
    boxed([x0, y0], [x, y]) {
      const { frame, figure } = this,
        within = (value, low, high) => Math.max(low, Math.min(high, value));
      const wide = Math.abs(x - x0) > 8 && !figure.x.hidden,
        high = Math.abs(y - y0) > 24 && !figure.y.hidden;
      const [x1, x2] = wide
        ? [x0, x].map((value) => within(value, frame.left, frame.right)).sort((a, b) => a - b)
        : [frame.left, frame.right];
      const [y1, y2] = high
        ? [y0, y].map((value) => within(value, frame.top, frame.bottom)).sort((a, b) => a - b)
        : [frame.top, frame.bottom];
      return { x1, x2, y1, y2, wide: wide && x2 > x1, high: high && y2 > y1 };
    }

    key(event) {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[
        event.key
      ];
      if (step && event.shiftKey) this.panBy({ x: step[0] * 0.1, y: step[1] * 0.1 });
      else if (step) this.move(step);
      else if (event.key === "+" || event.key === "=") this.zoomBy(0.5);
      else if (event.key === "-") this.zoomBy(2);
      else if (event.key === "0" || event.key === "Home") this.zoom({ x: null, y: null });
      else if (event.key === "Escape") this.hideTip();
      else return;
      event.preventDefault();
    }

    // The cursor by keys: along a curve, and from one to the next.
    move([along, across]) {
      const read = this.shown()
        .filter((own) => !own.silent)
        .map((own) => ({
          own,
          points: KINDS[own.kind].read(own).filter(([x, y]) => finite(x) && finite(y)),
        }))
        .filter(({ points }) => points.length);
      if (!read.length) return;
      const held = this.held || { curve: 0, index: -1 };
      held.curve = (held.curve + read.length - across) % read.length;
      const { own, points } = read[held.curve],
        stride = Math.max(1, Math.round(points.length / 200));
      held.index = Math.max(0, Math.min(points.length - 1, held.index + along * stride));
      this.held = held;
      const [x, y, label] = points[held.index];
      this.showTip([{ own, x, y, at: [this.sx.at(x), this.sy.at(y)], label }]);
    }
  };
})();

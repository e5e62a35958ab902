// A chart of a figure: its layout, its legend and its view. cursor.js adds cursor, mouse and keys;
// stack.js has several charts below each other.
"use strict";
const PyroshockChart = (() => {
  const { scaleOf, ticksOf } = pyroshockAxes;
  const { DASHES, KINDS, area, dots, html, node, paint, point, rectangle, shades, stroke } =
    pyroshockMarks;
  // Widths and heights in px: of a letter, about the axes, of the scale of colours, of what a region
  // has at least. A chart of a stack that is lower than STRIP has its title within; one with equal decades is no higher
  // than HIGHEST.
  const CHARACTER = 6.7,
    TOP = 12,
    RIGHT = 16,
    COLOUR_BAR = 46,
    NARROWEST = 3,
    STRIP = 170,
    HIGHEST = 720;
  const KEYS =
    "Plus and minus zoom, 0 shows everything, arrows move the cursor, with Shift the view.";
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const longest = (ticks) => Math.max(0, ...ticks.map(([, name]) => name.length));
  let charts = 0;

  return class {
    // Within a stack the legend is that of all its charts, and `inner` ones have no words at x.
    constructor(element, { stack = null, inner = false } = {}) {
      this.element = element;
      this.stack = stack;
      this.inner = inner;
      this.leftmost = 0;
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
      this.canvas.tabIndex = stack && stack.charts.length ? -1 : 0; // its keys move all of a stack
      this.canvas.setAttribute("role", "group");
      this.canvas.setAttribute("aria-roledescription", "chart");
      this.canvas.append(this.tip);
      element.replaceChildren(...(stack ? [] : [this.legend]), this.canvas);
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
        this.view = this.firstView();
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
    // What a page opens with: everything, unless the figure names other ends.
    firstView() {
      return { x: this.figure.x.first_view || null, y: this.figure.y.first_view || null };
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
    // ("zoomed"), of other entries of the legend ("switched"), and of any other view ("viewed").
    zoom(view) {
      this.view = this.evened({ ...this.view, ...view }, view);
      this.paint();
      this.element.dispatchEvent(new CustomEvent("viewed"));
      if ("x" in view)
        this.element.dispatchEvent(new CustomEvent("zoomed", { detail: this.view.x }));
    }

    // On paper with equal decades a view has the proportions of the frame: what was not asked for
    // follows what was, and of two the smaller one shows more.
    evened(view, wanted) {
      const { figure } = this;
      if (!figure.equal_decades || (!view.x && !view.y)) return view;
      const decades = (ends) => Math.log10(ends[1] / ends[0]);
      const about = (ends, span) => {
        const middle = Math.log10(ends[0] * ends[1]) / 2;
        return [10 ** (middle - span / 2), 10 ** (middle + span / 2)];
      };
      const ratio = decades(figure.x.limits) / decades(figure.y.limits),
        x = view.x || figure.x.limits,
        y = view.y || figure.y.limits;
      if (!("y" in wanted))
        return { x: view.x, y: view.x && about(this.seen(x) || y, decades(x) / ratio) };
      if (!("x" in wanted)) return { x: view.y && about(x, decades(y) * ratio), y: view.y };
      return decades(x) < decades(y) * ratio
        ? { x: about(x, decades(y) * ratio), y }
        : { x, y: about(y, decades(x) / ratio) };
    }
    // The least and the largest value of the curves within two ends of x.
    seen([low, high]) {
      const values = this.shown()
        .filter((own) => own.kind === "line" && !own.silent)
        .flatMap((own) => own.y.filter((y, i) => y !== null && own.x[i] >= low && own.x[i] <= high));
      return values.length ? [Math.min(...values), Math.max(...values)] : null;
    }

    // About the middle; a factor below one shows less. Charts of a stack differ in y.
    zoomBy(factor) {
      this.zoom(
        Object.fromEntries(
          (this.stack ? ["x"] : ["x", "y"])
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
      this.element.dispatchEvent(new CustomEvent("switched", { detail: [...this.hidden] }));
    }

    swatch(name, x = 0, y = 0) {
      const figures = this.stack ? this.stack.figure.rows : [this.figure],
        all = (key) => figures.flatMap((figure) => figure[key]);
      const has = (kinds) =>
        all("series")
          .filter((own) => own.name === name && kinds.includes(own.kind))
          .pop();
      const line = has(["line", "steps"]) || all("lines").find((own) => own.name === name),
        fill = has(["band", "bars", "boxes"]) || all("regions").find((own) => own.name === name),
        dot = has(["points"]);
      const parts = [
        fill
          ? node("rect", {
              x: 0,
              y: 2,
              width: 20,
              height: 8,
              fill: paint(fill.role),
              "fill-opacity": fill.opacity,
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
      if (this.stack) this.stack.align(this);
      const previous = canvas.querySelector(".drawing");
      if (previous) previous.replaceWith(this.drawing);
      else canvas.prepend(this.drawing);
      this.hideTip();
    }

    get strip() {
      return this.stack !== null && this.figure.height !== null && this.figure.height < STRIP;
    }

    drawn(width, usual) {
      const { figure, strip } = this,
        heat = figure.series.find((own) => own.kind === "heat"),
        { x: xAxis, y: yAxis } = figure;
      let height = usual + (strip && !this.inner ? 38 : 0);
      const yTicks = ticksOf(yAxis, ...this.limits("y"), Math.max(2, usual / (strip ? 26 : 55)));
      const yWords = Math.min(longest(yTicks) * CHARACTER, width * 0.4);
      const heading = strip ? "" : yAxis.heading;
      this.wanted = yAxis.hidden ? 12 : 14 + yWords + (heading ? 20 : 0);
      let left = Math.max(this.leftmost, this.wanted),
        right = width - RIGHT;
      let xTicks = ticksOf(xAxis, ...this.limits("x"), Math.max(2, (width - left) / 90));
      const slot = (width - left - RIGHT) / Math.max(1, xTicks.length),
        turned = xAxis.categories.length > 0 && longest(xTicks) * CHARACTER > slot - 6;
      if (turned && slot < 9) xTicks = xTicks.filter((_, i) => i % Math.ceil(9 / slot) === 0);
      const xWords = turned ? Math.min(longest(xTicks) * CHARACTER, height * 0.4) : 12;
      const margin = strip ? 5 : TOP,
        named = !xAxis.hidden && !this.inner,
        bottom = named ? 12 + xWords + (xAxis.heading ? 20 : 0) : margin,
        top = margin + (heat ? COLOUR_BAR : 0);
      if (figure.equal_decades) {
        const [wide, high] = ["x", "y"].map((key) => Math.log10(figure[key].limits[1] / figure[key].limits[0]));
        const decade = Math.min((right - left) / wide, (HIGHEST - top - bottom) / high),
          spare = (right - left - decade * wide) / 2;
        left += spare;
        right -= spare;
        height = decade * high + top + bottom;
      }
      const frame = { left, right, top, bottom: height - bottom };
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
        if (!named) return;
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
      if (xAxis.heading && named)
        names.push(
          label({ ...title, x: (frame.left + frame.right) / 2, y: height - 6 }, xAxis.heading),
        );
      if (heading && !yAxis.hidden)
        names.push(
          label(
            {
              ...title,
              transform: `translate(${frame.left - this.wanted + 14} ${(frame.top + frame.bottom) / 2}) rotate(-90)`,
            },
            heading,
          ),
        );
      const clip = `clip-${this.number}`,
        marks = node("g", { "clip-path": `url(#${clip})` });
      const across = (own, at) =>
        own.along === "x"
          ? `M${point(sx.at(at), frame.top)}V${frame.bottom}`
          : `M${point(frame.left, sy.at(at))}H${frame.right}`;
      this.places = []; // of regions along x, for the cursor
      figure.regions
        .filter((own) => !this.hidden.has(own.name))
        .forEach((own) => {
          if (own.along === "y") {
            marks.append(area(own, rectangle(frame.left, sy.at(own.start), frame.right, sy.at(own.stop))));
            return;
          }
          const [from, to] = [sx.at(own.start), sx.at(own.stop)],
            spare = Math.max(0, NARROWEST - (to - from)) / 2,
            place = { own, from: from - spare, to: to + spare };
          marks.append(
            area(
              own,
              rectangle(place.from, frame.top, place.to, frame.bottom),
              spare ? 0.9 : own.opacity,
            ),
          );
          if (own.mark) this.places.push(place);
        });
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
      // Marks that would lie on each other stand below each other.
      const flags = [];
      this.places.forEach((place) => {
        const x = place.to + 2,
          near = flags.filter((other) => Math.abs(other - x) < 12).length;
        flags.push(x);
        marks.append(
          label(
            {
              x: x.toFixed(1),
              y: frame.top + 12 + 13 * near,
              fill: paint(place.own.role),
              "font-weight": 700,
              "paint-order": "stroke",
              stroke: paint("card"),
              "stroke-width": 3,
            },
            place.own.mark,
          ),
        );
      });
      if (strip)
        names.push(
          label(
            {
              x: frame.left + 6,
              y: frame.top + 14,
              fill: paint("ink"),
              "paint-order": "stroke",
              stroke: paint("card"),
              "stroke-width": 3,
            },
            `${figure.title}${yAxis.unit === "1" ? "" : ` (${yAxis.unit})`}`,
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
  };
})();

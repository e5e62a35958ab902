// The cursor of charts: what it reads, and the mouse and the keys that move it and the view.
// Charts that are linked have one cursor ("pointed"), as they have one view ("zoomed").
"use strict";
(() => {
  const { finite, words } = pyroshockAxes;
  const { KINDS, html, node, paint } = pyroshockMarks;
  // In px: from further away the cursor reads nothing; so near to a mark it reads the mark.
  const REACH = 40,
    NEAR = 5;

  // A curve at x, whose numbers rise along x: its nearest point, or of a curve that shows the
  // extremes of buckets the least and the largest value of the bucket.
  const valueOf = (own, x) => {
    const xs = own.x;
    if (!xs.length) return null;
    let low = 0,
      high = xs.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (xs[middle] <= x) low = middle;
      else high = middle;
    }
    const nearest = Math.abs(xs[low] - x) <= Math.abs(xs[high] - x) ? low : high,
      reach = own.fine && x >= own.fine[0] && x <= own.fine[1] ? 0 : own.bucket || 0;
    if (!reach) return { x: xs[nearest], low: own.y[nearest], high: own.y[nearest] };
    let [first, last] = [nearest, nearest];
    while (first > 0 && x - xs[first - 1] <= reach) first -= 1;
    while (last < xs.length - 1 && xs[last + 1] - x <= reach) last += 1;
    const values = own.y.slice(first, last + 1).filter(finite);
    return values.length
      ? { x: xs[nearest], low: Math.min(...values), high: Math.max(...values) }
      : { x: xs[nearest], low: null, high: null };
  };

  const cursor = {
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
    },

    // The mouse is at a place: a mark says its sentence, a strip has a line with its values, any
    // other chart a tip.
    read(px, py) {
      const { frame } = this,
        mark = this.places.find((place) => px >= place.from - NEAR && px <= place.to + NEAR);
      if (mark && px >= frame.left && px <= frame.right) {
        this.clearCursor();
        this.tell([`${mark.own.mark}: ${mark.own.text}`], [px, py]);
        return;
      }
      if (!this.strip) {
        this.showTip(this.readings(px, py));
        return;
      }
      this.tip.hidden = true;
      if (px < frame.left || px > frame.right) this.hideTip();
      else this.stand(this.sx.back(px));
    },

    // The line of a strip at the sample that is nearest to x, and of every chart that is linked.
    stand(x) {
      const own = this.shown().find((other) => other.kind === "line" && !other.silent),
        value = own && valueOf(own, x);
      if (!value) return;
      this.follow(value.x);
      this.point(value.x);
    },

    upright(x) {
      const at = this.sx.at(x).toFixed(1);
      return node("path", {
        class: "cursor-line",
        d: `M${at} ${this.frame.top}V${this.frame.bottom}`,
        stroke: paint("ink"),
        "stroke-width": 1,
        "stroke-dasharray": "3 2",
        fill: "none",
      });
    },

    // The values of the curves of a strip at x, in words.
    valuesAt(x) {
      const { unit } = this.figure.y,
        suffix = unit === "1" ? "" : ` ${unit}`;
      return this.shown()
        .filter((own) => own.kind === "line" && !own.silent)
        .map((own) => ({ own, value: valueOf(own, x) }))
        .filter(({ value }) => value)
        .map(({ own, value }) => ({
          own,
          value,
          text:
            value.low === value.high
              ? `${words(value.low)}${suffix}`
              : `${words(value.low)} to ${words(value.high)}${suffix}`,
        }));
    },

    // The cursor where a linked chart has its own; null takes it away.
    follow(x) {
      this.clearCursor();
      if (x === null || !this.drawing) return;
      const { frame, sx, sy } = this,
        at = sx.at(x);
      if (!(at >= frame.left - 0.5 && at <= frame.right + 0.5)) return;
      const values = this.figure.series.some((own) => own.kind === "line") ? this.valuesAt(x) : [];
      const dots = values
        .filter(({ value }) => finite(value.low) && Math.abs(sx.at(value.x) - at) < REACH)
        .flatMap(({ own, value }) =>
          [...new Set([value.low, value.high])].map((y) =>
            node("circle", {
              cx: sx.at(value.x),
              cy: sy.at(y),
              r: 3.5,
              fill: paint(own.role),
              stroke: paint("card"),
            }),
          ),
        );
      const right = at < frame.right - 170;
      const texts = this.strip
        ? [
            node(
              "text",
              {
                class: "cursor-value",
                x: (at + (right ? 7 : -7)).toFixed(1),
                y: frame.bottom - 6,
                "text-anchor": right ? "start" : "end",
                "font-size": 12,
                "font-weight": 600,
                fill: paint("ink"),
                "paint-order": "stroke",
                stroke: paint("card"),
                "stroke-width": 4,
              },
              values.map(({ text }) => text).join(", "),
            ),
          ]
        : [];
      this.cursor = node("g", { class: "cursor" }, this.upright(x), ...dots, ...texts);
      this.drawing.append(this.cursor);
    },

    point(x) {
      this.pointed = x;
      this.element.dispatchEvent(new CustomEvent("pointed", { detail: x }));
    },

    clearCursor() {
      if (this.cursor) this.cursor.remove();
      this.cursor = null;
    },

    everything() {
      if (this.stack) this.stack.everything();
      else this.zoom({ x: null, y: null });
    },

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
      this.tell(hits.map(spoken), hits[0].at);
      this.clearCursor();
      const column = this.figure.cursor === "column";
      this.cursor = node(
        "g",
        { class: "cursor" },
        column ? this.upright(hits[0].x) : null,
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
      if (column) this.point(hits[0].x);
    },

    // Lines of text beside a place of the drawing.
    tell(lines, [x, y]) {
      this.tip.replaceChildren(...lines.map((line) => html("div", "", line)));
      this.tip.hidden = false;
      const box = this.tip.getBoundingClientRect();
      this.tip.style.left = `${Math.max(0, Math.min(this.width - box.width, x + 12))}px`;
      this.tip.style.top = `${Math.max(0, y - box.height - 10)}px`;
    },

    hideTip() {
      this.tip.hidden = true;
      this.clearCursor();
      if (this.pointed !== null && this.pointed !== undefined) this.point(null);
    },

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
          this.read(x, y);
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
      canvas.addEventListener("dblclick", () => this.figure && this.everything());
      canvas.addEventListener(
        "keydown",
        (event) =>
          this.figure && !event.ctrlKey && !event.metaKey && !event.altKey && this.key(event),
      );
      canvas.addEventListener("blur", () => this.hideTip());
    },

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
    },

    key(event) {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[
        event.key
      ];
      if (step && event.shiftKey) this.panBy({ x: step[0] * 0.1, y: step[1] * 0.1 });
      else if (step) this.move(step);
      else if (event.key === "+" || event.key === "=") this.zoomBy(0.5);
      else if (event.key === "-") this.zoomBy(2);
      else if (event.key === "0" || event.key === "Home") this.everything();
      else if (event.key === "Escape") this.hideTip();
      else return;
      event.preventDefault();
    },

    // The cursor by keys: along a curve, and from one to the next, within what is shown.
    move([along, across]) {
      const [low, high] = this.limits("x");
      const read = this.shown()
        .filter((own) => !own.silent)
        .map((own) => ({
          own,
          points: KINDS[own.kind]
            .read(own)
            .filter(([x, y]) => finite(x) && finite(y) && x >= low && x <= high),
        }))
        .filter(({ points }) => points.length);
      if (!read.length) return;
      const before = this.held || { curve: 0 },
        held = before.low === low && before.high === high ? before : { ...before, low, high, index: -1 };
      held.curve = (held.curve + read.length - across) % read.length;
      const { own, points } = read[held.curve],
        stride = Math.max(1, Math.round(points.length / 200));
      held.index = Math.max(0, Math.min(points.length - 1, held.index + along * stride));
      this.held = held;
      const [x, y, label] = points[held.index];
      if (this.strip) this.stand(x);
      else this.showTip([{ own, x, y, at: [this.sx.at(x), this.sy.at(y)], label }]);
    },
  };
  Object.assign(PyroshockChart.prototype, cursor);
})();

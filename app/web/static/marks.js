// The marks of charts as SVG: each kind of series of a figure (app/figures/page_renderer.py).
// Colours are custom properties of the page, so that a chart
// follows dark and light by itself.
"use strict";
const pyroshockMarks = (() => {
  const { finite, words } = pyroshockAxes;
  const DASHES = { dash: "8 5", dot: "2 4", dashdot: "8 4 2 4", longdash: "14 5" };
  const paint = (role) => `var(--${role})`;
  const node = (name, attributes = {}, ...children) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    Object.entries(attributes).forEach(
      ([key, value]) => value !== undefined && made.setAttribute(key, value),
    );
    made.append(...children.filter((child) => child !== null && child !== undefined));
    return made;
  };
  const html = (name, className, text = "") => {
    const made = document.createElement(name);
    made.className = className;
    made.textContent = text;
    return made;
  };
  const point = (x, y) => `${x.toFixed(1)} ${y.toFixed(1)}`;
  // A curve as a path; gaps stay gaps. Of many points a pixel keeps its extremes.
  const curve = (xs, ys, sx, sy) => {
    const parts = [],
      crowded = xs.length > 3000;
    let open = false,
      column = null,
      least = 0,
      most = 0,
      last = 0;
    const flush = () => {
      if (column === null) return;
      parts.push(`L${point(column, least)}L${point(column, most)}L${point(column, last)}`);
      column = null;
    };
    for (let i = 0; i < xs.length; i += 1) {
      const x = sx.at(xs[i]),
        y = sy.at(ys[i]);
      if (!Number.isFinite(x) || !Number.isFinite(y)) {
        flush();
        open = false;
        continue;
      }
      if (!open) {
        flush();
        parts.push(`M${point(x, y)}`);
        open = true;
        continue;
      }
      if (!crowded) {
        parts.push(`L${point(x, y)}`);
        continue;
      }
      const pixel = Math.round(x);
      if (pixel !== column) {
        flush();
        column = pixel;
        least = most = y;
      }
      least = Math.min(least, y);
      most = Math.max(most, y);
      last = y;
    }
    flush();
    return parts.join("");
  };
  const each = (count, part) =>
    Array.from({ length: count }, (_, i) => part(i))
      .filter(Boolean)
      .join("");
  const whiskers = (count, at, ends, upright) =>
    each(count, (i) => {
      const [place, low, high] = [at(i), ...ends(i)];
      if (![place, low, high].every(Number.isFinite)) return "";
      const end = high.toFixed(1);
      return upright
        ? `M${point(place, low)}V${end}M${point(place - 3, low)}h6M${point(place - 3, high)}h6`
        : `M${point(low, place)}H${end}M${point(low, place - 3)}v6M${point(high, place - 3)}v6`;
    });
  const stroke = (own, d, more = {}) =>
    node("path", {
      d,
      fill: "none",
      stroke: paint(own.role),
      "stroke-width": own.width || 1.5,
      "stroke-opacity": own.opacity,
      "stroke-linejoin": "round",
      "stroke-dasharray": DASHES[own.dash],
      ...more,
    });
  const area = (own, d, opacity = own.opacity) =>
    node("path", { d, fill: paint(own.role), "fill-opacity": opacity });
  const rectangle = (x1, y1, x2, y2) =>
    `M${point(x1, y1)}H${x2.toFixed(1)}V${y2.toFixed(1)}H${x1.toFixed(1)}Z`;
  const dots = (own, xs, ys, sx, sy, size, filled = true) => {
    const places = xs
      .map((x, i) => [sx.at(x), sy.at(ys[i])])
      .filter((pair) => pair.every(Number.isFinite));
    if (filled)
      return stroke(own, places.map(([x, y]) => `M${point(x, y)}h0`).join(""), {
        "stroke-width": size,
        "stroke-linecap": "round",
        "stroke-dasharray": undefined,
      });
    const r = size / 2 - 1;
    return stroke(
      own,
      places
        .map(
          ([x, y]) => `M${point(x - r, y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`,
        )
        .join(""),
      { "stroke-width": 2 },
    );
  };

  // How each kind is drawn, and the points of it that the cursor reads: [x, y, words].
  const KINDS = {
    line: {
      draw: (own, sx, sy) => [
        stroke(own, curve(own.x, own.y, sx, sy)),
        own.marks ? dots(own, own.x, own.y, sx, sy, 7) : null,
      ],
      read: (own) => own.x.map((x, i) => [x, own.y[i], own.labels[i]]),
    },
    points: {
      draw: (own, sx, sy) => {
        const thin = { "stroke-width": 1.2, "stroke-opacity": 0.6 * own.opacity };
        const upright =
          own.y_low &&
          whiskers(
            own.x.length,
            (i) => sx.at(own.x[i]),
            (i) => [sy.at(own.y_low[i]), sy.at(own.y_high[i])],
            true,
          );
        const across =
          own.x_low &&
          whiskers(
            own.x.length,
            (i) => sy.at(own.y[i]),
            (i) => [sx.at(own.x_low[i]), sx.at(own.x_high[i])],
            false,
          );
        return [
          upright ? stroke(own, upright, thin) : null,
          across ? stroke(own, across, { "stroke-width": 1.6 }) : null,
          dots(own, own.x, own.y, sx, sy, own.size, own.filled),
        ];
      },
      read: (own) =>
        own.x.map((x, i) => [
          x,
          own.y[i],
          own.labels[i] ||
            (own.x_low
              ? `${words(own.x_low[i])} to ${words(own.x_high[i])}`
              : own.y_low
                ? `${words(own.y_low[i])} to ${words(own.y_high[i])}`
                : ""),
        ]),
    },
    steps: {
      draw: (own, sx, sy) => {
        const floor = sy.axis.scale === "log" ? sy.low : 0;
        const outline = each(own.values.length, (i) => {
          const [a, b, y] = [
            sx.at(own.edges[i]),
            sx.at(own.edges[i + 1]),
            sy.at(own.values[i] === null ? floor : own.values[i]),
          ];
          return `${i ? "L" : "M"}${point(a, y)}H${b.toFixed(1)}`;
        });
        const ends = [own.edges[0], own.edges[own.edges.length - 1]].map((edge) => sx.at(edge));
        return [
          own.filled && outline
            ? area(
                own,
                `${outline}L${point(ends[1], sy.at(floor))}H${ends[0].toFixed(1)}Z`,
                0.6 * own.opacity,
              )
            : stroke(own, outline),
        ];
      },
      read: (own) =>
        own.values.map((value, i) => [
          (own.edges[i] + own.edges[i + 1]) / 2,
          value,
          `${words(own.edges[i])} to ${words(own.edges[i + 1])}`,
        ]),
    },
    bars: {
      draw: (own, sx, sy) => {
        const [along, across] = own.horizontal ? [sx, sy] : [sy, sx],
          zero = along.axis.scale === "log" ? along.low : 0,
          half = own.width / 2;
        const bars = each(own.position.length, (i) => {
          if (!finite(own.end[i])) return "";
          const [a, b] = [across.at(own.position[i] - half), across.at(own.position[i] + half)];
          const [from, to] = [
            along.at(own.base && finite(own.base[i]) ? own.base[i] : zero),
            along.at(own.end[i]),
          ];
          return own.horizontal ? rectangle(from, a, to, b) : rectangle(a, from, b, to);
        });
        const interval =
          own.low &&
          whiskers(
            own.position.length,
            (i) => across.at(own.position[i]),
            (i) => [along.at(own.low[i]), along.at(own.high[i])],
            !own.horizontal,
          );
        return [
          area(own, bars),
          interval
            ? node("path", { d: interval, stroke: paint("ink"), "stroke-width": 1.5, fill: "none" })
            : null,
        ];
      },
      read: (own) =>
        own.position.map((position, i) => {
          const label =
            own.labels[i] || (own.low ? `${words(own.low[i])} to ${words(own.high[i])}` : "");
          return own.horizontal ? [own.end[i], position, label] : [position, own.end[i], label];
        }),
    },
    boxes: {
      draw: (own, sx, sy) => {
        const half = own.width / 2;
        const lines = each(own.boxes.length, (i) => {
          if (!own.boxes[i]) return "";
          const [low, first, median, third, high] = own.boxes[i].map(sy.at),
            [a, b, middle] = [-half, half, 0].map((side) => sx.at(own.position[i] + side));
          const lower = `M${point(middle, first)}V${low.toFixed(1)}`;
          const upper = `M${point(middle, third)}V${high.toFixed(1)}`;
          return `${rectangle(a, first, b, third)}M${point(a, median)}H${b.toFixed(1)}${lower}${upper}`;
        });
        // Samples beside each other, so that equal ones do not hide each other.
        const spread = own.samples.flatMap((values, i) =>
          values.map((value, k) => [
            own.position[i] + half * 0.8 * (((k * 0.618) % 1) - 0.5),
            value,
          ]),
        );
        return [
          dots(
            { ...own, opacity: 0.6 },
            spread.map((pair) => pair[0]),
            spread.map((pair) => pair[1]),
            sx,
            sy,
            5,
          ),
          stroke(own, lines),
        ];
      },
      read: (own) =>
        own.boxes.flatMap((box, i) =>
          box
            ? [
                [
                  own.position[i],
                  box[2],
                  `quartiles ${words(box[1])} and ${words(box[3])}, ${own.samples[i].length} values`,
                ],
              ]
            : own.samples[i].map((value) => [own.position[i], value, ""]), // too few for a box
        ),
    },
    band: {
      draw: (own, sx, sy) => {
        const floor = sy.axis.scale === "log" ? sy.low : null,
          parts = [];
        let run = [];
        const flush = () => {
          if (run.length > 1) {
            const side = (key, order) =>
              order
                .map((i) =>
                  point(sx.at(own.x[i]), sy.at(own[key][i] === null ? floor : own[key][i])),
                )
                .join("L");
            parts.push(`M${side("high", run)}L${side("low", [...run].reverse())}Z`);
          }
          run = [];
        };
        own.x.forEach((x, i) =>
          finite(x) && finite(own.high[i]) && (finite(own.low[i]) || floor !== null)
            ? run.push(i)
            : flush(),
        );
        flush();
        return [area(own, parts.join(""))];
      },
      read: () => [],
    },
    heat: {
      draw: (own, sx, sy) => {
        const picture = document.createElement("canvas"),
          [height, width] = [own.values.length, (own.values[0] || []).length];
        if (!width) return [];
        picture.width = width;
        picture.height = height;
        const pen = picture.getContext("2d"),
          shade = shades(own);
        own.values.forEach((row, i) =>
          row.forEach((value, j) => {
            pen.fillStyle = shade(value);
            pen.fillRect(j, sy.axis.reversed ? i : height - 1 - i, 1, 1);
          }),
        );
        const [x1, x2, y1, y2] = [
          sx.at(-0.5),
          sx.at(width - 0.5),
          sy.at(-0.5),
          sy.at(height - 0.5),
        ];
        return [
          node("image", {
            href: picture.toDataURL(),
            x: Math.min(x1, x2),
            y: Math.min(y1, y2),
            width: Math.abs(x2 - x1),
            height: Math.abs(y2 - y1),
            preserveAspectRatio: "none",
            "image-rendering": "pixelated",
          }),
        ];
      },
      read: () => [],
    },
  };
  const resolve = (role) =>
    getComputedStyle(document.documentElement).getPropertyValue(`--${role}`).trim();
  // The colour of a value of a heat map, between those of the page.
  const shades = (own) => {
    const ends = (own.palette === "diverging" ? ["c0", "card", "c1"] : ["card", "c0"])
      .map(resolve)
      .map((hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16)));
    const log = own.colour.scale === "log" ? Math.log10 : Number,
      [low, high] = own.limits.map(log);
    return (value) => {
      if (!finite(value)) return resolve("rule");
      const share =
          Math.max(0, Math.min(1, (log(value) - low) / (high - low || 1))) * (ends.length - 1),
        i = Math.min(ends.length - 2, Math.floor(share));
      const parts = ends[i].map((part, k) =>
        Math.round(part + (share - i) * (ends[i + 1][k] - part)),
      );
      return `rgb(${parts.join(",")})`;
    };
  };
  return {
    DASHES,
    KINDS,
    area,
    dots,
    html,
    node,
    paint,
    point,
    rectangle,
    resolve,
    shades,
    stroke,
  };
})();

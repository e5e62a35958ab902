// What charts show as files: a table (CSV), and the drawing (SVG, PNG). What is hidden, or outside of
// the view, is in none of them.
"use strict";
const pyroshockFiles = (() => {
  const { node, paint, resolve } = pyroshockMarks;
  const CHARACTER = 6.7;
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
  const tableOf = (map, figure) => [
    ["", ...figure.x.categories],
    ...map.values.map((row, i) => [figure.y.categories[i], ...row]),
  ];
  // Columns of a chart with their headings: of the curves that are shown, as far as x is in view.
  const columnsOf = (chart) => {
    const { figure } = chart,
      [low, high] = chart.limits("x"),
      room = 1e-9 * Math.abs(high - low);
    return chart
      .shown()
      .filter((own) => !own.silent)
      .flatMap((own, place) => {
        const columns = COLUMNS[own.kind](own).filter(([, , numbers]) => numbers);
        const along = columns.find(([key]) => key === "x"),
          inView = (_, row) => {
            const x = along && along[2][row];
            return !along || x === null || (x >= low - room && x <= high + room);
          };
        return columns.map(([key, part, numbers]) => {
          const { categories, heading } = figure[key],
            shown = (value) =>
              categories.length && value !== null ? categories[Math.round(value)] : value;
          return [
            `${own.detail || own.name || `curve ${place + 1}`}: ${heading}${part}`,
            ...numbers.filter(inView).map(shown),
          ];
        });
      });
  };
  const csvOf = (charts) => {
    const [{ figure }] = charts,
      map = charts.length === 1 && figure.series.find((own) => own.kind === "heat");
    if (map)
      return tableOf(map, figure)
        .map((row) => row.map(cellOf).join(","))
        .join("\n");
    const columns = charts.flatMap(columnsOf),
      length = Math.max(0, ...columns.map((column) => column.length));
    return Array.from({ length }, (_, row) =>
      columns.map((column) => cellOf(column[row])).join(","),
    ).join("\n");
  };
  // The drawings below each other as a file of its own: with a background, the legend, and colours as
  // numbers.
  const svgOf = (charts, title) => {
    const [first] = charts,
      { width } = first,
      names = first.figure.legend.filter((name) => !first.hidden.has(name)),
      longest = Math.max(1, ...names.map((name) => name.length)),
      across = Math.max(1, Math.floor((width - 20) / (40 + CHARACTER * longest))),
      lines = Math.ceil(names.length / across);
    let height = lines * 18 + (lines ? 6 : 0);
    const legend = names.flatMap((name, i) => {
      const x = 10 + (i % across) * ((width - 20) / across),
        y = 4 + Math.floor(i / across) * 18;
      return [
        first.swatch(name, x, y),
        node("text", { x: x + 26, y: y + 10, "font-size": 12, fill: paint("ink") }, name),
      ];
    });
    const drawings = charts.map((chart) => {
      const drawing = chart.drawing.cloneNode(true);
      drawing.setAttribute("y", height);
      height += Number(chart.drawing.getAttribute("height"));
      return drawing;
    });
    const outer = node(
      "svg",
      { width, height, viewBox: `0 0 ${width} ${height}`, "font-family": "sans-serif" },
      node("title", {}, title),
      node("rect", { width, height, fill: paint("card") }),
      ...legend,
      ...drawings,
    );
    return new XMLSerializer()
      .serializeToString(outer)
      .replace(/var\(--([\w-]+)\)/g, (_, role) => resolve(role));
  };
  const save = (name, content) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(content);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const savePng = (name, svg) => {
    const picture = new Image(),
      address = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
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
  PyroshockChart.prototype.markup = function markup() {
    return svgOf([this], this.figure.title);
  };
  PyroshockStack.prototype.markup = function markup() {
    return svgOf(this.charts, this.figure.title);
  };
  return { csvOf, save, savePng };
})();

// The page of a diagnosis: ticked effects change the waterfall and the residuals, and a click on a
// run leads to its impact.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const of = (id) => document.getElementById(id);
  const json = (id) => (of(id) ? JSON.parse(of(id).textContent) : null);
  const plot = (id) => (of(id) ? of(id).querySelector("[data-figure]") : null);
  const residuals = json("residuals-all") || [],
    addresses = json("residuals-addresses") || [],
    family = of("family");

  // --- bars on a telephone: the value of a bar stands on a line of its own, below its name
  const narrow = matchMedia("(max-width: 40rem)"),
    LINE = 16,
    AXIS = 48;
  const fitted = (figure) => {
    const rows = figure.y.categories.length;
    if (!narrow.matches || !rows) return figure;
    const height = figure.height + LINE * rows,
      up = (LINE * rows) / (height - AXIS);
    const labels = figure.labels.map((own) =>
      own.anchor === "end"
        ? { ...own, anchor: "start", x: figure.x.limits[0], role: "quiet" }
        : { ...own, y: own.y - up },
    );
    const y = { ...figure.y, limits: [-0.5 - up, rows - 0.5] };
    return { ...figure, y, height, labels };
  };
  const bars = { waterfall: json("waterfall-data"), shares: json("shares-data") };
  const drawBars = () =>
    Object.entries(bars).forEach(([id, figure]) => figure && pyroshock.draw(plot(id), fitted(figure)));
  if (narrow.matches) drawBars();
  narrow.addEventListener("change", drawBars);

  // --- residuals by family; the last series holds the points with effects
  const AFTER = "with the effects";
  const drawResiduals = () => {
    if (family) pyroshock.draw(plot("residuals"), residuals[Number(family.value)]);
  };
  if (family) family.addEventListener("change", drawResiduals);

  // --- a click on a point names its run, with a link to its impact
  const pointed = (event) => {
    const chart = plot("residuals").chart;
    if (!chart || !chart.figure) return null;
    const box = chart.canvas.getBoundingClientRect();
    const [hit] = chart.readings(event.clientX - box.left, event.clientY - box.top);
    if (!hit || !hit.own.labels || !hit.label) return null;
    const index = hit.own.labels.indexOf(hit.label);
    return index < 0 ? null : { words: hit.label, address: addresses[index] };
  };
  const name = (run) => {
    const line = of("point");
    line.textContent = `${run.words}. `;
    if (!run.address) return;
    const link = document.createElement("a");
    link.href = run.address;
    link.id = "point-impact";
    link.textContent = "Open this impact";
    line.append(link);
  };
  if (plot("residuals")) {
    plot("residuals").addEventListener("click", (event) => {
      const run = pointed(event);
      if (run) name(run);
    });
    // Enter does for the keyboard's cursor what a click does for the pointer.
    plot("residuals").addEventListener("keydown", (event) => {
      const { chart } = plot("residuals"),
        held = chart && chart.held;
      if (event.key !== "Enter" || !held) return;
      // As the chart's own cursor counts them: curves with points, and points with numbers.
      const curves = chart
        .shown()
        .filter((own) => !own.silent)
        .map((own) => pyroshockMarks.KINDS[own.kind].read(own).filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y)))
        .filter((points) => points.length);
      const words = ((curves[held.curve] || [])[held.index] || [])[2],
        { labels } = chart.figure.series.find((own) => own.labels),
        index = labels.indexOf(words);
      if (index >= 0) name({ words, address: addresses[index] });
    });
  }

  // --- ticked effects
  const form = of("what-if"),
    computed = json("computed-sets") || [];
  if (!form || !computed.length) return;
  const boxes = [...form.querySelectorAll('input[name="with_effects"]')];
  const key = (names) => JSON.stringify([...names].sort());
  const known = new Set(computed.map(key));
  const ticked = () => boxes.filter((box) => box.checked).map((box) => box.value);
  const report = json("report-effects") || [];
  const overlaps = (one, other) => {
    const members = other.split(" or ");
    return one !== other && one.split(" or ").some((name) => members.includes(name));
  };
  const REST = "effects that are not established",
    path = (computed.filter((names) => names.includes(REST))[0] || []).filter((n) => n !== REST);
  // A set stands for each of its effects, and what is not established was computed beside the whole
  // path alone: a box takes along, or takes away, what cannot stand beside it.
  const settle = (box) => {
    if (box.checked)
      boxes.forEach((other) => {
        if (overlaps(box.value, other.value)) other.checked = false;
      });
    const rest = boxes.find((other) => other.value === REST);
    if (!rest) return;
    if (box === rest && rest.checked) boxes.forEach((other) => (other.checked = other === rest || path.includes(other.value)));
    else if (rest.checked && key(ticked()) !== key([...path, REST])) rest.checked = false;
  };
  // What a box leads to: it is marked where that was not computed.
  const mark = () =>
    boxes.forEach((box) => {
      const names = ticked().filter((name) => name !== box.value && name !== REST && !overlaps(box.value, name));
      if (!box.checked) names.push(box.value);
      const whole = box.value === REST && !box.checked;
      box.closest("li").querySelector(".job").hidden = whole || known.has(key(names));
    });
  let newest = 0;
  const show = async () => {
    const names = ticked(),
      turn = (newest += 1);
    mark();
    if (!known.has(key(names))) {
      of("combination").textContent =
        "This combination was not computed. Waterfall and residuals still show the one before; the button diagnoses with these effects.";
      return;
    }
    const address = new URLSearchParams();
    names.forEach((value) => address.append("effect", value));
    try {
      const answer = await pyroshock.asked(`${form.dataset.figures}?${address}`);
      if (turn !== newest) return; // another box was ticked meanwhile
      if (answer.waterfall) {
        bars.waterfall = answer.waterfall;
        drawBars();
      }
      answer.residuals.forEach((own, i) => {
        const after = residuals[i].series.find((series) => series.name === AFTER);
        if (after) after.y = own.after || after.x.map(() => null);
        residuals[i].y.limits = own.limits;
      });
      drawResiduals();
      of("waterfall-words").textContent = answer.words;
      of("combination").textContent = "";
      if (!names.length) address.append("effect", "");
      history.replaceState(history.state, "", `?${address}${location.hash}`);
    } catch (error) {
      of("combination").textContent = `Not shown: ${error.message}`;
    }
  };
  boxes.forEach((box) =>
    box.addEventListener("change", () => {
      settle(box);
      show();
    }),
  );
  of("back-to-path").addEventListener("click", () => {
    boxes.forEach((box) => (box.checked = report.includes(box.value)));
    show();
  });
  mark();
});

// The sliders ask the twin while they move; the newest answer is shown, and its address is the page's.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const form = document.getElementById("shot");
  const of = (id) => document.getElementById(id);
  const fixed = JSON.parse(form.dataset.fixed);
  const short = (value) => value === null ? "–" : Number(value.toPrecision(4)).toString().replace("-", "−");
  const asked = () => {
    const query = new URLSearchParams();
    Object.entries(fixed).forEach(([key, value]) => value && query.set(key, value));
    form.querySelectorAll("input, select").forEach((field) => field.value && query.set(field.name,
      field.dataset.scale ? Number((field.value / field.dataset.scale).toPrecision(9)) : field.value));
    return query;
  };
  // The lines of a list, or of the one in a box; nothing to say hides it.
  const list = (place, lines) => {
    place.hidden = !lines.length;
    (place.querySelector("ul") || place).replaceChildren(...lines.map((line) => {
      const item = document.createElement("li");
      item.textContent = line;
      return item;
    }));
  };
  // A line of cells for each row; `right`: columns of numbers, `headed`: the first cell names the row.
  const rows = (table, lines, right, headed) => table.tBodies[0].replaceChildren(...lines.map((cells) => {
    const line = document.createElement("tr");
    cells.forEach((text, column) => {
      const cell = document.createElement(headed && !column ? "th" : "td");
      if (headed && !column) cell.scope = "row";
      if (right.includes(column)) cell.className = "number";
      cell.textContent = text;
      line.append(cell);
    });
    return line;
  }));
  const show = (answer) => {
    Object.entries(answer.figures).forEach(([name, figure]) => {
      const place = of(name) && of(name).querySelector(".plot");
      if (place) pyroshock.draw(place, figure);
    });
    rows(of("numbers"), answer.numbers.map((row) => [row.quantity, row.mean, row.unit, row.band, row.measured, row.outside]), [1, 3, 4, 5], true);
    of("measured-here").textContent = answer.here; of("measured-here").hidden = !answer.here;
    of("measured-here").classList.toggle("warn", answer.contradicted);
    rows(of("nearest"), answer.nearest.map((row) => [row.shot, row.difference, row.velocity, row.peak_force, row.contact_time]), [2, 3, 4]);
    [...of("nearest").tBodies[0].rows].forEach((line, place) => {
      const address = answer.nearest[place].address;
      if (!address) return;
      const link = document.createElement("a");
      link.href = address; link.textContent = line.cells[0].textContent; line.cells[0].replaceChildren(link);
    });
    rows(of("known"), answer.known.map((row) => [row.quantity, row.asked, row.low, row.high, row.unit, row.shots]), [1, 2, 3, 5], true);
    of("known").hidden = !answer.known.length;
    of("nearest").hidden = !answer.nearest.length; of("no-nearest").hidden = Boolean(answer.nearest.length);
    of("velocity-basis").textContent = answer.basis; of("velocity-basis").hidden = !answer.basis;
    const prediction = answer.prediction;
    of("rests-on").textContent = prediction.rests_on.sentence;
    of("rests-on").hidden = !prediction.rests_on.sentence;
    list(of("notes"), prediction.notes);
    list(of("warnings"), prediction.warnings);
    form.querySelectorAll("input[type=range]").forEach((field) => {
      const warning = of(`${field.id}-warning`);
      warning.textContent = answer.beside[field.id] || "";
      warning.hidden = !warning.textContent;
    });
    of("link").href = answer.link;
    history.replaceState(null, "", answer.link + location.hash);
  };
  let busy = false, again = false, answers = 0;
  const ask = async () => {
    if (busy) { again = true; return; }
    busy = true;
    do {
      again = false;
      const begun = performance.now();
      try {
        const answer = await pyroshock.asked(`/twin/answer?${asked()}`);
        show(answer);
        of("why-not").hidden = true;
        of("took").textContent = `${Math.round(performance.now() - begun)} ms`;
        of("took").dataset.milliseconds = Math.round(performance.now() - begun);
      } catch (error) { of("why-not").textContent = error.message; of("why-not").hidden = false; }
      form.dataset.answers = ++answers;
    } while (again);
    busy = false;
  };
  // A text is asked for when it is whole, anything else while it moves.
  form.addEventListener("change", (event) => { if (event.target.type === "text") ask(); });
  form.addEventListener("input", (event) => {
    if (event.target.type === "text") return;
    const fault = of(`${event.target.id}-error`);
    if (fault) { fault.remove(); event.target.removeAttribute("aria-invalid"); }
    const shown = of(`${event.target.id}-shown`);
    if (shown) shown.textContent = short(Number(event.target.value));
    ask();
  });
  form.addEventListener("submit", (event) => { event.preventDefault(); ask(); });
});

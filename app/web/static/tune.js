// Draws the specification while it is chosen or typed: what the search will be asked for.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const of = (id) => document.getElementById(id);
  const file = of("target-file"), text = of("target"), tolerance = of("tolerance"), element = document.querySelector("#target-chart .plot");
  const show = (figure, sentence, fault) => {
    of("no-target").hidden = Boolean(figure || fault);
    of("target-fault").hidden = !fault; of("target-fault").textContent = fault;
    of("target-shown").hidden = !figure;
    of("target-sentence").textContent = sentence;
    if (figure) pyroshock.draw(element, figure);
  };
  let newest = 0;
  const ask = async () => {
    const turn = ++newest;
    const content = file.files.length ? await file.files[0].text() : text.value;
    let answer = { figure: null, sentence: "" }, fault = "";
    if (content.trim()) {
      try { answer = await pyroshock.asked("/tune/target", { text: content, tolerance: tolerance.value }); } catch (error) { fault = error.message; }
    }
    // an answer to what has changed since is none
    if (turn === newest) show(answer.figure, answer.sentence, fault);
  };
  let waiting = 0;
  const soon = () => { clearTimeout(waiting); waiting = setTimeout(ask, 300); };
  file.addEventListener("change", ask);
  [text, tolerance].forEach((control) => control.addEventListener("input", soon));
  ask();
});

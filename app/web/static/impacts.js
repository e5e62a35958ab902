// Ticks every impact of the page, or none.
"use strict";
document.addEventListener("DOMContentLoaded", () => document.querySelectorAll("[data-tick-all]").forEach((box) =>
  box.addEventListener("change", () => box.closest("table").querySelectorAll('input[name="impact"]')
    .forEach((tick) => { tick.checked = box.checked; }))));
// Columns stand in the address once somebody has chosen other ones.
document.addEventListener("DOMContentLoaded", () => {
  const form = document.getElementById("filter");
  const boxes = () => [...form.querySelectorAll('input[name="columns"]')];
  if (form) form.addEventListener("submit", () => {
    if (location.search.includes("columns=") || boxes().some((box) => box.checked !== box.defaultChecked)) return;
    boxes().forEach((box) => { box.disabled = true; });
    setTimeout(() => boxes().forEach((box) => { box.disabled = false; }), 0);
  });
});

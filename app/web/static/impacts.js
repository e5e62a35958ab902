// Ticks every impact of the page, or none.
"use strict";
document.addEventListener("DOMContentLoaded", () => document.querySelectorAll("[data-tick-all]").forEach((box) =>
  box.addEventListener("change", () => box.closest("table").querySelectorAll('input[name="impact"]')
    .forEach((tick) => { tick.checked = box.checked; }))));

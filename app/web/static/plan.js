// Shows the options of the chosen method of design; those of the others are neither shown nor sent.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const method = document.getElementById("method");
  if (!method) return;
  const parts = [...document.querySelectorAll("[data-methods]")];
  const show = () => {
    const shown = (part) => part.dataset.methods.split(" ").includes(method.value);
    parts.forEach((part) => { part.hidden = !shown(part); });
    // A part may lie in another one: a control is sent only if all around it are shown.
    parts.forEach((part) => part.querySelectorAll("input, select, textarea").forEach((control) => {
      control.disabled = control.closest("[data-methods][hidden]") !== null;
    }));
  };
  method.addEventListener("change", show);
  window.addEventListener("pageshow", show); // a page that comes back keeps what was chosen
  show();
});

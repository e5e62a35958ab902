// The form of a campaign shows what belongs to the chosen kind: the other fields and columns stay in the form, and are not written.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const form = document.getElementById("campaign-form"), kind = document.getElementById("kind");
  if (!form || !kind) return;
  const show = () => form.querySelectorAll("[data-kinds]").forEach((part) => {
    part.hidden = kind.value !== "" && !part.dataset.kinds.split(" ").includes(kind.value);
  });
  kind.addEventListener("change", show);
  show();
  // a field that was open is no longer marked once something stands in it
  form.addEventListener("input", (event) => {
    const field = event.target.closest(".field.open");
    if (field && event.target.value) field.classList.remove("open");
  });
});

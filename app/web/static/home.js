// Moves the pictures of the first page up and down within the form that orders them.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const list = document.getElementById("picture-choices");
  if (!list) return;
  const move = (button, item, earlier) => {
    const neighbour = earlier ? item.previousElementSibling : item.nextElementSibling;
    if (!neighbour) return;
    list.insertBefore(earlier ? item : neighbour, earlier ? neighbour : item);
    button.focus();
  };
  for (const item of list.children) {
    const name = item.querySelector("label").textContent.trim();
    for (const [sign, words, earlier] of [["↑", "earlier", true], ["↓", "later", false]]) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "second";
      button.textContent = sign;
      button.setAttribute("aria-label", `Show ${words}: ${name}`);
      button.addEventListener("click", () => move(button, item, earlier));
      item.append(" ", button);
    }
  }
});

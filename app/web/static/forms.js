// Sends a form that writes without leaving its page: an error stands beside its field, and what was typed stays.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const restore = (control) => {
    control.removeAttribute("aria-invalid");
    if (control.dataset.describedby === undefined) return;
    control.setAttribute("aria-describedby", control.dataset.describedby);
    if (!control.dataset.describedby) control.removeAttribute("aria-describedby");
  };
  const clear = (form) => {
    form.querySelectorAll(".field-error").forEach((message) => message.remove());
    form.querySelectorAll("[aria-invalid]").forEach(restore);
  };
  const unfold = (control) => {
    for (let box = control.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
  };
  // What is said of a value goes with the value; a file "NAME.file" stands in for the text NAME.
  const changed = (form, name) => [...form.querySelectorAll("[aria-invalid]")].filter((control) => control.name === name.replace(/\.file$/, ""))
    .forEach((control) => {
      restore(control);
      [...form.querySelectorAll(".field-error")].filter((line) => line.id === `${control.id || control.name}-error`).forEach((line) => line.remove());
    });
  const message = (id, text) => {
    const line = document.createElement("span");
    line.className = "field-error error"; line.id = id; line.setAttribute("role", "alert"); line.textContent = text;
    return line;
  };
  // A fault without a field that this form has stands at its top.
  const show = (form, faults) => {
    clear(form);
    faults.forEach(({ field, message: text }, place) => {
      const named = field ? form.elements.namedItem(field) : null;
      // a checkbox has a hidden control of its name before it; those of other methods are disabled
      const control = named instanceof RadioNodeList ? [...named].find((each) => each.type !== "hidden" && !each.disabled) : named;
      if (!control || control.type === "hidden") { form.prepend(message(`${form.id || "form"}-error-${place}`, text)); return; }
      unfold(control);
      const line = message(`${control.id || field}-error`, text);
      (control.closest(".field") || control.parentElement).append(line);
      const before = control.getAttribute("aria-describedby") || "";
      control.dataset.describedby = before;
      control.setAttribute("aria-invalid", "true");
      control.setAttribute("aria-describedby", `${before} ${line.id}`.trim());
    });
    const first = form.querySelector("[aria-invalid]") || form.querySelector(".field-error");
    if (first) { first.tabIndex = first.tabIndex < 0 ? -1 : first.tabIndex; first.focus(); first.scrollIntoView({ block: "center" }); }
  };
  // The address of a filter holds what was chosen, and nothing of what was left open.
  document.querySelectorAll('form[method="get"]').forEach((form) => form.addEventListener("submit", () => {
    const empty = [...form.elements].filter((control) => control.name && control.value === "" && !control.disabled);
    empty.forEach((control) => { control.disabled = true; });
    setTimeout(() => empty.forEach((control) => { control.disabled = false; }), 0);
  }));
  // `fetch` does not tell how much of an upload has left; the progress bar of a form with files shows it.
  const send = (form, address, headers, data) => form.enctype !== "multipart/form-data" && !form.querySelector("input[type=file]")
    ? fetch(address, { method: "POST", headers, body: new URLSearchParams(data) })
    : new Promise((resolve, reject) => {
      const request = new XMLHttpRequest(), bar = form.querySelector("progress");
      request.open("POST", address);
      Object.entries(headers).forEach(([name, value]) => request.setRequestHeader(name, value));
      if (bar) request.upload.onprogress = (event) => { bar.hidden = false; bar.max = event.total; bar.value = event.loaded; };
      request.onload = () => resolve({ ok: request.status < 400, statusText: request.statusText, json: async () => JSON.parse(request.responseText) });
      request.onerror = () => reject(new Error("the connection ended"));
      request.onloadend = () => { if (bar) bar.hidden = true; };
      request.send(data);
    });
  // The browser says of a value itself that it is outside of its limits, but not within what is folded: the form would stay silent.
  document.querySelectorAll("form").forEach((form) => form.addEventListener("invalid", (event) => unfold(event.target), true));
  const busy = (form, on) => form.querySelectorAll("button").forEach((button) => { button.disabled = on; });
  document.querySelectorAll('form[method="post"]').forEach((form) => form.addEventListener("input", (event) => changed(form, event.target.name || "")));
  document.querySelectorAll('form[method="post"]').forEach((form) => form.addEventListener("submit", async (event) => {
    if (event.defaultPrevented || form.dataset.plain !== undefined) return; // the answer is a page
    event.preventDefault();
    const data = new FormData(form, event.submitter);
    busy(form, true);
    try {
      const address = (event.submitter && event.submitter.getAttribute("formaction")) || form.action;
      const answer = await send(form, address, { Accept: "application/json", "X-Pyroshock-Form": "1" }, data);
      const result = await answer.json();
      if (answer.ok && result.location) {
        const [next, here] = [new URL(result.location, location.href), new URL(location.href)];
        location.assign(next.href);
        // an address that differs in its mark alone would only scroll
        if (next.hash && next.pathname === here.pathname && next.search === here.search) location.reload();
        return;
      }
      show(form, result.faults || [{ field: "", message: result.detail || answer.statusText }]);
    } catch (error) {
      show(form, [{ field: "", message: `The server did not answer (${error.message}). Nothing of the form is lost; send it again.` }]);
    }
    busy(form, false);
  }));
});
// A name that is too long for its cell is shortened, and shown whole where the pointer rests on it.
document.addEventListener("DOMContentLoaded", () => document.querySelectorAll("td a").forEach((link) => {
  if (link.scrollWidth > link.clientWidth && !link.title) link.title = link.textContent.trim();
}));
// A telephone shows the main columns of a table; its button shows all.
document.addEventListener("DOMContentLoaded", () => document.querySelectorAll("[data-unfold]").forEach((button) =>
  button.addEventListener("click", () => {
    button.closest("p").previousElementSibling.querySelector("table").classList.remove("folded");
    button.closest("p").remove();
  })));
// A form that was opened from a job gets the values of that job back.
document.addEventListener("DOMContentLoaded", async () => {
  const job = new URLSearchParams(location.search).get("again");
  if (!/^\d+$/.test(job || "")) return;
  const answer = await fetch(`/jobs/${job}/form`);
  if (!answer.ok) return;
  const values = await answer.json(), form = document.getElementById(values.form);
  if (!form) return;
  const fill = (control, texts) => {
    if (control.disabled) return; // another method has a control of this name, of other choices
    const before = control.type === "checkbox" ? control.checked : control.value;
    if (control.type === "checkbox") control.checked = texts.includes(control.value);
    else control.value = texts.join(",");
    const changed = before !== (control.type === "checkbox" ? control.checked : control.value);
    for (let box = changed && control.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
    if (changed) control.dispatchEvent(new Event("change", { bubbles: true }));
  };
  [...form.elements].filter((control) => control.name in values.fields && control.type !== "hidden")
    .forEach((control) => fill(control, [].concat(values.fields[control.name])));
  const line = document.createElement("p");
  line.className = "note"; line.id = "filled"; line.setAttribute("role", "status");
  line.textContent = `The values of job ${job} are filled in. Change what is wrong, and send the form again.`;
  form.prepend(line);
});

// Searches the operations of the API, and sends the request that a page's form describes.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const byId = (id) => document.getElementById(id);
  const element = (tag, className, text) => {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  };

  // --- the list
  const words = byId("api-words");
  if (words) {
    const rows = [...document.querySelectorAll("[data-words]")];
    const search = () => {
      const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
      rows.forEach((row) => { row.hidden = !wanted.every((word) => row.dataset.words.includes(word)); });
      document.querySelectorAll(".api-topic").forEach((topic) => { topic.hidden = !topic.querySelector("[data-words]:not([hidden])"); });
      const count = rows.filter((row) => !row.hidden).length;
      byId("search-count").textContent = wanted.length ? `${count} of ${rows.length} operations` : `${rows.length} operations`;
    };
    words.addEventListener("input", search);
    byId("api-search").addEventListener("submit", (event) => event.preventDefault());
    window.addEventListener("pageshow", search); // a page that comes back keeps what was typed
    return;
  }

  // --- the form of one operation
  const form = byId("try-form");
  if (!form) return;
  const route = JSON.parse(byId("try-data").textContent);
  const method = byId("try-method");
  const isShown = (field) => !byId(field.id).closest("[data-designs][hidden]");
  const showDesign = () => document.querySelectorAll("[data-designs]").forEach((part) => {
    part.hidden = !part.dataset.designs.split(" ").includes(method.value);
  });
  // A number, a truth value or JSON where the text is one; else the text, such as "5 bar". A bare number is in SI.
  const valueOf = (field, text) => {
    if (field.control === "lines") return text.split("\n").map((line) => line.trim()).filter(Boolean).map((line) => (line !== "" && isFinite(line) ? Number(line) : line));
    if (field.control === "json" || field.control === "number") { try { return JSON.parse(text); } catch { return text; } }
    if (field.unit && isFinite(text)) return Number(text);
    return text === "true" || text === "false" ? text === "true" : text;
  };
  const request = () => {
    let path = route.path;
    const query = new URLSearchParams(), body = method ? { method: method.value } : {};
    route.fields.filter(isShown).forEach((field) => {
      const text = byId(field.id).value.trim();
      if (field.place === "path") path = path.replace(`{${field.name}}`, text ? encodeURIComponent(text) : `{${field.name}}`);
      else if (!text) return;
      else if (field.place === "query") (field.control === "lines" ? text.split("\n") : [text]).map((line) => line.trim()).filter(Boolean).forEach((line) => query.append(field.name, field.unit && isFinite(line) ? `${line} ${field.unit}` : line));
      else body[field.name] = valueOf(field, text);
    });
    const rest = query.toString();
    return { address: rest ? `${path}?${rest}` : path, body };
  };
  const preview = () => {
    const { address, body } = request();
    byId("try-request").textContent = `${route.method} ${address}`;
    if (byId("try-body")) byId("try-body").textContent = JSON.stringify(body, null, 2);
  };

  // --- the answer, foldable
  const shownAtOnce = 100;
  const label = (value) => (Array.isArray(value) ? `list of ${value.length}` : `${Object.keys(value).length} fields`);
  const leaf = (name, value) => {
    const line = element("div", "api-leaf");
    if (name !== null) line.append(element("span", "quiet", `${name}: `));
    line.append(element("code", "", JSON.stringify(value)));
    return line;
  };
  const tree = (name, value, open) => {
    if (value === null || typeof value !== "object") return leaf(name, value);
    const box = element("details"), entries = Object.entries(value);
    box.append(element("summary", "", name === null ? label(value) : `${name} (${label(value)})`));
    let filled = false;
    // What is folded is not made: an answer may have a hundred thousand values.
    const fill = (from) => {
      entries.slice(from, from + shownAtOnce).forEach(([key, part]) => box.append(tree(key, part, false)));
      const rest = entries.length - from - shownAtOnce;
      if (rest <= 0) return;
      const more = element("button", "second", `${rest} more`);
      more.type = "button";
      more.addEventListener("click", () => { more.remove(); fill(from + shownAtOnce); });
      box.append(more);
    };
    box.addEventListener("toggle", () => { if (box.open && !filled) { filled = true; fill(0); } });
    if (open) { filled = true; fill(0); box.open = true; }
    return box;
  };
  const show = async (answer, started) => {
    const content = await answer.arrayBuffer(), time = performance.now() - started;
    const kind = (answer.headers.get("content-type") || "").split(";")[0];
    byId("try-answer").hidden = false;
    byId("try-status").textContent = `Status ${answer.status}, ${Math.round(time)} ms, ${content.byteLength.toLocaleString("en")} bytes`;
    byId("try-status").className = answer.ok ? "good" : "bad";
    const target = byId("try-tree"), link = byId("try-link");
    target.replaceChildren(); link.replaceChildren();
    if (kind !== "application/json") {
      const saved = element("a", "", "Save the answer");
      saved.href = URL.createObjectURL(new Blob([content])); saved.download = "answer.npy";
      link.append(saved, ` (${kind || "no type"})`);
      return;
    }
    const value = JSON.parse(new TextDecoder().decode(content));
    if (answer.ok && route.kind === "job" && value && Number.isInteger(value.id)) {
      const job = element("a", "", `Job ${value.id}`);
      job.href = `/jobs/${value.id}`;
      link.append("The work goes on as ", job, ".");
    }
    target.append(tree(null, value, true));
  };
  const send = async () => {
    const { address, body } = request(), started = performance.now(), button = byId("try-send");
    button.disabled = true;
    try {
      const headers = { accept: "application/json, */*" };
      const sent = route.method === "GET" ? {} : { method: "POST", body: JSON.stringify(body) };
      if (sent.method) { headers["content-type"] = "application/json"; headers["x-csrf-token"] = form.dataset.csrf; }
      await show(await fetch(address, { ...sent, headers, credentials: "same-origin" }), started);
    } catch (error) {
      byId("try-answer").hidden = false;
      byId("try-status").className = "bad";
      byId("try-status").textContent = `No answer: ${error.message}`;
      byId("try-tree").replaceChildren(); byId("try-link").replaceChildren();
    } finally {
      button.disabled = false;
    }
  };
  // A path without one of its names would be another route.
  const missing = () => route.fields.filter((field) => field.place === "path" && !byId(field.id).value.trim());
  const confirm = byId("try-confirm");
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const [first] = missing();
    if (first) { byId(first.id).setAttribute("aria-invalid", "true"); byId(first.id).focus(); return; }
    if (!confirm) { send(); return; }
    confirm.hidden = false;
    byId("try-yes").focus();
  });
  if (confirm) {
    byId("try-yes").addEventListener("click", () => { confirm.hidden = true; send(); });
    byId("try-no").addEventListener("click", () => { confirm.hidden = true; byId("try-send").focus(); });
  }
  form.addEventListener("input", (event) => { event.target.removeAttribute("aria-invalid"); if (confirm) confirm.hidden = true; preview(); });
  if (method) { method.addEventListener("change", () => { showDesign(); preview(); }); showDesign(); }
  window.addEventListener("pageshow", () => { if (method) showDesign(); preview(); });
  preview();
});

// A dropped folder becomes files of the upload form, and is checked at once.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const form = document.getElementById("upload"), zone = document.getElementById("drop");
  if (!form) return;
  const shown = document.getElementById("upload-chosen"), most = Number(form.dataset.mostBytes);
  const pickers = [...form.querySelectorAll('input[type="file"]')];
  let dropped = [];
  // Says what is chosen; false where it is more than the server takes.
  const tell = (files) => {
    const megabytes = files.reduce((sum, [, file]) => sum + file.size, 0) / 1e6, fits = megabytes * 1e6 <= most;
    shown.textContent = !files.length ? "No files are chosen." : `${files.length} files, ${megabytes.toFixed(1)} MB` +
      (fits ? "." : `: this server takes ${(most / 1e6).toFixed(0)} MB. Upload a part of them, or ask whoever operates the server.`);
    shown.classList.toggle("error", !fits);
    form.querySelectorAll("button").forEach((button) => { button.disabled = !fits; });
    return fits && files.length > 0;
  };
  const contents = (folder) => new Promise((resolve, reject) => {
    const reader = folder.createReader(), entries = [];
    const more = () => reader.readEntries((some) => { if (some.length) { entries.push(...some); more(); } else resolve(entries); }, reject);
    more();
  });
  const read = async (entry, path) => {
    if (entry.name.startsWith(".")) return [];
    if (entry.isFile) return [[path + entry.name, await new Promise((resolve, reject) => entry.file(resolve, reject))]];
    return (await Promise.all((await contents(entry)).map((child) => read(child, `${path}${entry.name}/`)))).flat();
  };
  const files = async (transfer) => {
    // Entries and files must be taken before the first wait: the browser empties the list of what was dropped.
    const items = [...transfer.items].filter((item) => item.kind === "file");
    const taken = items.map((item) => [item.webkitGetAsEntry && item.webkitGetAsEntry(), item.getAsFile()]);
    return (await Promise.all(taken.map(([entry, file]) => entry ? read(entry, "") : [[file.webkitRelativePath || file.name, file]]))).flat();
  };
  ["dragenter", "dragover"].forEach((name) => zone.addEventListener(name, (event) => { event.preventDefault(); zone.classList.add("over"); }));
  zone.addEventListener("dragleave", () => zone.classList.remove("over"));
  zone.addEventListener("drop", async (event) => {
    event.preventDefault();
    zone.classList.remove("over");
    try { dropped = await files(event.dataTransfer); } catch (error) { shown.textContent = `The browser could not read the folder: ${error.message}`; return; }
    pickers.forEach((picker) => { picker.value = ""; });
    if (tell(dropped)) form.requestSubmit(form.querySelector('button[name="dry_run"]'));
  });
  pickers.forEach((picker) => picker.addEventListener("change", () => {
    dropped = [];
    pickers.forEach((other) => { if (other !== picker) other.value = ""; });
    tell([...picker.files].map((file) => [file.name, file]));
  }));
  form.addEventListener("formdata", (event) => dropped.forEach(([path, file]) => event.formData.append("files", file, path)));
});

// The page of the demo: takes a file, has the worker do the job, shows the report, offers the results.
const find = (id) => document.getElementById(id);
const [drop, file, start, stop, status, log, report, downloads] =
  ["drop", "file", "start", "stop", "status", "log", "report", "downloads"].map(find);
let input = null;
let worker = null;
let clock = 0;

async function take(chosen) {
  if (!chosen) return;
  // The name becomes a path in the program's own file system.
  input = { name: chosen.name.replace(/[/\\]/g, "_"), bytes: new Uint8Array(await chosen.arrayBuffer()) };
  find("name").textContent = `${input.name} (${(input.bytes.length / 1e6).toFixed(1)} MB)`;
  start.disabled = false;
}

file.addEventListener("change", () => take(file.files[0]));
drop.addEventListener("dragover", (e) => { e.preventDefault(); drop.classList.add("over"); });
drop.addEventListener("dragleave", () => drop.classList.remove("over"));
drop.addEventListener("drop", (e) => {
  e.preventDefault();
  drop.classList.remove("over");
  take(e.dataTransfer.files[0]);
});
find("example").addEventListener("click", async () => {
  const answer = await fetch("vase.ply");
  await take(new File([await answer.arrayBuffer()], "vase.ply"));
  start.click();
});

function over(words) {
  clearInterval(clock);
  worker?.terminate();
  worker = null;
  start.disabled = input === null;
  stop.disabled = true;
  status.textContent = words;
  document.body.dataset.state = words.startsWith("Done") ? "done" : "over";
}

stop.addEventListener("click", () => over("Stopped."));
start.addEventListener("click", () => {
  const task = document.querySelector("input[name=task]:checked").value;
  const stem = input.name.replace(/\.[^.]*$/, "");
  const [surface, points, page] = [`${stem}-${task}.glb`, `${stem}-points.ply`, `${stem}-report.html`];
  const args = [task, `/${input.name}`, "-o", `/${surface}`, "--report", `/${page}`];
  const outputs = [page, surface];
  if (task === "denoise") {
    args.push("--points", `/${points}`, "--strength", find("strength").value || "1");
    if (find("uncertainty").checked) args.push("--uncertainty");
    outputs.push(points);
  }
  log.textContent = "";
  log.hidden = true;
  downloads.replaceChildren();
  report.replaceChildren();
  start.disabled = true;
  stop.disabled = false;
  delete document.body.dataset.state;
  const started = Date.now();
  clock = setInterval(() => {
    status.textContent = `At work for ${((Date.now() - started) / 1000).toFixed(0)} s`;
  }, 250);
  worker = new Worker("worker.js", { type: "module" });
  worker.onerror = (e) => over(`The work failed: ${e.message || "the worker cannot be loaded"}`);
  worker.onmessage = ({ data }) => {
    if (data.line !== undefined) {
      log.hidden = false;
      log.textContent += `${data.line}\n`;
    } else if (data.failed !== undefined) {
      over(`The work failed: ${data.failed}. The file may be damaged, or too large for a browser.`);
    } else if (data.code !== 0) {
      over("The work failed; the reason stands below.");
    } else {
      show(data, outputs, page);
      over(`Done in ${data.seconds.toFixed(1)} s.`);
    }
  };
  const bytes = input.bytes.slice();
  worker.postMessage({ name: input.name, bytes, args, outputs }, [bytes.buffer]);
});

function show(data, outputs, page) {
  for (const name of outputs) {
    const type = name.endsWith(".html") ? "text/html" : "application/octet-stream";
    const href = URL.createObjectURL(new Blob([data.files[name]], { type }));
    const link = document.createElement("a");
    Object.assign(link, { href, download: name, textContent: `Save ${name}` });
    downloads.append(link);
    if (name !== page) continue;
    const frame = document.createElement("iframe");
    frame.title = "report";
    frame.setAttribute("sandbox", "allow-scripts");
    frame.src = link.href;
    report.append(frame);
  }
}

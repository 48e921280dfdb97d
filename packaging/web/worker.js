// Runs the program once, in a file system in memory. In: {name, bytes, args, outputs}. Out: messages
// {line} for each line that the program says, then {code, seconds, files: {name: bytes}}, or {failed}.
import { ConsoleStdout, File, OpenFile, PreopenDirectory, WASI } from "./wasi/index.js";

onmessage = async ({ data: { name, bytes, args, outputs } }) => {
  try {
    const answer = await fetch("atlasfit.wasm");
    if (!answer.ok) throw new Error(`atlasfit.wasm: ${answer.status} ${answer.statusText}`);
    const module = await WebAssembly.compile(await answer.arrayBuffer());
    const folder = new PreopenDirectory("/", new Map([[name, new File(bytes)]]));
    const say = () => ConsoleStdout.lineBuffered((line) => postMessage({ line }));
    const wasi = new WASI(["atlasfit", ...args], [], [new OpenFile(new File([])), say(), say(), folder]);
    const instance = await WebAssembly.instantiate(module, { wasi_snapshot_preview1: wasi.wasiImport });
    const started = performance.now();
    const code = wasi.start(instance);
    const seconds = (performance.now() - started) / 1000;
    const files = {};
    for (const output of outputs) {
      const file = folder.dir.contents.get(output);
      if (file) files[output] = file.data;
    }
    postMessage({ code, seconds, files }, Object.values(files).map((f) => f.buffer));
  } catch (error) {
    postMessage({ failed: String(error) });
  }
};

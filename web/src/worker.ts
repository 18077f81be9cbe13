// Python in a worker: Pyodide, NumPy and levelhead, from the folder of this page alone.
import { parseBlock } from "./block";
import { serve, type Call } from "./call";
import { loadFilters, run } from "./modules";
import { readNumbers, type Numbers } from "./numbers";

const folder = new URL("pyodide/", self.location.href).href;

async function start(): Promise<{ python: any; view: any }> {
  const filters = loadFilters(), { loadPyodide } = await import(`${folder}pyodide.mjs`);
  const python = await loadPyodide({ indexURL: folder });
  await python.loadPackage("numpy", { messageCallback: () => {} });
  const answer = await fetch(new URL("levelhead.zip", self.location.href));
  if (!answer.ok) throw new Error("levelhead.zip is missing beside this page");
  python.unpackArchive(await answer.arrayBuffer(), "zip", { extractDir: "/levelhead" });
  python.FS.mkdirTree("/log");
  python.FS.chdir("/log");
  python.runPython("import os, sys; os.umask(0o22); sys.path.insert(0, '/levelhead')"); // Emscripten's umask denies all
  const make = python.runPython("from levelhead.publish.dashboard.browser import BrowserView; BrowserView"), loaded = await filters;
  const runs = (name: string, values: string, gyr: Float64Array, acc: Float64Array, mag: Float64Array | undefined, t: Float64Array) =>
    run(loaded.get(name), JSON.parse(values), { gyr, acc, mag, t });
  return { python, view: make(runs, python.toPy([...loaded.keys()]), numbers) };
}

let log: { path: string; bytes: Uint8Array } | null = null; // the file that Python reads

/** Columns of the file behind its `first` lines; null where it is not plain, so that Python reads it. */
function numbers(path: string, first: number, delimiter: string, width: number, wanted: any): Numbers | null {
  if (log === null || path !== log.path) return null;
  let begin = 0;
  for (let line = 0; line < first; line++) begin = log.bytes.indexOf(10, begin) + 1;
  const found = readNumbers(log.bytes, begin, delimiter.charCodeAt(0), width, wanted.toJs());
  wanted.destroy();
  return "cell" in found ? null : found;
}

const started = start();

serve(async ({ name, args, file }: Call) => {
  const { python, view } = await started;
  if (file !== undefined) {
    log = { path: file.name.replaceAll("/", "_"), bytes: new Uint8Array(file.bytes) };
    args.path = log.path;
    python.FS.writeFile(log.path, log.bytes); // where Python runs, so that it needs no folder
  }
  const found = view.call(name, JSON.stringify(args)), buffer = found.getBuffer("u8");
  const bytes = buffer.data.slice().buffer;
  buffer.release();
  found.destroy();
  return parseBlock(bytes);
});

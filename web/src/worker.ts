// Python in a worker: Pyodide, NumPy and levelhead, from the folder of this page alone.

export interface Call { id: number; name: string; args: Record<string, unknown>; file?: { name: string; bytes: ArrayBuffer } }
export interface Answer { id: number; bytes?: ArrayBuffer; failure?: string }

const folder = new URL("pyodide/", self.location.href).href;

/** The filters as modules of `levelhead export --wasm`: readings in, orientation out, the bits of Python. */
async function loadFilters(): Promise<Map<string, any>> {
  const answer = await fetch(new URL("filters/index.json", self.location.href)), loaded = new Map<string, any>();
  if (!answer.ok) return loaded;
  await Promise.all(Object.entries(await answer.json() as Record<string, string>).map(async ([name, folder]) => {
    const { Filter } = await import(new URL(`filters/${folder}/index.js`, self.location.href).href);
    loaded.set(name, await Filter.load());
  }));
  return loaded;
}

function runFilter(filter: any, values: string, gyr: Float64Array, acc: Float64Array, mag: Float64Array | undefined, t: Float64Array): object {
  for (const [name, value] of Object.entries(JSON.parse(values))) if (name in filter.parameters) filter.parameters[name] = value;
  filter.reset();
  return filter.updateRows({ gyr, acc, mag: mag ?? null, t });
}

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
  const run = (name: string, ...rest: [string, Float64Array, Float64Array, Float64Array | undefined, Float64Array]) => runFilter(loaded.get(name), ...rest);
  return { python, view: make(run, python.toPy([...loaded.keys()])) };
}

const started = start();

self.onmessage = async ({ data: { id, name, args, file } }: MessageEvent<Call>) => {
  const answer: Answer = { id };
  try {
    const { python, view } = await started;
    if (file !== undefined) {
      args.path = file.name.replaceAll("/", "_");
      python.FS.writeFile(args.path as string, new Uint8Array(file.bytes)); // where Python runs, so that it needs no folder
    }
    const found = view.call(name, JSON.stringify(args)), buffer = found.getBuffer("u8");
    answer.bytes = buffer.data.slice().buffer;
    buffer.release();
    found.destroy();
  } catch (error) {
    answer.failure = String((error as Error).message).trim().split("\n").at(-1);
  }
  self.postMessage(answer, { transfer: answer.bytes === undefined ? [] : [answer.bytes] });
};

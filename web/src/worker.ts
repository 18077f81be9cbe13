// Python in a worker: Pyodide, NumPy and levelhead, from the folder of this page alone.

export interface Call { id: number; name: string; args: Record<string, unknown>; file?: { name: string; bytes: ArrayBuffer } }
export interface Answer { id: number; bytes?: ArrayBuffer; failure?: string }

const folder = new URL("pyodide/", self.location.href).href;

async function start(): Promise<{ python: any; view: any }> {
  const { loadPyodide } = await import(`${folder}pyodide.mjs`);
  const python = await loadPyodide({ indexURL: folder });
  await python.loadPackage("numpy", { messageCallback: () => {} });
  const answer = await fetch(new URL("levelhead.zip", self.location.href));
  if (!answer.ok) throw new Error("levelhead.zip is missing beside this page");
  python.unpackArchive(await answer.arrayBuffer(), "zip", { extractDir: "/levelhead" });
  python.FS.mkdirTree("/log");
  python.FS.chdir("/log");
  python.runPython("import sys; sys.path.insert(0, '/levelhead')");
  return { python, view: python.runPython("from levelhead.publish.dashboard.browser import BrowserView; BrowserView()") };
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

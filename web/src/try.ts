// A log in the browser itself: a file is dropped, Python reads it in a worker, and the page shows it as `levelhead view` does.
import { App } from "./app";
import { parseBlock, type Block } from "./block";
import { byId, make } from "./dom";
import type { Source } from "./source";
import type { Answer, Call } from "./worker";

const HINTS: [string, string, string][] = [
  ["map", "columns", "gyr=gx,gy,gz acc=ax,ay,az"], ["units", "units", "gyr=deg/s acc=g"], ["counts", "counts", "gyr=131/deg/s"],
  ["rate", "rate, Hz", "100"],
];

class WorkerSource implements Source {
  private worker = new Worker("worker.js", { type: "module" });
  private waiting = new Map<number, (answer: Answer) => void>();
  private count = 0;

  constructor() {
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      this.waiting.get(data.id)?.(data);
      this.waiting.delete(data.id);
    };
  }

  private ask(call: Omit<Call, "id">): Promise<Answer> {
    const id = ++this.count;
    return new Promise((resolve) => {
      this.waiting.set(id, resolve);
      this.worker.postMessage({ ...call, id });
    });
  }

  async call(name: string, args: object = {}, file?: Call["file"]): Promise<Block> {
    const answer = await this.ask({ name, args: args as Record<string, unknown>, file });
    if (answer.bytes === undefined) throw new Error(answer.failure);
    const block = parseBlock(answer.bytes);
    if (block.header.error !== undefined) throw new Error(block.header.error);
    if (name === "about" && block.header.title === "simulate") block.header.title = "a simulated hand";
    return block;
  }

  stream(): void { /* a log does not grow */ }
}

const source = new WorkerSource();
let app: App | null = null, file: File | null = null;

/** Reads the file, or simulates one, with the hints of the form; then shows it. */
async function open(): Promise<void> {
  const state = byId("state"), hints = Object.fromEntries(HINTS.map(([name]) => [name, byId<HTMLInputElement>(`hint-${name}`).value]));
  state.textContent = file === null ? "Python starts, and simulates a hand …" : `Python starts, and reads ${file.name} …`;
  byId("message").hidden = true;
  try {
    const bytes = file === null ? undefined : { name: file.name, bytes: await file.arrayBuffer() };
    const { text } = (await source.call("open", bytes === undefined ? {} : hints, bytes)).header;
    state.textContent = "The filter runs …";
    app?.close();
    app = new App(source, source.call("about"));
    for (const id of ["main", "foot"]) byId(id).hidden = false;
    byId("intro").hidden = true;
    await app.start();
    addReports(text);
    byId("tools").prepend(make("button", { type: "button", id: "another", click: showIntro }, "Open …"));
  } catch (error) {
    const message = byId("message");
    message.textContent = (error as Error).message;
    message.hidden = false;
  }
  state.textContent = "";
}

/** What the reader found, the doctor's report, and on demand the symptoms and a comparison of the stretch that is shown. */
function addReports(columns: string): void {
  const card = (title: string, ...content: HTMLElement[]) => {
    const found = make("details", { class: "card" }, make("summary", {}, title), ...content);
    byId("side").append(found);
    return found;
  };
  const fill = async (place: HTMLElement, name: string) => {
    const text = make("pre", { tabindex: "0" }, "…");
    place.append(text);
    await source.call(name, { low: app!.time.low, high: app!.time.high }).then(
      ({ header }) => { text.textContent = header.text; }, (error: Error) => { text.textContent = error.message; });
  };
  if (columns) card("Columns and units", make("pre", { tabindex: "0" }, columns));
  void fill(card("Doctor"), "doctor");
  const answers = make("div", { role: "status" }), ask = make("button", { type: "button", id: "why", click: async () => {
    ask.disabled = true;
    answers.replaceChildren();
    for (const name of ["explain", "compare"]) await fill(answers, name);
    ask.disabled = false;
  } }, "Explain what is shown, and compare five filters");
  card("Why does it drift?", ask, answers);
}

function showIntro(): void {
  for (const id of ["main", "foot"]) byId(id).hidden = true;
  byId("intro").hidden = false;
}

function take(files: FileList | null): void {
  if (files === null || files.length === 0) return;
  file = files[0];
  void open();
}

function layOut(): void {
  const input = make("input", { type: "file", id: "file", hidden: true, change: () => take(input.files) });
  const drop = make("div", { class: "drop" },
    make("h2", {}, "Drop a log of an IMU here"),
    make("p", { class: "quiet" }, "CSV, text, MATLAB 5, ULog, Betaflight, KITTI and more. It stays in this browser."),
    make("button", { type: "button", class: "primary", click: () => input.click() }, "Choose a file"), input,
    make("button", { type: "button", id: "simulate", click: () => { file = null; void open(); } }, "or simulate a hand"),
    make("p", { id: "state", role: "status" }));
  const form = make("form", { class: "card", submit: (event: Event) => { event.preventDefault(); if (file !== null) void open(); } },
    make("h2", {}, "Where the reader is wrong"), make("p", { class: "quiet" }, "Leave these empty first. They are the options of levelhead fuse."),
    make("div", { class: "hints" }, ...HINTS.flatMap(([name, words, example]) => [
      make("label", { for: `hint-${name}` }, words), make("input", { id: `hint-${name}`, placeholder: example, autocomplete: "off", spellcheck: "false" }),
    ])), make("button", { type: "submit" }, "Read again"));
  byId("intro").append(make("div", {}, drop, form));
  for (const name of ["dragover", "dragenter"]) document.addEventListener(name, (event) => { event.preventDefault(); drop.classList.add("over"); });
  document.addEventListener("dragleave", () => drop.classList.remove("over"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    take(event.dataTransfer?.files ?? null);
  });
  byId("title").textContent = "levelhead in the browser";
}

layOut();

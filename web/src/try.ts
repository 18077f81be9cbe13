// A log in the browser itself: a file is dropped, a worker reads it, and the page shows it as `levelhead view` does.
import { App } from "./app";
import type { Block } from "./block";
import type { Answer, LogFile } from "./call";
import { byId, make } from "./dom";
import type { Source } from "./source";

/** What a person can say about the columns of the file. */
export interface ReaderForm {
  element: HTMLElement;
  hints(): object;
  /** Takes the answer to a call of "open"; gives a sentence about what is to be chosen first. */
  take(header: any): string;
}

class WorkerSource implements Source {
  private worker: Worker;
  private waiting = new Map<number, (answer: Answer) => void>();
  private count = 0;

  constructor(script: string) {
    this.worker = new Worker(script, { type: "module" });
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      this.waiting.get(data.id)?.(data);
      this.waiting.delete(data.id);
    };
  }

  async call(name: string, args: object = {}, file?: LogFile): Promise<Block> {
    const id = ++this.count, { block, failure } = await new Promise<Answer>((resolve) => {
      this.waiting.set(id, resolve);
      this.worker.postMessage({ id, name, args, file }, { transfer: file === undefined ? [] : [file.bytes] });
    });
    if (block === undefined) throw new Error(failure);
    if (block.header.error !== undefined) throw new Error(block.header.error);
    if (name === "about" && block.header.title === "simulate") block.header.title = "a simulated hand";
    return block;
  }

  stream(): void { /* a log does not grow */ }
}

/** The page; `example`: gives a log for those who have none, and nothing where the worker simulates one. */
export class TryPage {
  private source: WorkerSource;
  private app: App | null = null;
  private next: App | null = null; // without a log yet
  private file: File | null = null;
  private intro = make("section", { class: "intro", id: "intro", "aria-label": "Open a log" });

  constructor(script: string, words: string, private form: ReaderForm, private reports: boolean, private example: () => Promise<File | null>) {
    this.source = new WorkerSource(script);
    const input = make("input", { type: "file", id: "file", hidden: true, change: () => this.take(input.files) });
    const drop = make("div", { class: "drop" },
      make("h2", {}, "Drop a log of an IMU here"), make("p", { class: "quiet" }, words),
      make("button", { type: "button", class: "primary", click: () => input.click() }, "Choose a file"), input,
      make("button", { type: "button", id: "simulate", click: async () => { this.file = await this.example(); void this.open(); } }, "or simulate a hand"),
      make("p", { id: "state", role: "status" }));
    form.element.addEventListener("submit", (event) => { event.preventDefault(); void this.open(true); });
    this.intro.append(make("div", {}, drop, form.element));
    byId("main").before(this.intro);
    this.show(false);
    for (const name of ["dragover", "dragenter"]) document.addEventListener(name, (event) => { event.preventDefault(); drop.classList.add("over"); });
    document.addEventListener("dragleave", () => drop.classList.remove("over"));
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      this.take(event.dataTransfer?.files ?? null);
    });
  }

  /** The log, or the page's beginning. */
  private show(log: boolean): void {
    for (const id of ["main", "foot"]) byId(id).hidden = !log;
    this.intro.hidden = log;
  }

  private take(files: FileList | null): void {
    if (files === null || files.length === 0) return;
    this.file = files[0];
    void this.open();
  }

  /** Reads the file, or simulates one, with the hints of the form; then shows it. `again`: the worker has it. */
  private async open(again = false): Promise<void> {
    const state = byId("state"), { file } = this;
    if (again && file === null) return;
    state.textContent = file === null ? "The filter starts, and a hand is simulated …" : `${file.name} is read …`;
    byId("message").hidden = true;
    try {
      const asked = this.source.call("open", file === null ? {} : this.form.hints(), file === null || again ? undefined : { name: file.name, bytes: await file.arrayBuffer() });
      this.next ??= new App(this.source, () => this.source.call("about")); // while the worker reads
      const { header } = await asked;
      const open = this.form.take(header);
      if (open !== "") throw new Error(open);
      state.textContent = "The filter runs …";
      this.app?.close();
      [this.app, this.next] = [this.next, null];
      this.show(true);
      await this.app.start();
      this.addReports(header.text);
      byId("tools").prepend(make("button", { type: "button", id: "another", click: () => this.show(false) }, "Open …"));
    } catch (error) {
      const message = byId("message");
      message.textContent = (error as Error).message;
      message.hidden = false;
    }
    state.textContent = "";
  }

  /** What the reader found, the doctor's report, and on demand the symptoms and a comparison of the stretch that is shown. */
  private addReports(columns: string): void {
    const card = (title: string, ...content: HTMLElement[]) => {
      const found = make("details", { class: "card" }, make("summary", {}, title), ...content);
      byId("side").append(found);
      return found;
    };
    const fill = async (place: HTMLElement, name: string) => {
      const text = make("pre", { tabindex: "0" }, "…"), { low, high } = this.app!.time;
      place.append(text);
      await this.source.call(name, { low, high }).then(({ header }) => { text.textContent = header.text; }, (error: Error) => { text.textContent = error.message; });
    };
    if (columns) card("Columns and units", make("pre", { tabindex: "0" }, columns));
    if (!this.reports) return;
    void fill(card("Doctor"), "doctor");
    const answers = make("div", { role: "status" }), ask = make("button", { type: "button", id: "why", click: async () => {
      ask.disabled = true;
      answers.replaceChildren();
      for (const name of ["explain", "compare"]) await fill(answers, name);
      ask.disabled = false;
    } }, "Explain what is shown, and compare five filters");
    card("Why does it drift?", ask, answers);
  }
}

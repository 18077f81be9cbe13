// One page for every source: it fills the tracks and curves, lays out the parts, and lets them follow one time.
import { Attitude, type Quat } from "./attitude";
import type { Block } from "./block";
import type { Body, Ghost } from "./body";
import { Chart, type ChartContent, type Line } from "./chart";
import { Clock, Curve, DerivedCurve } from "./curve";
import { byId, make, replaceOthers, signed } from "./dom";
import { Health, type Moment } from "./health";
import { addKeys, showHelp } from "./keys";
import { ParameterPanel } from "./parameters";
import type { About, Filter, NodeEvent, NodeState, Source } from "./source";
import { Table } from "./table";
import { SPEEDS, Time } from "./time";
import { Timeline } from "./timeline";

export type AngleMode = "wrapped" | "continuous" | "quaternion";
const MODES: AngleMode[] = ["wrapped", "continuous", "quaternion"];
const OVERLAYS = ["second", "third", "fourth"]; // colours of the filters beside the first
const DEGREE = 180 / Math.PI;
const SILENCE = 600; // ms without a block, after which the server is dead
const MOST_ROWS = 400_000; // of a node, before the older half is dropped
const LISTED = 500;
const VECTORS = [
  { id: "bias", title: "Gyroscope bias", unit: "°/s", scale: DEGREE, digits: 3, least: 0.02 },
  { id: "gyr", title: "Angular rate", unit: "°/s", scale: DEGREE, digits: 2, least: 2 },
  { id: "acc", title: "Specific force", unit: "m/s²", scale: 1, digits: 3, least: 1 },
  { id: "mag", title: "Magnetic field", unit: "µT", scale: 1, digits: 2, least: 2 },
];
const TILT = [ // roll and pitch in degrees from a specific force
  (_: number, y: number, z: number) => DEGREE * Math.atan2(y, z),
  (x: number, y: number, z: number) => DEGREE * Math.atan2(-x, Math.sqrt(y * y + z * z)),
];

export class App {
  about!: About;
  time!: Time;
  mode: AngleMode = "wrapped";
  private clock = new Clock();
  private main = new Attitude("");
  private overlays: Attitude[] = [];
  private truth: Attitude | null = null;
  private vectors = new Map(VECTORS.map(({ id }) => [id, [new Curve(), new Curve(), new Curve()]]));
  private tilt = TILT.map((angle) => new DerivedCurve(this.vectors.get("acc")!, angle)); // by the accelerometer alone
  private filter: Filter = { name: "", parameters: [] };
  private health!: Health;
  private scene = make("div", { class: "scene" });
  private body: Body | null = null; // until the charts are drawn
  private timeline!: Timeline;
  private table!: Table;
  private charts = new Map<string, Chart>();
  private panel = new ParameterPanel((name, value) => this.setParameter(name, value));
  private wanted: Record<string, number | boolean> | null = null;
  private asking = false;
  private state: NodeState | null = null;
  private heard = 0;
  private lost = false;
  private dirty = { charts: true, cursor: true };
  private moments: Moment[] = [];
  private items = new WeakMap<Moment, HTMLElement>();
  private frames = 0;
  private drawn = ""; // what the body shows
  private over = new AbortController();
  private charted = ""; // which lines the charts of a node have

  /** `ask`: gives the answer to the call "about", which may be under way already. */
  constructor(private source: Source, private ask: () => Promise<Block>) {}

  async start(): Promise<void> {
    try {
      await this.open();
    } catch (error) {
      byId("status").textContent = "";
      this.tell(String((error as Error).message));
    }
  }

  /** Takes all of it off the page, for another source. */
  close(): void {
    this.over.abort();
    for (const id of ["side", "charts", "tools", "foot"]) byId(id).replaceChildren();
    delete document.body.dataset.ready;
  }

  /** Loads what there is, and shows it. */
  async open(): Promise<void> {
    byId("status").textContent = "the log is read …";
    const block = await this.ask();
    byId("status").textContent = "";
    this.about = block.header as About;
    const { kind, title, clock } = this.about;
    document.title = `${title}, levelhead`;
    document.body.classList.add(`kind-${kind}`);
    byId("title").textContent = title;
    this.time = new Time(this.clock, !!clock);
    this.health = new Health(this.about.health, this.time);
    this.timeline = new Timeline(this.time, this.health);
    this.table = new Table(this.time);
    this.time.onChange((change) => {
      if (change === "range") this.dirty.charts = true;
      if (change === "hover") for (const chart of this.charts.values()) chart.showValues();
      else this.dirty.cursor = true;
    });
    if (kind === "recording") await this.loadRecording(block);
    this.layOut();
    if (kind === "recording") {
      this.time.showAll();
      this.time.seek(this.time.first);
      this.listMoments(this.health.moments());
    } else {
      await this.loadBody(); // before samples come, which do not wait
      this.time.following = true;
      this.heard = performance.now();
      this.source.stream((block) => this.takeBlock(block), () => { this.lost = true; });
    }
    addKeys(this, this.over.signal);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour(), { signal: this.over.signal });
    requestAnimationFrame((now) => this.frame(now));
    document.body.dataset.ready = "true";
  }

  /** The body in space; what draws it takes longer than all charts. */
  private async loadBody(): Promise<void> {
    const { Body } = await import("./body");
    if (this.over.signal.aborted) return;
    this.body = new Body(this.scene);
    this.body.setRelative(this.main.relative);
    this.body.recolour();
    this.dirty.cursor = true;
  }

  // A recording

  private async loadRecording(block: Block): Promise<void> {
    const second = this.about.second;
    this.clock.append(block.columns.get("t")!.values);
    this.time.interval = this.clock.interval;
    this.takeVectors(block);
    this.takeTrack(block);
    if (block.columns.has("truth")) {
      this.truth = new Attitude("truth", this.main);
      this.truth.append({ header: {}, columns: new Map([["quat", block.columns.get("truth")!]]) });
    }
    if (second) this.addOverlay(await this.source.call("track", asked(second)));
  }

  /** The track of the first filter; those beside it keep their turns with it. */
  private takeTrack(block: Block): void {
    this.filter = block.header.filter;
    this.main.clear();
    this.main.name = this.filter.name;
    this.main.score = block.header.score ?? null;
    this.main.relative = block.header.relative;
    this.main.append(block);
    this.health.clear();
    this.health.append(block.columns.get("health")!.values);
    const bias = this.vectors.get("bias")!, column = block.columns.get("bias");
    for (const curve of bias) curve.clear();
    if (column !== undefined) bias.forEach((curve, k) => curve.append(column.values, column.rows, k, 3, DEGREE));
  }

  private takeVectors(block: Block): void {
    for (const { id, scale } of VECTORS) {
      const column = block.columns.get(id);
      if (column !== undefined) this.vectors.get(id)!.forEach((curve, k) => curve.append(column.values, column.rows, k, 3, scale));
    }
  }

  private addOverlay(block: Block): void {
    const overlay = new Attitude(block.header.filter.name, this.main);
    overlay.score = block.header.score ?? null;
    overlay.append({ header: {}, columns: new Map([["quat", block.columns.get("quat")!]]) });
    this.overlays.push(overlay);
  }

  async compareWith(name: string): Promise<void> {
    if (this.overlays.length >= OVERLAYS.length || this.overlays.some((one) => one.name === name)) return;
    try {
      this.addOverlay(await this.source.call("track", { filter: name }));
    } catch (error) {
      this.tell(String((error as Error).message));
    }
    this.rebuild();
  }

  private removeOverlay(overlay: Attitude): void {
    this.overlays = this.overlays.filter((one) => one !== overlay);
    this.rebuild();
  }

  async chooseFilter(name: string): Promise<void> {
    this.wanted = null;
    await this.fuse({ filter: name });
    this.panel.show(this.filter);
  }

  private async fuse(args: object): Promise<void> {
    try {
      const block = await this.source.call("track", args);
      this.takeTrack(block);
      this.tell("");
    } catch (error) {
      this.tell(String((error as Error).message));
      this.panel.show(this.filter);
      return;
    }
    this.listMoments(this.health.moments());
    this.rebuild();
  }

  private setParameter(name: string, value: number | boolean): void {
    this.wanted = { ...(this.wanted ?? {}), [name]: value };
    if (!this.asking) void this.askParameters();
  }

  /** One request at a time: while a slider moves, only its newest value counts. */
  private async askParameters(): Promise<void> {
    this.asking = true;
    while (this.wanted !== null) {
      const changes = this.wanted;
      this.wanted = null;
      if (this.about.kind === "recording") {
        await this.fuse({ filter: this.filter.name, values: { ...valuesOf(this.filter), ...changes } });
        if (this.wanted === null) this.panel.show(this.filter);
      } else {
        try {
          await this.source.call("set", { values: changes });
          this.tell("");
        } catch (error) {
          this.tell(String((error as Error).message));
          if (this.state?.filter) this.panel.show(this.state.filter);
        }
      }
    }
    this.asking = false;
  }

  async download(suffix: string): Promise<void> {
    const { low, high, interval } = this.time;
    try {
      if (this.about.suffixes === undefined) {
        save("levelhead.csv", new Blob([this.csv()]));
        return;
      }
      const args = { ...asked(this.filter), suffix, low, high: high + 0.5 * interval };
      const block = await this.source.call("download", args);
      save(block.header.name, new Blob([block.columns.get("file")!.values as Uint8Array<ArrayBuffer>]));
    } catch (error) {
      this.tell(String((error as Error).message));
    }
  }

  /** What is shown, as text: where no Python writes files. */
  private csv(): string {
    const columns = this.tableColumns(), rows = [["t [s]", ...columns.map(({ name, unit }) => `${name}${unit ? ` [${unit}]` : ""}`)].join(",")];
    for (let row = this.clock.rowFrom(this.time.low); row < this.clock.n && this.clock.values[row] <= this.time.high; row++) {
      rows.push([this.clock.values[row].toFixed(6), ...columns.map(({ curve }) => (Number.isFinite(curve.values[row]) ? curve.values[row] : ""))].join(","));
    }
    return `${rows.join("\n")}\n`;
  }

  // A node

  private takeBlock(block: Block): void {
    this.heard = performance.now();
    this.lost = false;
    const state = (this.state = block.header.state as NodeState), t = block.columns.get("t");
    if (t !== undefined) {
      if (this.clock.n > 0 && t.values[0] <= this.clock.last) this.clearRows(); // another node, or a clock that was set back
      this.clock.append(t.values);
      this.main.append(block);
      this.takeVectors(block);
      this.health.append(block.columns.get("health")!.values);
      if (this.clock.n > MOST_ROWS) this.dropRows(MOST_ROWS >> 1);
      if (this.clock.n > 20) this.time.interval = this.clock.interval;
      if (this.time.following) this.time.follow();
    }
    if (state.filter !== undefined) {
      this.main.name = state.filter.name;
      const known = JSON.stringify(this.filter), other = JSON.stringify(state.filter);
      this.filter = state.filter;
      if (known !== other && !this.asking) this.panel.show(state.filter);
    }
    this.main.relative = !this.hasMag();
    const charted = `${this.main.name} ${this.main.hasSigma} ${this.clock.n > 0} ${this.hasMag()}`;
    if (charted !== this.charted) {
      this.charted = charted;
      this.rebuild();
    }
    if (block.header.events?.length > 0) {
      const found = (block.header.events as NodeEvent[]).map(({ t: at, name, text, on, fault }) => ({ t: at, words: on || name ? `${name}: ${text}` : text, fault }));
      this.listMoments([...this.moments, ...found].slice(-LISTED));
    }
    this.showState();
  }

  private clearRows(): void {
    this.clock.clear();
    this.main.clear();
    this.health.clear();
    for (const curves of [...this.vectors.values(), this.tilt]) for (const curve of curves) curve.clear();
  }

  private dropRows(rows: number): void {
    this.clock.drop(rows);
    this.main.drop(rows);
    this.health.drop(rows);
    for (const curves of [...this.vectors.values(), this.tilt]) for (const curve of curves) curve.drop(rows);
  }

  private hasMag(): boolean {
    const { n, values } = this.vectors.get("mag")![0];
    for (let row = Math.max(0, n - 200); row < n; row++) if (Number.isFinite(values[row])) return true;
    return false;
  }

  /** Why the orientation of now may not be believed; "": it may. */
  private trouble(): string {
    if (this.about.kind === "recording") return "";
    if (this.lost || performance.now() - this.heard > SILENCE) return "levelhead view does not answer";
    const state = this.state;
    if (state === null) return "no orientation yet";
    if (state.failure) return state.failure;
    if (state.guide !== undefined) return "";
    if (state.seq === undefined) return "no orientation yet";
    if (!state.valid) return "the node is silent: this is its last orientation";
    return "";
  }

  private showState(): void {
    const trouble = this.trouble(), state = this.state, status = byId("status");
    document.body.classList.toggle("invalid", trouble !== "");
    let words = trouble;
    if (trouble === "" && state !== null && this.about.kind === "node") {
      words = `sample ${state.seq}, ${Math.round(1000 * (state.age ?? 0))} ms old`;
      if (state.offset !== undefined && state.offset !== null) {
        words += `, node's clock ${signed(1000 * state.offset)} ± ${(1000 * (state.uncertainty ?? 0)).toFixed(1)} ms`;
      }
    }
    if (state?.stamp !== undefined) status.dataset.stamp = String(Math.round(1000 * state.stamp));
    if (this.about.kind !== "recording") {
      if (status.textContent !== words) status.textContent = words;
      status.className = trouble === "" ? "" : "bad";
    }
    document.getElementById("starts")?.toggleAttribute("hidden", state?.seq !== undefined);
    const record = state?.record, button = document.getElementById("record");
    if (button !== null) {
      button.setAttribute("aria-pressed", String(!!record));
      const label = record ? `■ ${record.rows} samples` : "● Record";
      if (button.textContent !== label) button.textContent = label;
      button.title = record ? (record.failure || record.path) : "write all samples into a black box (r)";
      if (record?.failure) this.tell(record.failure);
    }
    const guide = state?.guide;
    if (guide !== undefined) {
      byId("guide-words").textContent = guide.words;
      byId<HTMLProgressElement>("guide-progress").value = guide.fraction;
      byId("guide-notes").replaceChildren(...guide.notes.map((note) => make("p", { class: "quiet" }, note)));
      if (guide.quat) this.body?.turn(guide.quat, null, [], trouble === "");
    }
    this.dirty.cursor = true;
  }

  /** From here on, where the node points now is yaw 0. */
  async zeroHeading(): Promise<void> {
    if (this.about.kind !== "node") return;
    try {
      await this.source.call("set", { values: { heading: 0 } });
      this.tell("");
    } catch (error) {
      this.tell(String((error as Error).message));
    }
  }

  async record(): Promise<void> {
    if (this.about.kind !== "node") return;
    const on = !this.state?.record, path = this.state?.record?.path;
    try {
      await this.source.call("record", { on });
      if (!on) this.tell(`written: ${path}`, false);
    } catch (error) {
      this.tell(String((error as Error).message));
    }
  }

  // The parts of the page

  private layOut(): void {
    const { kind } = this.about, side = byId("side");
    const readouts = make("dl", { class: "readouts" }, ...["roll", "pitch", "yaw"].map((name) =>
      make("div", {}, make("dt", {}, name), make("dd", { id: name }, "–"), make("dd", { id: `${name}-band` }))));
    const view = make("section", { class: "card view", "aria-label": "Orientation" }, this.scene,
      kind === "guide" ? null : readouts, make("div", { class: "facts", id: "facts" }));
    view.style.padding = "0";
    side.append(view);
    if (kind === "guide") {
      side.append(make("section", { class: "card guide", "aria-label": "Instruction" }, make("p", { id: "guide-words", role: "status" }),
        make("progress", { id: "guide-progress", max: "1", value: "0", "aria-label": "progress of the calibration" }), make("div", { id: "guide-notes" })));
      return;
    }
    if (this.about.starts?.length) {
      side.append(make("section", { class: "card", id: "starts", "aria-label": "Start a node" }, make("p", {}, "No orientation yet. Each of these starts a node here:"),
        ...this.about.starts.map((command) => make("pre", { tabindex: "0" }, command))));
    }
    if (kind === "recording") side.append(make("section", { class: "card", id: "filters", "aria-label": "Filters" }));
    const open = innerWidth > 700;
    side.append(
      make("details", { class: "card", open, id: "parameter-card" }, make("summary", {}, kind === "node" ? "Parameters of the node" : "Parameters"), this.panel.element),
      make("details", { class: "card", open, id: "event-card" }, make("summary", { id: "event-summary" }, "Events"), make("ol", { class: "events", id: "events" })),
    );
    if (this.about.notes?.length) {
      side.append(make("details", { class: "card" }, make("summary", {}, `Notes on the file (${this.about.notes.length})`), ...this.about.notes.map((note) => make("p", {}, note))));
    }
    if (kind === "recording") this.panel.show(this.filter);
    byId("charts").append(this.table.element, this.health.element);
    this.health.build();
    this.layOutTools();
    this.layOutFoot();
    this.rebuild();
  }

  private layOutTools(): void {
    const tools = byId("tools"), recording = this.about.kind === "recording";
    const mode = make("select", { id: "mode", "aria-label": "how angles are drawn", change: () => this.setMode(mode.value as AngleMode) },
      ...MODES.map((name) => make("option", { value: name }, name)));
    tools.append(mode,
      make("button", { type: "button", id: "table", "aria-pressed": "false", title: "samples as a table (t)", click: () => this.toggleTable() }, "Table"));
    if (this.about.kind === "node") tools.append(make("button", { type: "button", id: "zero", title: "yaw is 0 from here on (h)", click: () => void this.zeroHeading() }, "Heading 0°"));
    if (!recording) tools.append(make("button", { type: "button", id: "record", "aria-pressed": "false", click: () => void this.record() }, "● Record"));
    for (const suffix of this.about.suffixes ?? [".csv"]) {
      tools.append(make("button", { type: "button", title: "the shown stretch as a file (d)", click: () => void this.download(suffix) }, `↓ ${suffix.slice(1).toUpperCase()}`));
    }
    tools.append(make("button", { type: "button", "aria-label": "help and keys", title: "help and keys (?)", click: () => showHelp() }, "?"));
  }

  private layOutFoot(): void {
    const live = this.about.kind === "node", speed = make("select", { id: "speed", "aria-label": "speed", change: () => this.time.setSpeed(Number(speed.value)) },
      ...SPEEDS.map((value) => make("option", { value: String(value), selected: value === 1 }, `${value}×`)));
    const player = make("div", { class: "player" },
      make("button", { type: "button", class: "play", id: "play", "aria-label": "play", click: () => this.time.play(!this.time.playing) }, "▶"),
      live ? make("button", { type: "button", id: "follow", "aria-pressed": "true", title: "follow the newest sample (f)", click: () => this.follow() }, "Live") : null,
      speed, make("output", { id: "now", "aria-label": "time of the cursor" }),
      make("button", { type: "button", title: "all (0)", "aria-label": "show all", click: () => this.showAll() }, "⤢"));
    const rulers = make("div", { class: "rulers" }, this.timeline.slider, this.timeline.ruler, this.timeline.overview);
    byId("foot").append(player, rulers);
    this.time.onChange((change) => { if (change === "play") this.showPlayer(); });
  }

  follow(): void {
    if (this.about.kind === "node") this.time.follow();
  }

  showAll(): void {
    this.time.following = false;
    this.time.showAll();
  }

  setMode(mode: AngleMode): void {
    this.mode = mode;
    byId<HTMLSelectElement>("mode").value = mode;
    this.rebuild();
  }

  nextMode(): void {
    this.setMode(MODES[(MODES.indexOf(this.mode) + 1) % MODES.length]);
  }

  toggleTable(): void {
    byId("table").setAttribute("aria-pressed", String(this.table.toggle()));
  }

  nextView(): void {
    this.body?.nextView();
  }

  /** To the event after the cursor, or before it. */
  toEvent(step: 1 | -1): void {
    const margin = 0.5 * this.time.interval, times = this.moments.map(({ t }) => t);
    const found = step > 0 ? times.find((t) => t > this.time.at + margin) : times.findLast((t) => t < this.time.at - margin);
    if (found !== undefined) this.time.seek(found);
  }

  private contents(): ChartContent[] {
    const attitudes: [Attitude, string, boolean][] = [[this.main, "estimate", false]];
    this.overlays.forEach((one, k) => attitudes.push([one, OVERLAYS[k], false]));
    if (this.truth !== null) attitudes.push([this.truth, "truth", true]);
    const found: ChartContent[] = [];
    if (this.mode === "quaternion") {
      const colours = ["truth", "x", "y", "z"], lines: Line[] = [];
      for (const [attitude, , dash] of attitudes.filter(([one]) => one === this.main || one === this.truth)) {
        attitude.quat.forEach((curve, k) => lines.push({ label: `${dash ? "true " : ""}${"wxyz"[k]}`, colour: colours[k], curve, dash }));
      }
      found.push({ id: "quaternion", title: "Quaternion", unit: "body to earth", digits: 5, least: 0.1, lines });
    } else {
      const mode = this.mode;
      ["roll", "pitch", "yaw"].forEach((name, k) => {
        const lines: Line[] = attitudes.map(([attitude, colour, dash]) => {
          const { angle, above, below } = attitude[mode], band = attitude === this.main && attitude.hasSigma;
          return { label: attitude.name || "estimate", colour, curve: angle[k], dash, wraps: mode === "wrapped", band: band ? [above[k], below[k]] : undefined };
        });
        if (k < 2) lines.push({ label: "accelerometer", colour: "warm", curve: this.tilt[k], wraps: mode === "wrapped", optional: true });
        found.push({ id: name, title: name[0].toUpperCase() + name.slice(1), unit: "°", digits: 2, least: 4, lines, note: this.main.hasSigma ? "±2σ" : undefined });
      });
    }
    for (const { id, title, unit, digits, least } of VECTORS) {
      const curves = this.vectors.get(id)!;
      if (curves[0].n === 0 || (id === "mag" && this.about.kind === "node" && !this.hasMag())) continue;
      found.push({ id, title, unit, digits, least, lines: curves.map((curve, k) => ({ label: "xyz"[k], colour: "xyz"[k], curve })) });
    }
    return found;
  }

  /** Other lines: the charts, the table, the list of filters. */
  private rebuild(): void {
    const contents = this.contents(), place = byId("charts");
    for (const [id, chart] of this.charts) {
      if (!contents.some((content) => content.id === id)) {
        chart.element.remove();
        this.charts.delete(id);
      }
    }
    for (const content of contents) {
      let chart = this.charts.get(content.id);
      if (chart === undefined) {
        chart = new Chart(content, this.time);
        chart.element.classList.toggle("tall", ["roll", "pitch", "yaw", "quaternion"].includes(content.id));
        this.charts.set(content.id, chart);
      }
      place.append(chart.element);
    }
    const bias = this.charts.get("bias") ?? this.charts.get("gyr");
    if (bias !== undefined) bias.element.before(this.health.element);
    for (const content of contents) this.charts.get(content.id)!.setContent(content); // where each has its size
    this.table.setColumns(this.tableColumns(), (row) => this.health.words(row).map(({ words }) => words).join(", "));
    this.listFilters();
    this.body?.setRelative(this.main.relative);
    this.dirty.charts = this.dirty.cursor = true;
  }

  private tableColumns(): { name: string; unit: string; curve: Curve; digits: number }[] {
    const { quat, wrapped, sigmaTilt, sigmaHeading, hasSigma } = this.main;
    const columns = quat.map((curve, k) => ({ name: `q${"wxyz"[k]}`, unit: "", curve, digits: 6 }));
    ["roll", "pitch", "yaw"].forEach((name, k) => columns.push({ name, unit: "°", curve: wrapped.angle[k], digits: 3 }));
    if (hasSigma) columns.push({ name: "σ tilt", unit: "°", curve: sigmaTilt, digits: 3 }, { name: "σ heading", unit: "°", curve: sigmaHeading, digits: 3 });
    for (const { id, unit, digits } of VECTORS) {
      const curves = this.vectors.get(id)!;
      if (curves[0].n > 0) curves.forEach((curve, k) => columns.push({ name: `${id} ${"xyz"[k]}`, unit, curve, digits: digits + 1 }));
    }
    return columns;
  }

  private listFilters(): void {
    const card = document.getElementById("filters");
    if (card === null) return;
    const names = this.about.filters ?? [];
    const choose = make("select", { id: "filter", "aria-label": "filter", change: () => void this.chooseFilter(choose.value) },
      ...names.map(({ name, doc }) => make("option", { value: name, title: doc, selected: name === this.filter.name }, name)));
    const add = make("select", { id: "beside", "aria-label": "another filter beside it", change: () => void this.compareWith(add.value) },
      make("option", { value: "" }, "+ beside it"), ...names.filter(({ name }) => name !== this.filter.name && !this.overlays.some((one) => one.name === name))
        .map(({ name, doc }) => make("option", { value: name, title: doc }, name)));
    add.disabled = this.overlays.length >= OVERLAYS.length;
    const rows = [this.main, ...this.overlays].map((one, k) => {
      const swatch = make("i");
      swatch.style.setProperty("--swatch", `var(--${k === 0 ? "estimate" : OVERLAYS[k - 1]})`);
      const remove = k === 0 ? null : make("button", { type: "button", "aria-label": `remove ${one.name}`, click: () => this.removeOverlay(one) }, "×");
      const figures = [one.score?.tilt, one.score?.heading].map((value) => make("td", {}, value === undefined ? "" : `${value.toFixed(2)}°`));
      return make("tr", {}, make("td", {}, swatch, one.name), ...(this.truth === null ? [] : figures), make("td", {}, remove));
    });
    const head = make("tr", {}, make("th", { scope: "col" }, this.truth === null ? "filter" : "RMS error against truth"),
      ...(this.truth === null ? [] : ["tilt", "heading"].map((name) => make("th", { scope: "col" }, name))), make("th", { scope: "col", "aria-label": "remove" }));
    const focused = card.contains(document.activeElement) ? document.activeElement!.id : "";
    card.replaceChildren(make("div", { class: "choose" }, choose, add), make("table", { class: "filters" }, make("thead", {}, head), make("tbody", {}, ...rows)));
    if (focused) byId(focused).focus();
  }

  private listMoments(moments: Moment[]): void {
    this.moments = moments;
    const list = document.getElementById("events");
    if (list === null) return;
    const newest = this.about.kind === "node" ? moments.slice().reverse() : moments;
    byId("event-summary").textContent = moments.length === 0 ? "Events: none" : `Events (${moments.length})`;
    const items: HTMLElement[] = newest.slice(0, LISTED).map((moment) => this.momentItem(moment));
    if (moments.length > LISTED) items.push(make("li", { class: "quiet" }, `and ${moments.length - LISTED} more: keys ] and [ reach them`));
    replaceOthers(list, items);
  }

  /** The entry of an event; one that is listed already keeps its own. */
  private momentItem(moment: Moment): HTMLElement {
    const { t, words, fault } = moment, known = this.items.get(moment);
    if (known !== undefined) return known;
    const item = make("li", {}, make("button", { type: "button", class: fault ? "fault" : "", click: () => this.time.seek(t) }, make("time", {}, this.time.words(t)), words));
    this.items.set(moment, item);
    return item;
  }

  private recolour(): void {
    this.body?.recolour();
    for (const chart of this.charts.values()) chart.build();
    this.dirty.charts = this.dirty.cursor = true;
  }

  /** A sentence in the page's head; "": none. */
  tell(words: string, bad = true): void {
    const message = byId("message");
    message.textContent = words;
    message.hidden = words === "";
    message.style.background = bad ? "" : "var(--good)";
    if (!bad) setTimeout(() => { if (message.textContent === words) this.tell(""); }, 8000);
  }

  // Frames

  private last = 0;

  private frame(now: number): void {
    if (this.over.signal.aborted) return;
    if (this.time.playing) this.time.advance(Math.min(0.1, 0.001 * (now - this.last)));
    this.last = now;
    this.frames++;
    if (this.about.kind !== "recording" && this.frames % 6 === 0) this.showState();
    if (this.frames === 3 && this.body === null) setTimeout(() => void this.loadBody()); // the first one is on the screen
    const charts = [...this.charts.values()];
    if (this.dirty.charts) for (const chart of charts) chart.drawInView();
    else charts.find(({ stale }) => stale)?.draw();
    if (this.dirty.charts || this.dirty.cursor) this.showCursor();
    this.dirty.charts = this.dirty.cursor = false;
    this.body?.frame();
    requestAnimationFrame((next) => this.frame(next));
  }

  private showCursor(): void {
    for (const chart of this.charts.values()) chart.placeCursor();
    this.health.draw();
    this.timeline.draw();
    this.table.follow();
    this.showPlayer();
    if (this.clock.n > 0) this.showAttitude();
  }

  private showPlayer(): void {
    const play = document.getElementById("play"), follow = document.getElementById("follow");
    if (play === null) return;
    play.textContent = this.time.playing ? "❚❚" : "▶";
    play.setAttribute("aria-label", this.time.playing ? "pause" : "play");
    follow?.setAttribute("aria-pressed", String(this.time.following));
    byId<HTMLSelectElement>("speed").value = String(this.time.speed);
    byId("now").textContent = this.clock.n > 0 ? this.time.words(this.time.at, this.time.wallClock ? 2 : 3) : "–";
  }

  private showAttitude(): void {
    const row = this.clock.rowAt(this.time.at), main = this.main, quat = main.quatAt(row);
    const live = this.about.kind !== "node" || this.time.following, trouble = live ? this.trouble() : "";
    const health = this.health.words(row), faults = health.filter(({ fault }) => fault);
    const doubt = main.hasSigma ? { tilt: main.sigmaTilt.values[row] / DEGREE, heading: main.sigmaHeading.values[row] / DEGREE } : null;
    const ghosts: Ghost[] = this.overlays.map((one, k) => ({ quat: one.quatAt(row), colour: OVERLAYS[k] }));
    if (this.truth !== null) ghosts.push({ quat: this.truth.quatAt(row), colour: "truth" });
    const valid = trouble === "" && faults.length === 0, drawn = JSON.stringify([quat, doubt, ghosts, valid]);
    if (this.body !== null && drawn !== this.drawn) {
      this.body.turn(quat as Quat, doubt, ghosts, valid);
      this.drawn = drawn;
    }
    ["roll", "pitch", "yaw"].forEach((name, k) => {
      byId(name).textContent = `${signed(main.wrapped.angle[k].values[row])}°`;
      const band = 2 * (k < 2 ? main.sigmaTilt : main.sigmaHeading).values[row];
      byId(`${name}-band`).textContent = main.hasSigma && Number.isFinite(band) ? (band < 90 ? `±${band.toFixed(1)}° (2σ)` : "not known yet") : "";
    });
    const yaw = main.wrapped.angle[2].values[row], facts = [
      ...(trouble ? [make("span", { class: "fault" }, trouble)] : []),
      ...faults.map(({ words }) => make("span", { class: "fault" }, words)),
      ...health.filter(({ fault }) => !fault).map(({ words }) => make("span", {}, words)),
      make("span", {}, main.relative ? "heading counts from the start" : `bearing ${((450 - yaw) % 360).toFixed(0).padStart(3, "0")}°`),
    ];
    const place = byId("facts"), key = facts.map((fact) => fact.className + fact.textContent).join("|");
    if (place.dataset.key !== key) {
      place.dataset.key = key;
      place.replaceChildren(...facts);
    }
  }
}

const valuesOf = (filter: Filter) =>
  Object.fromEntries(filter.parameters.filter(({ value }) => value !== null).map(({ name, value }) => [name, value]));

const asked = (filter: Filter) => ({ filter: filter.name, values: valuesOf(filter) });

/** Hands a file to the browser's downloads. */
function save(name: string, content: Blob): void {
  const link = make("a", { href: URL.createObjectURL(content), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

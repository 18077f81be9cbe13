// The samples around the cursor as rows of numbers.
import type { Curve } from "./curve";
import { make } from "./dom";
import type { Time } from "./time";

export interface TableColumn { name: string; unit: string; curve: Curve; digits: number }
const ROW = 24; // pixels

export class Table {
  readonly element = make("section", { class: "table", "aria-label": "Samples", hidden: true, tabindex: "0" });
  private table = make("table");
  private top = 0;
  private columns: TableColumn[] = [];
  private words: (row: number) => string = () => "";

  constructor(private time: Time) {
    this.element.append(this.table);
    this.element.addEventListener("wheel", (event) => {
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) return;
      event.preventDefault();
      this.move(Math.sign(event.deltaY) * Math.max(1, Math.round(Math.abs(event.deltaY) / ROW)));
    }, { passive: false });
    this.element.addEventListener("keydown", (event) => {
      const rows = ({ ArrowDown: 1, ArrowUp: -1, PageDown: this.size - 1, PageUp: 1 - this.size } as Record<string, number>)[event.key];
      if (rows === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.time.step(rows);
    });
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  setColumns(columns: TableColumn[], words: (row: number) => string): void {
    this.columns = columns;
    this.words = words;
    this.draw();
  }

  toggle(): boolean {
    this.element.hidden = !this.element.hidden;
    if (!this.element.hidden) this.follow();
    return !this.element.hidden;
  }

  private get size(): number {
    return Math.max(3, Math.floor((this.element.clientHeight - 34) / ROW));
  }

  private move(rows: number): void {
    this.top = Math.min(Math.max(0, this.top + rows), Math.max(0, this.time.clock.n - this.size));
    this.draw();
  }

  /** Keeps the row of the cursor in sight. */
  follow(): void {
    if (this.element.hidden) return;
    const row = this.time.clock.rowAt(this.time.at);
    if (row < this.top || row >= this.top + this.size) this.top = Math.max(0, row - (this.size >> 1));
    this.draw();
  }

  draw(): void {
    if (this.element.hidden || this.time.clock.n === 0) return;
    const { clock, at } = this.time, marked = clock.rowAt(at), last = Math.min(clock.n, this.top + this.size);
    const head = make("tr", {}, make("th", { scope: "col" }, "row"), make("th", { scope: "col" }, "t"),
      ...this.columns.map(({ name, unit }) => make("th", { scope: "col" }, name, make("small", {}, unit ? ` ${unit}` : ""))), make("th", { scope: "col" }, "health"));
    const rows: HTMLElement[] = [];
    for (let row = this.top; row < last; row++) {
      const line = make("tr", { class: row === marked ? "now" : "", click: () => this.time.seek(clock.values[row]) },
        make("td", {}, String(row)), make("td", {}, this.time.words(clock.values[row], 4)),
        ...this.columns.map(({ curve, digits }) => {
          const value = curve.values[row];
          return make("td", {}, Number.isFinite(value) ? value.toFixed(digits).replace("-", "−") : "–");
        }), make("td", { class: "words" }, this.words(row)));
      if (row === marked) line.setAttribute("aria-current", "true");
      rows.push(line);
    }
    this.table.replaceChildren(make("thead", {}, head), make("tbody", {}, ...rows));
  }
}

// The health of the samples: a lane for each bit that occurs, with its words, and the changes as events.
import { AXIS, MARGIN } from "./chart";
import { colour, fitCanvas, make } from "./dom";
import type { HealthName } from "./source";
import type { Time } from "./time";

export interface Moment { t: number; words: string; fault: boolean }

export class Health {
  bits = new Uint32Array(1024);
  n = 0;
  present = 0; // bits of all rows
  readonly element = make("section", { class: "health", "aria-label": "Health of the samples" });
  private faults: number;
  private lanes: { name: HealthName; canvas: HTMLCanvasElement; row: HTMLElement }[] = [];

  constructor(private names: HealthName[], private time: Time) {
    this.faults = names.reduce((all, { bit, fault }) => (fault ? all | bit : all), 0);
    this.element.addEventListener("click", (event) => {
      const lane = (event.target as Element).closest("canvas");
      if (lane === null) return;
      const box = lane.getBoundingClientRect(), { low, high } = this.time;
      this.time.seek(low + ((event.clientX - box.left) / box.width) * (high - low));
    });
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  append(bits: ArrayLike<number>): void {
    if (this.n + bits.length > this.bits.length) {
      const larger = new Uint32Array(Math.max(this.n + bits.length, Math.ceil(1.5 * this.bits.length)));
      larger.set(this.bits);
      this.bits = larger;
    }
    this.bits.set(bits, this.n);
    this.n += bits.length;
    const before = this.present;
    for (let i = 0; i < bits.length; i++) this.present |= bits[i];
    if (this.present !== before) this.build();
  }

  clear(): void {
    this.n = this.present = 0;
    this.build();
  }

  drop(rows: number): void {
    this.bits.copyWithin(0, rows, this.n);
    this.n -= rows;
  }

  words(row: number): HealthName[] {
    const bits = row >= 0 && row < this.n ? this.bits[row] : 0;
    return this.names.filter(({ bit }) => bits & bit);
  }

  isFault(row: number): boolean {
    return (this.bits[row] & this.faults) !== 0;
  }

  /** When bits of a fault began. */
  moments(): Moment[] {
    const found: Moment[] = [];
    for (let row = 1; row < this.n; row++) {
      const began = this.bits[row] & ~this.bits[row - 1] & this.faults;
      if (began === 0) continue;
      const words = this.names.filter(({ bit }) => began & bit).map((name) => name.words).join(", ");
      found.push({ t: this.time.clock.values[row], words, fault: true });
    }
    return found;
  }

  build(): void {
    this.lanes = this.names.filter(({ bit }) => this.present & bit).map((name) => {
      const canvas = make("canvas", { role: "img", "aria-label": `when: ${name.words}` });
      const row = make("div", { class: `lane ${name.fault ? "fault" : ""}` }, make("span", {}, name.words), canvas);
      return { name, canvas, row };
    });
    this.element.replaceChildren(make("header", {}, make("h2", {}, "Health")), ...(this.lanes.length > 0
      ? this.lanes.map(({ row }) => row) : [make("p", { class: "quiet" }, "nothing was wrong with any sample")]));
    this.element.style.setProperty("--axis", `${AXIS}px`);
    this.element.style.setProperty("--margin", `${MARGIN}px`);
    this.draw();
  }

  draw(): void {
    const { clock, low, high, at } = this.time;
    for (const { name, canvas } of this.lanes) {
      const { context, width, height } = fitCanvas(canvas);
      if (width === 0) continue;
      context.fillStyle = colour(name.fault ? "bad" : "good");
      let row = Math.max(0, clock.rowFrom(low) - 1);
      for (let pixel = 0; pixel < width; pixel++) {
        const end = Math.min(this.n, clock.rowFrom(low + ((pixel + 1) / width) * (high - low)));
        let found = row > 0 && end === row ? this.bits[row - 1] & name.bit : 0;
        for (; row < end && found === 0; row++) found = this.bits[row] & name.bit;
        row = Math.max(row, end);
        if (found) context.fillRect(pixel, 0, 1, height);
      }
      const x = ((at - low) / (high - low)) * width;
      context.fillStyle = colour("ink");
      if (x >= 0 && x <= width) context.fillRect(x - 0.75, 0, 1.5, height);
    }
  }
}

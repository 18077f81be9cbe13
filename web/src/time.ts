// The one time of the page: what is shown, where the cursor is, and whether it moves.
import type { Clock } from "./curve";

export type Change = "range" | "cursor" | "hover" | "play";
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const LEAST = 5; // usual intervals: no shorter stretch is shown

export class Time {
  low = 0;
  high = 1;
  at = 0;
  hover: number | null = null;
  playing = false;
  speed = 1;
  following = false; // the newest sample of a node
  window = 20; // s of a node that are shown
  interval = 0.01;
  private listeners: ((change: Change) => void)[] = [];

  constructor(readonly clock: Clock, readonly wallClock: boolean) {}

  onChange(listener: (change: Change) => void): void {
    this.listeners.push(listener);
  }

  private tell(change: Change): void {
    for (const listener of this.listeners) listener(change);
  }

  get first(): number { return this.clock.first; }
  get last(): number { return Math.max(this.clock.last, this.first + this.interval); }
  get all(): boolean { return this.low <= this.first && this.high >= this.last; }

  show(low: number, high: number): void {
    const length = Math.min(Math.max(high - low, LEAST * this.interval), this.last - this.first);
    const middle = 0.5 * (low + high);
    let from = length < high - low || length > high - low ? middle - 0.5 * length : low;
    from = Math.min(Math.max(from, this.first), this.last - length);
    this.low = from;
    this.high = from + length;
    this.tell("range");
  }

  showAll(): void { this.show(this.first, this.last); }

  zoom(factor: number, about = this.at): void {
    this.following = false;
    const centre = about >= this.low && about <= this.high ? about : 0.5 * (this.low + this.high);
    this.show(centre - (centre - this.low) * factor, centre + (this.high - centre) * factor);
  }

  pan(share: number): void {
    this.following = false;
    const step = share * (this.high - this.low);
    const moved = Math.min(Math.max(step, this.first - this.low), this.last - this.high);
    this.show(this.low + moved, this.high + moved);
  }

  seek(time: number, keepInView = true): void {
    this.at = Math.min(Math.max(time, this.first), this.last);
    if (this.at < this.last - this.interval) this.following = false;
    if (keepInView && (this.at < this.low || this.at > this.high)) {
      const half = 0.5 * (this.high - this.low);
      this.show(this.at - half, this.at + half);
    }
    this.tell("cursor");
  }

  step(rows: number): void {
    const row = Math.min(Math.max(this.clock.rowAt(this.at) + rows, 0), this.clock.n - 1);
    this.seek(this.clock.values[row]);
  }

  point(time: number | null): void {
    this.hover = time;
    this.tell("hover");
  }

  play(on: boolean): void {
    if (on && this.at >= this.last) this.at = this.first;
    this.playing = on;
    this.tell("play");
  }

  follow(): void {
    this.following = true;
    this.playing = false;
    this.at = this.last;
    this.low = Math.max(this.first, this.last - this.window);
    this.high = Math.max(this.last, this.low + Math.min(this.window, 1));
    this.tell("range");
    this.tell("cursor");
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.tell("play");
  }

  /** One frame of `seconds` further. */
  advance(seconds: number): void {
    const to = this.at + seconds * this.speed;
    if (to >= this.last) this.play(false);
    this.seek(to);
  }

  /** A time for people: s since the beginning, or the clock's. */
  words(time: number, digits = 2): string {
    if (!this.wallClock) return `${(time - this.first).toFixed(digits)} s`;
    return clockWords(time, digits);
  }
}

export function clockWords(time: number, digits = 3): string {
  const date = new Date(1000 * time), two = (value: number) => String(value).padStart(2, "0");
  const seconds = (date.getSeconds() + (time - Math.floor(time))).toFixed(digits).padStart(digits > 0 ? 3 + digits : 2, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${seconds}`;
}

// One chart: its curves over the shown stretch of time, their values at the cursor, and the gestures on it.
import uPlot from "uplot";
import type { Curve } from "./curve";
import { decimate } from "./decimate";
import { colour, make } from "./dom";
import type { Time } from "./time";

export const AXIS = 54; // pixels left of every chart and of the ruler
export const MARGIN = 12; // pixels right of them
const LETTER = 6.5; // pixels that a letter of a tick takes at most, on average
const ANGLE_STEPS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1800, 3600];
type Values = ArrayLike<number | null | undefined>;
const STEEP = 4; // pixels up and down a point, beyond which a curve is drawn as columns
const SPIKES = 0.004; // share of values at either end that do not widen a chart

/** `optional`: hidden until its name is clicked. */
export interface Line {
  label: string; colour: string; curve: Curve; wraps?: boolean; dash?: boolean; optional?: boolean; band?: [Curve, Curve];
}
export interface ChartContent { id: string; title: string; unit: string; digits: number; least: number; lines: Line[]; note?: string; ruler?: boolean }

export class Chart {
  readonly element: HTMLElement;
  stale = false; // the curves have changed since it was drawn
  private plot: uPlot | null = null;
  private host: HTMLElement;
  private legend: HTMLElement;
  private cursor: HTMLElement;
  private toggled = new Set<string>(); // lines that were shown or hidden by their name
  private content: ChartContent;
  private values: HTMLElement[] = [];
  private dense = false; // whether each pixel has its minimum and maximum
  private bands: { fill: string; above: (number | null)[]; below: (number | null)[] }[] = [];

  constructor(content: ChartContent, private time: Time) {
    this.content = content;
    this.legend = make("div", { class: "legend" });
    this.host = make("div", { class: "plot" });
    this.cursor = make("div", { class: "cursor" });
    this.element = make("section", { class: "chart", id: `chart-${content.id}`, "aria-label": content.title },
      make("header", {}, make("h2", {}, content.title, make("small", {}, ` ${content.unit}`)), this.legend), this.host);
    new ResizeObserver(() => this.resize()).observe(this.host);
    this.addGestures();
  }

  /** Other curves, or the same ones with other values: those keep their plot. */
  setContent(content: ChartContent): void {
    const known = this.plot !== null && sameLines(this.content, content);
    this.content = content;
    if (!known) this.build();
  }

  private get shown(): Line[] {
    return this.content.lines.filter((line) => this.isShown(line));
  }

  private isShown(line: Line): boolean {
    return this.toggled.has(line.label) === !!line.optional;
  }

  /** Makes the plot anew: other lines or other colours. */
  build(): void {
    this.plot?.destroy();
    this.plot = null;
    const { width, height } = this.host.getBoundingClientRect();
    if (width < 10 || height < 10) return;
    const series: uPlot.Series[] = [{}, ...this.shown.map((line) => ({
      stroke: colour(line.colour), paths: () => null,
      points: { show: (_: uPlot, __: number, from: number, to: number) => to - from < 60, size: 4 },
    }))];
    const grid = { stroke: colour("grid"), width: 1 }, font = "11px system-ui, sans-serif";
    this.plot = new uPlot({
      width, height, series, legend: { show: false }, padding: [6, MARGIN, 4, 0],
      cursor: { drag: { x: true, y: false, setScale: false, dist: 4 }, y: false, points: { size: 6 }, sync: { key: "time" } },
      scales: { x: { time: false, range: () => [this.time.low, this.time.high] }, y: { range: (plot) => this.range(plot) } },
      axes: [
        {
          size: this.content.ruler ? 22 : 0, font, stroke: colour("soft"), grid, ticks: { show: false }, gap: 2,
          values: (plot, splits) => splits.map((t) => (this.content.ruler ? this.tick(plot, t, splits[1] - splits[0]) : "")),
        },
        {
          size: AXIS, font, stroke: colour("soft"), grid, ticks: { show: false }, gap: 6,
          space: 24, incrs: this.content.unit === "°" ? ANGLE_STEPS : undefined, values: (_, splits) => splits.map(axisWords),
        },
      ],
      hooks: {
        drawAxes: [(plot) => this.drawLines(plot)],
        setSelect: [(plot) => {
          if (plot.select.width < 4) return;
          const [low, high] = [plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x")];
          plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          this.time.following = false;
          this.time.show(low, high);
        }],
        setCursor: [(plot) => {
          if (plot.cursor.event !== undefined && plot.over.matches(":hover")) {
            const left = plot.cursor.left ?? -1;
            this.time.point(left >= 0 ? plot.posToVal(left, "x") : null);
          }
        }],
      },
    }, [[], ...series.slice(1).map(() => [])] as uPlot.AlignedData, this.host);
    this.plot.over.append(this.cursor);
    this.buildLegend();
  }

  /** The words of a tick; none where the chart's edge would cut them. */
  private tick(plot: uPlot, t: number, step: number): string {
    const words = this.time.words(t, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));
    const { low, high } = this.time, room = MARGIN + ((high - t) / (high - low)) * (plot.width - AXIS - MARGIN);
    return room < 0.5 * LETTER * words.length ? "" : words;
  }

  private buildLegend(): void {
    this.values = [];
    this.legend.replaceChildren(...this.content.lines.map((line) => {
      const value = make("output", {}, "");
      this.values.push(value);
      const swatch = make("i", { class: line.dash ? "dash" : "" });
      swatch.style.setProperty("--swatch", `var(--${line.colour})`);
      return make("button", {
        type: "button", "aria-pressed": String(this.isShown(line)), title: `show or hide ${line.label}`,
        click: () => {
          if (!this.toggled.delete(line.label)) this.toggled.add(line.label);
          this.build();
          this.draw();
        },
      }, swatch, line.label, value);
    }), ...(this.content.note ? [make("span", { class: "note" }, this.content.note)] : []));
    this.showValues();
  }

  /** ±2σ as areas, and the lines on them. uPlot's own lines leave a trace in narrow gaps, and their round joins take long. */
  private drawLines(plot: uPlot): void {
    const context = plot.ctx, { left, top, width, height } = plot.bbox;
    context.save();
    context.beginPath();
    context.rect(left, top, width, height);
    context.clip();
    const x = Array.from(plot.data[0], (t) => plot.valToPos(t, "x", true));
    const { min, max } = plot.scales.y, slope = -height / (max! - min!), base = top + height - slope * min!;
    for (const { fill, above, below } of this.bands) {
      context.fillStyle = fill;
      for (let first = 0; first < x.length; first++) {
        if (above[first] === null || below[first] === null) continue;
        let end = first;
        while (end < x.length && above[end] !== null && below[end] !== null) end++;
        context.beginPath();
        for (let i = first; i < end; i++) context.lineTo(x[i], base + slope * above[i]!);
        for (let i = end - 1; i >= first; i--) context.lineTo(x[i], base + slope * below[i]!);
        context.fill();
        first = end;
      }
    }
    context.lineJoin = "bevel";
    const lines = this.shown;
    for (let k = lines.length - 1; k >= 0; k--) { // the first line lies on top
      const line = lines[k], y = plot.data[k + 1];
      context.strokeStyle = context.fillStyle = colour(line.colour);
      if (this.dense && travel(y) * Math.abs(slope) > STEEP * x.length) {
        fillColumns(context, x, y, base, slope, 1.3 * devicePixelRatio);
        continue;
      }
      context.lineWidth = 1.3 * devicePixelRatio;
      context.setLineDash(line.dash && x.length < width ? [5 * devicePixelRatio, 4 * devicePixelRatio] : []);
      context.beginPath();
      let drawing = false;
      for (let i = 0; i < x.length; i++) {
        const value = y[i];
        if (value === null || value === undefined) { drawing = false; continue; }
        if (drawing) context.lineTo(x[i], base + slope * value);
        else context.moveTo(x[i], base + slope * value);
        drawing = true;
      }
      context.stroke();
    }
    context.restore();
  }

  /** The y axis ends where the lines do; single spikes and bands do not widen it. */
  private range(plot: uPlot): [number, number] {
    const values = Float64Array.from(plot.data.slice(1).flatMap((column) => (column as (number | null)[]).filter((value) => value !== null)));
    if (values.length === 0) return [-this.content.least, this.content.least];
    values.sort();
    const cut = values.length > 200 ? Math.floor(SPIKES * values.length) : 0;
    const low = values[cut], high = values[values.length - 1 - cut];
    const margin = Math.max(0.12 * (high - low), 0.5 * (this.content.least - (high - low)));
    return [low - margin, high + margin];
  }

  /** Draws it where it is seen; elsewhere it is stale, and drawn when there is time. */
  drawInView(): void {
    const { top, bottom } = this.host.getBoundingClientRect();
    this.stale = bottom < 0 || top > innerHeight;
    if (!this.stale) this.draw();
  }

  draw(): void {
    const plot = this.plot;
    this.stale = false;
    if (plot === null) return;
    const lines = this.shown, banded = lines.filter((line) => line.band !== undefined);
    for (const { curve } of lines) curve.extend();
    const curves: Curve[] = [...lines.map((line) => line.curve), ...banded.flatMap((line) => line.band!)];
    const wraps = [...lines.map((line) => !!line.wraps), ...banded.flatMap((line) => [!!line.wraps, !!line.wraps])];
    const pixels = Math.max(50, Math.round((plot.bbox.width / devicePixelRatio) || 300));
    const { x, ys, dense } = decimate(this.time.clock, curves, wraps, this.time.low, this.time.high, pixels, this.time.interval);
    this.dense = dense;
    this.bands = banded.map((line, k) => ({
      fill: mixed(colour(line.colour), 0.22), above: ys[lines.length + 2 * k], below: ys[lines.length + 2 * k + 1],
    }));
    plot.setData([x, ...ys.slice(0, lines.length)] as uPlot.AlignedData, true);
    this.placeCursor();
  }

  placeCursor(): void {
    if (this.plot === null) return;
    const { low, high, at } = this.time, share = (at - low) / (high - low);
    this.cursor.hidden = !(share >= 0 && share <= 1);
    this.cursor.style.transform = `translateX(${(share * this.plot.bbox.width) / devicePixelRatio}px)`;
    this.showValues();
  }

  showValues(): void {
    const row = this.time.clock.rowAt(this.time.hover ?? this.time.at);
    this.content.lines.forEach((line, k) => {
      const value = line.curve.values[row], known = row >= 0 && row < line.curve.n && Number.isFinite(value);
      if (!this.values[k]) return;
      this.values[k].textContent = !this.isShown(line) ? "" : known ? value.toFixed(this.content.digits).replace("-", "−") : "–";
    });
  }

  private resize(): void {
    const { width, height } = this.host.getBoundingClientRect();
    if (this.plot === null) this.build();
    else if (width < 10 || height < 10 || (width === this.plot.width && height === this.plot.height)) return;
    else this.plot.setSize({ width, height });
    this.draw();
  }

  private addGestures(): void {
    let downAt = 0;
    const inside = (event: MouseEvent | PointerEvent) => (event.target as Element).closest(".u-over") as HTMLElement | null;
    const timeOf = (event: MouseEvent | Touch, over: HTMLElement) => {
      const box = over.getBoundingClientRect();
      return this.time.low + ((event.clientX - box.left) / box.width) * (this.time.high - this.time.low);
    };
    this.host.addEventListener("pointerdown", (event) => { downAt = event.clientX; }, true);
    this.host.addEventListener("click", (event) => {
      const over = inside(event);
      if (over !== null && Math.abs(event.clientX - downAt) < 4) this.time.seek(timeOf(event, over));
    });
    this.host.addEventListener("dblclick", () => this.time.showAll());
    this.host.addEventListener("mouseleave", () => this.time.point(null));
    this.host.addEventListener("wheel", (event) => {
      const over = inside(event);
      if (over === null || !(event.ctrlKey || event.metaKey || event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY))) return;
      event.preventDefault();
      if (event.ctrlKey || event.metaKey) this.time.zoom(Math.exp(0.003 * event.deltaY), timeOf(event, over));
      else this.time.pan(0.001 * (event.deltaX || event.deltaY));
    }, { passive: false });
    let pinch: { distance: number; low: number; high: number } | null = null;
    this.host.addEventListener("touchmove", (event) => {
      const over = inside(event as unknown as MouseEvent);
      if (over === null || event.touches.length !== 2) return;
      event.preventDefault();
      const [one, two] = event.touches, distance = Math.max(10, Math.abs(one.clientX - two.clientX));
      if (pinch === null) pinch = { distance, low: this.time.low, high: this.time.high };
      const centre = 0.5 * (timeOf(one, over) + timeOf(two, over)), half = 0.5 * (pinch.high - pinch.low) * (pinch.distance / distance);
      this.time.show(centre - half, centre + half);
    }, { passive: false });
    this.host.addEventListener("touchend", () => { pinch = null; });
  }
}

/** Whether two contents are drawn alike: the same lines of the same curves. */
function sameLines(one: ChartContent, other: ChartContent): boolean {
  const parts = ({ lines, ...rest }: ChartContent) => JSON.stringify([rest, lines.map(({ curve, band, ...line }) => [line, !!band])]);
  return parts(one) === parts(other) && one.lines.every(({ curve }, k) => curve === other.lines[k].curve);
}

/** How far a curve goes up and down. */
function travel(y: Values): number {
  let sum = 0;
  for (let i = 1; i < y.length; i++) sum += Math.abs((y[i] ?? 0) - (y[i - 1] ?? y[i] ?? 0));
  return sum;
}

/** From the least to the most of each pixel, and on from where the curve was: a stroke of so many joints takes ten times as long. */
function fillColumns(context: CanvasRenderingContext2D, x: number[], y: Values, base: number, slope: number, width: number): void {
  let left = NaN, top = 0, bottom = 0, last = 0;
  for (let i = 0; i <= x.length; i++) {
    const value = y[i] ?? null, at = value === null ? NaN : Math.floor(x[i]), place = value === null ? 0 : base + slope * value;
    if (at === left) {
      top = Math.min(top, place);
      bottom = Math.max(bottom, place);
    } else {
      const joined = left === left;
      if (joined) context.fillRect(left, top - 0.5 * width, Math.ceil(width), bottom - top + width);
      top = joined ? Math.min(last, place) : place;
      bottom = joined ? Math.max(last, place) : place;
      left = at;
    }
    last = place;
  }
}

/** A colour #rrggbb with a share of opacity. */
export function mixed(hex: string, share: number): string {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
  return `rgba(${r}, ${g}, ${b}, ${share})`;
}

function axisWords(value: number): string {
  return String(Math.abs(value) >= 1e5 ? value.toExponential(1) : +value.toFixed(6)).replace("-", "−");
}

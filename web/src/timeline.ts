// The bar at the foot: a ruler of what is shown, and below it the whole recording with the part that is shown.
import { AXIS, MARGIN } from "./chart";
import { colour, fitCanvas, make } from "./dom";
import { clockWords, type Time } from "./time";
import type { Health } from "./health";

const STEPS = [1, 2, 5];
const CLOCK_STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200, 86400];

export class Timeline {
  readonly ruler = make("canvas", { class: "ruler", "aria-hidden": "true" });
  readonly overview = make("canvas", { class: "overview", "aria-hidden": "true" });
  readonly slider = make("input", { type: "range", class: "seek", min: "0", max: "1", step: "any", "aria-label": "time" });

  constructor(private time: Time, private health: Health) {
    this.slider.addEventListener("input", () => this.time.seek(this.time.first + Number(this.slider.value)));
    new ResizeObserver(() => this.draw()).observe(this.overview);
    this.addDrag(this.ruler, () => [this.time.low, this.time.high], true);
    this.addDrag(this.overview, () => [this.time.first, this.time.last], false);
  }

  private addDrag(canvas: HTMLCanvasElement, scale: () => [number, number], seeks: boolean): void {
    const timeOf = (event: MouseEvent) => {
      const box = canvas.getBoundingClientRect(), [low, high] = scale();
      return low + ((event.clientX - box.left - AXIS) / (box.width - AXIS - MARGIN)) * (high - low);
    };
    let grip = 0, dragging = false;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      dragging = true;
      const t = timeOf(event), inside = t >= this.time.low && t <= this.time.high;
      grip = inside ? t - 0.5 * (this.time.low + this.time.high) : 0;
      if (seeks || this.time.all) this.time.seek(t);
      else this.moveTo(t - grip);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!dragging) return;
      if (seeks || this.time.all) this.time.seek(timeOf(event));
      else this.moveTo(timeOf(event) - grip);
    });
    canvas.addEventListener("pointerup", () => { dragging = false; });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) this.time.pan(0.001 * event.deltaX);
      else this.time.zoom(Math.exp(0.002 * event.deltaY), seeks ? timeOf(event) : this.time.at);
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.time.showAll());
  }

  private moveTo(centre: number): void {
    const half = 0.5 * (this.time.high - this.time.low);
    this.time.following = false;
    this.time.show(centre - half, centre + half);
  }

  draw(): void {
    this.drawRuler();
    this.drawOverview();
    this.slider.max = String(this.time.last - this.time.first);
    this.slider.value = String(this.time.at - this.time.first);
    this.slider.setAttribute("aria-valuetext", this.time.words(this.time.at));
  }

  private drawRuler(): void {
    const { context, width, height } = fitCanvas(this.ruler), { low, high, at, first, wallClock } = this.time;
    const inner = width - AXIS - MARGIN, step = tickStep((high - low) / Math.max(2, inner / 90), wallClock);
    const x = (t: number) => AXIS + ((t - low) / (high - low)) * inner, origin = wallClock ? 0 : first;
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let k = Math.ceil((low - origin) / step); origin + k * step <= high; k++) {
      const t = origin + k * step, place = x(t);
      context.fillStyle = colour("line");
      context.fillRect(place - 0.5, 0, 1, 5);
      const words = wallClock ? clockWords(t + 1e-6, Math.min(3, digits)) : secondWords(k * step, digits, step);
      const half = 0.5 * context.measureText(words).width;
      context.fillStyle = colour("soft");
      if (place - half > 2 && place + half < width) context.fillText(words, place, 0.5 * height + 2);
    }
    if (at >= low && at <= high) {
      const place = x(at);
      context.fillStyle = colour("cursor");
      context.beginPath();
      context.moveTo(place - 6, 0);
      context.lineTo(place + 6, 0);
      context.lineTo(place, 8);
      context.fill();
    }
  }

  private drawOverview(): void {
    const { context, width, height } = fitCanvas(this.overview), { clock, low, high, first, last, at } = this.time;
    const inner = width - AXIS - MARGIN, x = (t: number) => AXIS + ((t - first) / (last - first)) * inner;
    context.fillStyle = colour("track");
    context.beginPath();
    context.roundRect(AXIS, 4, inner, height - 8, 4);
    context.fill();
    context.fillStyle = colour("bad");
    for (let pixel = 0, row = 0; pixel < inner; pixel++) {
      const end = Math.min(this.health.n, clock.rowFrom(first + ((pixel + 1) / inner) * (last - first)));
      let fault = false;
      for (; row < end && !fault; row++) fault = this.health.isFault(row);
      row = Math.max(row, end);
      if (fault) context.fillRect(AXIS + pixel, height - 8, 1, 4);
    }
    const [from, to] = [x(low), x(high)];
    context.fillStyle = colour("brush");
    context.strokeStyle = colour("accent");
    context.beginPath();
    context.roundRect(from, 2.5, Math.max(4, to - from), height - 5, 4);
    context.fill();
    context.stroke();
    context.fillStyle = colour("cursor");
    context.fillRect(x(at) - 1, 0, 2, height);
  }
}

function tickStep(least: number, clock: boolean): number {
  if (least > (clock ? 1 : 30)) return CLOCK_STEPS.find((step) => step >= least) ?? 86400;
  const power = 10 ** Math.floor(Math.log10(least));
  return (STEPS.find((step) => step * power >= least) ?? 10) * power;
}

function secondWords(seconds: number, digits: number, step: number): string {
  if (step < 60 && seconds < 600) return `${seconds.toFixed(digits)} s`;
  const minutes = Math.floor(seconds / 60 + 1e-9), rest = seconds - 60 * minutes;
  return `${minutes}:${rest.toFixed(digits).padStart(digits > 0 ? 3 + digits : 2, "0")} min`;
}

// The lesson, live: two sensors that contradict each other, two filters as modules for WebAssembly, and the truth.
import { Attitude } from "./attitude";
import { parseBlock, type Numbers } from "./block";
import { Chart, type Line } from "./chart";
import { Clock, Curve } from "./curve";
import { byId, make } from "./dom";
import { loadFilter } from "./modules";
import { ParameterPanel } from "./parameters";
import type { Parameter } from "./source";
import { Time } from "./time";

const GRAVITY = 9.80665, RADIAN = Math.PI / 180, INTERVAL = 0.01;
const FILTERS = ["GyroIntegration", "Complementary", "Kalman"];

const slider = (name: string, unit: string, doc: string, value: number, low: number, high: number, log = false): Parameter =>
  ({ name, unit, doc, range: "", value, default: value, switch: false, low, high, log });
const SENSORS = [
  slider("accel_noise", "°", "white noise of the accelerometer's angle, 1σ", 3, 0, 10),
  slider("gyr_noise", "°/s", "white noise of the gyroscope, 1σ", 0.3, 0, 3),
  slider("bias", "°/s", "constant bias of the gyroscope", 0, -3, 3),
  slider("bias_walk", "°/s", "the bias takes steps of this times 0.01 s", 0.02, 0, 1),
];
const SETTINGS = [
  slider("alpha", "", "complementary filter: weight of the gyroscope", 0.98, 0.5, 0.999),
  slider("q_angle", "deg²", "Kalman: process noise of the angle, a sample", 0.001, 1e-5, 1, true),
  slider("q_bias", "(deg/s)²", "Kalman: process noise of the bias, a sample", 0.003, 1e-6, 1, true),
  slider("r_measure", "deg²", "Kalman: variance of the accelerometer's angle", 4, 0.01, 100, true),
];

class Lesson {
  private values: Record<string, number> = Object.fromEntries([...SENSORS, ...SETTINGS].map(({ name, value }) => [name, value as number]));
  private clock = new Clock();
  private time = new Time(this.clock, false);
  private truth = new Curve();
  private measured = new Curve();
  private roll = FILTERS.map(() => new Curve());
  private error = FILTERS.map(() => new Curve());
  private charts: Chart[] = [];
  private figures = make("tbody", { id: "figures" });
  private dirty = true;
  private stale = false; // a slider moved: the filters run once a frame

  constructor(private given: Record<string, Float64Array>, private filters: any[]) {
    this.clock.append(given.t);
    this.truth.append(given.angle);
    this.time.interval = INTERVAL;
    this.time.showAll();
    this.time.at = 30;
    this.time.onChange(() => { this.dirty = true; });
    this.compute();
    const colours = ["third", "estimate", "second"], lines = (curves: Curve[]): Line[] =>
      [1, 2, 0].map((k) => ({ label: ["gyroscope alone", "complementary", "Kalman"][k], colour: colours[k], curve: curves[k], optional: k === 0 }));
    const wrong: Line = { label: "accelerometer alone", colour: "warm", curve: this.measured, optional: true };
    this.charts = [
      new Chart({ id: "roll", title: "Roll", unit: "°", digits: 2, least: 4, lines: [...lines(this.roll), { label: "truth", colour: "truth", curve: this.truth, dash: true }, wrong] }, this.time),
      new Chart({ id: "error", title: "Error", unit: "°", digits: 3, least: 1, lines: lines(this.error), ruler: true }, this.time),
    ];
    byId("charts").append(...this.charts.map((chart) => chart.element));
    byId("side").append(make("section", { class: "card", "aria-label": "Error" }, make("h2", {}, "RMS error over 60 s"), make("table", { class: "filters" }, this.figures)));
    for (const [id, title, parameters] of [["sensors", "The sensors", SENSORS], ["settings", "The filters", SETTINGS]] as const) {
      const panel = new ParameterPanel((name, value) => { this.values[name] = value as number; this.stale = true; });
      panel.show({ name: id, parameters: [...parameters] });
      byId("side").append(make("section", { class: "card", "aria-label": title }, make("h2", {}, title), panel.element));
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { for (const chart of this.charts) chart.build(); this.dirty = true; });
    const frame = () => { if (this.stale) this.compute(); if (this.dirty) this.draw(); requestAnimationFrame(frame); };
    frame();
  }

  /** The readings with these errors, through the filters. */
  private compute(): void {
    const { accel_noise, gyr_noise, bias, bias_walk, alpha, q_angle, q_bias, r_measure } = this.values;
    const { accel, accel_unit, rate, rate_unit, bias_unit, angle, t } = this.given, n = t.length;
    const gyr = new Float64Array(3 * n), acc = new Float64Array(3 * n), measured = new Float32Array(n);
    for (let i = 0; i < n; i++) {
      measured[i] = accel[i] + accel_noise * accel_unit[i];
      const level = RADIAN * (accel[i] + accel_noise * accel_unit[i]);
      gyr[3 * i] = RADIAN * (rate[i] + gyr_noise * rate_unit[i] + bias_walk * bias_unit[i] + bias);
      acc[3 * i + 1] = GRAVITY * Math.sin(level);
      acc[3 * i + 2] = GRAVITY * Math.cos(level);
    }
    this.stale = false;
    this.measured.clear();
    this.measured.append(measured);
    const settings: Record<string, number | boolean>[] = [{}, { tau: (alpha * INTERVAL) / (1 - alpha) }, { q_angle, q_bias, r_measure, q_per_sample: true }];
    const figures: [string, number][] = [["accelerometer alone", rms(measured, angle)]];
    this.filters.forEach((filter, k) => {
      Object.assign(filter.parameters, settings[k]);
      filter.reset();
      const { quaternion } = filter.updateRows({ gyr, acc, mag: null, t }), attitude = new Attitude("");
      attitude.append({ header: {}, columns: new Map([["quat", { values: quaternion as Numbers, rows: n, width: 4 }]]) });
      const roll = attitude.wrapped.angle[0].values.subarray(0, n);
      this.roll[k].clear();
      this.roll[k].append(roll);
      this.error[k].clear();
      this.error[k].append(roll.map((value, i) => value - angle[i]));
      figures.push([["gyroscope alone", "complementary filter", "Kalman filter"][k], rms(roll, angle)]);
    });
    this.figures.replaceChildren(...figures.map(([name, value]) => make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, `${value.toFixed(4)}°`))));
    this.dirty = true;
  }

  private draw(): void {
    this.dirty = false;
    for (const chart of this.charts) chart.draw();
  }
}

/** Root of the mean square of a difference. */
function rms(values: Float32Array, truth: Float64Array): number {
  let sum = 0;
  for (let i = 0; i < truth.length; i++) sum += (values[i] - truth[i]) ** 2;
  return Math.sqrt(sum / truth.length);
}

async function start(): Promise<void> {
  const { columns } = parseBlock(await (await fetch("lesson.bin")).arrayBuffer());
  const filters = await Promise.all(FILTERS.map((name) => loadFilter(`lesson/lh-${name.toLowerCase()}`)));
  new Lesson(Object.fromEntries([...columns].map(([name, { values }]) => [name, values as Float64Array])), filters);
  document.body.dataset.ready = "true";
}

start().catch((error: Error) => {
  byId("message").textContent = error.message;
  byId("message").hidden = false;
});

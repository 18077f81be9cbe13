// This phone as the sensor: its readings through three filters in the browser, and a body that turns with the hand.
import { Attitude, type Quat } from "./attitude";
import { Body } from "./body";
import { Chart } from "./chart";
import { Clock } from "./curve";
import { byId, make, signed } from "./dom";
import { loadFilter } from "./modules";
import { Time } from "./time";

const RADIAN = Math.PI / 180, SHOWN = 15, MOST = 60_000; // s of the charts; samples that are kept
const FILTERS: [string, string, string][] = [["ESKF", "filters/lh-eskf", "estimate"],
  ["Complementary", "lesson/lh-complementary", "second"], ["GyroIntegration", "lesson/lh-gyrointegration", "third"]];

class Phone {
  private clock = new Clock();
  private time = new Time(this.clock, false);
  private attitudes = FILTERS.map(([name]) => new Attitude(name));
  private body = new Body();
  private charts: Chart[];
  private button = make("button", { id: "start", class: "primary", type: "button", click: () => void this.start() }, "Start");
  private state = make("p", { id: "state", role: "status" }, "Three filters run in this browser. No reading leaves the phone.");
  private figures = make("tbody", { id: "figures" });
  private up: number[] | null = null;
  private sign = 0;
  private began = 0;
  private last = -Infinity;

  constructor(private filters: any[]) {
    this.time.window = SHOWN;
    byId("side").append(make("section", { class: "card view", "aria-label": "Orientation" }, this.body.element, make("div", { class: "phone" }, this.button, this.state,
      make("table", { class: "filters" }, make("thead", {}, make("tr", {}, ...["filter", "roll", "pitch", "yaw"].map((name) => make("th", { scope: "col" }, name)))), this.figures))));
    this.charts = ["roll", "pitch", "yaw"].map((name, k) => new Chart({
      id: name, title: name[0].toUpperCase() + name.slice(1), unit: "°", digits: 1, least: 4, ruler: k === 2,
      lines: this.attitudes.map(({ name: label, wrapped }, i) => ({ label, colour: FILTERS[i][2], curve: wrapped.angle[k], wraps: true })),
    }, this.time));
    byId("charts").append(...this.charts.map((chart) => chart.element));
    this.body.setRelative(true);
    this.body.recolour();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.body.recolour();
      for (const chart of this.charts) { chart.build(); chart.draw(); }
    });
    this.frame();
  }

  private async start(): Promise<void> {
    const motion = (globalThis as any).DeviceMotionEvent;
    try {
      if (motion?.requestPermission !== undefined && (await motion.requestPermission()) !== "granted") throw new Error("refused");
    } catch {
      this.say("The browser refused the motion sensors. Allow them for this page, then try again.");
      return;
    }
    this.began = performance.now();
    addEventListener("deviceorientation", (event) => this.takeOrientation(event));
    addEventListener("devicemotion", (event) => this.takeMotion(event));
    this.button.disabled = true;
    this.say("Turn the phone.");
    setTimeout(() => { if (this.clock.n === 0) this.say("No readings come: this device has no gyroscope, or the browser keeps it back. Phones give it to pages over HTTPS only."); }, 3000);
  }

  private say(words: string): void {
    this.state.textContent = words;
  }

  /** Up along the phone's axes (W3C, Z-X'-Y''): iPhones give accelerations with the opposite sign. */
  private takeOrientation({ beta, gamma }: DeviceOrientationEvent): void {
    if (beta === null || gamma === null) return;
    const [b, c] = [beta * RADIAN, gamma * RADIAN];
    this.up = [-Math.cos(b) * Math.sin(c), Math.sin(b), Math.cos(b) * Math.cos(c)];
  }

  private takeMotion(event: DeviceMotionEvent): void {
    const rate = event.rotationRate, force = event.accelerationIncludingGravity;
    if (rate?.alpha == null || force?.x == null) return;
    const acc = [force.x, force.y!, force.z!];
    if (this.sign === 0 && this.up !== null) {
      const along = acc.reduce((sum, value, k) => sum + value * this.up![k], 0);
      if (Math.abs(along) > 5) this.sign = Math.sign(along);
    } else if (this.sign === 0 && performance.now() - this.began > 1000) {
      this.sign = /iPhone|iPad|iPod|Macintosh/.test(navigator.userAgent) ? -1 : 1;
    }
    const t = event.timeStamp / 1000;
    if (this.sign === 0 || !(t > this.last)) return;
    // Browsers name the rates about x, y and z alpha, beta and gamma.
    const gyr = [rate.alpha, rate.beta!, rate.gamma!].map((value) => value * RADIAN), up = acc.map((value) => this.sign * value);
    const interval = this.clock.n === 0 ? 1 : t - this.last;
    this.last = t;
    if (this.clock.n >= MOST) for (const kept of [this.clock, ...this.attitudes]) kept.drop(MOST / 2);
    this.clock.append([t]);
    this.filters.forEach((filter, k) => {
      filter.update(gyr, up, null, interval);
      const columns = new Map([["quat", { values: Float64Array.from(filter.quaternion), rows: 1, width: 4 }]]);
      if (k === 0) columns.set("sigma", { values: Float64Array.from(filter.sigma), rows: 1, width: 3 });
      this.attitudes[k].append({ header: {}, columns });
    });
    if (this.clock.n > 20) this.time.interval = this.clock.interval;
  }

  private frame(): void {
    if (this.clock.n > 1 && this.time.at !== this.clock.last) {
      this.time.follow();
      const row = this.clock.n - 1, [first, ...others] = this.attitudes;
      const doubt = { tilt: first.sigmaTilt.values[row] * RADIAN, heading: first.sigmaHeading.values[row] * RADIAN };
      this.body.turn(first.quatAt(row) as Quat, doubt, others.map((one, k) => ({ quat: one.quatAt(row), colour: FILTERS[k + 1][2] })), true);
      this.figures.replaceChildren(...this.attitudes.map((one) => make("tr", {}, make("th", { scope: "row" }, one.name),
        ...one.wrapped.angle.map((curve) => make("td", {}, `${signed(curve.values[row])}°`)))));
      for (const chart of this.charts) chart.draw();
    }
    this.body.frame();
    requestAnimationFrame(() => this.frame());
  }
}

Promise.all(FILTERS.map(([, folder]) => loadFilter(folder))).then((filters) => {
  new Phone(filters);
  document.body.dataset.ready = "true";
}, (error: Error) => {
  byId("message").textContent = error.message;
  byId("message").hidden = false;
});

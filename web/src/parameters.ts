// A slider and a number for each parameter of a filter.
import { make } from "./dom";
import type { Filter, Parameter } from "./source";

const NOTCHES = 200;

export class ParameterPanel {
  readonly element = make("div", { class: "parameters" });
  private setters = new Map<string, (value: number | boolean | null) => void>();
  private name = "";

  constructor(private change: (name: string, value: number | boolean) => void) {}

  /** Shows a filter; the same filter keeps its widgets, so that none is taken from under a hand. */
  show(filter: Filter): void {
    if (filter.name === this.name) {
      for (const { name, value } of filter.parameters) this.setters.get(name)?.(value);
      return;
    }
    this.name = filter.name;
    this.setters.clear();
    this.element.replaceChildren(...filter.parameters.map((parameter) => this.row(parameter)));
    if (filter.parameters.length === 0) this.element.append(make("p", { class: "quiet" }, "this filter has no parameters"));
  }

  private row(parameter: Parameter): HTMLElement {
    const { name, unit, doc, range } = parameter, id = `parameter-${name}`;
    const label = make("label", { for: id, title: `${doc}; ${range}` }, name, make("small", {}, unit ? ` ${unit}` : ""));
    if (parameter.switch) {
      const box = make("input", { type: "checkbox", id, change: () => this.change(name, box.checked) });
      box.checked = parameter.value === true;
      this.setters.set(name, (value) => { box.checked = value === true; });
      return make("div", { class: "row" }, label, box, make("p", {}, doc));
    }
    const slider = make("input", { type: "range", id, min: "0", max: String(NOTCHES), step: "1", "aria-describedby": `${id}-doc` });
    const box = make("input", { type: "text", inputmode: "decimal", "aria-label": `${name}, as a number`, autocomplete: "off" });
    let now = parameter.value as number | null, typing = false;
    const show = (value: number | boolean | null) => {
      now = value as number | null;
      if (!typing) box.value = now === null ? "∞" : String(now);
      if (document.activeElement !== slider || notch(parameter, now) !== Number(slider.value)) slider.value = String(notch(parameter, now));
      slider.setAttribute("aria-valuetext", `${box.value} ${unit}`);
      back.hidden = now === parameter.default;
    };
    const back = make("button", {
      type: "button", class: "reset", "aria-label": `${name} back to its default ${parameter.default}`, title: `default: ${parameter.default}`,
      click: () => { if (parameter.default !== null) { this.change(name, parameter.default); show(parameter.default); } },
    }, "↺");
    slider.addEventListener("input", () => {
      now = valueOf(parameter, Number(slider.value));
      box.value = String(now);
      back.hidden = now === parameter.default;
      this.change(name, now);
    });
    box.addEventListener("input", () => { typing = true; });
    box.addEventListener("change", () => {
      typing = false;
      const value = Number(box.value.trim().replace(",", ".").replace("−", "-"));
      if (box.value.trim() === "" || !Number.isFinite(value)) { box.value = String(now); return; }
      slider.value = String(notch(parameter, value));
      this.change(name, value);
    });
    this.setters.set(name, show);
    show(parameter.value);
    return make("div", { class: "row" }, label, back, box, slider, make("p", { id: `${id}-doc` }, doc));
  }
}

function notch({ low, high, log }: Parameter, value: number | null): number {
  if (value === null || high <= low) return NOTCHES;
  const share = log ? (value > 0 ? Math.log(value / low) / Math.log(high / low) : 0) : (value - low) / (high - low);
  return Math.round(NOTCHES * Math.min(1, Math.max(0, share)));
}

function valueOf({ low, high, log }: Parameter, place: number): number {
  const share = place / NOTCHES;
  return Number((log ? low * (high / low) ** share : low + share * (high - low)).toPrecision(4));
}

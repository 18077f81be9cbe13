// Keys for everything, and the page that lists them.
import type { App } from "./app";
import { byId, make } from "./dom";

const HELP: [string[], string][] = [
  [["Space"], "play or pause"],
  [["←", "→"], "one sample back or on; with Shift a second"],
  [["Home", "End"], "to the beginning or the end"],
  [["[", "]"], "to the event before or after the cursor"],
  [["+", "−"], "zoom in or out at the cursor"],
  [[",", "."], "move the shown stretch back or on"],
  [["0"], "show all"],
  [["f"], "follow the newest sample of a node"],
  [["<", ">"], "play slower or faster"],
  [["a"], "angles wrapped, continuous, or as a quaternion"],
  [["v"], "look from another side"],
  [["t"], "samples as a table"],
  [["d"], "download the shown stretch as CSV"],
  [["h"], "yaw of a node is 0 from here on"],
  [["r"], "record a node, or end the record"],
  [["p"], "to the parameters"],
  [["c"], "add a filter beside the first"],
  [["?"], "this page"],
];
const MOUSE = [
  "Click in a chart: the cursor goes there. Drag: zoom. Double-click: all.",
  "Ctrl + wheel zooms, Shift + wheel moves, two fingers do both. On the bar below, the wheel alone zooms.",
  "A click on a name in a legend hides its curve. Drag the body to look from elsewhere.",
  "Grey body: something is wrong with this sample, or the node is silent. Orange cone: ±2σ of the x axis.",
];

export function addKeys(app: App, signal: AbortSignal): void {
  document.addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || byId<HTMLDialogElement>("help").open) return;
    if (target instanceof Element && target.matches("input[type=text], input[type=range], select")) return;
    if (event.key === " " && target instanceof Element && target.matches("button, summary, input")) return;
    const act = action(app, event);
    if (act === null) return;
    event.preventDefault();
    act();
  }, { signal });
}

function action(app: App, event: KeyboardEvent): (() => void) | null {
  const { time } = app, recording = app.about.kind === "recording", second = Math.max(1, Math.round(1 / time.interval));
  const faster = (factor: number) => () => time.setSpeed(Math.min(16, Math.max(0.25, time.speed * factor)));
  const actions: Record<string, () => void> = {
    " ": () => time.play(!time.playing),
    ArrowLeft: () => time.step(event.shiftKey ? -second : -1), ArrowRight: () => time.step(event.shiftKey ? second : 1),
    Home: () => time.seek(time.first), End: () => time.seek(time.last),
    "[": () => app.toEvent(-1), "]": () => app.toEvent(1),
    "+": () => time.zoom(0.5), "=": () => time.zoom(0.5), "-": () => time.zoom(2), "−": () => time.zoom(2),
    ",": () => time.pan(-0.25), ".": () => time.pan(0.25), "0": () => app.showAll(),
    f: () => app.follow(), "<": faster(0.5), ">": faster(2), a: () => app.nextMode(), v: () => app.nextView(), t: () => app.toggleTable(),
    d: () => void app.download(".csv"), h: () => void app.zeroHeading(), r: () => void app.record(), p: () => focusIn("parameter-card", "input"),
    c: () => { if (recording) document.getElementById("beside")?.focus(); }, "?": showHelp,
  };
  return actions[event.key] ?? null;
}

function focusIn(id: string, selector: string): void {
  const card = document.getElementById(id) as HTMLDetailsElement | null;
  if (card === null) return;
  card.open = true;
  card.querySelector<HTMLElement>(selector)?.focus();
}

export function showHelp(): void {
  const dialog = byId<HTMLDialogElement>("help");
  dialog.replaceChildren(
    make("h2", { id: "help-title" }, "Keys and gestures"),
    make("dl", { class: "keys" }, ...HELP.flatMap(([keys, words]) => [make("dt", {}, ...keys.map((key) => make("kbd", {}, key))), make("dd", {}, words)])),
    ...MOUSE.map((words) => make("p", {}, words)),
    make("p", {}, make("a", { href: "licences.txt" }, "Licences of what this page contains")),
    make("form", { method: "dialog" }, make("button", { type: "submit", autofocus: true }, "Close")),
  );
  dialog.showModal();
}

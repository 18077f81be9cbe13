// The page with Python: what levelhead reads, with the hints of its command line.
import { byId, make } from "./dom";
import { TryPage } from "./try";

const HINTS: [string, string, string][] = [
  ["map", "columns", "gyr=gx,gy,gz acc=ax,ay,az"], ["units", "units", "gyr=deg/s acc=g"], ["counts", "counts", "gyr=131/deg/s"],
  ["rate", "rate, Hz", "100"],
];
const element = make("form", { class: "card" },
  make("h2", {}, "Where the reader is wrong"), make("p", { class: "quiet" }, "Leave these empty first. They are the options of levelhead fuse."),
  make("div", { class: "hints" }, ...HINTS.flatMap(([name, words, example]) => [
    make("label", { for: `hint-${name}` }, words), make("input", { id: `hint-${name}`, placeholder: example, autocomplete: "off", spellcheck: "false" }),
  ])), make("button", { type: "submit" }, "Read again"));
const hints = () => Object.fromEntries(HINTS.map(([name]) => [name, byId<HTMLInputElement>(`hint-${name}`).value]));

new TryPage("worker.js", "CSV, text, MATLAB 5, ULog, Betaflight, KITTI and more. It stays in this browser.", { element, hints, take: () => "" }, true, async () => null);

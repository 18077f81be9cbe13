// The page without Python: a CSV of plain columns, which are chosen where their names do not say what they are.
import { make } from "./dom";
import { ROLES, type Choices, type Role } from "./plain_log";
import { TryPage } from "./try";

const TITLES: Record<Role, string> = { t: "time", gyr: "gyroscope", acc: "accelerometer", mag: "magnetometer" };
const rows = make("div", { class: "columns" }), element = make("form", { class: "card", id: "columns", hidden: true },
  make("h2", {}, "Columns and units"), make("p", { class: "quiet" }, "Correct what is wrong here. Without a magnetometer, heading counts from the start."),
  rows, make("button", { type: "submit", class: "primary" }, "Read"));
const places = new Map<Role, { columns: HTMLSelectElement[]; unit: HTMLSelectElement }>();

function select(label: string, empty: string, options: string[], value: string): HTMLSelectElement {
  return make("select", { "aria-label": label, title: label }, ...["", ...options].map((one) => make("option", { value: one, selected: one === value }, one || `${empty} –`)));
}

function show({ names, chosen, units }: { names: string[]; chosen: Choices; units: Record<Role, string[]> }): void {
  rows.replaceChildren(...ROLES.map((role) => {
    const { columns, unit } = chosen[role], title = TITLES[role];
    const found = { columns: columns.map((one, k) => (role === "t" ? select(title, "column", names, one) : select(`${title} ${"xyz"[k]}`, "xyz"[k], names, one))), unit: select(`unit of the ${title}`, "unit", units[role], unit) };
    places.set(role, found);
    return make("fieldset", {}, make("legend", {}, title), ...found.columns, found.unit);
  }));
  element.hidden = false;
}

const hints = () => ({ chosen: Object.fromEntries([...places].map(([role, { columns, unit }]) => [role, { columns: columns.map(({ value }) => value), unit: unit.value }])) });

/** A file of this page's own, for those who have none. */
async function example(): Promise<File> {
  return new File([await (await fetch("hand.csv")).blob()], "a simulated hand.csv");
}

new TryPage("plain_worker.js", "CSV with a line of names, such as t [s], gyr_x [deg/s] … acc_z [m/s²]. It stays in this browser.",
  { element, hints, take: (header) => { show(header); return header.lack; } }, false, example);

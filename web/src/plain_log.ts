// Columns of a CSV file that name themselves and their unit, without Python. All else is for the reader in Python.
import { NUMBER, readNumbers } from "./numbers";

export const ROLES = ["t", "gyr", "acc", "mag"] as const;
export type Role = typeof ROLES[number];

/** The columns of a sensor, and their unit; "": not chosen. */
export interface Choice { columns: string[]; unit: string }
export type Choices = Record<Role, Choice>;

/** What Python's reader has for names and units: a name without signs to role and axis; a role to factors to SI, and to
 * the units that most people write; s from which stamps count from a date. */
export interface Words { names: Record<string, [Role, number]>; units: Record<Role, Record<string, number>>; usual: Record<Role, string[]>; uptime: number }

const ELSEWHERE = "levelhead fuse, and this page with Python, read more: other formats, gaps, decimal commas, counts, clocks that jump";
const SENSORS: Record<Role, string> = { t: "time", gyr: "gyroscope", acc: "accelerometer", mag: "magnetometer" };

export const refuse = (words: string) => new Error(`${words}; ${ELSEWHERE}`);

/** A CSV file: its name, the names of its columns, and its bytes. */
export class PlainLog {
  private constructor(readonly name: string, readonly names: string[], private bytes: Uint8Array, private begin: number, private delimiter: string) {}

  static open(name: string, content: ArrayBuffer): PlainLog {
    const bytes = new Uint8Array(content), end = bytes.indexOf(10), head = bytes.subarray(0, Math.max(0, end));
    let first: string;
    try {
      first = new TextDecoder("utf-8", { fatal: true }).decode(head);
    } catch {
      throw refuse(`${name} is no text in UTF-8; expected a CSV file`);
    }
    const delimiter = [",", ";", "\t"].reduce((best, one) => (first.split(one).length > first.split(best).length ? one : best));
    const names = first.split(delimiter).map((one) => one.trim());
    if (names.length < 7 || names.some((one) => NUMBER.test(one) || one === "" || one.includes('"')) || new Set(names).size < names.length) {
      throw refuse(`${name} does not begin with the names of its columns; expected such as t [s],gyr_x [rad/s],…,acc_z [m/s²]`);
    }
    return new PlainLog(name, names, bytes, end + 1, delimiter);
  }

  /** The columns that name themselves, with their unit where the name holds one. */
  choose(words: Words): Choices {
    const found = Object.fromEntries(ROLES.map((role) => [role, { columns: role === "t" ? [""] : ["", "", ""], unit: "" }])) as Choices;
    for (const name of this.names) {
      const [, bare, unit] = /^(.*?)\s*(?:[[(]([^\])]*)[\])])?$/.exec(name)!;
      const known = words.names[bare.toLowerCase().replace(/[^\p{L}\d]/gu, "")];
      if (known === undefined || found[known[0]].columns[known[1]] !== "") continue;
      const choice = found[known[0]];
      choice.columns[known[1]] = name;
      if (unit in words.units[known[0]]) choice.unit = unit;
    }
    if (found.mag.columns.includes("")) found.mag = { columns: ["", "", ""], unit: "" };
    return found;
  }

  /** A sentence about what nobody has chosen; "": nothing. */
  lack(choices: Choices): string {
    for (const role of ROLES) {
      const { columns, unit } = choices[role], missing = columns.indexOf("");
      if (role === "mag" && columns.every((one) => one === "")) continue;
      if (missing >= 0) return `${this.name} names no column as the ${SENSORS[role]}${role === "t" ? "" : `'s ${"xyz"[missing]} axis`}: choose it`;
      if (unit === "") return `${this.name} names no unit of the ${SENSORS[role]}: choose it`;
    }
    const all = ROLES.flatMap((role) => choices[role].columns).filter((one) => one !== ""), twice = all.find((one, k) => all.indexOf(one) < k);
    return twice === undefined ? "" : `column '${twice}' is chosen twice: choose another`;
  }

  /** (n,) numbers of each column, as they stand. */
  private read(columns: string[]): Float64Array[] {
    const found = readNumbers(this.bytes, this.begin, this.delimiter.charCodeAt(0), this.names.length, columns.map((one) => this.names.indexOf(one)));
    if ("cell" in found) {
      const { line, place, cell, cells } = found, where = `${this.name}, line ${line + 2}`;
      throw refuse(cells === null ? `${where}, column '${this.names[place]}': '${cell}'; expected a number` : `${where}: ${cells} cells${cells > this.names.length ? " or more" : ""}; expected ${this.names.length}`);
    }
    const rows = found.columns[0].length;
    if (rows < 3) throw refuse(`${this.name} has ${rows} rows; expected a recording`);
    return found.columns;
  }

  /** Readings in SI units, scaled as Python's reader does. */
  readings(choices: Choices, words: Words): { t: Float64Array; gyr: Float64Array; acc: Float64Array; mag: Float64Array | null } {
    const used = ROLES.filter((role) => choices[role].columns[0] !== ""), columns = this.read(used.flatMap((role) => choices[role].columns));
    const factor = (role: Role) => words.units[role][choices[role].unit];
    const sensor = (role: Role) => {
      const first = used.includes(role) ? 1 + 3 * (used.indexOf(role) - 1) : -1, scale = factor(role), rows = columns[0].length;
      if (first < 0) return null;
      const found = new Float64Array(3 * rows);
      for (let i = 0; i < rows; i++) for (let k = 0; k < 3; k++) found[3 * i + k] = columns[first + k][i] * scale;
      return found;
    };
    return { t: this.seconds(columns[0], factor("t"), words.uptime), gyr: sensor("gyr")!, acc: sensor("acc")!, mag: sensor("mag") };
  }

  /** Stamps that count from a date become seconds since the first one. */
  private seconds(stamps: Float64Array, factor: number, uptime: number): Float64Array {
    const start = Math.abs(stamps[0]) * factor > uptime ? stamps[0] : 0;
    if (!Number.isSafeInteger(Math.trunc(stamps[0]))) throw refuse(`${this.name}: its stamps, such as ${stamps[0]}, have more digits than a double`);
    const back = stamps.findIndex((stamp, i) => i > 0 && !(stamp > stamps[i - 1]));
    if (back >= 0) throw refuse(`${this.name}, row ${back + 1}: its stamp ${stamps[back]} is not after ${stamps[back - 1]}; expected stamps that increase`);
    return stamps.map((stamp) => (factor < 1 ? (stamp - start) / Math.round(1 / factor) : (stamp - start) * factor));
  }
}

// Columns of a CSV file that name themselves and their unit, without Python. All else is for the reader in Python.

export const ROLES = ["t", "gyr", "acc", "mag"] as const;
export type Role = typeof ROLES[number];

/** The columns of a sensor, and their unit; "": not chosen. */
export interface Choice { columns: string[]; unit: string }
export type Choices = Record<Role, Choice>;

/** What Python's reader has for names and units: a name without signs to role and axis; a role to factors to SI, and to
 * the units that most people write; s from which stamps count from a date. */
export interface Words { names: Record<string, [Role, number]>; units: Record<Role, Record<string, number>>; usual: Record<Role, string[]>; uptime: number }

const ELSEWHERE = "levelhead fuse, and this page with Python, read more: other formats, gaps, decimal commas, counts, clocks that jump";
const NUMBER = /^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*$/;
const SENSORS: Record<Role, string> = { t: "time", gyr: "gyroscope", acc: "accelerometer", mag: "magnetometer" };

export const refuse = (words: string) => new Error(`${words}; ${ELSEWHERE}`);

/** The text of a CSV file: its name, the names of its columns, and its rows. */
export class PlainLog {
  readonly names: string[];
  private begin: number;

  constructor(readonly name: string, private text: string, private delimiter: string, first: string) {
    this.names = first.split(delimiter).map((one) => one.trim());
    this.begin = first.length + 1;
  }

  static open(name: string, bytes: ArrayBuffer): PlainLog {
    let text: string;
    try {
      text = new TextDecoder("utf-8", { fatal: true }).decode(bytes);
    } catch {
      throw refuse(`${name} is no text in UTF-8; expected a CSV file`);
    }
    const first = text.slice(0, Math.max(0, text.indexOf("\n"))).replace(/\r$/, "");
    const delimiter = [",", ";", "\t"].reduce((best, one) => (first.split(one).length > first.split(best).length ? one : best));
    const log = new PlainLog(name, text, delimiter, text.slice(0, Math.max(0, text.indexOf("\n"))));
    if (log.names.length < 7 || log.names.some((one) => NUMBER.test(one) || one === "" || one.includes('"')) || new Set(log.names).size < log.names.length) {
      throw refuse(`${name} does not begin with the names of its columns; expected such as t [s],gyr_x [rad/s],…,acc_z [m/s²]`);
    }
    return log;
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
  read(columns: string[]): Float64Array[] {
    const places = columns.map((one) => this.names.indexOf(one)), { text, delimiter, names } = this;
    let room = Math.max(16, Math.ceil((text.length - this.begin) / Math.max(1, text.indexOf("\n", this.begin) - this.begin)));
    let found = places.map(() => new Float64Array(room)), rows = 0;
    for (let at = this.begin, line = 2; at < text.length; line++) {
      let end = text.indexOf("\n", at);
      if (end < 0) end = text.length;
      const cells = text.slice(at, end).split(delimiter);
      at = end + 1;
      if (cells.length === 1 && cells[0].trim() === "" && at >= text.length) break;
      if (cells.length !== names.length) throw refuse(`${this.name}, line ${line}: ${cells.length} cells; expected ${names.length}`);
      if (rows === room) {
        room = Math.ceil(1.5 * room);
        found = found.map((column) => { const larger = new Float64Array(room); larger.set(column); return larger; });
      }
      for (let k = 0; k < places.length; k++) {
        const cell = cells[places[k]];
        if (!NUMBER.test(cell)) throw refuse(`${this.name}, line ${line}, column '${names[places[k]]}': '${cell.trim()}'; expected a number`);
        found[k][rows] = Number(cell);
      }
      rows++;
    }
    if (rows < 3) throw refuse(`${this.name} has ${rows} rows; expected a recording`);
    return found.map((column) => column.subarray(0, rows));
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

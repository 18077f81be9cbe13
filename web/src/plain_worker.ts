// A CSV of plain columns without Python: its columns as chosen, and the filters as modules for WebAssembly.
import type { Block, Column, Numbers } from "./block";
import { serve, type Call } from "./call";
import { load, loadFilters, run, type Readings } from "./modules";
import { PlainLog, ROLES, type Choices, type Words } from "./plain_log";
import type { About, Filter } from "./source";

type Known = Filter & { doc: string; relative: [boolean, boolean] }; // whether heading counts from the start, without and with a field
interface Facts extends Words { filters: Known[]; health: About["health"] }

class PlainView {
  private log: PlainLog | null = null;
  private readings: Readings | null = null;

  constructor(private facts: Facts, private filters: Map<string, any>) {}

  /** Takes a file where there is one; reads the columns that are chosen, or that name themselves. */
  open({ args, file }: Call): Block {
    if (file !== undefined) this.log = PlainLog.open(file.name, file.bytes);
    const log = this.log!, chosen = (file === undefined && (args.chosen as Choices)) || log.choose(this.facts), lack = log.lack(chosen);
    const text = ROLES.filter((role) => chosen[role].unit).map((role) => `${role.padEnd(4)} ${chosen[role].columns.join(", ")}: ${chosen[role].unit}`).join("\n");
    const units = Object.fromEntries(ROLES.map((role) => [role, [...new Set([...this.facts.usual[role], chosen[role].unit])].filter(Boolean)]));
    if (lack === "") this.readings = log.readings(chosen, this.facts);
    return block({ names: log.names, chosen, units, lack, text });
  }

  about(): Block {
    const { t, gyr, acc, mag } = this.readings!, rows = t.length, [{ name }] = this.facts.filters, { header, columns } = this.track(name, {});
    const about: About = {
      kind: "recording", title: this.log!.name, samples: rows, clock: false, health: this.facts.health,
      filters: this.facts.filters,
    };
    for (const [key, values] of Object.entries({ gyr, acc, ...(mag ? { mag } : {}) })) columns.set(key, column(values, rows));
    columns.set("t", column(t, rows));
    return { header: { ...header, ...about }, columns };
  }

  /** A filter with these parameters, and its defaults for the others. */
  track(name: string, values: Record<string, unknown>): Block {
    const known = this.facts.filters.find((one) => one.name === name)!, rows = this.readings!.t.length;
    const all = Object.fromEntries(known.parameters.map((one) => [one.name, values[one.name] ?? one.value]).filter(([, value]) => value !== null));
    const found = run(this.filters.get(name), all, this.readings!), columns = new Map([["quat", column(found.quaternion, rows)]]);
    for (const key of ["bias", "sigma"]) if (found[key] !== undefined) columns.set(key, column(found[key], rows));
    columns.set("health", column(found.health === undefined ? new Uint32Array(rows) : new Uint32Array(found.health.buffer), rows));
    const parameters = known.parameters.map((one) => ({ ...one, value: (all[one.name] ?? one.value) as number | boolean | null }));
    return block({ filter: { name, parameters }, relative: known.relative[this.readings!.mag ? 1 : 0] }, columns);
  }
}

const column = (values: Numbers, rows: number): Column => ({ values, rows, width: values.length / rows });
const block = (header: object, columns = new Map<string, Column>()): Block => ({ header, columns });

const started = Promise.all([load("filters/facts.json"), loadFilters()]).then(([facts, filters]) => {
  facts.filters = facts.filters.filter(({ name }: Filter) => filters.has(name));
  return new PlainView(facts, filters);
});

serve(async (call) => {
  const view = await started;
  if (call.name === "open") return view.open(call);
  if (call.name === "about") return view.about();
  return view.track(call.args.filter as string, (call.args.values ?? {}) as Record<string, unknown>);
});

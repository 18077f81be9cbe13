// The filters as modules of `levelhead export --wasm`: readings in, orientation out, the bits of Python.

const beside = (path: string) => new URL(path, self.location.href).href;

/** A JSON file beside this page. */
export async function load(path: string): Promise<any> {
  const answer = await fetch(beside(path));
  if (!answer.ok) throw new Error(`${path} is missing beside this page`);
  return answer.json();
}

export async function loadFilter(folder: string): Promise<any> {
  return (await import(beside(`${folder}/index.js`))).Filter.load();
}

/** Name of each filter that is there to what loads it. */
export async function loadFilters(): Promise<Map<string, any>> {
  const folders = Object.entries(await load("filters/index.json") as Record<string, string>);
  return new Map(await Promise.all(folders.map(async ([name, folder]) => [name, await loadFilter(`filters/${folder}`)] as const)));
}

export interface Readings { gyr: Float64Array; acc: Float64Array; mag?: Float64Array | null; t: Float64Array }

/** Quaternion, and bias, sigma and health where the filter has them, of every sample. */
export function run(filter: any, values: Record<string, unknown>, { gyr, acc, mag, t }: Readings): Record<string, any> {
  for (const [name, value] of Object.entries(values)) if (name in filter.parameters) filter.parameters[name] = value;
  filter.reset();
  return filter.updateRows({ gyr, acc, mag: mag ?? null, t });
}

// A block of columns as typed arrays over the received bytes; levelhead/publish/dashboard/block.py has the layout.

export type Numbers = Float64Array | Float32Array | Uint32Array | Uint8Array;
export interface Column { values: Numbers; rows: number; width: number }
/** `bytes`: what all columns lie in, where they lie in nothing else. */
export interface Block { header: any; columns: Map<string, Column>; bytes?: ArrayBuffer }

const TYPES = { f8: Float64Array, f4: Float32Array, u4: Uint32Array, u1: Uint8Array } as const;

const padded = (place: number) => (place + 7) & ~7;

export function parseBlock(bytes: ArrayBuffer): Block {
  const view = new DataView(bytes);
  if (bytes.byteLength < 8 || view.getUint32(0, false) !== 0x4c484231) throw new Error("the answer is no block of columns");
  const length = view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length)));
  const columns = new Map<string, Column>();
  let place = padded(8 + length);
  for (const [name, type, rows, width] of header.columns as [string, keyof typeof TYPES, number, number][]) {
    const values = new TYPES[type](bytes, place, rows * width);
    columns.set(name, { values, rows, width });
    place = padded(place + values.byteLength);
  }
  return { header, columns, bytes };
}

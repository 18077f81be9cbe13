// Columns of decimal numbers out of the bytes of a CSV file, to the bit what Number and Python's float give.

const NEWLINE = 10, RETURN = 13, BLANK = 32, PLUS = 43, MINUS = 45, POINT = 46, ZERO = 48, NINE = 57;
const EXACT = 15; // digits of a whole number that is a double whatever they are
const POWERS = Array.from({ length: 23 }, (_, k) => Number(`1e${k}`)); // doubles: the quotient of two is rounded once (Clinger 1990)
export const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$/;

/** `whole`: whether no cell of a column has a point or an exponent. */
export interface Numbers { columns: Float64Array[]; whole: boolean[] }

/** The first cell that is no number, or a line with `cells` cells; lines count from 0. */
export interface Fault { line: number; place: number; cell: string; cells: number | null }

/** The columns at `places` of lines with `width` cells each, from byte `begin` on. */
export function readNumbers(bytes: Uint8Array, begin: number, delimiter: number, width: number, places: number[]): Numbers | Fault {
  const size = bytes.length, slots = new Int32Array(width).fill(-1);
  places.forEach((place, k) => { slots[place] = k; });
  let rows = 1;
  for (let at = begin; at < size; at++) if (bytes[at] === NEWLINE) rows++;
  const columns = places.map(() => new Float64Array(rows)), whole = places.map(() => true);
  let row = 0;
  for (let at = begin; at < size; row++) {
    for (let place = 0; place < width; place++) {
      const start = at, slot = slots[place];
      if (slot < 0) while (at < size && bytes[at] !== delimiter && bytes[at] !== NEWLINE) at++;
      else {
        while (bytes[at] === BLANK) at++;
        const sign = bytes[at];
        if (sign === MINUS || sign === PLUS) at++;
        let mantissa = 0, digits = at, decimals = 0;
        for (; bytes[at] >= ZERO && bytes[at] <= NINE; at++) mantissa = 10 * mantissa + bytes[at] - ZERO;
        digits = at - digits;
        if (bytes[at] === POINT) {
          const point = ++at;
          for (; bytes[at] >= ZERO && bytes[at] <= NINE; at++) mantissa = 10 * mantissa + bytes[at] - ZERO;
          decimals = at - point;
          digits += decimals;
          whole[slot] = false;
        }
        if (bytes[at] === RETURN) at++;
        const ends = at >= size || bytes[at] === delimiter || bytes[at] === NEWLINE;
        if (ends && digits > 0 && digits <= EXACT) columns[slot][row] = (sign === MINUS ? -mantissa : mantissa) / POWERS[decimals];
        else {
          while (at < size && bytes[at] !== delimiter && bytes[at] !== NEWLINE) at++;
          const cell = new TextDecoder().decode(bytes.subarray(start, at)).trim();
          if (!NUMBER.test(cell)) return row > 0 && at >= size && cell === "" && place === 0 ? trimmed(columns, whole, row) : { line: row, place, cell, cells: null };
          if (/[eE]/.test(cell)) whole[slot] = false;
          columns[slot][row] = Number(cell);
        }
      }
      const last = place === width - 1, ended = at >= size || bytes[at] === NEWLINE;
      if (last !== ended) return { line: row, place, cell: "", cells: place + (last ? 2 : 1) };
      at++;
    }
  }
  return trimmed(columns, whole, row);
}

const trimmed = (columns: Float64Array[], whole: boolean[], rows: number): Numbers => ({ columns: columns.map((column) => column.subarray(0, rows)), whole });

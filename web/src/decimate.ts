// The rows of a stretch of time for a chart: all of them while there is room, else minimum and maximum of each pixel.
import type { Clock, Curve } from "./curve";

/** `dense`: minimum and maximum of each pixel. */
export interface Drawn { x: number[]; ys: (number | null)[][]; dense: boolean }
const GAP = 8; // usual intervals without a sample, after which a curve is broken

/** `wraps`: whether each curve is an angle within ±180°, which is broken where it goes round. */
export function decimate(
  clock: Clock, curves: Curve[], wraps: boolean[], low: number, high: number, pixels: number, interval: number,
): Drawn {
  const begin = Math.max(0, clock.rowFrom(low) - 1), end = Math.min(clock.n, clock.rowFrom(high) + 1);
  const drawn: Drawn = { x: [], ys: curves.map(() => []), dense: end - begin > 2 * pixels };
  if (end <= begin) return drawn;
  if (!drawn.dense) drawRows(clock, curves, wraps, begin, end, interval, drawn);
  else drawPixels(clock, curves, wraps, begin, end, low, high, pixels, interval, drawn);
  return drawn;
}

const number = (value: number) => (Number.isFinite(value) ? value : null);

/** Ends the curves that go round, or all of them, before row `row`. */
function breakBefore(clock: Clock, curves: Curve[], wraps: boolean[], row: number, gap: boolean, drawn: Drawn): void {
  const broken = curves.map((curve, k) => gap || (wraps[k] && Math.abs(curve.values[row] - curve.values[row - 1]) > 180));
  if (!broken.some(Boolean)) return;
  drawn.x.push(clock.values[row]);
  curves.forEach((curve, k) => drawn.ys[k].push(broken[k] ? null : number(curve.values[row - 1])));
}

function drawRows(
  clock: Clock, curves: Curve[], wraps: boolean[], begin: number, end: number, interval: number, drawn: Drawn,
): void {
  const t = clock.values;
  for (let row = begin; row < end; row++) {
    if (row > begin) breakBefore(clock, curves, wraps, row, t[row] - t[row - 1] > GAP * interval, drawn);
    drawn.x.push(t[row]);
    curves.forEach((curve, k) => drawn.ys[k].push(number(curve.values[row])));
  }
}

function drawPixels(
  clock: Clock, curves: Curve[], wraps: boolean[], begin: number, end: number, low: number, high: number, pixels: number,
  interval: number, drawn: Drawn,
): void {
  const t = clock.values, width = (high - low) / pixels, round = curves.map(() => false);
  for (let pixel = 0, row = begin; pixel <= pixels && row < end; pixel++) {
    const next = pixel === pixels ? end : Math.min(end, clock.rowFrom(low + (pixel + 1) * width));
    if (next <= row) continue;
    if (row > begin) breakBefore(clock, curves, wraps, row, t[row] - t[row - 1] > GAP * interval, drawn);
    drawn.x.push(t[row], t[next - 1]);
    curves.forEach((curve, k) => {
      const [least, most] = curve.extent(row, next);
      const goesRound = wraps[k] && most - least > 180;
      // Once around within a pixel is a break; around and around is a field.
      if (least > most || (goesRound && !round[k])) drawn.ys[k].push(null, null);
      else if (curve.values[row] <= curve.values[next - 1]) drawn.ys[k].push(least, most);
      else drawn.ys[k].push(most, least);
      round[k] = goesRound && !round[k];
    });
    row = next;
  }
}

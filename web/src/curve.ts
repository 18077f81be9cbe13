// A curve of single precision with the minimum and maximum of its blocks, so that any stretch is drawn at once.

const BLOCK = 16;
const ADOPTED = 10_000; // values from which on a first array is taken as it is, not copied

export class Curve {
  values: Float32Array;
  n = 0;
  private least: Float32Array[] = [];
  private most: Float32Array[] = [];
  private summed = 0; // rows whose blocks are known; a curve that nobody draws needs none

  constructor(capacity = 1024) {
    this.values = new Float32Array(capacity);
  }

  /** Appends `count` values of `source`, each `stride` after the other, times `scale`. */
  append(source: ArrayLike<number>, count = source.length, offset = 0, stride = 1, scale = 1): void {
    const first = this.n;
    if (first === 0 && stride === 1 && scale === 1 && count > ADOPTED && source instanceof Float32Array && count === source.length) {
      this.values = source; // the caller keeps no other use of so long an array
      this.n = count;
      return;
    }
    this.reserve(first + count);
    if (stride === 1 && scale === 1) this.values.set(source, first);
    else copyColumn(source as Float32Array, this.values, first, count, offset, stride, scale);
    this.n = first + count;
  }

  /** Makes the values that are drawn, where they are made of other curves. */
  extend(): void { /* the values of most are given */ }

  clear(): void {
    this.n = this.summed = 0;
  }

  /** Drops the first `rows` values. */
  drop(rows: number): void {
    this.values.copyWithin(0, rows, this.n);
    this.n = Math.max(0, this.n - rows);
    this.summed = 0;
  }

  private reserve(size: number): void {
    if (size > this.values.length) this.values = grown(this.values, size);
  }

  /** Minimum and maximum of all blocks from that of row `first` on. */
  private summarise(first: number): void {
    let [low, high] = [this.values, this.values], size = this.n;
    this.summed = this.n;
    for (let level = 0; size > BLOCK; level++) {
      first = Math.floor(first / BLOCK);
      const blocks = Math.ceil(size / BLOCK);
      if (this.least[level] === undefined) this.least[level] = this.most[level] = new Float32Array(0);
      if (this.least[level].length < blocks) {
        this.least[level] = grown(this.least[level], blocks);
        this.most[level] = grown(this.most[level], blocks);
      }
      summariseLevel(low, high, size, this.least[level], this.most[level], first, blocks);
      [low, high, size] = [this.least[level], this.most[level], blocks];
    }
  }

  /** Minimum and maximum of the rows from `begin` to before `end`; infinite where none is a number. */
  extent(begin: number, end: number): [number, number] {
    if (this.summed < this.n) this.summarise(this.summed);
    let [low, high] = [this.values, this.values], lo = Infinity, hi = -Infinity, level = 0;
    for (;;) {
      const coarser = end - begin > 2 * BLOCK;
      const stop = coarser ? Math.ceil(begin / BLOCK) * BLOCK : end;
      for (; begin < stop; begin++) {
        if (low[begin] < lo) lo = low[begin];
        if (high[begin] > hi) hi = high[begin];
      }
      if (!coarser) return [lo, hi];
      for (const last = Math.floor(end / BLOCK) * BLOCK; end > last; end--) {
        if (low[end - 1] < lo) lo = low[end - 1];
        if (high[end - 1] > hi) hi = high[end - 1];
      }
      [low, high] = [this.least[level], this.most[level]];
      begin /= BLOCK;
      end /= BLOCK;
      level++;
    }
  }
}

/** A curve that is computed row by row from others, when it is first drawn. */
export class DerivedCurve extends Curve {
  constructor(private sources: Curve[], private value: (...values: number[]) => number) {
    super();
  }

  extend(): void {
    const from = this.n, found = new Float32Array(this.sources[0].n - from), columns = this.sources.map(({ values }) => values);
    if (found.length === 0) return;
    for (let i = 0; i < found.length; i++) found[i] = this.value(...columns.map((column) => column[from + i]));
    this.append(found);
  }
}

function summariseLevel(
  low: Float32Array, high: Float32Array, size: number, least: Float32Array, most: Float32Array, first: number, blocks: number,
): void {
  for (let block = first; block < blocks; block++) {
    let lo = Infinity, hi = -Infinity;
    for (let i = block * BLOCK, end = Math.min(size, i + BLOCK); i < end; i++) {
      const l = low[i], h = high[i];
      if (l < lo) lo = l;
      if (h > hi) hi = h;
    }
    least[block] = lo;
    most[block] = hi;
  }
}

function copyColumn(
  source: Float32Array, target: Float32Array, first: number, count: number, offset: number, stride: number, scale: number,
): void {
  for (let i = 0, from = offset; i < count; i++, from += stride) target[first + i] = source[from] * scale;
}

function grown(values: Float32Array, size: number): Float32Array {
  const larger = new Float32Array(Math.max(size, Math.ceil(1.5 * values.length)));
  larger.set(values);
  return larger;
}

/** Times of the rows, in s. */
export class Clock {
  values = new Float64Array(1024);
  n = 0;

  append(source: ArrayLike<number>): void {
    if (this.n + source.length > this.values.length) {
      const larger = new Float64Array(Math.max(this.n + source.length, Math.ceil(1.5 * this.values.length)));
      larger.set(this.values);
      this.values = larger;
    }
    this.values.set(source, this.n);
    this.n += source.length;
  }

  clear(): void {
    this.n = 0;
  }

  drop(rows: number): void {
    this.values.copyWithin(0, rows, this.n);
    this.n -= rows;
  }

  /** The first row at or after a time; n: none. */
  rowFrom(time: number): number {
    let low = 0, high = this.n;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.values[middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The row that is shown at a time: the nearest one. */
  rowAt(time: number): number {
    const after = this.rowFrom(time);
    if (after === 0) return 0;
    if (after === this.n) return this.n - 1;
    return time - this.values[after - 1] <= this.values[after] - time ? after - 1 : after;
  }

  get first(): number {
    return this.n > 0 ? this.values[0] : 0;
  }

  get last(): number {
    return this.n > 0 ? this.values[this.n - 1] : 0;
  }

  /** The usual interval: the median of a thousand. */
  get interval(): number {
    const step = Math.max(1, Math.floor(this.n / 1000)), found: number[] = [];
    for (let i = 1; i < this.n; i += step) found.push(this.values[i] - this.values[i - 1]);
    found.sort((a, b) => a - b);
    return found.length > 0 ? found[found.length >> 1] : 0.01;
  }
}

// Orientations of one filter, or of the truth: quaternion, angles within their range and without jumps, and their ±2σ.
import type { Block } from "./block";
import { Curve } from "./curve";

export type Quat = [number, number, number, number];
const DEGREE = 180 / Math.PI;

/** Roll, pitch and yaw in degrees, as Track.euler. */
export function euler(quat: Quat): number[] {
  return anglesOf(new Float32Array(quat), 1).map(([angle]) => angle);
}

const three = () => [new Curve(), new Curve(), new Curve()];

/** Roll, pitch and yaw in degrees, with the edges of ±2σ. */
export class Angles {
  angle = three();
  above = three();
  below = three();

  all(): Curve[] {
    return [...this.angle, ...this.above, ...this.below];
  }

  /** Appends angles, and their band by 1σ of tilt and heading. */
  append(angles: Float32Array[], doubt: [Float32Array, Float32Array] | null): void {
    angles.forEach((values, k) => {
      this.angle[k].append(values);
      if (doubt === null) return;
      const sigma = doubt[k < 2 ? 0 : 1], n = values.length, above = new Float32Array(n), below = new Float32Array(n);
      for (let i = 0; i < n; i++) {
        above[i] = values[i] + 2 * sigma[i];
        below[i] = values[i] - 2 * sigma[i];
      }
      this.above[k].append(above);
      this.below[k].append(below);
    });
  }
}

export class Attitude {
  quat = [...three(), new Curve()];
  wrapped = new Angles();
  sigmaTilt = new Curve();
  sigmaHeading = new Curve();
  hasSigma = false;
  score: { tilt: number; heading: number; total: number } | null = null;
  relative = false;
  private unrolled: Angles | null = null; // made when it is first asked for

  /** `reference`: the continuous angles follow those of this one. */
  constructor(public name: string, private reference: Attitude | null = null) {}

  clear(): void {
    for (const curve of this.curves()) curve.clear();
  }

  drop(rows: number): void {
    for (const curve of this.curves()) curve.drop(rows);
  }

  private curves(): Curve[] {
    return [...this.quat, this.sigmaTilt, this.sigmaHeading, ...this.wrapped.all(), ...(this.unrolled?.all() ?? [])];
  }

  append(block: Block, column = "quat"): void {
    const { values, rows } = block.columns.get(column)!, sigma = block.columns.get("sigma"), first = this.quat[0].n;
    this.quat.forEach((curve, k) => curve.append(values, rows, k, 4));
    this.hasSigma = sigma !== undefined;
    const doubt = sigma === undefined ? null : doubtOf(sigma.values as Float32Array, rows);
    if (doubt !== null) {
      this.sigmaTilt.append(doubt[0]);
      this.sigmaHeading.append(doubt[1]);
    }
    this.wrapped.append(anglesOf(values as Float32Array, rows), doubt);
    if (this.unrolled !== null) this.unroll(this.unrolled, first);
  }

  /** The angles without jumps; the first ones lie within their range. */
  get continuous(): Angles {
    if (this.unrolled === null) {
      this.unrolled = new Angles();
      this.unroll(this.unrolled, 0);
    }
    return this.unrolled;
  }

  private unroll(target: Angles, first: number): void {
    const n = this.quat[0].n, row = (curve: Curve) => curve.values.subarray(first, n);
    const angles = this.wrapped.angle.map((curve, k) => {
      const values = row(curve), found = new Float32Array(values.length), guide = this.reference?.continuous.angle[k].values;
      let last = first > 0 ? target.angle[k].values[first - 1] : NaN;
      for (let i = 0; i < values.length; i++) {
        const near = guide === undefined ? last : guide[first + i];
        found[i] = Number.isFinite(near) ? values[i] + 360 * Math.round((near - values[i]) / 360) : values[i];
        if (Number.isFinite(values[i])) last = found[i];
      }
      return found;
    });
    target.append(angles, this.hasSigma ? [row(this.sigmaTilt), row(this.sigmaHeading)] : null);
  }

  quatAt(row: number): Quat {
    return this.quat.map((curve) => curve.values[row]) as Quat;
  }
}

/** 1σ of tilt and heading in degrees. */
function doubtOf(sigma: Float32Array, n: number): [Float32Array, Float32Array] {
  const tilt = new Float32Array(n), heading = new Float32Array(n);
  for (let i = 0; i < n; i++) {
    const east = sigma[3 * i], north = sigma[3 * i + 1];
    tilt[i] = DEGREE * Math.sqrt(east * east + north * north);
    heading[i] = DEGREE * sigma[3 * i + 2];
  }
  return [tilt, heading];
}

function anglesOf(quat: Float32Array, n: number): Float32Array[] {
  const roll = new Float32Array(n), pitch = new Float32Array(n), yaw = new Float32Array(n);
  for (let i = 0; i < n; i++) {
    const w = quat[4 * i], x = quat[4 * i + 1], y = quat[4 * i + 2], z = quat[4 * i + 3];
    const forwardX = 1 - 2 * (y * y + z * z), forwardY = 2 * (w * z + x * y);
    roll[i] = DEGREE * Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
    pitch[i] = DEGREE * Math.atan2(2 * (w * y - z * x), Math.sqrt(forwardX * forwardX + forwardY * forwardY));
    yaw[i] = DEGREE * Math.atan2(forwardY, forwardX);
  }
  return [roll, pitch, yaw];
}

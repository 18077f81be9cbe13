// Curves: what is drawn of a stretch against all of its samples, and angles without jumps.
import assert from "node:assert/strict";
import test from "node:test";
import { buildSync } from "esbuild";

async function load(source) {
  const { outputFiles } = buildSync({ stdin: { contents: source, resolveDir: "src" }, bundle: true, format: "esm", write: false });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
}

const { Attitude, Clock, Curve, decimate } = await load(
  'export * from "./curve"; export * from "./decimate"; export * from "./attitude";');

function noise(n, seed = 1) {
  const values = new Float32Array(n);
  for (let i = 0, state = seed; i < n; i++) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    values[i] = state / 2 ** 31 - 1;
  }
  return values;
}

function series(values, rate = 100) {
  const clock = new Clock(), curve = new Curve();
  clock.append(Float64Array.from(values, (_, i) => i / rate));
  curve.append(values);
  return { clock, curve };
}

test("the extent of any stretch is that of its samples, also after single rows were appended or dropped", () => {
  const values = noise(10_000);
  values[77] = NaN;
  const curve = new Curve();
  curve.append(values.subarray(0, 4001));
  for (let i = 4001; i < 5000; i++) curve.append(values.subarray(i, i + 1));
  curve.append(values.subarray(5000));
  for (const shift of [0, 1234]) {
    if (shift > 0) curve.drop(shift);
    for (const [begin, end] of [[0, 8000], [3, 8], [60, 90], [15, 33], [255, 4097], [4095, 4096], [16, 32]]) {
      const known = [...values.subarray(shift + begin, shift + end)].filter(Number.isFinite);
      assert.deepEqual(curve.extent(begin, end), [Math.min(...known), Math.max(...known)]);
    }
  }
});

test("every sample while there is room, else minimum and maximum of each pixel", () => {
  const values = noise(2 ** 19); // 4096 s: times and pixels without rounding
  values[200_000] = 50; // one sample of an hour
  const { clock, curve } = series(values, 128);
  const whole = decimate(clock, [curve], [false], 0, 4096, 1024, 1 / 128);
  assert.ok(whole.x.length <= 2050 && whole.ys[0].includes(50));
  for (let pixel = 0; pixel < 1024; pixel++) {
    const rows = values.subarray(512 * pixel, 512 * (pixel + 1));
    const drawn = whole.ys[0].slice(2 * pixel, 2 * pixel + 2).sort((a, b) => a - b);
    assert.deepEqual(drawn, [Math.min(...rows), Math.max(...rows)]);
  }
  const zoomed = decimate(clock, [curve], [false], 1560, 1564, 1000, 1 / 128);
  assert.deepEqual(zoomed.ys[0], [...values.subarray(128 * 1560 - 1, 128 * 1564 + 1)]);
});

test("a gap in time and an angle that goes round break the curve; what is missing is not drawn", () => {
  const { curve } = series(Float32Array.of(170, 175, -175, -170, NaN, -160, -155)), clock = new Clock();
  clock.append(Float64Array.of(0, 0.01, 0.02, 0.03, 0.04, 0.05, 1));
  const { ys } = decimate(clock, [curve], [true], 0, 1, 100, 0.01);
  assert.deepEqual(ys[0], [170, 175, null, -175, -170, null, -160, null, -155]);
});

test("angles are those of the quaternion; continuous ones begin within their range and have no jump", () => {
  const n = 2000, quat = new Float32Array(4 * n), yaw = Float64Array.from({ length: n }, (_, i) => 150 + i);
  yaw.forEach((angle, i) => quat.set([Math.cos(angle * Math.PI / 360), 0, 0, Math.sin(angle * Math.PI / 360)], 4 * i));
  const attitude = new Attitude("a"), block = (from, to) => ({
    header: {}, columns: new Map([["quat", { values: quat.subarray(4 * from, 4 * to), rows: to - from, width: 4 }]]),
  });
  attitude.append(block(0, 500));
  assert.ok(Math.abs(attitude.continuous.angle[2].values[0] - 150) < 1e-3);
  attitude.append(block(500, n)); // as a node goes on
  for (let i = 0; i < n; i++) {
    assert.ok(Math.abs(attitude.continuous.angle[2].values[i] - yaw[i]) < 1e-2);
    assert.ok(Math.abs(attitude.wrapped.angle[2].values[i]) <= 180.001);
  }
});

// Numbers out of bytes against those of JavaScript itself, which rounds as Python does.
import assert from "node:assert/strict";
import test from "node:test";
import { buildSync } from "esbuild";

const { outputFiles } = buildSync({ entryPoints: ["src/numbers.ts"], bundle: true, format: "esm", write: false });
const { readNumbers } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const read = (text, width, places) => readNumbers(new TextEncoder().encode(text), 0, 44, width, places);

test("every cell is the double that its text is nearest to", () => {
  let state = 7;
  const random = () => { state = (Math.imul(state, 1664525) + 1013904223) >>> 0; return state / 2 ** 32; };
  const cells = ["-0.0", "+1", "0", ".5", "5.", "1e-7", "123456789012345678", "0.1234567890123456789", " 7", "-0.000001"];
  for (let i = 0; i < 20_000; i++) {
    const value = (random() - 0.5) * 10 ** Math.floor(12 * random());
    cells.push(i % 3 === 0 ? String(value) : value.toFixed(i % 12));
  }
  const { columns, whole } = read(cells.map((cell) => `word,${cell}`).join("\n") + "\n", 2, [1]);
  assert.equal(columns[0].length, cells.length);
  cells.forEach((cell, i) => assert.ok(Object.is(columns[0][i], Number(cell)), cell));
  assert.deepEqual(whole, [false]);
});

test("columns come in the order that is asked for, with any line ends", () => {
  const { columns, whole } = read("1,2.5,3\r\n4,5.5,6\r\n", 3, [2, 1]);
  assert.deepEqual(columns.map((column) => [...column]), [[3, 6], [2.5, 5.5]]);
  assert.deepEqual(whole, [true, false]);
  assert.deepEqual([...read("1,2\n3,4", 2, [0]).columns[0]], [1, 3]);
});

test("what is no number is named", () => {
  assert.deepEqual(read("1,2\n3,\n", 2, [1]), { line: 1, place: 1, cell: "", cells: null });
  assert.deepEqual(read("1,2\n3,0x4\n", 2, [1]), { line: 1, place: 1, cell: "0x4", cells: null });
  assert.equal(read("1,2\n3\n", 2, [0, 1]).cells, 1);
  assert.equal(read("1,2\n3,4,5\n", 2, [0]).cells, 3);
  assert.equal(read("1,2\n\n3,4\n", 2, [0]).cell, "");
});

"""An exported package for WebAssembly, run in node."""

import json
import subprocess
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import levelhead as lh

RUN = """
import { Filter } from './index.js';
import { readFileSync, writeFileSync } from 'node:fs';
const repeats = Number(process.argv[2]), n = Number(process.argv[3]);
const given = new Float64Array(readFileSync('rows').buffer);
const columns = { t: given.slice(0, n), gyr: given.slice(n, 4 * n), acc: given.slice(4 * n, 7 * n) };
columns.mag = given.length > 7 * n ? given.slice(7 * n) : null;
const quat = new Float64Array(4 * n);
const now = () => process.cpuUsage().user / 1000;
let rows = Infinity, live = Infinity, found;
for (let k = 0; k < repeats; k++) {
  const batch = await Filter.load(), single = await Filter.load();
  let began = now();
  found = batch.updateRows(columns);
  rows = Math.min(rows, now() - began);
  began = now();
  for (let i = 0; i < n; i++) {
    const part = (array) => array.subarray(3 * i, 3 * i + 3);
    const dt = i ? columns.t[i] - columns.t[i - 1] : 1;
    single.update(part(columns.gyr), part(columns.acc), columns.mag ? part(columns.mag) : null, dt);
    quat.set(single.quaternion, 4 * i);
  }
  live = Math.min(live, now() - began);
}
for (const [name, array] of Object.entries(found)) if (name !== 'taken') writeFileSync(name, array);
writeFileSync('live', quat);
console.log(JSON.stringify({ rows: rows * 1e6 / n, live: live * 1e6 / n }));
"""


class InNode(NamedTuple):
    """A recording through the package."""

    track: dict[str, np.ndarray[Any, Any]]  # quaternion, bias, sigma and health by rows, and live: the quaternion
    nanoseconds: dict[str, float]  # of a sample, by rows and live


def run_in_node(package: Path, recording: lh.Recording, repeats: int = 1) -> InNode:
    """All of a recording through a package that was written, as Float64Arrays."""
    columns = [recording.t, recording.gyr.ravel(), recording.acc.ravel()]
    columns += [] if recording.mag is None else [recording.mag.ravel()]
    np.concatenate(columns).astype("<f8").tofile(package / "rows")
    (package / "run.js").write_text(RUN, encoding="utf-8")
    command = ["node", "run.js", str(repeats), str(len(recording))]
    done = subprocess.run(command, cwd=package, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"node failed:\n{done.stderr}")
    found = {
        name: np.fromfile(package / name, "<f8").reshape(len(recording), -1)
        for name in ("quaternion", "bias", "sigma", "live")
        if (package / name).exists()
    }
    return InNode(found | {"health": np.fromfile(package / "health", "<i4")}, json.loads(done.stdout))

"""A filter as a package for npm: a module for WebAssembly without imports, its JavaScript and types, and a self-test.

clang and its linker for WebAssembly make the module: no other compiler that a package registry has does it alone.
"""

import hashlib
import json
import math
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from levelhead.errors import LevelheadError
from levelhead.export import frame, sensor
from levelhead.export.axis_api import AxisApi
from levelhead.export.c_api import CApi
from levelhead.export.config import ExportConfig
from levelhead.export.kinds import BOOL, INT, Struct, variable
from levelhead.export.layout import join_lines, template, wrap_line
from levelhead.export.selftest import BOUND
from levelhead.export.test_vectors import axis_rows, vector_rows
from levelhead.filters.parameters import Param, param_table
from levelhead.version import VERSION

COMMAND = (
    *("clang", "--target=wasm32", "-std=c99", "-O2", "-ffreestanding", "-nostdlib", "-mbulk-memory"),
    *("-DLH_FREESTANDING", "-Wl,--no-entry", "-Wl,--gc-sections", "-Wl,--strip-all", "-Wl,--export=__heap_base"),
)
ARRAYS = {"double": "Float64Array", "float": "Float32Array"}
PARTS = {"bias": 3, "sigma": 3}  # answers of several numbers beside the quaternion
WORDS = {
    "bias": "Bias of the gyroscope, rad/s.",
    "sigma": "1 sigma of the attitude error about {axes}, rad.",
    "health": "Faults of the last sample: bits; 0 means none.",
}
FIRST, PERIOD = 171.5, 360.0  # of the self-test of one axis


def package_files(api: CApi, sources: dict[str, str]) -> dict[str, str | bytes]:
    """Path inside the package -> text or bytes; ``sources``: header and source in C.

    Raises:
        LevelheadError: there is no clang for WebAssembly.
    """
    gaps = api.common_gaps() | _gaps(api)
    kind = "axis" if isinstance(api, AxisApi) else "imu"
    name = api.name
    shim = template(f"wasm.{kind}.c").substitute(gaps | {"build": " ".join(_command(name))})
    sources = {f"src/{file}": text for file, text in (sources | {f"{name}_module.c": shim}).items()}
    module = compile_module(sources, name)
    mark = list(hashlib.sha256(module).digest()[:8])
    common = template("wasm.common.js").substitute(gaps | {"mark": mark})
    return {
        "package.json": _manifest(api),
        "README.md": template(f"wasm.{kind}.md").substitute(gaps | {"package": _package(name)}),
        f"{name}.wasm": module,
        "index.js": template(f"wasm.{kind}.js").substitute(gaps | {"common": common}),
        "index.d.ts": template(f"wasm.{kind}.d.ts").substitute(gaps | _types(api)),
        "selftest.js": template("wasm.selftest.js").substitute(gaps | _selftest(api.config)),
        **sources,
    }


def _command(name: str) -> list[str]:
    return [*COMMAND, f"src/{name}_module.c", "-o", f"{name}.wasm"]


def _package(name: str) -> str:
    return name.replace("_", "-")


def compile_module(sources: dict[str, str], name: str) -> bytes:
    """The module, from path -> text.

    Raises:
        LevelheadError: there is no clang for WebAssembly.
    """
    if shutil.which("clang") is None or shutil.which("wasm-ld") is None:
        raise LevelheadError("--wasm needs clang and wasm-ld on the PATH; install clang and lld")
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for path, text in sources.items():
            (folder / path).parent.mkdir(exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        done = subprocess.run(_command(name), cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            said = done.stderr.strip().splitlines() or ["no reason given"]
            raise LevelheadError(
                f"clang made no module for WebAssembly: {said[0]}; expected clang 14 or later with lld"
            )
        return (folder / f"{name}.wasm").read_bytes()


def _manifest(api: CApi) -> str:
    package = {
        "name": _package(api.name),
        "version": VERSION,
        "description": str(api.config.flt.params.__doc__).split("\n")[0],
        "keywords": ["imu", "orientation", "ahrs", "sensor fusion", "wasm"],
        "license": "MIT",
        "type": "module",
        "exports": {
            ".": {"types": "./index.d.ts", "default": "./index.js"},
            f"./{api.name}.wasm": f"./{api.name}.wasm",
        },
        "types": "./index.d.ts",
        "files": ["index.js", "index.d.ts", f"{api.name}.wasm", "selftest.js", "src"],
        "sideEffects": False,
        "scripts": {"test": "node selftest.js"},
        "engines": {"node": ">=18"},
    }
    return json.dumps(package, indent=2) + "\n"


# Parameters


def _groups(api: CApi) -> Iterator[tuple[str, str, Struct]]:
    """Name in JavaScript, path in C, and the parameters there that the program reads."""
    settings = api.whole.fields.get("params" if api.config.axis else "settings")
    if isinstance(settings, Struct) and api.config.axis:
        yield "filter", "filter.params", settings
    elif isinstance(settings, Struct):
        for group, kind in settings.fields.items():
            if isinstance(kind, Struct):
                yield group, f"filter.settings.{group}", kind


def _parameters(api: CApi) -> Iterator[tuple[str, str, str, str, Param]]:
    """Group, name, path in C, kind in JavaScript, and meaning of each parameter."""
    for group, path, struct in _groups(api):
        assert struct.origin is not None
        table = param_table(struct.origin)
        for name, kind in struct.fields.items():
            word = "int" if kind is INT else "bool" if kind is BOOL else "real"
            yield group, name, f"{path}.{variable(name)}", word, table[name]


def _number(value: float) -> str:
    """A number in JavaScript, which has the digits of Python."""
    if math.isnan(value):
        return "NaN"
    return repr(value) if math.isfinite(value) else "Infinity" if value > 0.0 else "-Infinity"


def _gaps(api: CApi) -> dict[str, object]:
    config, found = api.config, list(_parameters(api))
    rows = [
        f"  ['{group}', '{name}', '{kind}', {_number(one.low)}, {str(not one.low_open).lower()}, "
        f"{_number(one.high)}, {str(not one.high_open).lower()}],"
        for group, name, _, kind, one in found
    ]
    addresses = ", ".join(f"&{path}" for _, _, path, _, _ in found)
    parameters = (
        join_lines(wrap_line(f"static void *const parameters[] = {{{addresses}}};", ""))
        + "\nLH_EXPORT(parameter) void *module_parameter(int32_t index)\n{\n    return parameters[index];\n}\n"
    )
    gaps = {
        "array": ARRAYS[config.real],
        "table": "[\n" + "\n".join(rows) + "\n]" if rows else "[]",
        "parameters": parameters if found else "",
    }
    return gaps | (_axis_gaps(api) if isinstance(api, AxisApi) else _imu_gaps(config))


def _axis_gaps(api: AxisApi) -> dict[str, object]:
    assert isinstance(api.report, Struct)
    fields = list(api.report.fields)
    found = ", ".join(f"report.{variable(name)}" for name in fields)
    return {"numbers": len(fields), "found": found, "fields": json.dumps(fields).replace('"', "'")}


def _imu_gaps(config: ExportConfig) -> dict[str, object]:
    parts, axes = [name for name in PARTS if name in config.answers], frame.axes_list(config.frame)
    found = [f"now.quat.{axis}" for axis in "wxyz"] + [f"angles.{name}" for name in ("roll", "pitch", "yaw")]
    found += [f"now.{name}.{axis}" for name in parts for axis in "xyz"]
    columns = {"quat": "wxyz", **dict.fromkeys(parts, "xyz")}
    row = [
        f"        {name}[{len(axes)} * i + {k}] = now.{name}.{axis};"
        for name, axes in columns.items()
        for k, axis in enumerate(axes)
    ]
    row += [f"        (void){name};" for name in PARTS if name not in parts]
    healthy = "health" in config.answers
    row.append("        health[i] = now.health;" if healthy else "        (void)health;")
    words = {name: WORDS[name].format(axes=axes) for name in parts}
    answers = [
        f"\n  /** {words[name]} */\n  get {name}() {{\n    return this.#numbers({7 + 3 * i}, 3);\n  }}\n"
        for i, name in enumerate(parts)
    ]
    rows = [
        f"\n      {name}: this.#memory.at(at[{4 + 1 + list(PARTS).index(name)}], 3 * count).slice()," for name in parts
    ]
    if healthy:
        answers.append(f"\n  /** {WORDS['health']} */\n  get health() {{\n    return this.#wasm.health();\n  }}\n")
        rows.append("\n      health: new Int32Array(this.#wasm.memory.buffer, at[7], count).slice(),")
    return {
        "numbers": len(found),
        "found": join_lines(wrap_line(", ".join(found), "")).strip(),
        "health": f"{config.name}_health(&filter)" if healthy else "0",
        "row": join_lines(row).rstrip(),
        "rows": "".join(rows),
        "answers": "".join(answers),
        "field": sensor.field_unit(config),
        "frame": sensor.frame(config),
        "earth": frame.axes_words(config.frame),
        "yaw": frame.YAW[config.frame],
        **_temperature(config),
    }


def _temperature(config: ExportConfig) -> dict[str, str]:
    """The gaps of the call that takes a temperature; empty without curves."""
    if not config.curves:
        return {"temperature": "", "temperature_js": "", "temperature_types": ""}
    words = "  /** The sensor's temperature, °C: its biases are those at it from here on. */\n"
    call = f"{config.name}_update_temperature(&filter, celsius);"
    return {
        "temperature": f"LH_EXPORT(temperature) void module_temperature({config.real} celsius)\n{{\n    {call}\n}}\n\n",
        "temperature_js": f"\n{words}  updateTemperature(celsius) {{\n    this.#wasm.temperature(celsius);\n  }}\n",
        "temperature_types": f"{words}  updateTemperature(celsius: number): void;\n",
    }


def _types(api: CApi) -> dict[str, str]:
    """The gaps of the declarations."""
    config = api.config
    groups: dict[str, list[str]] = {"filter": [], "guard": []}
    for group, name, _, kind, one in _parameters(api):
        unit = f"{one.unit}: " if one.unit else ""
        bounds = "" if one.range == "any number" else f" ({one.range})"
        word = "boolean" if kind == "bool" else "number"
        groups[group].append(f"  /** {unit}{one.doc}{bounds} */\n  {name}: {word};\n")
    found = {"parameters": "".join(groups["filter"]), "guard": "".join(groups["guard"])}
    if isinstance(api, AxisApi):
        assert isinstance(api.report, Struct)
        fields = list(api.report.fields)
        return found | {
            "rows": "".join(f" {name}: Numbers;" for name in fields),
            "report": "".join(f" {name}: number;" for name in fields),
        }
    axes = frame.axes_list(config.frame)
    answers = [name for name in ("bias", "sigma", "health") if name in config.answers]
    kinds = {"bias": "Numbers", "sigma": "Numbers", "health": "number"}
    rows = {"bias": "Numbers", "sigma": "Numbers", "health": "Int32Array"}
    return found | {
        "rows": "".join(f" {name}: {rows[name]};" for name in answers),
        "answers": "".join(
            f"  /** {WORDS[name].format(axes=axes)} */\n  get {name}(): {kinds[name]};\n" for name in answers
        ),
    }


# Self-test


def _list(values: Iterator[float] | tuple[float, ...]) -> str:
    return "[" + ", ".join(map(_number, values)) + "]"


def _selftest(config: ExportConfig) -> dict[str, object]:
    exact = "Object.is(a, b)"
    same = exact if config.real == "double" else f"{exact} || Math.abs(a - b) <= {BOUND} * (1 + Math.abs(b))"
    promise = "the same to the bit as" if config.real == "double" else f"within {BOUND:g} (1 + its size) of"
    warm = f"for (const one of [live, batch, again]) one.updateTemperature({config.test_temperature!r});\n"
    gaps = {
        "warm": warm if config.curves else "",
        "same": same,
        "promise": promise.removesuffix(" as").removesuffix(" of"),
    }
    if config.axis:
        lines = [
            f"  [{_list((row.level, row.rate, row.dt, PERIOD))}, {str(row.taken).lower()}, {_list(row.report)}],"
            for row in axis_rows(config, FIRST, PERIOD)
        ]
        columns = ", ".join(
            f"{name}: ROWS.map(([given]) => given[{k}])" for k, name in enumerate(("level", "rate", "dt"))
        )
        return gaps | {
            "rows": "\n".join(lines),
            "start": FIRST,
            "middle": len(lines) // 2,
            "answer": "Object.values(live.report)",
            "columns": f"{{ {columns}, period: {PERIOD:g} }}",
            "manyAnswer": "Object.keys(live.report).map((name) => many[name][i])",
        }
    lines = []
    for sample, taken, output in vector_rows(config):
        given = ", ".join([*map(_list, (sample.gyr, sample.acc, sample.mag)), _number(sample.dt)])
        numbers = [x for field in config.answers.values() if field != "health" for x in getattr(output, field)]
        numbers += [output.health] if "health" in config.answers else []
        lines.append(f"  [[{given}], {str(taken).lower()}, {_list(tuple(numbers))}],")
    answers = [name for name in config.answers if name not in ("quaternion", "health")]
    one = ["...live.quaternion", *(f"...live.{name}" for name in answers)]
    many = ["...many.quaternion.slice(4 * i, 4 * i + 4)"]
    many += [f"...many.{name}.slice(3 * i, 3 * i + 3)" for name in answers]
    if "health" in config.answers:
        one, many = [*one, "live.health"], [*many, "many.health[i]"]
    given_columns = [
        f"{name}: ROWS.flatMap(([given]) => given[{k}])" for k, name in enumerate(("gyr", "acc", "mag", "dt"))
    ]
    return gaps | {
        "rows": "\n".join(lines),
        "start": "",
        "middle": len(lines) // 2,
        "answer": f"[{', '.join(one)}]",
        "columns": f"{{ {', '.join(given_columns)} }}",
        "manyAnswer": f"[{', '.join(many)}]",
    }

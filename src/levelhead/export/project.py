"""The files of an export and where they lie; each appears whole or not at all."""

from collections.abc import Mapping
from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.export.arduino import sketch
from levelhead.export.axis_api import AxisApi
from levelhead.export.board import find_board, fitting, require_fit
from levelhead.export.c_api import CApi
from levelhead.export.chips import file_stem, find_chip
from levelhead.export.config import ExportConfig
from levelhead.export.imu_api import ImuApi
from levelhead.export.layout import template
from levelhead.export.library import library_files
from levelhead.export.selftest import selftest
from levelhead.export.wasm import package_files


def build_c_api(config: ExportConfig) -> ImuApi | AxisApi:
    """The writer of header and source for the chosen program."""
    return AxisApi(config) if config.axis else ImuApi(config)


def files(config: ExportConfig, arduino: bool = False) -> dict[str, str]:
    """Path inside the folder -> text of all that is exported.

    ``arduino``: as a library for the Arduino IDE, with the sketch as its example.

    Raises:
        LevelheadError: a kernel is outside of the language that can be translated; file and line come first. Or the
            sketch does not fit the board.
    """
    board = find_board(config.board) if config.board else None
    api = build_c_api(config)
    name, written, chip = config.name, api.write(), file_stem(find_chip(config.chip))
    if board is not None:
        require_fit(api, board)
    if not arduino:
        return {
            **written,
            **selftest(api),
            "CMakeLists.txt": _cmake(api, "", ""),
            f"{name}_{chip}/{name}_{chip}.ino": sketch(api, fitting(api), beside=True),
        }
    return {
        **{f"{name}/src/{file}": text for file, text in written.items()},
        **{f"{name}/{file}": text for file, text in library_files(api, written[f"{name}.h"]).items()},
        **{f"{name}/extras/{file}": text for file, text in selftest(api).items()},
        f"{name}/CMakeLists.txt": _cmake(api, "src/", "extras/"),
        f"{name}/examples/{chip}/{chip}.ino": sketch(api, fitting(api), beside=False),
    }


def _cmake(api: CApi, sources: str, tests: str) -> str:
    """Without a word about one filter: exports into the same folder share it."""
    folder = api.name if sources else "board"
    gaps = {"sources": sources, "selftest": tests, "folder": folder}
    return template("CMakeLists.txt").substitute(api.common_gaps() | gaps)


def write(config: ExportConfig, folder: Path, arduino: bool = False) -> list[Path]:
    """Writes an export into a folder, which is made if it is not there; returns the paths.

    Raises:
        LevelheadError: a kernel cannot be translated, or the folder cannot be written.
    """
    return _write(files(config, arduino), folder)


def write_package(config: ExportConfig, folder: Path) -> list[Path]:
    """Writes a package for npm, as a folder of the filter's name; returns the paths.

    Raises:
        LevelheadError: as ``write``, or there is no clang for WebAssembly.
    """
    api = build_c_api(config)
    found = package_files(api, api.write())
    return _write({f"{config.name.replace('_', '-')}/{file}": content for file, content in found.items()}, folder)


def _write(contents: Mapping[str, str | bytes], folder: Path) -> list[Path]:
    written = []
    for name, content in contents.items():
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LevelheadError(f"cannot make the folder {path.parent}: {error.strerror or error}") from None
        with atomic_path(path) as temporary:
            temporary.write_bytes(content if isinstance(content, bytes) else content.encode())
        written.append(path)
    return written

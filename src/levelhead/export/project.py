"""The files of an export and where they lie; each appears whole or not at all."""

from pathlib import Path

from levelhead.atomic import atomic_path
from levelhead.errors import LevelheadError
from levelhead.export.arduino import sketch
from levelhead.export.c_api import AxisFace, Face, ImuFace
from levelhead.export.config import Choice
from levelhead.export.layout import template
from levelhead.export.selftest import selftest


def files(choice: Choice, arduino: bool = False) -> dict[str, str]:
    """Path inside the folder -> text of all that is exported.

    ``arduino``: as a library for the Arduino IDE, with the sketch as its example.

    Raises:
        LevelheadError: a kernel is outside of the language that can be translated; file and line come first.
    """
    face: ImuFace | AxisFace = AxisFace(choice) if choice.axis else ImuFace(choice)
    name = choice.name
    if not arduino:
        return {
            **face.write(),
            **selftest(face),
            "CMakeLists.txt": _cmake(face, "", ""),
            f"{name}_mpu6050/{name}_mpu6050.ino": sketch(face, beside=True),
        }
    sentence = str(choice.flt.params.__doc__).split("\n")[0]
    return {
        **{f"{name}/src/{file}": text for file, text in face.write().items()},
        **{f"{name}/extras/{file}": text for file, text in selftest(face).items()},
        f"{name}/CMakeLists.txt": _cmake(face, "src/", "extras/"),
        f"{name}/library.properties": template("library.properties").substitute(face.common() | {"sentence": sentence}),
        f"{name}/examples/mpu6050/mpu6050.ino": sketch(face, beside=False),
    }


def _cmake(face: Face, sources: str, tests: str) -> str:
    return template("CMakeLists.txt").substitute(face.common() | {"sources": sources, "selftest": tests})


def write(choice: Choice, folder: Path, arduino: bool = False) -> list[Path]:
    """Writes an export into a folder, which is made if it is not there; returns what was written.

    Raises:
        LevelheadError: a kernel cannot be translated, or the folder cannot be written.
    """
    written = []
    for name, text in files(choice, arduino).items():
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LevelheadError(f"cannot make the folder {path.parent}: {error.strerror or error}") from None
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        written.append(path)
    return written

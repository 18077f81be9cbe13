"""A library folder for Arduino and PlatformIO: its description, a class, and an example of its use."""

import json
import re

from levelhead.export.c_api import CApi
from levelhead.export.frame import YAW
from levelhead.export.layout import template
from levelhead.version import VERSION

URL = "https://pypi.org/project/levelhead"
BITS = {
    "double": "gives the same bits as the filter in Python",
    "float": "the same filter as in Python but for the rounding of float",
}
METHODS = {
    False: ("begin", "update", "getRoll", "getPitch", "getYaw"),
    True: ("setAngle", "getAngle", "report"),
}


def class_name(name: str) -> str:
    """lh_kalman_axis -> LhKalmanAxis."""
    return "".join(word.title() for word in name.split("_"))


def library_files(api: CApi, header: str) -> dict[str, str]:
    """Path inside of the library -> text, but for C, self-test and the sketch that logs; ``header``: the C's."""
    config, name = api.config, api.name
    kind = "axis" if config.axis else "imu"
    sentence = str(config.flt.params.__doc__).split("\n")[0]
    gaps = api.common_gaps() | {
        "sentence": sentence,
        "bits": BITS[config.real],
        "url": URL,
        "class_name": class_name(name),
        "yaw": YAW[config.frame],
        "temperature": template("class.temperature.h").substitute(api.common_gaps()) if config.curves else "",
        "title_words": sentence.rstrip("."),
    }
    return {
        "library.properties": template("library.properties").substitute(gaps),
        "library.json": _platformio(api, sentence),
        "keywords.txt": _keywords(name, header, config.axis),
        f"src/{class_name(name)}.h": template(f"class.{kind}.h").substitute(gaps),
        "examples/simple/simple.ino": template(f"simple.{kind}.ino").substitute(gaps),
    }


def _platformio(api: CApi, sentence: str) -> str:
    """The manifest of PlatformIO."""
    return (
        json.dumps(
            {
                "name": api.name,
                "version": VERSION,
                "description": sentence,
                "keywords": ["imu", "orientation", "ahrs", "sensor fusion"],
                "homepage": URL,
                "license": "MIT",
                "frameworks": "*",
                "platforms": "*",
                "headers": [f"{class_name(api.name)}.h", f"{api.name}.h"],
                "build": {"srcDir": "src", "includeDir": "src"},
            },
            indent=2,
        )
        + "\n"
    )


def _keywords(name: str, header: str, axis: bool) -> str:
    """The words that the IDE colours: tabs between the columns."""
    functions = sorted(set(re.findall(rf"\b{name}_\w+(?=\()", header)))
    types = sorted(set(re.findall(rf"}} ({name}\w*);", header)))
    lines = [f"{word}\tKEYWORD1" for word in (class_name(name), *types)]
    lines += [f"{word}\tKEYWORD2" for word in (*METHODS[axis], *functions)]
    return "\n".join(lines) + "\n"

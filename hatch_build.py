"""Builds the native engine with the package; without a C compiler the package is built all the same, and says so."""

import shutil
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PAGES = ("tutorials", "howto", "coming-from", "reference", "explanation")  # for `levelhead help`


class NativeEngine(BuildHookInterface):
    """For a wheel into the wheel, for an editable install beside the sources."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling before a wheel is made."""
        if version != "editable":
            for part in PAGES:
                build_data["force_include"][str(Path(self.root, "docs", part))] = f"levelhead/docs/{part}"
        sys.path.insert(0, str(Path(self.root, "src")))
        from levelhead.engine.native import up_to_date
        from levelhead.export.extension import FILE, PLACE, NoCompilerError, build

        if version == "editable" and up_to_date():
            return
        made = Path(self.root, "build", "native", FILE)
        try:
            build(made.parent, made)
        except NoCompilerError as error:
            self.app.display_warning(
                f"levelhead is built without its native engine, so that Numba or plain Python does the work: {error}"
            )
            return
        if version == "editable":
            shutil.copy(made, PLACE.with_suffix(".new"))
            PLACE.with_suffix(".new").replace(PLACE)
            return
        build_data["pure_python"] = False
        build_data["tag"] = f"cp311-abi3-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
        build_data["force_include"][str(made)] = f"levelhead/engine/{FILE}"

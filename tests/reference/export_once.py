"""One trace of a filter for the tests of a process that export it with the same configuration."""

import contextlib
import copy
import dataclasses
from collections.abc import Iterator

import numpy as np

from levelhead.export import project
from levelhead.export.axis_api import AxisApi
from levelhead.export.config import ExportConfig
from levelhead.export.imu_api import ImuApi

KEPT = 16  # programs: each has its graph in memory


@contextlib.contextmanager
def export_once() -> Iterator[None]:
    """While this is entered, ``project`` takes the program of a configuration that differs in the command alone."""
    build = project.build_c_api
    made: dict[str, ImuApi | AxisApi] = {}

    def build_once(config: ExportConfig) -> ImuApi | AxisApi:
        with np.printoptions(floatmode="unique", threshold=10**6):
            key = repr(dataclasses.replace(config, command=""))
        made[key] = api = made.pop(key, None) or build(config)
        for old in list(made)[:-KEPT]:
            del made[old]
        api = copy.copy(api)
        api.config = config
        return api

    project.build_c_api = build_once
    try:
        yield
    finally:
        project.build_c_api = build

"""The methods of a comparison: levelhead's default, its smoother, its filters, and the contenders."""

from collections.abc import Sequence
from typing import NamedTuple

from levelhead import filters
from levelhead.bench import contenders
from levelhead.engine import fuse, smooth
from levelhead.errors import LevelheadError, nearest
from levelhead.filters.parameters import Params, short_name
from levelhead.recording import Array, Recording

DEFAULT = "default"
SMOOTHER = "smoother"
OURS = "levelhead"


class Method(NamedTuple):
    """A way from a recording to an orientation.

    Attributes:
        name: as in a table.
        params: of one of levelhead's filters; None for its default and for contenders.
    """

    name: str
    params: Params | None = None

    @property
    def package(self) -> str:
        """Whose it is: "levelhead", or the contender's package."""
        return contenders.BY_NAME[self.name].package if self.name in contenders.BY_NAME else OURS

    def orientation(self, recording: Recording) -> Array:
        """(n, 4) quaternions wxyz, sensor to earth."""
        return self.run(recording)[0]

    def run(self, recording: Recording) -> tuple[Array, Array | None]:
        """(n, 4) quaternions wxyz, sensor to earth, and (n, 3) 1σ about east, north and up, rad, if it has one."""
        if self.name in contenders.BY_NAME:
            return contenders.BY_NAME[self.name].run(recording), None
        track = (smooth if self.name == SMOOTHER else fuse)(recording, self.params)
        return track.quat, track.sigma


def ours() -> list[Method]:
    """The default, the smoother and all of levelhead's filters."""
    return [Method(DEFAULT), Method(SMOOTHER), *(Method(flt.name, flt.params()) for flt in filters.ALL)]


def all_methods() -> tuple[list[Method], list[str]]:
    """All that can run here, and a sentence for each package that is not installed."""
    there = [Method(one.name) for one in contenders.ALL if one.installed]
    absent = dict.fromkeys(one.package for one in contenders.ALL if not one.installed)
    return ours() + there, [f"{package} is not installed: {contenders.INSTALL}" for package in absent]


def from_params(params: Params) -> Method:
    """One of levelhead's filters with parameters."""
    return Method(short_name(params), params)


def find_method(name: str) -> Method:
    """The method of that name: "default", a filter's, or a contender's such as vqf.VQF; case, - and _ do not count.

    Raises:
        LevelheadError: there is none, or its package is not installed.
    """
    known = {method.name: method for method in ours()} | {one.name: Method(one.name) for one in contenders.ALL}
    method = {_plain(key): method for key, method in known.items()}.get(_plain(name))
    if method is None:
        raise LevelheadError(f"there is no filter or contender '{name}'; {nearest(name, known)}")
    if method.name in contenders.BY_NAME and not contenders.BY_NAME[method.name].installed:
        raise LevelheadError(
            f"{method.name} cannot run, because {method.package} is not installed: {contenders.INSTALL}"
        )
    return method


def _plain(name: str) -> str:
    return name.lower().replace("-", "").replace("_", "")


def distinct_methods(methods: Sequence[Method]) -> list[Method]:
    """The methods, each once."""
    return list({method.name: method for method in methods}.values())

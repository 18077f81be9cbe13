"""The one error that levelhead raises for what a user can put right."""

import difflib
import importlib.util
from collections.abc import Iterable


class LevelheadError(ValueError):
    """Bad input, in one sentence: what is wrong, where, and what would be right.

    The command line prints it on one line and leaves with ``exit_code``.
    """

    exit_code = 2


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint for a word that is not known: the nearest known one, or the whole list.

    >>> nearest("r_mesure", ["q_angle", "q_bias", "r_measure"])
    "did you mean 'r_measure'?"
    """
    names = list(known)
    lowered = {name.lower(): name for name in names}
    close = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=0.5)
    if close:
        return f"did you mean '{lowered[close[0]]}'?"
    return f"known: {', '.join(names)}" if names else "there are none"


def require(package: str, what: str, extra: str) -> None:
    """Makes sure that a package is installed that only some uses need.

    Raises:
        LevelheadError: it is not; the sentence names the extra that brings it.
    """
    if importlib.util.find_spec(package) is None:
        raise LevelheadError(f"{what} needs {package}: pip install 'levelhead[{extra}]'")

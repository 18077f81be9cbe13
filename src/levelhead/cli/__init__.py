"""The command ``levelhead``: one thin module per verb, loaded when the verb is used."""

import sys
from collections.abc import Sequence

from cyclopts import App
from cyclopts.exceptions import CycloptsError

from levelhead import __version__
from levelhead.errors import LevelheadError

HELP = """Turn the contradictory readings of an IMU into an orientation that people can trust.

Start with `levelhead demo`; then `levelhead fuse LOG` for a recording of your own.
"""

app = App(name="levelhead", help=HELP, version=__version__, help_format="markdown")
VERBS = {
    "demo": "The classic lesson: two sensors that lie, and what filters make of them.",
    "fuse": "Fuse a log into orientation: the main job.",
    "compare": "Filters side by side on a recording: a table and the four-panel picture.",
    "sweep": "One parameter over its range: where is the best value, and how flat is it there?",
    "simulate": "Write a simulated recording with known truth.",
}
for verb, words in VERBS.items():
    app.command(f"levelhead.cli.{verb}:{verb}", name=verb, help=words, sort_key=list(VERBS).index(verb))
app.register_install_completion_command(help="Complete commands, options and filter names in your shell.")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; returns its exit code: 0, 2 for bad input (one line on standard error), 130 for Ctrl-C."""
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    try:
        app(tokens, exit_on_error=False, print_error=False, result_action="return_none")
    except (LevelheadError, CycloptsError) as error:
        words = " ".join(str(error).split())
        sys.stderr.write(f"levelhead: {words}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("levelhead: stopped\n")
        return 130
    except BrokenPipeError:  # the reader of our output has seen enough
        sys.stderr.close()
        return 0
    return 0

"""The command ``levelhead``: one thin module per verb, loaded when the verb is used.

A short run spends most of its time in its start, so a verb imports only the modules that it uses.
"""

import atexit
import gc
import io
import os
import sys
from collections.abc import Sequence

from cyclopts import App, Parameter
from cyclopts.exceptions import CycloptsError, UnknownOptionError, UnusedCliTokensError

from levelhead import __version__
from levelhead.errors import LevelheadError
from levelhead.standard_output import NAME, standard_output

HELP = """Turn the contradictory readings of an IMU into an orientation that people can trust.

Start with `levelhead demo`; then `levelhead fuse LOG` for a recording of your own. `levelhead help` lists all pages.
"""


def _default(value: object) -> str | None:
    """A default that the help shows; a flag that is off shows none."""
    return None if value in (None, (), "") or value is False else str(value)


app = App(
    name="levelhead",
    help=HELP,
    version=__version__,
    help_format="markdown",
    default_parameter=Parameter(show_default=_default),
)
PIPE = "/dev/stdin"  # written as -
SAME_HINTS = frozenset({"explain", "stress", "noise", "calibrate", "view", "convert"})
WITHOUT_OUT = {  # verbs without a folder of results, and the option meant by --out
    "run": "--box FILE.mcap for a record of the run",
    "explain": "--plot FILE for the picture of the evidence, or --json > FILE for the symptoms as JSON",
}
VERBS = {
    "demo": "Show the lesson: an accelerometer and a gyroscope with errors, and the results of the filters.",
    "fuse": "Fuse a log into orientation.",
    "doctor": "Find the problems of a log, each with its evidence and cure.",
    "explain": "Explain the symptoms of a track, such as drift or jitter, each with its cause and cure.",
    "noise": "Measure the noise of a sensor at rest (Allan deviation); write a file for filters and simulations.",
    "calibrate": "Find the errors of a sensor from poses by hand, in a log or live, each number with its σ.",
    "smooth": "Estimate orientation from the whole recording at every instant.",
    "compare": "Compare filters on a recording: a table and a picture of four panels.",
    "sweep": "Vary one parameter over its range: the best value, and how flat the minimum is.",
    "tune": "Search a filter's parameters for your logs, with a true orientation or without, and judge the gain.",
    "stress": "Put faults on a recording: error, recovery, health and σ of filters and of other packages.",
    "run": "Run a live node: read a real, emulated or replayed sensor and publish its orientation.",
    "view": "Show a recording or a running node in the browser.",
    "ports": "List serial ports, and I²C buses with the chips on them.",
    "axes": "Find the mounting of the sensor on its body, from a still pose and one turn.",
    "joint": "Find the angles of a joint, such as a knee, from a sensor on each of its two segments.",
    "gait": "Find the path and the strides of a foot, from a sensor on the shoe.",
    "align": "Find convention, mounting and delay between two orientations.",
    "sync": "Find offset and drift of the clocks of several sensors on one body.",
    "export": "Write a filter with its numbers as C99 for a microcontroller, with self-test and Arduino sketch.",
    "convert": "Write a log, track or black box in another format: mcap, bag, db3, parquet, csv, npz, rrd or sto.",
    "simulate": "Write a simulated recording with known truth.",
    "corpus": "Apply one verb to many recordings: folders, patterns and URLs, on all cores or a cluster.",
    "bench": "Compare levelhead with other packages: errors on real recordings, and times.",
    "help": "Show a page of the documentation in the terminal, such as yaw-drift or enu-ned.",
}
for verb, words in VERBS.items():
    app.command(f"levelhead.cli.{verb}:{verb}", name=verb, help=words, sort_key=list(VERBS).index(verb))

# The interpreter looks for garbage in every object before it ends: a fifth of a short run. All of it goes anyway.
atexit.register(gc.freeze)


def main(arguments: Sequence[str] | None = None) -> int:  # noqa: PLR0911
    """Runs the command line; returns its exit code: 0, 2 for bad input (one sentence and a topic of help on standard
    error), 3 for a live source that was lost, 130 for Ctrl-C.
    """
    tokens = [PIPE if token == "-" else token for token in (sys.argv[1:] if arguments is None else arguments)]
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal or pipe without σ gets a ? and no traceback
    _start(tokens)
    try:
        code = app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        with standard_output():
            sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except UnusedCliTokensError as error:
        extra = " ".join(error.unused_tokens or ())
        return _report_error(f"'{extra}' is one argument too many; --help shows the arguments", "option")
    except UnknownOptionError as error:
        return _report_error(_unknown_option(error, tokens), "option")
    except (LevelheadError, CycloptsError) as error:
        family = error.code if isinstance(error, LevelheadError) else "option"
        return _report_error(_text(error, tokens), family, getattr(error, "exit_code", 2))
    except MemoryError:
        return _report_error("that needs more memory than there is", "")
    except KeyboardInterrupt:
        sys.stderr.write("levelhead: stopped\n")
        return 130
    except BrokenPipeError:  # the reader of our output has seen enough
        _discard_output()
    except OSError as error:
        if error.filename == NAME:
            _discard_output()
            return _report_error(f"{NAME}: {error.strerror or error}", "output")
        where, family = (f"{error.filename}: ", "file") if error.filename else ("", "")
        return _report_error(f"{where}{error.strerror or error}", family)
    return 0


def _start(tokens: Sequence[str]) -> None:
    """Settings of the process, and the completion command where no verb is given."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # NumPy starts a thread for each core, for products of matrices
    gc.set_threshold(1_000_000, 20, 20)  # importing makes many objects, hardly one of which is garbage
    if not (tokens and tokens[0] in VERBS) and "--install-completion" not in app:
        app.register_install_completion_command(help="Complete commands, options and filter names in your shell.")


def _text(error: Exception, tokens: Sequence[str]) -> str:
    """The sentence of an error; the command in it has the verb that was typed, if that verb takes the same hints."""
    from levelhead.sources.hints import SuggestsCommand

    if not isinstance(error, SuggestsCommand):
        return str(error)
    verb = tokens[0] if tokens and "--live" not in tokens else ""
    return error.text(verb if verb in SAME_HINTS else "fuse")


def _unknown_option(error: UnknownOptionError, tokens: Sequence[str]) -> str:
    """The message for an option that a verb does not have, but most of its siblings do."""
    typed = (error.token.keyword or error.token.value).partition("=")[0]
    typed = "-o" if typed.startswith("-o") else typed  # -oFILE
    if typed not in ("-o", "--out") or tokens[0] not in WITHOUT_OUT:
        return str(error)
    return f"{tokens[0]} has no option {typed}; expected {WITHOUT_OUT[tokens[0]]}"


def _report_error(words: str, family: str, exit_code: int = 2) -> int:
    """The sentence on one line, and the topic of ``levelhead help`` with its cause and cure on the next one."""
    sys.stderr.write(f"levelhead: {' '.join(words.split())}\n")
    if family:
        sys.stderr.write(f"  more: levelhead help {family}\n")
    return exit_code


def _discard_output() -> None:
    """Standard output takes nothing any more; without this the interpreter would try once more as it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

"""riann 0.2.0: D. Weber, C. Gühmann, T. Seel, RIANN, AI 2021, 2(3), 444-463: a recurrent network, for tilt alone.

It is in SI units and its earth frame has z up. It takes no magnetometer, and its heading has no meaning.
"""

from importlib.resources import as_file, files

import numpy as np

from levelhead.recording import Array, Recording


def tilt(recording: Recording) -> Array:
    """(n, 4) by the network that the package brings. Its path is given, because 0.2.0 does not find it itself."""
    from riann.riann import RIANN

    with as_file(files("riann") / "riann.onnx") as network:
        one = RIANN(str(network))
    found: Array = np.asarray(one.predict(recording.acc, recording.gyr, recording.rate), dtype=float)
    return found

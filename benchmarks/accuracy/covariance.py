"""Covariance of the self-calibrating filter over ten million samples of everything that is hard, in double and float.

Pieces of simulated recordings, one after the other through one filter: other chips, motions and sample rates; readings
missing in bursts and for good, gaps of up to an hour, a gyroscope at full scale, magnets, blows of 100 g, and readings
that stand still to the last bit. Double is the native engine, float the C of ``levelhead export --float``. P is
looked at after every 1000 samples, σ of attitude after each one.
"""

import numpy as np
from benchmarks.measure import options, show
from tests.reference.covariance import PIECE, Exported, Native, piece, watch

import levelhead as lh
from levelhead.bench.timing import Table

CASES = {
    "double, native": (lh.ESKF(), Native),
    "float, exported C": (lh.ESKF(), Exported),
    "double, a correction at every sample": (lh.ESKF(block=0.0), Native),
    "float, a correction at every sample": (lh.ESKF(block=0.0), Exported),
}
COLUMNS = {
    "case": "case",
    "looks": "looks at P",
    "crooked": "largest |P − Pᵀ|",
    "least": "least eigenvalue",
    "zero": "samples with σ ≤ 0 or NaN",
    "smallest": "least σ °",
    "largest": "largest σ °",
}


def main() -> None:
    """Run all of it."""
    parser = options(__doc__, repeats=1)
    parser.add_argument("--samples", type=int, default=10_000_000, help="samples of each case (default 10,000,000)")
    given = parser.parse_args()
    rows = []
    for name, (params, kind) in CASES.items():
        found = watch(kind(params), map(piece, range(given.samples // PIECE)))
        angles = {"smallest": np.degrees(found.smallest), "largest": np.degrees(found.largest)}
        rows.append({"case": name, **found._asdict(), **angles})
    note = "Eigenvalues of P scaled to a diagonal of ones. Resolution of double 2.2e-16, of float 1.2e-7."
    show([Table(f"Covariance over {given.samples:,} samples", COLUMNS, rows, note)], given.json)


if __name__ == "__main__":
    main()

"""Published filters in C by hand, without what levelhead adds."""

from pathlib import Path

TWINS = Path(__file__).parents[2] / "benchmarks" / "c" / "twins"
NAMES = ("twin_mahony", "twin_madgwick", "twin_kalman_axis")
LEAN = TWINS.parent / "lean"  # exports by hand, to the bit
LEAN_NAMES = ("lean_mahony", "lean_ekf")

"""One step of the smoother backwards, over fixed-size memory as the filter has it.

With A = P⁻_k+1, B = F P_k, d = x_k+1 + x^s_k+1 and the Cholesky factor A = Rᵀ R:

    Rᵀ Y = B,   R Gᵀ = Y                                                                                        (1)
    x^s_k = G d,   P^s_k = P_k + G (P^s_k+1 − A) Gᵀ                                                             (2)

Everything goes by whole rows, which vector instructions take. A state without variance, or one that the past says
nothing about, has a column of zeros in G, and what only it would need is left out.
"""

from math import sqrt

from levelhead.compiler.mark import WIDE, kernel, noinline
from levelhead.filters.eskf import state as at
from levelhead.kernels.arrays import Floats, copy, subtract_rows

WHOLE = at.ROW * at.ROW  # numbers of a matrix; those of aiding stay unused
N = WIDE
LEAST = 1e-13  # share of a variance that must be left of it for it to say something of its own

# The memory
AHEAD = 0  # A, then P^s_k+1 − A
FACTOR = AHEAD + WHOLE  # R
GAIN = FACTOR + WHOLE  # B, then Y, then Gᵀ
LATER = GAIN + WHOLE  # P^s_k+1
NOW = LATER + WHOLE  # P_k, then P^s_k
PRODUCT = NOW + WHOLE
OFF = PRODUCT + WHOLE  # d
SMOOTHED = OFF + at.ROW  # x^s
SIZE = SMOOTHED + at.ROW


@kernel
def scaled(m: Floats, row: int, factor: float) -> None:
    """A row times a number."""
    for i in range(N):
        m[row + i] = m[row + i] * factor


@kernel
def factorize(m: Floats, cut: bool) -> None:
    """R by rows; the diagonal holds 1/R_jj, and 0 for what tells nothing."""
    copy(m, FACTOR, AHEAD, WHOLE)
    for j in range(N):
        row = FACTOR + j * at.ROW
        if m[AHEAD + j * at.ROW + j] > 0.0:
            subtract_rows(m, row, FACTOR + j, at.ROW, FACTOR, at.ROW, j)
        pivot = m[row + j]
        silent = pivot <= LEAST * m[AHEAD + j * at.ROW + j] or (cut and at.VELOCITY <= j < at.VELOCITY + at.DRIVEN)
        one = 0.0 if silent else 1.0 / sqrt(pivot)
        scaled(m, row, one)
        m[row + j] = one


@kernel
def solve(m: Floats) -> None:
    """Eq. 1."""
    for j in range(N):
        if m[FACTOR + j * at.ROW + j] != 0.0:
            subtract_rows(m, GAIN + j * at.ROW, FACTOR + j, at.ROW, GAIN, at.ROW, j)
        scaled(m, GAIN + j * at.ROW, m[FACTOR + j * at.ROW + j])
    for k in range(N):
        j = N - 1 - k
        after = j + 1
        if m[FACTOR + j * at.ROW + j] != 0.0:
            subtract_rows(m, GAIN + j * at.ROW, FACTOR + j * at.ROW + after, 1, GAIN + after * at.ROW, at.ROW, k)
        scaled(m, GAIN + j * at.ROW, m[FACTOR + j * at.ROW + j])


@kernel
def combine(m: Floats) -> None:
    """Eq. 2."""
    for i in range(WHOLE):
        m[AHEAD + i] = m[LATER + i] - m[AHEAD + i]
        m[PRODUCT + i] = 0.0
    for i in range(at.ROW):
        m[SMOOTHED + i] = 0.0
        m[OFF + i] = -m[OFF + i]
    subtract_rows(m, SMOOTHED, OFF, 1, GAIN, at.ROW, N)
    for i in range(N):
        if m[FACTOR + i * at.ROW + i] != 0.0:
            subtract_rows(m, PRODUCT + i * at.ROW, AHEAD + i * at.ROW, 1, GAIN, at.ROW, N)
    for i in range(N):
        if m[NOW + i * at.ROW + i] != 0.0:
            subtract_rows(m, NOW + i * at.ROW, GAIN + i, at.ROW, PRODUCT, at.ROW, N)
    for i in range(N):
        for j in range(i):
            m[NOW + i * at.ROW + j] = m[NOW + j * at.ROW + i]


@noinline
def step_back(m: Floats, cut: bool) -> None:
    """Eqs. 1 and 2: from AHEAD, GAIN = B, LATER, NOW = P_k and OFF to SMOOTHED and NOW."""
    factorize(m, cut)
    solve(m)
    combine(m)

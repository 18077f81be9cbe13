"""One step of the smoother backwards, over fixed-size memory as the filter has it.

With A = P⁻_k+1, B = F P_k, d = x_k+1 + x^s_k+1 and the Cholesky factor A = Rᵀ R:

    Rᵀ Y = B,   R Gᵀ = Y                                                                                        (1)
    x^s_k = G d,   P^s_k = P_k + G (P^s_k+1 − A) Gᵀ                                                             (2)

Everything goes by whole rows, which vector instructions take. A state without variance, or one that the past says
nothing about, has a column of zeros in G.
"""

from math import sqrt

from levelhead.filters.error_state import DRIVEN, HERE, ROW, SPEED
from levelhead.kernels.arrays import Floats, add_scaled, copy
from levelhead.kernels.jit import kernel, rare

WHOLE = ROW * ROW  # numbers of a matrix; those of aiding stay unused
N = HERE
LEAST = 1e-13  # share of a variance that must be left of it for it to say something of its own

# The memory
AHEAD = 0  # A, then P^s_k+1 − A
FACTOR = AHEAD + WHOLE  # R
GAIN = FACTOR + WHOLE  # B, then Y, then Gᵀ
LATER = GAIN + WHOLE  # P^s_k+1
NOW = LATER + WHOLE  # P_k, then P^s_k
PRODUCT = NOW + WHOLE
OFF = PRODUCT + WHOLE  # d
SMOOTHED = OFF + ROW  # x^s
SIZE = SMOOTHED + ROW


@kernel
def factorize(m: Floats, cut: bool) -> None:
    """R by rows; the diagonal holds 1/R_jj, and 0 for what tells nothing."""
    copy(m, FACTOR, AHEAD, WHOLE)
    for j in range(N):
        row = FACTOR + j * ROW
        pivot = m[row + j]
        silent = pivot <= LEAST * m[AHEAD + j * ROW + j] or (cut and SPEED <= j < SPEED + DRIVEN)
        one = 0.0 if silent else 1.0 / sqrt(pivot)
        for i in range(j + 1, N):
            m[row + i] = m[row + i] * one
        m[row + j] = one
        for i in range(j + 1, N):
            if m[row + i] != 0.0:
                add_scaled(m, FACTOR + i * ROW + i, -m[row + i], row + i, N - i)


@kernel
def solve(m: Floats) -> None:
    """Eq. 1."""
    for j in range(N):
        row = FACTOR + j * ROW
        for i in range(N):
            m[GAIN + j * ROW + i] = m[GAIN + j * ROW + i] * m[row + j]
        for i in range(j + 1, N):
            if m[row + i] != 0.0:
                add_scaled(m, GAIN + i * ROW, -m[row + i], GAIN + j * ROW, N)
    for k in range(N):
        j = N - 1 - k
        for i in range(N):
            m[GAIN + j * ROW + i] = m[GAIN + j * ROW + i] * m[FACTOR + j * ROW + j]
        for i in range(j):
            weight = m[FACTOR + i * ROW + j]
            if weight != 0.0:
                add_scaled(m, GAIN + i * ROW, -weight, GAIN + j * ROW, N)


@kernel
def combine(m: Floats) -> None:
    """Eq. 2."""
    for i in range(WHOLE):
        m[AHEAD + i] = m[LATER + i] - m[AHEAD + i]
        m[PRODUCT + i] = 0.0
    for i in range(ROW):
        m[SMOOTHED + i] = 0.0
    for i in range(N):
        if m[FACTOR + i * ROW + i] != 0.0:
            add_scaled(m, SMOOTHED, m[OFF + i], GAIN + i * ROW, N)
            for j in range(N):
                add_scaled(m, PRODUCT + i * ROW, m[AHEAD + i * ROW + j], GAIN + j * ROW, N)
    for j in range(N):
        if m[FACTOR + j * ROW + j] != 0.0:
            for i in range(N):
                add_scaled(m, NOW + i * ROW + i, m[GAIN + j * ROW + i], PRODUCT + j * ROW + i, N - i)
    for i in range(N):
        for j in range(i):
            m[NOW + i * ROW + j] = m[NOW + j * ROW + i]


@rare
def step_back(m: Floats, cut: bool) -> None:
    """Eqs. 1 and 2: from AHEAD, GAIN = B, LATER, NOW = P_k and OFF to SMOOTHED and NOW."""
    factorize(m, cut)
    solve(m)
    combine(m)

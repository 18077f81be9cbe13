"""Symmetric positive semidefinite matrices by rows in one row of floats: A = L Lᵀ, and A X = B.

G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., 2013, sections 4.2.5 and 4.2.8. A pivot that is zero to
working precision belongs to what is known exactly; its row and column of L are zero, and so is its part of X: the
solution in the space that A spans.
"""

from math import sqrt

from levelhead.kernels.arrays import Floats
from levelhead.kernels.jit import rare

TINY = 1e-13  # of the diagonal element that the pivot was


@rare
def factor(a: Floats, size: int, n: int) -> None:
    """A (n × n of ``size`` columns) is replaced by L, which has its lower triangle."""
    for j in range(n):
        row = j * size
        before = a[row + j]
        pivot = before
        for k in range(j):
            pivot -= a[row + k] * a[row + k]
        if pivot > TINY * before:
            root = sqrt(pivot)
            a[row + j] = root
            one = 1.0 / root
            for i in range(j + 1, n):
                at = i * size
                total = a[at + j]
                for k in range(j):
                    total -= a[at + k] * a[row + k]
                a[at + j] = total * one
        else:
            for i in range(j, n):
                a[i * size + j] = 0.0


@rare
def solve(low: Floats, size: int, n: int, b: Floats, columns: int) -> None:
    """B (n × ``columns`` of ``size``) is replaced by X of L Lᵀ X = B."""
    for i in range(n):
        row = i * size
        if low[row + i] == 0.0:
            for c in range(columns):
                b[row + c] = 0.0
        else:
            for k in range(i):
                weight = low[row + k]
                for c in range(columns):
                    b[row + c] -= weight * b[k * size + c]
            one = 1.0 / low[row + i]
            for c in range(columns):
                b[row + c] *= one
    for down in range(n):
        i = n - 1 - down
        row = i * size
        if low[row + i] != 0.0:
            for k in range(i + 1, n):
                weight = low[k * size + i]
                for c in range(columns):
                    b[row + c] -= weight * b[k * size + c]
            one = 1.0 / low[row + i]
            for c in range(columns):
                b[row + c] *= one

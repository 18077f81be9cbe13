"""Coefficients of the polynomials in ``kernels/trig.py``, in exact fractions, by economized Taylor series.

A long Taylor series in u on [0, b] is written in shifted Chebyshev polynomials T*_k, cut, and written in powers of u
again (C. Lanczos, Applied Analysis, 1956, chapter 7). What is cut off is spread evenly over the interval, so that the
error is nearly the least that a polynomial of this degree can have. Only the end result is rounded to floats.
"""

from fractions import Fraction
from math import factorial

LONG = 40  # terms of the Taylor series: what is left out is below 1e-30
PI = Fraction(31415926535897932384626433832795028841971693993751, 10**49)
TAN2 = Fraction(1715728752538099023966225515806038428607, 10**40)  # tan² π/8 = 3 − 2√2


def shifted_chebyshev(count: int, b: Fraction) -> list[list[Fraction]]:
    """T*_0 … T*_{count−1} in powers of u, for u in [0, b]: T*_k = 2 (2u/b − 1) T*_{k−1} − T*_{k−2}."""
    polynomials = [[Fraction(1)], [Fraction(-1), 2 / b]]
    while len(polynomials) < count:
        one, two = polynomials[-1], [*polynomials[-2], Fraction(0), Fraction(0)]
        up = [Fraction(0), *(4 * c / b for c in one)]
        polynomials.append([a - 2 * c - d for a, c, d in zip(up, [*one, Fraction(0)], two, strict=True)])
    return polynomials


def economized(taylor: list[Fraction], b: Fraction, terms: int) -> list[float]:
    """The ``terms`` coefficients that are left when all higher T*_k have been taken off the Taylor series."""
    basis = shifted_chebyshev(len(taylor), b)
    rest = list(taylor)
    while len(rest) > terms:
        highest = basis[len(rest) - 1]
        share = rest[-1] / highest[-1]
        rest = [c - share * t for c, t in zip(rest, highest, strict=True)][:-1]
    return [float(c) for c in rest]


def arctangent(terms: int) -> list[float]:
    """(atan t/t − 1)/u in powers of u = t², |t| ≤ tan π/8."""
    return economized([Fraction((-1) ** k, 2 * k + 1) for k in range(1, LONG)], TAN2, terms)


def sine(terms: int) -> list[float]:
    """(sin r/r − 1)/u in powers of u = r², |r| ≤ π/4."""
    return economized([Fraction((-1) ** k, factorial(2 * k + 1)) for k in range(1, LONG)], (PI / 4) ** 2, terms)


def cosine(terms: int) -> list[float]:
    """(cos r − 1 + u/2)/u² in powers of u = r², |r| ≤ π/4."""
    return economized([Fraction((-1) ** k, factorial(2 * k)) for k in range(2, LONG)], (PI / 4) ** 2, terms)


def half_pi_parts() -> tuple[float, float, float]:
    """π/2 in three floats: the first two with 33 bits, the third the rest."""
    first = _short(PI / 2)
    second = _short(PI / 2 - Fraction(first))
    return first, second, float(PI / 2 - Fraction(first) - Fraction(second))


def _short(value: Fraction, bits: int = 33) -> float:
    unit = Fraction(1)
    while value / unit < 2 ** (bits - 1):
        unit /= 2
    return float(int(value / unit) * unit)


if __name__ == "__main__":
    for name, numbers in (("atan", arctangent(11)), ("sin", sine(6)), ("cos", cosine(6)), ("π/2", half_pi_parts())):
        print(name, *map(repr, numbers), sep="\n  ")  # noqa: T201

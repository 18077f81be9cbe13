"""The error state of ``ESKF`` in memory: where each state stands, and the algebra of its covariance.

One row of floats holds the covariance P by rows, the mean of what is additive (attitude is not), the correction
x gathered in a block, a row h of a measurement, P hᵀ, the couplings F − 1 of the states that others drive, their rows
of F P, what was seen of position and velocity, and integrals over the block.

Prediction: P ← F P Fᵀ + Q. Only velocity and attitude are driven by others, so that six rows change (1).
Measurements are scalar, one after the other (P. S. Maybeck, Stochastic Models, Estimation, and Control, vol. 1, 1979,
section 7.4). With a row h, variance r and innovation y of the state as it was before the block:

    s = h P hᵀ + r,   u = P hᵀ/√s                                                                              (2)
    x ← x + u (y − h x)/√s,   P ← P − u uᵀ                                                                     (3)

u_i u_j is u_j u_i to the last bit, so that P stays symmetric by itself. States before ``first`` are only considered
(S. F. Schmidt, Application of State-Space Methods to Navigation Problems, 1966): their gain is zero, and with
k = u/√s elsewhere

    P ← P − k (P hᵀ)ᵀ − (P hᵀ) kᵀ + s k kᵀ                                                                     (4)

is (3) but for the block of P that belongs to them alone, which stays.
"""

from math import sqrt

from levelhead.compiler.mark import kernel, noinline
from levelhead.kernels.arrays import Floats, add_scaled, copy
from levelhead.kernels.vec3 import Vec3

# The states. Those before TURN_Z are the horizon and what hangs on it: a magnetometer only considers them. Those from
# MAG on exist with a magnetometer only, those from PLACE on where position or velocity is seen (``filters.aiding``); of
# what does not exist yet the first n leave out what stands behind.
ACC = 0  # accelerometer bias c, m/s², 3
SPEED = 3  # velocity v, m/s, earth frame, 3
TURN = 6  # attitude θ, rad, earth frame, 3
TURN_Z = 8
BIAS = 9  # gyroscope bias b, rad/s, 3
GYR = 12  # gyroscope matrix S, 9 by rows
MAG = 21  # horizontal and vertical field m, in units of the first norm, 2
IRON = 23  # magnetometer offset o, the same unit, 3
DELAY = 26  # by which the magnetometer is late, s
EAST = 27  # of the field where the sensor is, which points aside of north, the same unit
PLACE = 28  # position p, m, earth frame, 3
AIR = 31  # by which the barometer's height is off, m
N = 32
DRIVEN = 6  # from SPEED on

# How much of a row is computed: fours, which vector instructions take. What does not exist is zero there.
BARE = 24  # without a magnetometer
HERE = 28  # without position and velocity
ROW = 32  # all of it; from one row to the next

# The memory
P = 0
MEAN = P + ROW * ROW
X = MEAN + ROW
H = X + ROW
U = H + ROW
F = U + ROW
W = F + DRIVEN * ROW
KNOWN = W + DRIVEN * ROW  # what an earlier run has learned: means, the field's in µT,
SURE = KNOWN + N  # and their σ; 0: nothing known
AGE = SURE + N  # s over which Q has been added
ROWS = 7  # that can be seen: position 3, velocity 3, height by barometer
SIGHT = AGE + 1  # Σ y/σ² of a row's innovations in the block
WEIGHT = SIGHT + ROWS  # Σ 1/σ²
SINCE = WEIGHT + ROWS  # s since a row was last believed
OUT = SINCE + ROWS  # s for which it has not been, 0: it is
SWIFT = OUT + ROWS  # (m/s)², to which velocity went while it was aided, 3
AIDED = SWIFT + 3  # 0: nothing of this was ever seen
ROTATED = AIDED + 1  # ∫ R dt, 9
SCALED = ROTATED + 9  # ∫ R_ik ω_l dt, 27
PUSHED = SCALED + 27  # ∫ f dt, earth frame, 3
TURNED = PUSHED + 3  # ∫ ω dt, 3
WOUND = TURNED + 3  # ∫ |ω|² dt
SHOVED = WOUND + 1  # ∫ |f − g|² dt
HEARD = SHOVED + 1  # s with an accelerometer
SPELL = HEARD + 1  # s
FIELD = SPELL + 1  # Σ e, 3
SEEN = FIELD + 3  # Σ R where the field was seen, 9
LATE = SEEN + 9  # Σ R (ω × h), 3
COUNT = LATE + 3
LOST = COUNT + 1  # variance of turns that were not measured, rad²
LOST_Z = LOST + 1
CUT = LOST_Z + 1  # s of a gap before the block
FOUND = CUT + 1  # 1: attitude was taken from the sensors at the end of the block
GONE = FOUND + 1  # share of EAST that was forgotten
SIZE = GONE + 1


@kernel
def independent(m: Floats, first: int, count: int, sigma: float) -> None:
    """States that know nothing of others, and themselves to this σ."""
    for i in range(first, first + count):
        for j in range(N):
            m[P + i * ROW + j] = 0.0
            m[P + j * ROW + i] = 0.0
        m[P + i * ROW + i] = sigma * sigma


@kernel
def recall(m: Floats, first: int, count: int, unit: float) -> None:
    """What an earlier run has learned of these states, in these units; their σ becomes no larger."""
    for i in range(first, first + count):
        sigma = m[SURE + i] / unit
        if sigma > 0.0:
            m[MEAN + i] = m[KNOWN + i] / unit
            m[P + i * ROW + i] = min(m[P + i * ROW + i], sigma * sigma)


@kernel
def widen(m: Floats, first: int, count: int, variance: float) -> None:
    """Q of independent states."""
    for i in range(first, first + count):
        m[P + i * ROW + i] += variance


@kernel
def vector(m: Floats, at: int) -> Vec3:
    """Three numbers from memory."""
    return Vec3(m[at], m[at + 1], m[at + 2])


@kernel
def variance(m: Floats, i: int) -> float:
    """Of one state."""
    return m[P + i * ROW + i]


@kernel
def driven_rows(m: Floats, n: int) -> None:
    """Rows of F P."""
    for i in range(DRIVEN):
        row = i * ROW
        copy(m, W + row, P + SPEED * ROW + row, n)
        for k in range(n):
            if m[F + row + k] != 0.0:
                add_scaled(m, W + row, m[F + row + k], P + k * ROW, n)


@kernel
def driven_block(m: Floats, n: int) -> None:
    """What of F P Fᵀ driven states have in common, where F P stands already."""
    for j in range(DRIVEN):
        for k in range(n):
            weight = m[F + j * ROW + k]
            if weight != 0.0:
                for i in range(j + 1):
                    m[P + (SPEED + i) * ROW + SPEED + j] += weight * m[W + i * ROW + k]
    for i in range(DRIVEN):
        for j in range(i):
            m[P + (SPEED + i) * ROW + SPEED + j] = m[P + (SPEED + j) * ROW + SPEED + i]


@noinline
def propagate(m: Floats, n: int) -> None:
    """Eq. 1, P ← F P Fᵀ."""
    driven_rows(m, n)
    for j in range(n):
        for i in range(DRIVEN):
            m[P + j * ROW + SPEED + i] = m[W + i * ROW + j]
    for i in range(DRIVEN):
        copy(m, P + (SPEED + i) * ROW, W + i * ROW, n)
    driven_block(m, n)


@noinline
def carry_place(m: Floats, n: int, dt: float) -> None:
    """Eq. 1 of p ← p + v dt."""
    for i in range(3):
        for j in range(n):
            m[P + (PLACE + i) * ROW + j] += dt * m[P + (SPEED + i) * ROW + j]
    for i in range(3):
        row = P + (PLACE + i) * ROW
        for j in range(i, 3):
            m[row + PLACE + j] += dt * m[row + SPEED + j]
        for j in range(n):
            if j < PLACE or j > PLACE + i:
                m[P + j * ROW + PLACE + i] = m[row + j]


@noinline
def take_along(m: Floats, p: int, n: int, x: float, y: float) -> None:
    """Errors of velocity by what it is since it was corrected by (x, y): θ_z takes more of it along, θ_z × (x, y).

    Without this the covariance at ``p`` would claim to know heading the better, the more often velocity is corrected,
    though nothing has told it (A. Barrau, S. Bonnabel, The invariant extended Kalman filter as a stable observer, IEEE
    Transactions on Automatic Control 62(4), 2017).
    """
    east = p + SPEED * ROW
    north = east + ROW
    turn = p + TURN_Z * ROW
    add_scaled(m, east, -y, turn, n)
    add_scaled(m, north, x, turn, n)
    for j in range(n):
        row = p + j * ROW
        m[row + SPEED] -= y * m[row + TURN_Z]
        m[row + SPEED + 1] += x * m[row + TURN_Z]
    m[north + SPEED] = m[east + SPEED + 1]


@noinline
def measure(m: Floats, n: int, first: int, innovation: float, noise: float) -> float:
    """Eqs. 2 to 4 with the row h, which is zero again afterwards; returns innovation²/s."""
    for i in range(n):
        m[U + i] = 0.0
    for j in range(n):
        if m[H + j] != 0.0:
            add_scaled(m, U, m[H + j], P + j * ROW, n)
    s = noise
    for j in range(n):
        s += m[H + j] * m[U + j]
        innovation -= m[H + j] * m[X + j]
        m[H + j] = 0.0
    one = 1.0 / sqrt(s)
    gain = innovation * one
    for i in range(n):
        m[U + i] = m[U + i] * one
    add_scaled(m, X + first, gain, U + first, n - first)
    for i in range(n):
        start = first if i < first else 0
        add_scaled(m, P + i * ROW + start, -m[U + i], U + start, n - start)
    return gain * gain

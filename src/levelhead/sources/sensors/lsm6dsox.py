"""LSM6DSOX, LSM6DSO: the LSM6DSO32 with other full scales of the accelerometer (ST DS12814, table 2 and CTRL1_XL).

All three give the same identity: the name is on the board.
"""

import functools

from levelhead.sources.sensors import lsm6dso32
from levelhead.sources.sensors.fifo_imu import FifoImu
from levelhead.units import GRAVITY

ACC_BITS = {2.0: 0.061e-3, 4.0: 0.122e-3, 8.0: 0.244e-3, 16.0: 0.488e-3}  # g
ACC_CODES = {2.0: 0x00, 16.0: 0x04, 4.0: 0x08, 8.0: 0x0C}

CHIP = lsm6dso32.CHIP._replace(
    name="LSM6DSOX", acc_bits={g: bit * GRAVITY for g, bit in ACC_BITS.items()}, acc_codes=ACC_CODES
)
LSM6DSOX = functools.partial(FifoImu, CHIP)

"""What the readings of an IMU show by themselves: rest, gravity's turn, mean force, the field."""

"""Properties of an IMU's readings by themselves: rest, gravity's turn, mean force, the field."""

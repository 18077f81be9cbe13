float mag_count[3];  // uT, of each axis: the chip holds its own factor

bool read_sensitivities() {
  if (!read_registers(MAGNETOMETER, $register, 3)) {
    return false;
  }
  for (int k = 0; k < 3; k++) {
    mag_count[k] = MAG_COUNT * (1.0f + ((int)Wire.read() - 128) / 256.0f);
  }
  return true;
}


bool start_field() {
  return read_registers(MAGNETOMETER, $identity, 1) && (Wire.read() & $mask) == $value
    && $starts;
}

// The field in uT, in the axes of the other readings; false if there is nothing new, or more than the range holds.
bool read_field(float mag[3]) {
  uint8_t bytes[$size];
  if (!read_registers(MAGNETOMETER, $status, sizeof bytes)) {
    return false;
  }
  for (uint8_t &one : bytes) {
    one = Wire.read();
  }
$lines
  return $fresh;
}


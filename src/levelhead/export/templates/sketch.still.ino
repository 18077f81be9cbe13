// The mean rate of two seconds, if the sensor was still; false if it was not.
bool calibrate() {
  float sum[3] = {0.0f, 0.0f, 0.0f}, low[3], high[3], gyr[3], acc[3];
  for (int i = 0; i < 200; i++) {
    delay(10);
    if (!read_chip(gyr, acc)) {
      return false;
    }
    for (int k = 0; k < 3; k++) {
      low[k] = i == 0 || gyr[k] < low[k] ? gyr[k] : low[k];
      high[k] = i == 0 || gyr[k] > high[k] ? gyr[k] : high[k];
      sum[k] += gyr[k];
    }
  }
  for (int k = 0; k < 3; k++) {
    if (high[k] - low[k] > 2.0f * DEGREE) {
      return false;
    }
    bias[k] = sum[k] / 200.0f;
  }
  return true;
}


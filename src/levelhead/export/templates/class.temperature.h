  // The sensor's temperature, deg C: its biases are those at it from here on.
  void updateTemperature($real celsius) { ${name}_update_temperature(&filter, celsius); }


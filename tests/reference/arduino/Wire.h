// An I2C bus with one chip that reads what a file says: 6 numbers a line, gyr in deg/s, acc in g.
#pragma once
#include "Arduino.h"

struct Bus {
  void begin() {}
  void setClock(unsigned long) {}
  void beginTransmission(uint8_t address);
  void write(uint8_t value);
  uint8_t endTransmission(bool stop = true);
  uint8_t requestFrom(uint8_t address, uint8_t count);
  uint8_t read();
};
extern Bus Wire;

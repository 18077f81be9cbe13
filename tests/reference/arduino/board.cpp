// The board: runs the sketch over a file of readings, one every 10 ms of virtual time; the bus is deaf for row 300.
#include <cstdlib>
#include <vector>

#include "Wire.h"

uint64_t now_us = 0;
Port Serial;
Bus Wire;
static std::vector<double> readings;
static uint8_t registers[256] = {0};
static uint8_t address, pointer, bytes[14];
static int written, next_byte;

static size_t row() { return now_us / 10000; }

void Bus::beginTransmission(uint8_t to) { address = to; written = 0; }

void Bus::write(uint8_t value) {
  if (written++ == 0) pointer = value;
  else registers[pointer] = value;
}

uint8_t Bus::endTransmission(bool) { return address == 0x68 && row() != 300 ? 0 : 2; }

uint8_t Bus::requestFrom(uint8_t from, uint8_t count) {
  if (from != 0x68 || count != 14 || pointer != 0x3B || registers[0x6B] & 0x40) return 0;
  const double gyr_lsb = 131.0 / (1 << (registers[0x1B] >> 3 & 3)), acc_lsb = 16384.0 / (1 << (registers[0x1C] >> 3 & 3));
  const double *reading = &readings[6 * row()];
  for (int i = 0; i < 7; i++) {
    const double value = i < 3 ? reading[3 + i] * acc_lsb : i == 3 ? -3000.0 : reading[i - 4] * gyr_lsb;
    const double kept = value > 32767.0 ? 32767.0 : value < -32768.0 ? -32768.0 : value;
    const int16_t counts = (int16_t)std::lround(kept);
    bytes[2 * i] = (uint8_t)((uint16_t)counts >> 8);
    bytes[2 * i + 1] = (uint8_t)counts;
  }
  next_byte = 0;
  return 14;
}

uint8_t Bus::read() { return bytes[next_byte++]; }

int main(int, char **arguments) {
  std::FILE *file = std::fopen(arguments[1], "r");
  double value;
  while (std::fscanf(file, "%lf", &value) == 1) readings.push_back(value);
  std::fclose(file);
  setup();
  while (6 * (row() + 1) < readings.size()) {
    loop();
    now_us += 137;
  }
  return 0;
}

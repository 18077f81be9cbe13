// The board with the chip that the defines are of: runs the sketch over a file of readings, one every 10 ms of virtual time; the bus is deaf for row 300.
#include <cstdlib>
#include <vector>

#include "Wire.h"

uint64_t now_us = 0;
Port Serial;
Bus Wire;
static std::vector<double> readings;
static uint8_t registers[256] = {0};
static uint8_t address, pointer, bytes[32];
static int written, next_byte;

static size_t row() { return now_us / 10000; }

void Bus::beginTransmission(uint8_t to) { address = to; written = 0; }

void Bus::write(uint8_t value) {
  if (written++ == 0) pointer = value;
  else registers[pointer] = value;
}

uint8_t Bus::endTransmission(bool) { return address == ADDRESS && row() != 300 ? 0 : 2; }

uint8_t Bus::requestFrom(uint8_t from, uint8_t count) {
  next_byte = 0;
  if (from == ADDRESS && count == 1 && pointer == ID_REGISTER) {
    bytes[0] = IDENTITY;
    return 1;
  }
  if (from != ADDRESS || count != 2 * WORDS || pointer != FIRST || !(AWAKE)) return 0;
  const double *reading = &readings[6 * row()];
  for (int i = 0; i < WORDS; i++) {
    const int gyr = i - GYR_WORD, acc = i - ACC_WORD;
    const double value = gyr >= 0 && gyr < 3 ? reading[gyr] * (GYR_LSB)
      : acc >= 0 && acc < 3 ? reading[3 + acc] * (ACC_LSB) : -3000.0;
    const double kept = value > 32767.0 ? 32767.0 : value < -32768.0 ? -32768.0 : value;
    const uint16_t counts = (uint16_t)(int16_t)std::lround(kept);
    bytes[2 * i + LITTLE] = (uint8_t)(counts >> 8);
    bytes[2 * i + !LITTLE] = (uint8_t)counts;
  }
  return count;
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

// The board with the chip that the defines are of: runs the sketch over a file of readings (deg/s, g, uT), one every 10 ms of virtual time; the bus is deaf for row 300.
#include <cstdlib>
#include <vector>

#include "Wire.h"

uint64_t now_us = 0;
Port Serial;
Bus Wire;
static std::vector<double> readings;
static uint8_t registers[256] = {0}, others[256] = {0};  // of the chip, of its magnetometer
static uint8_t address, pointer, bytes[32];
static int written, next_byte;

static size_t row() { return now_us / 10000; }

void Bus::beginTransmission(uint8_t to) { address = to; written = 0; }

void Bus::write(uint8_t value) {
  if (written++ == 0) pointer = value;
  else (address == ADDRESS ? registers : others)[pointer] = value;
}

uint8_t Bus::endTransmission(bool) {
#ifdef MAG_ADDRESS
  if (address == MAG_ADDRESS) return 0;
#endif
  return address == ADDRESS && row() != 300 ? 0 : 2;
}

#ifdef MAG_ADDRESS
// What the magnetometer sends: its identity, its sensitivities, and the field, every third time not ready.
static uint8_t send_field(uint8_t count) {
  static int asked = 0;
  if (pointer == MAG_ID_REGISTER) {
    bytes[0] = MAG_IDENTITY;
    return 1;
  }
  if (count == 3) {
    bytes[0] = 176, bytes[1] = 128, bytes[2] = 144;
    return 3;
  }
  if (pointer != MAG_FIRST || !(MAG_AWAKE)) return 0;
  const double *f = &readings[9 * row() + 6], counts[3] = {MAG_COUNTS};
  for (int i = 0; i < 3; i++) {
    const uint16_t word = (uint16_t)(int16_t)std::lround(counts[i]);
    bytes[2 * i + 1] = (uint8_t)word;
    bytes[2 * i + 2] = (uint8_t)(word >> 8);
  }
  bytes[0] = asked++ % 3 ? 0x09 : 0x00;
  bytes[7] = bytes[8] = 0x00;
  return count;
}
#endif

uint8_t Bus::requestFrom(uint8_t from, uint8_t count) {
  next_byte = 0;
#ifdef MAG_ADDRESS
  if (from == MAG_ADDRESS) return send_field(count);
#endif
  if (from == ADDRESS && count == 1 && pointer == ID_REGISTER) {
    bytes[0] = IDENTITY;
    return 1;
  }
  if (from != ADDRESS || count != 2 * WORDS || pointer != FIRST || !(AWAKE)) return 0;
  const double *reading = &readings[9 * row()];
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
  while (9 * (row() + 1) < readings.size()) {
    loop();
    now_us += 137;
  }
  return 0;
}

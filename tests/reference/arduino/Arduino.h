// As much of the Arduino core as the sketch uses, on a computer: virtual time, serial port on standard output.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>

extern uint64_t now_us;
inline uint32_t micros() { return (uint32_t)now_us; }
inline void delay(unsigned long ms) { now_us += 1000ull * ms; }
#define F(text) text
#ifndef NAN
#define NAN __builtin_nanf("")
#endif

struct Port {
  void begin(unsigned long) {}
  void print(const char *text) { std::fputs(text, stdout); }
  void print(char letter) { std::putchar(letter); }
  void print(unsigned long number) { std::printf("%lu", number); }
  void print(long number) { std::printf("%ld", number); }
  void print(float number, int digits) { std::printf("%.*f", digits, (double)number); }
  void println(const char *text = "") { std::puts(text); }
};
extern Port Serial;
void setup();
void loop();

/* What an update costs on an AVR: cycles and stack, said on the serial port of an ATmega2560 in simavr.

   FILTER is the name, AXIS for one axis. double is float here. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

#include FILTER_H

#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define UPDATES 40

extern uint8_t _end; /* of all variables: above it lies the stack */
static FILTER filter;

static void put(char letter)
{
    while (!(UCSR0A & (1 << UDRE0))) {
    }
    UDR0 = letter;
}

static void number(uint32_t value)
{
    char digits[12];
    int8_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10);
        value /= 10;
    } while (value);
    while (count) {
        put(digits[--count]);
    }
    put(' ');
}

static __attribute__((noinline)) void update(int i)
{
    const float wave = (float)(i % 40 - 20) / 100.0f;
#ifdef AXIS
    (void)JOIN(FILTER, _update)(&filter, wave * 50.0f, wave, 0.01f, 360.0f, 0);
#else
    const float gyr[3] = {wave, wave * 0.5f, -wave}, acc[3] = {wave, 0.3f, 9.8f + wave};
    const float mag[3] = {3.0f + wave, 19.0f - wave, -45.0f};
    (void)JOIN(FILTER, _update)(&filter, gyr, acc, mag, 0.01f);
#endif
}

int main(void)
{
    UCSR0B = 1 << TXEN0;
#ifdef AXIS
    JOIN(FILTER, _init)(&filter, 0.0f);
#else
    JOIN(FILTER, _init)(&filter);
#endif
    for (int i = 0; i < 20; i++) {
        update(i);
    }
    uint8_t *byte = &_end;
    for (uint8_t *last = (uint8_t *)SP - 4; byte < last; byte++) {
        *byte = 0xA5;
    }
    update(1);
    for (byte = &_end; *byte == 0xA5; byte++) {
    }
    TCCR1B = 1 << CS12 | 1 << CS10; /* a tick is 1024 cycles */
    TCNT1 = 0;
    for (int i = 0; i < UPDATES; i++) {
        update(i);
    }
    const uint16_t ticks = TCNT1;
    number((uint16_t)(RAMEND + 1 - (uint16_t)byte));
    number((uint32_t)ticks * 1024 / UPDATES);
    put('\n');
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}

/* What an update costs on a Cortex-M4F: instructions and stack. FILTER is the name, REAL the type; AXIS for one axis.

   QEMU with -icount shift=0 takes 1 ns for every instruction, and the SysTick of the mps2-an386 counts 25 MHz: one tick
   is 40 instructions. */
#include FILTER_H
#include <stdio.h>

#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define UPDATES 400
#define PAINTED 16384
#define CTRL (*(volatile uint32_t *)0xE000E010)
#define LOAD (*(volatile uint32_t *)0xE000E014)
#define NOW (*(volatile uint32_t *)0xE000E018)

static FILTER filter;

/* What the loop itself costs, which is taken off: the same readings, and nobody to take them. */
static __attribute__((noinline)) void idle(int i)
{
    const REAL wave = (REAL)(i % 40 - 20) / (REAL)100.0;
    const REAL gyr[3] = {wave, wave * (REAL)0.5, -wave}, acc[3] = {wave, (REAL)0.3, (REAL)9.8 + wave};
    const REAL mag[3] = {(REAL)3.0 + wave, (REAL)19.0 - wave, (REAL)-45.0};
    __asm volatile("" : : "r"(gyr), "r"(acc), "r"(mag) : "memory");
}

static __attribute__((noinline)) void update(int i)
{
    const REAL wave = (REAL)(i % 40 - 20) / (REAL)100.0;
#ifdef AXIS
    (void)JOIN(FILTER, _update)(&filter, wave * (REAL)50.0, wave, (REAL)0.01, (REAL)360.0, 0);
#else
    const REAL gyr[3] = {wave, wave * (REAL)0.5, -wave}, acc[3] = {wave, (REAL)0.3, (REAL)9.8 + wave};
    const REAL mag[3] = {(REAL)3.0 + wave, (REAL)19.0 - wave, (REAL)-45.0};
    (void)JOIN(FILTER, _update)(&filter, gyr, acc, mag, (REAL)0.01);
#endif
}

static __attribute__((noinline)) unsigned stack(void)
{
    volatile uint8_t *here = __builtin_frame_address(0);
    volatile uint8_t *bottom = here - PAINTED;
    for (volatile uint8_t *p = bottom; p < here - 48; p++) {
        *p = 0xA5;
    }
    update(1);
    while (*bottom == 0xA5) {
        bottom++;
    }
    return (unsigned)(here - bottom);
}

static uint32_t ticks(void (*one)(int))
{
    LOAD = 0xFFFFFF;
    NOW = 0;
    CTRL = 5;
    const uint32_t before = NOW;
    for (int i = 0; i < UPDATES; i++) {
        one(i);
    }
    return (before - NOW) & 0xFFFFFF;
}

int main(void)
{
#ifdef AXIS
    JOIN(FILTER, _init)(&filter, (REAL)0.0);
#else
    JOIN(FILTER, _init)(&filter);
#endif
    for (int i = 0; i < 50; i++) {
        update(i);
    }
    const unsigned deep = stack();
    const uint32_t spent = ticks(update) - ticks(idle);
    printf("{\"instructions\": %lu, \"stack\": %u, \"ram\": %lu}\n", (unsigned long)(spent * 40u / UPDATES), deep,
           (unsigned long)sizeof filter);
    return 0;
}

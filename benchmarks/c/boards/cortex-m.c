/* What runs before main on a bare Cortex-M: the vector table, the FPU, memory that starts at zero. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t __stack, __bss_start__, __bss_end__;
extern void initialise_monitor_handles(void);
int main(void);
void reset(void);

void _init(void);
void _fini(void);

void _init(void)
{
}

void _fini(void)
{
}

static void fault(void)
{
    abort();
}

__attribute__((section(".vectors"), used)) static const uintptr_t vectors[16] = {
    (uintptr_t)&__stack, (uintptr_t)reset, (uintptr_t)fault, (uintptr_t)fault, (uintptr_t)fault, (uintptr_t)fault,
};

void reset(void)
{
#ifdef __ARM_FP
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* CPACR: the FPU is on */
    __asm volatile("dsb\n isb");
#endif
    for (uint32_t *word = &__bss_start__; word < &__bss_end__; word++) {
        *word = 0;
    }
    initialise_monitor_handles();
    exit(main());
}

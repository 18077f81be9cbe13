/* A board with an AVR in simavr, and an MPU-6050 that lies still on its I2C bus: what a sketch says, and its stack.

   uno ELF MCU SECONDS: the serial port goes to standard output; at the end "# stack BYTES" is the deepest stack. */
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ADDRESS 0xD0 /* 0x68 and the bit of the direction */
#define FIRST 0x3B   /* ACCEL_XOUT_H */

static avr_irq_t *bus;
static uint8_t selected, pointer, counter, registers[256] = {[0x75] = 0x68}; /* WHO_AM_I */

static uint8_t reading(uint8_t at)
{
    /* 1 g along z at +-4 g, 25 degrees, no rate */
    static const uint8_t still[14] = {0, 0, 0, 0, 0x20, 0, 0xF1, 0, 0, 0, 0, 0, 0, 0};
    return at >= FIRST && at < FIRST + 14 ? still[at - FIRST] : registers[at];
}

static void on_bus(struct avr_irq_t *irq, uint32_t value, void *none)
{
    (void)irq, (void)none;
    avr_twi_msg_irq_t v;
    v.u.v = value;
    if (v.u.twi.msg & TWI_COND_STOP) {
        selected = 0;
    }
    if (v.u.twi.msg & TWI_COND_START) {
        selected = (v.u.twi.addr & 0xFE) == ADDRESS ? v.u.twi.addr : 0;
        counter = 0;
        if (selected) {
            avr_raise_irq(bus + TWI_IRQ_INPUT, avr_twi_irq_msg(TWI_COND_ACK, selected, 1));
        }
    }
    if (!selected) {
        return;
    }
    if (v.u.twi.msg & TWI_COND_WRITE) {
        avr_raise_irq(bus + TWI_IRQ_INPUT, avr_twi_irq_msg(TWI_COND_ACK, selected, 1));
        if (counter++ == 0) {
            pointer = v.u.twi.data;
        } else {
            registers[pointer++] = v.u.twi.data;
        }
    }
    if (v.u.twi.msg & TWI_COND_READ) {
        avr_raise_irq(bus + TWI_IRQ_INPUT, avr_twi_irq_msg(TWI_COND_READ, selected, reading(pointer++)));
    }
}

static void on_serial(struct avr_irq_t *irq, uint32_t value, void *none)
{
    (void)irq, (void)none;
    putchar((int)value);
}

int main(int count, char **words)
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (count != 4 || elf_read_firmware(words[1], &firmware) != 0) {
        return 2;
    }
    avr_t *avr = avr_make_mcu_by_name(words[2]);
    if (!avr) {
        return 2;
    }
    avr_init(avr);
    avr->frequency = firmware.frequency = 16000000;
    avr_load_firmware(avr, &firmware);
    static const char *names[2] = {"<bus.in", ">bus.out"};
    bus = avr_alloc_irq(&avr->irq_pool, 0, 2, names);
    avr_irq_register_notify(bus + TWI_IRQ_OUTPUT, on_bus, NULL);
    avr_connect_irq(bus + TWI_IRQ_INPUT, avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT));
    avr_connect_irq(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), bus + TWI_IRQ_OUTPUT);
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)AVR_UART_FLAG_STDIO;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_serial, NULL);
    const avr_cycle_count_t end = (avr_cycle_count_t)(atof(words[3]) * 16e6);
    uint16_t deepest = avr->ramend;
    int state = cpu_Running;
    while (avr->cycle < end && state != cpu_Done && state != cpu_Crashed) {
        state = avr_run(avr);
        const uint16_t sp = (uint16_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
        if (sp > 0x100 && sp < deepest) {
            deepest = sp;
        }
    }
    printf("\n# stack %d\n", avr->ramend - deepest);
    return state == cpu_Crashed;
}

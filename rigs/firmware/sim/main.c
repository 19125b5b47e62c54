/* An ATmega328P in simavr with the firmware in its flash: its UART on a pseudo-terminal, its pins in a log.
 * Call: sim_controller FIRMWARE.elf LOG
 *
 * Chip and pseudo-terminal are served by one thread, and the chip's clock follows this computer's: it is never ahead,
 * and catches up when this program had to wait for a processor. (The ready-made uart_pty of libsimavrparts 1.6 raises
 * the chip's interrupts from a second thread without a lock, and reads on past a hang-up.) */
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench.h"

#define F_CPU 16000000u
#define BOOTED (F_CPU / 100)
#define DDRD 0x2a /* addresses in the chip's data space */
#define PORTD 0x2b
#define FIRST_LINE 4

static int line;
static bool wants_bytes = true;

static void ready(struct avr_irq_t *irq, uint32_t value, void *param) { wants_bytes = true; }
static void full(struct avr_irq_t *irq, uint32_t value, void *param) { wants_bytes = false; }

static void said(struct avr_irq_t *irq, uint32_t value, void *param) {
    char byte = (char)value;
    /* What nobody reads is lost, as on a real line. */
    if (write(line, &byte, 1) < 0) return;
}

static avr_t *boot(const char *path) {
    elf_firmware_t firmware = {0};
    if (elf_read_firmware(path, &firmware)) exit(1);
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    avr_init(avr);
    avr->frequency = F_CPU;
    avr_load_firmware(avr, &firmware);
    return avr;
}

/* The chip asleep: its cycles go by at once. What holds it to the computer's clock is the main loop. */
static void skip(avr_t *avr, avr_cycle_count_t cycles) {}

static avr_irq_t *connect_uart(avr_t *avr) {
    uint32_t flags = 0; /* neither copied to the terminal nor slept upon */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    uint32_t uart = AVR_IOCTL_UART_GETIRQ('0');
    avr_irq_register_notify(avr_io_getirq(avr, uart, UART_IRQ_OUTPUT), said, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, uart, UART_IRQ_OUT_XON), ready, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, uart, UART_IRQ_OUT_XOFF), full, NULL);
    return avr_io_getirq(avr, uart, UART_IRQ_INPUT);
}

static void hand_over_bytes(avr_irq_t *input) {
    char byte;
    while (wants_bytes && read(line, &byte, 1) == 1) avr_raise_irq(input, (uint8_t)byte);
}

/* Runs the chip up to a cycle, its pins watched. */
static void run_until(avr_t *avr, uint64_t cycle, FILE *log) {
    while (avr->cycle < cycle) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) exit(1);
        /* A pin is driven high where it is an output and its register says so. */
        log_lines(log, (uint8_t)(avr->data[PORTD] & avr->data[DDRD]) >> FIRST_LINE);
    }
}

int main(int count, char **arguments) {
    FILE *log = count == 3 ? fopen(arguments[2], "w") : NULL;
    if (!log) {
        fprintf(stderr, "call: %s FIRMWARE.elf LOG\n", arguments[0]);
        return 2;
    }
    avr_t *avr = boot(arguments[1]);
    avr->sleep = skip;
    avr_irq_t *input = connect_uart(avr);
    avr_irq_t *interlock = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 0);
    watch_interlock_signal();
    run_until(avr, BOOTED, log); /* a board's port appears when the board is up */
    line = open_line();
    uint64_t began_ns = now_ns();
    for (;;) {
        hand_over_bytes(input);
        avr_raise_irq(interlock, interlock_closed ? 0 : 1);
        run_until(avr, BOOTED + (now_ns() - began_ns) * (F_CPU / 1000000u) / 1000u, log);
        wait_for_bytes(line);
    }
}

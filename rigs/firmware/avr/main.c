/* The laser controller on an ATmega328P at 16 MHz (Arduino Uno): lines 1 to 4 on D4 to D7 (PD4 to PD7), high is on;
 * interlock between D8 (PB0) and ground, closed is low. Every gate needs a resistor to ground: while the chip
 * resets or its boot loader runs, the pins are open. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "laser_controller.h"

#define FIRST_LINE PD4
#define LINES ((uint8_t)(((1u << LASER_LINES) - 1) << FIRST_LINE))
#define INTERLOCK _BV(PB0)
#define RING 128 /* a power of two */
#define SPOILT '\0'

typedef struct {
    volatile uint8_t head, tail; /* one side writes the one, the other side the other */
    volatile char bytes[RING];
} Ring;

static Ring heard, to_say;
static volatile uint32_t ticks_ms;

static uint8_t used(const Ring *ring) { return (uint8_t)(ring->head - ring->tail) % RING; }

static void put(Ring *ring, char byte) {
    ring->bytes[ring->head] = byte;
    ring->head = (ring->head + 1) % RING;
}

static char take(Ring *ring) {
    char byte = ring->bytes[ring->tail];
    ring->tail = (ring->tail + 1) % RING;
    return byte;
}

/* The watchdog runs from the first instructions on: a reset by it leaves it on, at its shortest time. */
void watch_early(void) __attribute__((naked, used, section(".init3")));
void watch_early(void) {
    MCUSR = 0;
    wdt_enable(WDTO_30MS);
}

ISR(TIMER0_COMPA_vect) { ticks_ms++; }

ISR(USART_RX_vect) {
    bool damaged = UCSR0A & (_BV(FE0) | _BV(DOR0)); /* to be read before the byte */
    char byte = (char)UDR0;
    /* A request that lost a byte could be another request. No request holds the byte that takes its place. */
    if (damaged && byte != '!') byte = SPOILT;
    if (used(&heard) < RING - 2) put(&heard, byte);
    else if (used(&heard) < RING - 1) put(&heard, SPOILT);
}

ISR(USART_UDRE_vect) {
    if (used(&to_say)) UDR0 = take(&to_say);
    else UCSR0B &= (uint8_t)~_BV(UDRIE0);
}

static uint32_t now_ms(void) {
    uint32_t now;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { now = ticks_ms; }
    return now;
}

static LaserInputs sample(void) {
    return (LaserInputs){
        .now_ms = now_ms(),
        .interlock_closed = !(PINB & INTERLOCK),
        .lines = (PIND & LINES) >> FIRST_LINE,
    };
}

static void drive(LaserController *controller) {
    LaserInputs inputs = sample();
    PORTD = (uint8_t)((PORTD & ~LINES) | (laser_outputs(controller, &inputs) << FIRST_LINE));
}

/* A reply that does not fit is dropped whole: waiting for a line that nobody reads would hold up the lease. */
static void say(const char *reply, size_t length) {
    if (length >= (size_t)(RING - 1 - used(&to_say))) return;
    while (length--) put(&to_say, *reply++);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { UCSR0B |= _BV(UDRIE0); }
}

static void set_up(void) {
    PORTD &= (uint8_t)~LINES; /* low before they are outputs */
    DDRD |= LINES;
    PORTB |= INTERLOCK; /* pull-up: a wire that breaks is an open interlock */
    TCCR0A = _BV(WGM01);
    OCR0A = F_CPU / 64 / 1000 - 1;
    TIMSK0 = _BV(OCIE0A);
    TCCR0B = _BV(CS01) | _BV(CS00);
    UBRR0 = (F_CPU / 4 / BAUD - 1) / 2;
    UCSR0A = _BV(U2X0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
    set_sleep_mode(SLEEP_MODE_IDLE);
    sei();
}

static void sleep_until_something(void) {
    cli();
    if (!used(&heard)) {
        sleep_enable();
        sei(); /* holds only after the next instruction: no interrupt gets in between */
        sleep_cpu();
        sleep_disable();
    }
    sei();
}

int main(void) {
    LaserController controller;
    char reply[LASER_REPLY_SIZE];
    uint32_t watched_ms = 0;
    laser_boot(&controller);
    set_up();
    for (;;) {
        while (used(&heard)) {
            char byte = take(&heard);
#ifdef HANG_ON_BEL /* built for the test of the watchdog alone */
            if (byte == '\a') for (;;) {}
#endif
            LaserInputs inputs = sample();
            size_t length = laser_receive(&controller, &inputs, byte, reply);
            drive(&controller);
            if (length) say(reply, length);
        }
        drive(&controller);
        /* Tied to the clock: a clock that stands still would never end a lease. */
        uint32_t now = now_ms();
        if (now != watched_ms) {
            wdt_reset();
            watched_ms = now;
        }
        sleep_until_something();
    }
}

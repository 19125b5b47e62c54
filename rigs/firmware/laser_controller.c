#include "laser_controller.h"

#include <stdio.h>
#include <string.h>

#ifndef LASER_IDENTITY
#define LASER_IDENTITY "laser-range-workbench,laser controller,0,1"
#endif
#define MOST_WORDS 3

/* Part of a request; not terminated. */
typedef struct {
    const char *text;
    uint8_t length;
} Word;

void laser_boot(LaserController *controller) { memset(controller, 0, sizeof *controller); }

uint8_t laser_outputs(LaserController *controller, const LaserInputs *inputs) {
    /* Unsigned arithmetic: right across the wrap of the clock. */
    bool ended = inputs->now_ms - controller->began_ms >= controller->lease_ms;
    if (ended || !inputs->interlock_closed) controller->mask = 0;
    return controller->mask;
}

static bool is(Word word, const char *verb) {
    return word.length == strlen(verb) && memcmp(word.text, verb, word.length) == 0;
}

static int say(char reply[LASER_REPLY_SIZE], const char *text) {
    return snprintf(reply, LASER_REPLY_SIZE, "%s\n", text);
}

/* Decimal digits and nothing else, low to high. */
static bool number(Word word, uint16_t low, uint16_t high, uint16_t *value) {
    uint32_t sum = 0;
    for (uint8_t i = 0; i < word.length; i++) {
        if (word.text[i] < '0' || word.text[i] > '9') return false;
        sum = 10 * sum + (uint32_t)(word.text[i] - '0');
        if (sum > high) return false;
    }
    *value = (uint16_t)sum;
    return word.length > 0 && sum >= low;
}

static int refuse_number(char reply[LASER_REPLY_SIZE], uint16_t low, uint16_t high) {
    return snprintf(reply, LASER_REPLY_SIZE, "ERR 2 expected a number from %u to %u\n", low, high);
}

static int off(LaserController *controller, char reply[LASER_REPLY_SIZE]) {
    controller->mask = 0;
    return say(reply, "OK OFF");
}

static int on(LaserController *controller, const LaserInputs *inputs, uint8_t mask, Word lease,
              char reply[LASER_REPLY_SIZE]) {
    uint16_t lease_ms;
    if (!number(lease, 1, LASER_LONGEST_LEASE_MS, &lease_ms)) return refuse_number(reply, 1, LASER_LONGEST_LEASE_MS);
    if (!inputs->interlock_closed) return say(reply, "ERR 3 interlock open");
    controller->mask = mask;
    controller->lease_ms = lease_ms;
    controller->began_ms = inputs->now_ms;
    return snprintf(reply, LASER_REPLY_SIZE, "OK ON %u %u\n", mask, lease_ms);
}

static int state(const LaserController *controller, const LaserInputs *inputs, uint16_t token,
                 char reply[LASER_REPLY_SIZE]) {
    uint32_t gone_ms = inputs->now_ms - controller->began_ms;
    /* Lit with no lease left is a fault, and is told as one: lines, and 0 ms. */
    bool leased = inputs->lines != 0 && gone_ms < controller->lease_ms;
    uint16_t left_ms = leased ? (uint16_t)(controller->lease_ms - gone_ms) : 0;
    return snprintf(reply, LASER_REPLY_SIZE, "OK STATE %u %u %u\n", token, inputs->lines, left_ms);
}

/* Splits at single spaces; more than MOST_WORDS are told as MOST_WORDS + 1. */
static uint8_t split(const char *text, uint8_t length, Word words[MOST_WORDS]) {
    uint8_t count = 0;
    const char *begin = text, *end = text + length;
    for (const char *at = text; at <= end; at++) {
        if (at < end && *at != ' ') continue;
        if (count == MOST_WORDS) return MOST_WORDS + 1;
        words[count++] = (Word){begin, (uint8_t)(at - begin)};
        begin = at + 1;
    }
    return count;
}

static bool is_blank(char byte) { return byte == ' ' || byte == '\r'; }

static int obey(LaserController *controller, const LaserInputs *inputs, char reply[LASER_REPLY_SIZE]) {
    const char *text = controller->request;
    uint8_t length = controller->length;
    while (length && is_blank(text[length - 1])) length--;
    while (length && is_blank(*text)) text++, length--;
    if (length == 0) return 0;
    if (length > LASER_LONGEST_REQUEST) return say(reply, "ERR 4 line too long");

    Word words[MOST_WORDS];
    uint16_t value;
    switch (split(text, length, words)) {
    case 1:
        if (is(words[0], "*IDN?")) return say(reply, "OK *IDN " LASER_IDENTITY);
        if (is(words[0], "OFF")) return off(controller, reply);
        if (is(words[0], "INTERLOCK?"))
            return say(reply, inputs->interlock_closed ? "OK INTERLOCK CLOSED" : "OK INTERLOCK OPEN");
        break;
    case 2:
        if (is(words[0], "STATE?")) {
            if (!number(words[1], 0, 65535u, &value)) return refuse_number(reply, 0, 65535u);
            return state(controller, inputs, value, reply);
        }
        break;
    case 3:
        if (is(words[0], "ON")) {
            if (!number(words[1], 1, LASER_LINES, &value)) return refuse_number(reply, 1, LASER_LINES);
            return on(controller, inputs, (uint8_t)(1u << (value - 1)), words[2], reply);
        }
        if (is(words[0], "MASK")) {
            uint16_t all = (1u << LASER_LINES) - 1;
            if (!number(words[1], 0, all, &value)) return refuse_number(reply, 0, all);
            return on(controller, inputs, (uint8_t)value, words[2], reply);
        }
        break;
    }
    return say(reply, "ERR 1 unknown request");
}

size_t laser_receive(LaserController *controller, const LaserInputs *inputs, char byte,
                     char reply[LASER_REPLY_SIZE]) {
    int length = 0;
    if (byte == '!') {
        controller->length = 0;
        length = off(controller, reply);
    } else if (byte == '\n') {
        length = obey(controller, inputs, reply);
        controller->length = 0;
    } else if (controller->length < sizeof controller->request) {
        controller->request[controller->length++] = byte;
    }
    return (size_t)length;
}

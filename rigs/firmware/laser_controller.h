/* The laser controller of docs/laser-controller.md: protocol, lease, interlock. No hardware, no clock of its own,
 * no memory but its struct; whoever runs it samples the inputs, drives the outputs and carries the bytes. */
#ifndef LASER_CONTROLLER_H
#define LASER_CONTROLLER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LASER_LINES 4
#define LASER_LONGEST_LEASE_MS 60000u
#define LASER_LONGEST_REQUEST 64
#define LASER_REPLY_SIZE 64

/* What the controller sees at one moment. */
typedef struct {
    uint32_t now_ms; /* may wrap */
    bool interlock_closed;
    uint8_t lines; /* what the outputs do, read back at the pins; bit 0 is line 1 */
} LaserInputs;

typedef struct {
    uint8_t mask; /* of the lease */
    uint16_t lease_ms;
    uint32_t began_ms;
    uint8_t length;
    char request[LASER_LONGEST_REQUEST + 1]; /* one more than fits: a line that is too long shows by it */
} LaserController;

/* All off, nothing heard. */
void laser_boot(LaserController *controller);

/* The lines to drive at this moment. Call it at least once a millisecond, and after every byte. */
uint8_t laser_outputs(LaserController *controller, const LaserInputs *inputs);

/* One byte from the line. Returns the length of the reply, 0 while there is none; it ends with a line feed. Drive
 * the outputs before you send it: "OK OFF" is said of lasers that are off. */
size_t laser_receive(LaserController *controller, const LaserInputs *inputs, char byte, char reply[LASER_REPLY_SIZE]);

#endif

/* What the two programs that run the controller on a computer share: a pseudo-terminal, a log of the lines, and an
 * interlock that SIGUSR1 opens and closes. */
#ifndef BENCH_H
#define BENCH_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* Opens a raw pseudo-terminal and prints "port PATH" of its other side. Returns its descriptor, which does not
 * block. The other side is kept open here as well: a port nobody holds is quiet, not dead. */
int open_line(void);

/* Nanoseconds of CLOCK_MONOTONIC. */
uint64_t now_ns(void);

/* Writes "<ns> <lines>" when the lines are not what they were. */
void log_lines(FILE *log, uint8_t lines);

/* Waits for bytes, a millisecond at the most. */
void wait_for_bytes(int line);

void watch_interlock_signal(void);
extern volatile bool interlock_closed;

#endif

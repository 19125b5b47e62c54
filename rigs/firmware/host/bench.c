#define _GNU_SOURCE
#include "bench.h"

#include <fcntl.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

volatile bool interlock_closed = true;

static void toggle(int number) {
    (void)number;
    interlock_closed = !interlock_closed;
}

void watch_interlock_signal(void) {
    struct sigaction action = {.sa_handler = toggle, .sa_flags = SA_RESTART};
    sigaction(SIGUSR1, &action, NULL);
}

int open_line(void) {
    int ours = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    char path[128];
    if (ours < 0 || grantpt(ours) || unlockpt(ours) || ptsname_r(ours, path, sizeof path)) {
        perror("pseudo-terminal");
        exit(1);
    }
    int theirs = open(path, O_RDWR | O_NOCTTY);
    struct termios raw;
    tcgetattr(theirs, &raw);
    cfmakeraw(&raw);
    tcsetattr(theirs, TCSANOW, &raw);
    printf("port %s\n", path);
    fflush(stdout);
    return ours;
}

uint64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

void log_lines(FILE *log, uint8_t lines) {
    static int last = -1;
    if (lines == last) return;
    last = lines;
    fprintf(log, "%" PRIu64 " %u\n", now_ns(), lines);
    fflush(log);
}

void wait_for_bytes(int line) {
    struct pollfd waiting = {.fd = line, .events = POLLIN};
    poll(&waiting, 1, 1);
}

/* The laser controller on this computer: its line a pseudo-terminal, its lines in a log. For tests without a chip.
 * Call: host_controller LOG */
#include <string.h>
#include <unistd.h>

#include "bench.h"
#include "laser_controller.h"

static uint8_t lines; /* stands for the pins */

static LaserInputs sample(void) {
    return (LaserInputs){
        .now_ms = (uint32_t)(now_ns() / 1000000u), .interlock_closed = interlock_closed, .lines = lines};
}

static void drive(LaserController *controller, FILE *log) {
    LaserInputs inputs = sample();
    lines = laser_outputs(controller, &inputs);
    log_lines(log, lines);
}

int main(int count, char **arguments) {
    FILE *log = count == 2 ? fopen(arguments[1], "w") : NULL;
    if (!log) {
        fprintf(stderr, "call: %s LOG\n", arguments[0]);
        return 2;
    }
    LaserController controller;
    laser_boot(&controller);
    drive(&controller, log);
    watch_interlock_signal();
    int line = open_line();
    for (;;) {
        char bytes[256], reply[LASER_REPLY_SIZE];
        ssize_t came = read(line, bytes, sizeof bytes);
        for (ssize_t i = 0; i < came; i++) {
            LaserInputs inputs = sample();
            size_t length = laser_receive(&controller, &inputs, bytes[i], reply);
            drive(&controller, log);
            /* What nobody reads is lost, as on a real line. */
            if (length && write(line, reply, length) < 0) continue;
        }
        drive(&controller, log);
        wait_for_bytes(line);
    }
}

/* Ranges of a pair of frames, or of spots: see README.md. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration.h"
#include "frames.h"
#include "ranger.h"

#define BAD_INPUT 2
#define MOST_SPOTS 32

static int fail(const char *file, const char *wrong)
{
    fprintf(stderr, "error: %s: %s\n", file, wrong);
    return BAD_INPUT;
}

static int laser_index(const struct ranger_calibration *c, const char *id)
{
    for (int i = 0; i < c->lasers; i++)
        if (strcmp(c->laser[i].id, id) == 0)
            return i;
    return -1;
}

static void print_range(const struct ranger_calibration *c, int laser, const real uv[2], real su, real sv)
{
    struct ranger_range found;
    const char *id = c->laser[laser].id;
    if (ranger_range(c, laser, uv, su, sv, &found) != RANGER_OK) {
        printf("%s - - %.3f %.3f no range\n", id, (double)uv[0], (double)uv[1]);
        return;
    }
    int is_calibrated = found.range_mm >= c->nearest_mm && found.range_mm <= c->farthest_mm;
    printf("%s %.9g %.3g %.3f %.3f%s\n", id, (double)found.range_mm, (double)found.sd_mm, (double)uv[0],
           (double)uv[1], is_calibrated ? "" : " outside the calibrated ranges");
}

/* Lines `laser u v [sd_u sd_v]` on standard input. */
static int range_spots(const struct ranger_calibration *c)
{
    char text[256], id[RANGER_ID_SIZE];
    for (int line = 1; fgets(text, sizeof text, stdin) != NULL; line++) {
        double u, v, su = (double)c->spot_sd_px, sv = su;
        int count = sscanf(text, "%15s %lf %lf %lf %lf", id, &u, &v, &su, &sv);
        if ((count != 3 && count != 5) || !(su > 0) || !(sv > 0)) {
            fprintf(stderr, "error: standard input: line %d: expected `laser u v` or `laser u v sd_u sd_v`\n", line);
            return BAD_INPUT;
        }
        int laser = laser_index(c, id);
        if (laser < 0) {
            fprintf(stderr, "error: standard input: line %d: %s is not a laser of this calibration\n", line, id);
            return BAD_INPUT;
        }
        const real uv[2] = {(real)u, (real)v};
        print_range(c, laser, uv, (real)su, (real)sv);
    }
    return 0;
}

static int range_frames(const struct ranger_calibration *c, const struct frame *on, const struct frame *off, int only)
{
    real uv[MOST_SPOTS][2];
    int laser_of[MOST_SPOTS], spots = frame_find_spots(on, off, uv, MOST_SPOTS), ambiguous = 0, on_line = 0;
    int range_of[RANGER_MAX_LASERS];
    for (int i = 0; i < RANGER_MAX_LASERS; i++)
        range_of[i] = -1;
    if (only >= 0) { /* the brightest spot on its line is that of the laser */
        for (int i = 0; i < spots && range_of[only] < 0; i++)
            if (ranger_is_on_line(c, only, uv[i]))
                range_of[only] = i;
    } else
        for (const char *axis = "uv"; *axis; axis++) {
            if (ranger_assign(c, *axis, spots, (const real(*)[2])uv, laser_of) == RANGER_AMBIGUOUS) {
                ambiguous = 1;
                continue;
            }
            for (int i = 0; i < spots; i++)
                if (laser_of[i] >= 0)
                    range_of[laser_of[i]] = i;
        }
    for (int laser = 0; laser < c->lasers; laser++)
        if (range_of[laser] >= 0) {
            print_range(c, laser, uv[range_of[laser]], c->spot_sd_px, c->spot_sd_px);
            on_line++;
        } else if (only < 0 || only == laser)
            printf("%s - - - - no spot\n", c->laser[laser].id);
    if (ambiguous)
        fprintf(stderr, "note: %d spots fit the lasers in several ways; fire the lasers one by one\n", spots);
    return on_line > 0 ? 0 : 1;
}

static const char *read_frame(const char *path, struct frame *frame)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return "it cannot be opened";
    const char *wrong = frame_read(file, frame);
    fclose(file);
    return wrong;
}

int main(int argc, char **argv)
{
    struct ranger_calibration c;
    struct frame on = {0, 0, NULL}, off = {0, 0, NULL};
    const char *wrong;
    int line, only = -1, result;
    if (argc != 2 && argc != 4 && argc != 5) {
        fprintf(stderr, "usage: ranger calibration.yaml on.pgm off.pgm [laser]\n"
                        "       ranger calibration.yaml < lines of `laser u v [sd_u sd_v]`\n");
        return BAD_INPUT;
    }
    FILE *file = fopen(argv[1], "r");
    if (file == NULL)
        return fail(argv[1], "it cannot be opened");
    wrong = calibration_read(file, &c, &line);
    fclose(file);
    if (wrong != NULL) {
        if (line > 0)
            fprintf(stderr, "error: %s: line %d: %s\n", argv[1], line, wrong);
        return line > 0 ? BAD_INPUT : fail(argv[1], wrong);
    }
    if (argc == 2)
        return range_spots(&c);
    if (argc == 5 && (only = laser_index(&c, argv[4])) < 0)
        return fail(argv[4], "no laser of the calibration has this id");
    if ((wrong = read_frame(argv[2], &on)) != NULL)
        return fail(argv[2], wrong);
    if ((wrong = read_frame(argv[3], &off)) != NULL) {
        free(on.pixels);
        return fail(argv[3], wrong);
    }
    if (on.width != c.width_px || on.height != c.height_px || off.width != on.width || off.height != on.height)
        result = fail(argv[2], "its size, or that of the dark frame, is not that of the calibration");
    else
        result = range_frames(&c, &on, &off, only);
    free(on.pixels);
    free(off.pixels);
    return result;
}

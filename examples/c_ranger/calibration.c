#include "calibration.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LINE_SIZE 512 /* longer lines hold the covariance, which is not used here: their ends are dropped */
#define KEY_SIZE 48
#define FORMAT 1

enum seen {
    WIDTH = 1, HEIGHT = 2, LENS = 4, MATRIX = 8, DISTORTION = 16, OFFSET = 32, NOISE = 64, SPECKLE = 128,
    VALIDITY = 256, FORMAT_SEEN = 512, VERDICT = 1024, ALL = 2047
};

struct reader {
    struct ranger_calibration *c;
    char section[3][KEY_SIZE]; /* keys above the present one: of no indentation, of two, of four */
    unsigned seen;
    unsigned laser_seen; /* of the present laser: 1 origin, 2 direction, 4 axis */
    real noise, speckle;
    int is_refused, is_accepted_with_reason;
};

/* Numbers in brackets; their count, or -1. */
static int numbers(const char *text, real out[], int most)
{
    if (*text++ != '[')
        return -1;
    for (int n = 0; n < most; n++) {
        char *end;
        double value = strtod(text, &end);
        if (end == text || !isfinite(value))
            return -1;
        out[n] = (real)value;
        while (*end == ' ')
            end++;
        if (*end == ']')
            return n + 1;
        if (*end != ',')
            return -1;
        text = end + 1;
    }
    return -1;
}

static int number(const char *text, real *out)
{
    char *end;
    double value = strtod(text, &end);
    *out = (real)value;
    return end != text && *end == '\0' && isfinite(value);
}

static int positive_int(const char *text, int *out)
{
    char *end;
    long value = strtol(text, &end, 10);
    *out = (int)value;
    return end != text && *end == '\0' && value > 0 && value < 100000;
}

static int string(const char *text, char *out, size_t size)
{
    size_t length = strlen(text);
    if (length < 2 || text[0] != '"' || text[length - 1] != '"' || length - 2 >= size || memchr(text, '\\', length))
        return 0;
    memcpy(out, text + 1, length - 2);
    out[length - 2] = '\0';
    return 1;
}

static int is_in(const struct reader *r, const char *first, const char *second)
{
    return strcmp(r->section[0], first) == 0 && strcmp(r->section[1], second) == 0;
}

static const char *top_level(struct reader *r, const char *key, const char *value)
{
    struct ranger_calibration *c = r->c;
    char name[KEY_SIZE];
    if (strcmp(key, "image_width") == 0) {
        r->seen |= WIDTH;
        return positive_int(value, &c->width_px) ? NULL : "image_width: expected a positive integer";
    }
    if (strcmp(key, "image_height") == 0) {
        r->seen |= HEIGHT;
        return positive_int(value, &c->height_px) ? NULL : "image_height: expected a positive integer";
    }
    if (strcmp(key, "distortion_model") == 0) {
        r->seen |= LENS;
        if (!string(value, name, sizeof name))
            return "distortion_model: expected a name in quotes";
        c->lens = strcmp(name, "equidistant") == 0 ? RANGER_EQUIDISTANT : RANGER_PLUMB_BOB;
        return strcmp(name, "equidistant") == 0 || strcmp(name, "plumb_bob") == 0
                   ? NULL : "distortion_model: expected plumb_bob or equidistant";
    }
    return NULL;
}

static const char *laser(struct reader *r, const char *key, const char *value, int begins)
{
    struct ranger_calibration *c = r->c;
    real v[3];
    if (begins) {
        if (c->lasers > 0 && r->laser_seen != 7)
            return "lasers: expected axis, origin_mm and direction of the laser before this one";
        if (c->lasers == RANGER_MAX_LASERS)
            return "lasers: more than RANGER_MAX_LASERS";
        r->laser_seen = 0;
        return strcmp(key, "id") == 0 && string(value, c->laser[c->lasers++].id, RANGER_ID_SIZE)
                   ? NULL : "lasers: expected an id in quotes";
    }
    if (c->lasers == 0)
        return "lasers: expected an id first";
    struct ranger_laser *own = &c->laser[c->lasers - 1];
    if (strcmp(key, "origin_mm") == 0) {
        if (numbers(value, v, 3) != 3 || v[2] != 0 || (v[0] == 0 && v[1] == 0))
            return "origin_mm: expected [x, y, 0], off the camera's pinhole";
        own->x_mm = v[0], own->y_mm = v[1], r->laser_seen |= 1;
    } else if (strcmp(key, "direction") == 0) {
        if (numbers(value, v, 3) != 3 || v[2] != 1)
            return "direction: expected [tx, ty, 1]";
        own->tx = v[0], own->ty = v[1], r->laser_seen |= 2;
    } else if (strcmp(key, "axis") == 0) {
        char axis[KEY_SIZE];
        if (!string(value, axis, sizeof axis) || (strcmp(axis, "u") != 0 && strcmp(axis, "v") != 0))
            return "axis: expected \"u\" or \"v\"";
        own->axis = axis[0], r->laser_seen |= 4;
    }
    return NULL;
}

/* A line `key: value` at its indentation. */
static const char *take(struct reader *r, int indent, int is_item, const char *key, const char *value)
{
    struct ranger_calibration *c = r->c;
    real v[9];
    if (indent == 0)
        return top_level(r, key, value);
    if (is_in(r, "camera_matrix", "data")) {
        r->seen |= MATRIX;
        if (numbers(value, v, 9) != 9 || !(v[0] > 0) || v[0] != v[4])
            return "camera_matrix: expected nine numbers with one focal length";
        c->f_px = v[0], c->cx_px = v[2], c->cy_px = v[5];
    } else if (is_in(r, "distortion_coefficients", "data")) {
        r->seen |= DISTORTION;
        int expected = c->lens == RANGER_EQUIDISTANT ? 4 : 5;
        if (!(r->seen & LENS) || numbers(value, c->distortion, 5) != expected)
            return "distortion_coefficients: expected as many as distortion_model has, which comes first";
    } else if (is_in(r, "laser_ranger", "format")) {
        r->seen |= FORMAT_SEEN;
        int format;
        if (!positive_int(value, &format) || format != FORMAT)
            return "laser_ranger.format: this reader knows format 1";
    } else if (is_in(r, "laser_ranger", "reference_plane") && strcmp(key, "offset_mm") == 0) {
        r->seen |= OFFSET;
        return number(value, &c->offset_mm) ? NULL : "offset_mm: expected a number";
    } else if (is_in(r, "laser_ranger", "noise") && strcmp(key, "spot_sd_px") == 0) {
        r->seen |= NOISE;
        return number(value, &r->noise) && r->noise > 0 ? NULL : "spot_sd_px: expected a positive number";
    } else if (is_in(r, "laser_ranger", "noise") && strcmp(key, "speckle_sd_px") == 0) {
        r->seen |= SPECKLE;
        return number(value, &r->speckle) && r->speckle >= 0 ? NULL : "speckle_sd_px: expected 0 or more";
    } else if (is_in(r, "laser_ranger", "validity") && strcmp(key, "standoff_mm") == 0) {
        r->seen |= VALIDITY;
        if (numbers(value, v, 2) != 2 || !(v[0] <= v[1]))
            return "validity.standoff_mm: expected [nearest, farthest]";
        c->nearest_mm = v[0], c->farthest_mm = v[1];
    } else if (is_in(r, "laser_ranger", "fit") && indent == 4 && strcmp(key, "verdict") == 0) {
        r->seen |= VERDICT;
        r->is_refused = strcmp(value, "\"accepted\"") != 0;
    } else if (is_in(r, "laser_ranger", "fit") && indent == 4 && strcmp(key, "accepted_because") == 0) {
        r->is_accepted_with_reason = strlen(value) > 2; /* more than the quotes */
    } else if (is_in(r, "laser_ranger", "lasers") && (is_item || indent == 6))
        return laser(r, key, value, is_item);
    return NULL;
}

static const char *take_line(struct reader *r, char *text)
{
    int indent = 0, is_item = 0;
    while (text[indent] == ' ')
        indent++;
    char *key = text + indent;
    if (*key == '\0' || *key == '#' || *key == '%' || strcmp(key, "---") == 0)
        return NULL;
    if (strncmp(key, "- ", 2) == 0) {
        is_item = 1;
        key += 2;
    }
    char *colon = strchr(key, ':');
    if (colon == NULL || (colon[1] != ' ' && colon[1] != '\0'))
        return NULL; /* an item of a list of texts */
    *colon = '\0';
    const char *value = colon[1] == '\0' ? "" : colon + 2;
    if (!is_item && indent % 2 == 0 && indent <= 4) {
        if (strlen(key) >= KEY_SIZE)
            return "a key that this reader does not know";
        for (int level = indent / 2; level < 3; level++)
            r->section[level][0] = '\0';
        strcpy(r->section[indent / 2], key);
    }
    return take(r, indent, is_item, key, value);
}

const char *calibration_read(FILE *file, struct ranger_calibration *c, int *line)
{
    struct reader r = {0};
    char text[LINE_SIZE];
    const char *wrong;
    memset(c, 0, sizeof *c);
    r.c = c;
    for (*line = 1; fgets(text, sizeof text, file) != NULL; (*line)++) {
        size_t length = strcspn(text, "\r\n");
        if (text[length] == '\0' && !feof(file)) /* a long line: skip its end */
            for (int skipped = fgetc(file); skipped != '\n' && skipped != EOF;)
                skipped = fgetc(file);
        text[length] = '\0';
        if ((wrong = take_line(&r, text)) != NULL)
            return wrong;
    }
    *line = 0;
    if (ferror(file))
        return "it cannot be read";
    if (r.seen != ALL)
        return "it is not a calibration of the workbench, or a part is missing";
    if (c->lasers == 0 || r.laser_seen != 7)
        return "lasers: expected axis, origin_mm and direction of each";
    if (r.is_refused && !r.is_accepted_with_reason)
        return "it was refused, and not accepted with a reason";
    c->spot_sd_px = (real)hypot(r.noise, r.speckle);
    return NULL;
}

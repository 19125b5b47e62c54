#ifndef RANGER_FRAMES_H
#define RANGER_FRAMES_H

#include <stdint.h>
#include <stdio.h>

#include "ranger.h"

struct frame {
    int width, height;
    uint8_t *pixels; /* height rows of width grey values */
};

/* Read a grey 8-bit PGM file (P5). NULL, or what is wrong. The caller frees the pixels. */
const char *frame_read(FILE *file, struct frame *frame);

/* Find the spots of a lit frame minus a dark one, the brightest first. Returns their number, at most `most`. */
int frame_find_spots(const struct frame *on, const struct frame *off, real uv[][2], int most);

#endif

#ifndef RANGER_CALIBRATION_H
#define RANGER_CALIBRATION_H

#include <stdio.h>

#include "ranger.h"

/* Read the calibration YAML that `workbench` writes. It is read line by line as the workbench lays it out: one
   key a line, two spaces a level, lists of numbers in brackets. Other keys are skipped.

   Returns NULL, or what is wrong: a text for the user; *line is then the number of the line, or 0. */
const char *calibration_read(FILE *file, struct ranger_calibration *calibration, int *line);

#endif

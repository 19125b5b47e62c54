/* Smallest program that ranges four spots: to see what flash and memory it takes on a microcontroller.

   On a real one `spots` comes from the image sensor, and `calibration` is a constant in flash. */

#include "ranger.h"

struct ranger_calibration calibration;
volatile real spots[4][2], ranges_mm[4];

int main(void)
{
    real uv[4][2];
    int laser_of[4];
    struct ranger_range found;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 2; j++)
            uv[i][j] = spots[i][j];
    if (ranger_assign(&calibration, 'u', 4, (const real(*)[2])uv, laser_of) != RANGER_OK)
        return 1;
    for (int i = 0; i < 4; i++)
        if (laser_of[i] >= 0 && ranger_range(&calibration, laser_of[i], uv[i], 1, 1, &found) == RANGER_OK)
            ranges_mm[laser_of[i]] = found.range_mm;
    return 0;
}

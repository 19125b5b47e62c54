#include "frames.h"

#include <math.h>
#include <stdlib.h>

#define MOST_SIDE 16384
#define THRESHOLD_SD 7.0  /* of the sum over 3 x 3 pixels */
#define LEAST_SD_DN 0.5   /* quantisation, where the room is dark */
#define MOST_SPOTS 64
#define RADIUS 5          /* of the window about a spot, px */
#define WINDOW_PX 1.6     /* standard deviation of the window's weights */
#define ROUNDS 20
#define MEDIAN_OF_HALF 0.6745 /* half of a normal distribution lies within this many standard deviations */

static int header_number(FILE *file)
{
    int next = fgetc(file);
    while (next == '#' || next == ' ' || next == '\n' || next == '\r' || next == '\t') {
        if (next == '#')
            while (next != '\n' && next != EOF)
                next = fgetc(file);
        next = fgetc(file);
    }
    int value = 0;
    if (next < '0' || next > '9')
        return -1;
    for (; next >= '0' && next <= '9'; next = fgetc(file)) {
        value = 10 * value + next - '0';
        if (value > MOST_SIDE)
            return -1;
    }
    return value; /* one character after the number is read, as the format has it */
}

const char *frame_read(FILE *file, struct frame *frame)
{
    frame->pixels = NULL;
    if (fgetc(file) != 'P' || fgetc(file) != '5')
        return "expected a binary PGM file (P5)";
    frame->width = header_number(file);
    frame->height = header_number(file);
    if (frame->width <= 0 || frame->height <= 0)
        return "expected a width and a height of 1 to 16384 px";
    if (header_number(file) != 255)
        return "expected grey values of 8 bits (255)";
    size_t size = (size_t)frame->width * (size_t)frame->height;
    if ((frame->pixels = malloc(size)) == NULL)
        return "not enough memory";
    if (fread(frame->pixels, 1, size, file) == size)
        return NULL;
    free(frame->pixels);
    frame->pixels = NULL;
    return "the file ends before its last pixel";
}

static int signal_at(const struct frame *on, const struct frame *off, int u, int v)
{
    size_t at = (size_t)v * (size_t)on->width + (size_t)u;
    return on->pixels[at] - off->pixels[at];
}

/* Standard deviation of a pixel of the difference, from the median of its absolute values. */
static double noise_dn(const struct frame *on, const struct frame *off)
{
    long count[256] = {0}, total = (long)on->width * on->height, below = 0;
    for (int v = 0; v < on->height; v++)
        for (int u = 0; u < on->width; u++)
            count[abs(signal_at(on, off, u, v))]++;
    int median = 0;
    while (2 * (below += count[median]) < total)
        median++;
    /* Within the median's bin by interpolation: most differences are one or two grey values. */
    double share = ((double)total / 2 - (double)(below - count[median])) / (double)count[median];
    double edge = median == 0 ? 0.5 * share : median - 0.5 + share;
    double sd = edge / MEDIAN_OF_HALF;
    return sd > LEAST_SD_DN ? sd : LEAST_SD_DN;
}

static int sum9(const struct frame *on, const struct frame *off, int u, int v)
{
    int sum = 0;
    for (int dv = -1; dv <= 1; dv++)
        for (int du = -1; du <= 1; du++)
            sum += signal_at(on, off, u + du, v + dv);
    return sum;
}

/* Whether no neighbour within two pixels is brighter; of equal ones the first counts. */
static int is_peak(const struct frame *on, const struct frame *off, int u, int v, int sum)
{
    for (int dv = -2; dv <= 2; dv++)
        for (int du = -2; du <= 2; du++) {
            int x = u + du, y = v + dv;
            if ((du == 0 && dv == 0) || x < 1 || y < 1 || x > on->width - 2 || y > on->height - 2)
                continue;
            int other = sum9(on, off, x, y);
            if (other > sum || (other == sum && (dv < 0 || (dv == 0 && du < 0))))
                return 0;
        }
    return 1;
}

/* Centroid under a Gaussian window that follows it: for a symmetric spot it has no bias. */
static void centre(const struct frame *on, const struct frame *off, int u, int v, real uv[2])
{
    double cu = u, cv = v;
    for (int n = 0; n < ROUNDS; n++) {
        double sum = 0, su = 0, sv = 0;
        for (int y = v - RADIUS; y <= v + RADIUS; y++)
            for (int x = u - RADIUS; x <= u + RADIUS; x++) {
                if (x < 0 || y < 0 || x >= on->width || y >= on->height)
                    continue;
                double d2 = (x - cu) * (x - cu) + (y - cv) * (y - cv);
                double weight = exp(-d2 / (2 * WINDOW_PX * WINDOW_PX)) * signal_at(on, off, x, y);
                sum += weight;
                su += weight * (x - cu);
                sv += weight * (y - cv);
            }
        if (!(sum > 0))
            break;
        /* The window halves the step of a spot of its own width: twice the step converges in few rounds. */
        double du = 2 * su / sum, dv = 2 * sv / sum;
        if (fabs(cu + du - u) > 2 || fabs(cv + dv - v) > 2)
            break;
        cu += du;
        cv += dv;
        if (fabs(du) + fabs(dv) < 1e-4)
            break;
    }
    uv[0] = (real)cu;
    uv[1] = (real)cv;
}

int frame_find_spots(const struct frame *on, const struct frame *off, real uv[][2], int most)
{
    int found = 0, peak[MOST_SPOTS];
    double threshold = THRESHOLD_SD * 3 * noise_dn(on, off); /* the sum of nine has three times the deviation */
    if (most > MOST_SPOTS)
        most = MOST_SPOTS;
    for (int v = 1; v < on->height - 1; v++)
        for (int u = 1; u < on->width - 1; u++) {
            int sum = sum9(on, off, u, v), at = found;
            if (sum < threshold || !is_peak(on, off, u, v, sum))
                continue;
            while (at > 0 && peak[at - 1] < sum)
                at--;
            if (at == most)
                continue; /* fainter than all of a full list */
            found += found < most;
            for (int i = found - 1; i > at; i--) {
                peak[i] = peak[i - 1];
                uv[i][0] = uv[i - 1][0];
                uv[i][1] = uv[i - 1][1];
            }
            peak[at] = sum;
            centre(on, off, u, v, uv[at]);
        }
    return found;
}

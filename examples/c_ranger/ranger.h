/* Ranger for a calibrated laser-spot range sensor, in C99 without dependencies and without allocation.

   Lengths are in mm, image positions in px; the centre of the top-left pixel is (0, 0). The camera frame is
   that of OpenCV. A range counts along the optical axis, from the sensor's reference plane. */

#ifndef RANGER_H
#define RANGER_H

#ifndef RANGER_MAX_LASERS
#define RANGER_MAX_LASERS 8
#endif
#define RANGER_ID_SIZE 16

#ifndef RANGER_REAL
#define RANGER_REAL double
#endif
typedef RANGER_REAL real;

enum ranger_lens { RANGER_PLUMB_BOB, RANGER_EQUIDISTANT };

/* A laser is a ray: origin (x, y, 0), direction (tx, ty, 1). */
struct ranger_laser {
    char id[RANGER_ID_SIZE];
    char axis; /* 'u' or 'v': image axis along which its spot moves */
    real x_mm, y_mm, tx, ty;
};

struct ranger_calibration {
    int width_px, height_px;
    enum ranger_lens lens;
    real f_px, cx_px, cy_px;
    real distortion[5]; /* plumb_bob: k1 k2 p1 p2 k3; equidistant: k1 k2 k3 k4 */
    real offset_mm;     /* distance of the pinhole behind the reference plane */
    real spot_sd_px;    /* 1 sigma of a spot's centre, noise and speckle together */
    real nearest_mm, farthest_mm; /* calibrated ranges */
    int lasers;
    struct ranger_laser laser[RANGER_MAX_LASERS];
};

struct ranger_range {
    real range_mm;
    real sd_mm;     /* 1 sigma by the spot alone, without the error of the calibration */
    real across_px; /* signed distance of the spot from the laser's line */
};

enum ranger_status {
    RANGER_OK,
    RANGER_NO_RANGE, /* the spot lies at or beyond infinity, or no depth of the lens model gives it */
    RANGER_AMBIGUOUS /* several assignments of spots to lasers are possible: fire the lasers one by one */
};

/* Position (u, v) of a laser's spot at the inverse depth w >= 0, 1/mm, and its derivatives by w. */
void ranger_spot(const struct ranger_calibration *calibration, int laser, real w, real uv[2], real duv_dw[2]);

/* Range of a spot of a known laser, by maximum likelihood. su and sv are standard deviations, px. */
enum ranger_status ranger_range(const struct ranger_calibration *calibration, int laser, const real uv[2],
                                real su, real sv, struct ranger_range *found);

/* Whether a spot may be that of a laser: it has a range, and lies on the laser's line. */
int ranger_is_on_line(const struct ranger_calibration *calibration, int laser, const real uv[2]);

/* Lasers of spots seen while all lasers of the image axis are on: laser_of[i] is the index of the laser of
   spot i, or -1 for other light. */
enum ranger_status ranger_assign(const struct ranger_calibration *calibration, char axis, int spots,
                                 const real uv[][2], int laser_of[]);

#endif

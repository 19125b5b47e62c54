#include "ranger.h"

#include <math.h>

#define STEPS 50
#define CONVERGED 1e-12
#define CONVERGED_FLOAT 1e-4f /* pixels of some hundreds have this resolution in single precision */
#define DIVERGED 0.1      /* growth of the squared misfit, in squared deviations, that rounding does not cause */
#define OFF_LINE_PX 1.0   /* a spot farther from a laser's line is not of this laser */
#define CLEARLY_BETTER 2.0 /* ratio of the spread of the second best assignment to that of the best */
#define SMOOTH 0.05       /* largest relative spread of inverse depths on one surface, where spots are missing */

/* Distorted coordinates of the undistorted xy, and their derivatives along the direction dxy. */
static void plumb_bob(const real k[5], const real xy[2], const real dxy[2], real out[2], real dout[2])
{
    real x = xy[0], y = xy[1], dx = dxy[0], dy = dxy[1];
    real r2 = x * x + y * y, dr2 = 2 * (x * dx + y * dy), p1 = k[2], p2 = k[3];
    real radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    real dradial = (k[0] + r2 * (2 * k[1] + 3 * k[4] * r2)) * dr2;
    out[0] = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    out[1] = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    dout[0] = dx * radial + x * dradial + 2 * p1 * (dx * y + x * dy) + p2 * (dr2 + 4 * x * dx);
    dout[1] = dy * radial + y * dradial + p1 * (dr2 + 4 * y * dy) + 2 * p2 * (dx * y + x * dy);
}

static void equidistant(const real k[5], const real xy[2], const real dxy[2], real out[2], real dout[2])
{
    real r = (real)hypot(xy[0], xy[1]), scale = 1, dscale = 0;
    if (r > (real)1e-9) {
        real dr = (xy[0] * dxy[0] + xy[1] * dxy[1]) / r, angle = (real)atan(r), a2 = angle * angle;
        real bent = angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
        real slope = (1 + a2 * (3 * k[0] + a2 * (5 * k[1] + a2 * (7 * k[2] + a2 * 9 * k[3])))) / (1 + r * r);
        scale = bent / r;
        dscale = (slope - scale) / r * dr;
    }
    for (int i = 0; i < 2; i++) {
        out[i] = xy[i] * scale;
        dout[i] = dxy[i] * scale + xy[i] * dscale;
    }
}

void ranger_spot(const struct ranger_calibration *c, int laser, real w, real uv[2], real duv_dw[2])
{
    const struct ranger_laser *ray = &c->laser[laser];
    /* The undistorted coordinates x = X/Z, y = Y/Z are linear in the inverse depth. */
    const real xy[2] = {ray->tx + ray->x_mm * w, ray->ty + ray->y_mm * w}, dxy[2] = {ray->x_mm, ray->y_mm};
    real bent[2], dbent[2];
    (c->lens == RANGER_EQUIDISTANT ? equidistant : plumb_bob)(c->distortion, xy, dxy, bent, dbent);
    uv[0] = c->cx_px + c->f_px * bent[0];
    uv[1] = c->cy_px + c->f_px * bent[1];
    duv_dw[0] = c->f_px * dbent[0];
    duv_dw[1] = c->f_px * dbent[1];
}

/* Inverse depth with which the search begins: that of the undistorted lens. */
static real first_w(const struct ranger_calibration *c, const struct ranger_laser *ray, const real uv[2])
{
    real x = (uv[0] - c->cx_px) / c->f_px, y = (uv[1] - c->cy_px) / c->f_px;
    if (c->lens == RANGER_EQUIDISTANT) {
        real angle = (real)hypot(x, y);
        if (angle > (real)1e-9) {
            real scale = (real)tan(angle < (real)1.4 ? angle : (real)1.4) / angle;
            x *= scale;
            y *= scale;
        }
    }
    return ((x - ray->tx) * ray->x_mm + (y - ray->ty) * ray->y_mm)
           / (ray->x_mm * ray->x_mm + ray->y_mm * ray->y_mm);
}

static real misfit2(const struct ranger_calibration *c, int laser, real w, const real uv[2], real su, real sv)
{
    real seen[2], slope[2];
    ranger_spot(c, laser, w, seen, slope);
    real du = (seen[0] - uv[0]) / su, dv = (seen[1] - uv[1]) / sv;
    return du * du + dv * dv;
}

enum ranger_status ranger_range(const struct ranger_calibration *c, int laser, const real uv[2], real su,
                                real sv, struct ranger_range *found)
{
    const struct ranger_laser *ray = &c->laser[laser];
    const real converged = sizeof(real) < 8 ? (real)CONVERGED_FLOAT : (real)CONVERGED;
    /* One pixel in inverse depth, the scale of the steps. */
    real unit = 1 / (c->f_px * (real)hypot(ray->x_mm, ray->y_mm));
    real w = first_w(c, ray, uv), step = unit, information = 0, seen[2], slope[2];
    for (int n = 0; n < STEPS && fabs(step) > converged * (fabs(w) + unit); n++) {
        ranger_spot(c, laser, w, seen, slope);
        real du = (seen[0] - uv[0]) / su, dv = (seen[1] - uv[1]) / sv;
        real su_w = slope[0] / su, sv_w = slope[1] / sv, before = du * du + dv * dv;
        information = su_w * su_w + sv_w * sv_w;
        step = (su_w * du + sv_w * dv) / information;
        /* Gauss-Newton; a step that makes the misfit larger is halved. */
        for (int half = 0; half < 8 && misfit2(c, laser, w - step, uv, su, sv) > before + (real)DIVERGED; half++)
            step /= 2;
        w -= step;
    }
    if (!(fabs(step) <= converged * (fabs(w) + unit)) || !(w > 0))
        return RANGER_NO_RANGE;
    ranger_spot(c, laser, w, seen, slope);
    found->range_mm = 1 / w - c->offset_mm;
    found->sd_mm = 1 / (w * w * (real)sqrt(information));
    found->across_px = ((uv[1] - seen[1]) * slope[0] - (uv[0] - seen[0]) * slope[1]) / (real)hypot(slope[0], slope[1]);
    return found->range_mm > 0 ? RANGER_OK : RANGER_NO_RANGE;
}

int ranger_is_on_line(const struct ranger_calibration *c, int laser, const real uv[2])
{
    struct ranger_range found;
    return ranger_range(c, laser, uv, 1, 1, &found) == RANGER_OK && fabs(found.across_px) < OFF_LINE_PX;
}

struct search {
    int spots;                                          /* on any line */
    int candidates[RANGER_MAX_LASERS];                  /* index of the spot */
    real w[RANGER_MAX_LASERS][RANGER_MAX_LASERS];       /* of spot and laser; 0: impossible */
    int taken[RANGER_MAX_LASERS], best[RANGER_MAX_LASERS];
    real best_spread, next_spread;
    int assignments;
};

/* Relative spread of the inverse depths of an assignment. */
static real spread(const struct search *s)
{
    real sum = 0, squares = 0;
    for (int i = 0; i < s->spots; i++)
        sum += s->w[i][s->taken[i]];
    real mean = sum / (real)s->spots;
    for (int i = 0; i < s->spots; i++)
        squares += (s->w[i][s->taken[i]] - mean) * (s->w[i][s->taken[i]] - mean);
    return (real)sqrt(squares / (real)s->spots) / mean;
}

static void try_all(struct search *s, int spot, unsigned free_lasers)
{
    if (spot == s->spots) {
        real now = spread(s);
        s->assignments++;
        if (s->assignments == 1 || now < s->best_spread) {
            s->next_spread = s->assignments == 1 ? (real)1e30 : s->best_spread;
            s->best_spread = now;
            for (int i = 0; i < s->spots; i++)
                s->best[i] = s->taken[i];
        } else if (now < s->next_spread)
            s->next_spread = now;
        return;
    }
    for (int laser = 0; laser < RANGER_MAX_LASERS; laser++)
        if ((free_lasers >> laser & 1u) && s->w[spot][laser] > 0) {
            s->taken[spot] = laser;
            try_all(s, spot + 1, free_lasers & ~(1u << laser));
        }
}

enum ranger_status ranger_assign(const struct ranger_calibration *c, char axis, int spots, const real uv[][2],
                                 int laser_of[])
{
    struct search s = {0};
    unsigned lasers = 0;
    int on_axis = 0;
    for (int laser = 0; laser < c->lasers; laser++)
        if (c->laser[laser].axis == axis) {
            lasers |= 1u << laser;
            on_axis++;
        }
    for (int i = 0; i < spots; i++) {
        real w[RANGER_MAX_LASERS] = {0};
        int possible = 0;
        laser_of[i] = -1;
        for (int laser = 0; laser < c->lasers; laser++) {
            struct ranger_range found;
            if ((lasers >> laser & 1u) && ranger_is_on_line(c, laser, uv[i])) {
                ranger_range(c, laser, uv[i], 1, 1, &found);
                w[laser] = 1 / (found.range_mm + c->offset_mm);
                possible = 1;
            }
        }
        if (!possible)
            continue;
        if (s.spots == on_axis)
            return RANGER_AMBIGUOUS; /* more spots than lasers */
        s.candidates[s.spots] = i;
        for (int laser = 0; laser < RANGER_MAX_LASERS; laser++)
            s.w[s.spots][laser] = w[laser];
        s.spots++;
    }
    if (s.spots == 0)
        return RANGER_OK;
    try_all(&s, 0, lasers);
    int is_smooth = s.spots == on_axis || (s.spots > 2 && s.best_spread < (real)SMOOTH);
    if (s.assignments == 0
        || (s.assignments > 1 && (!is_smooth || s.next_spread < (real)CLEARLY_BETTER * s.best_spread)))
        return RANGER_AMBIGUOUS;
    for (int i = 0; i < s.spots; i++)
        laser_of[s.candidates[i]] = s.best[i];
    return RANGER_OK;
}

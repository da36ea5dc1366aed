/* Hulls of clouds that are hard on a hull: lattices, rings, balls and points on segments between points, thin, noisy
 * and far out. Whatever the points:
 *
 *   - they are refused for lying on a plane, a line or a point, or have a hull
 *   - it is a closed polyhedron of corners that are points, bit for bit; no point is outside by more than faces were
 *     joined by, and the block for contact finding says the same
 *   - the points backwards have the same hull
 *   - its mass passes for a body's, rounded or not
 */
#include <string.h>

#include "bytes.h"

/* The tools are made for Check: here a failed check ends the program. */
#define ck_assert_msg(condition, ...) MUST(condition, __VA_ARGS__)
#include "../hull_tools.h"

/* A point on a segment between two that are there, at a quarter of it. */
static void take_between(struct bytes *in, const struct cloud *c, double x[3])
{
    const size_t i = (size_t)take_choice(in, 256) % c->count, j = (size_t)take_choice(in, 256) % c->count;
    const double w = take_choice(in, 5) / 4.0;
    for (int k = 0; k < 3; ++k) x[k] = w * c->x[3 * i + (size_t)k] + (1 - w) * c->x[3 * j + (size_t)k];
}

static void take_point(struct bytes *in, int kind, const struct cloud *c, double x[3])
{
    double a, b, norm = 0;
    switch (kind) {
    case 0: /* a lattice */
        for (int k = 0; k < 3; ++k) x[k] = take_choice(in, 3) - 1;
        return;
    case 1: /* the rim of a drum */
        a = 2 * M_PI * take_choice(in, 12) / 12;
        x[0] = cos(a), x[1] = sin(a), x[2] = take_choice(in, 2);
        return;
    case 2: /* a globe */
        a = 2 * M_PI * take_choice(in, 16) / 16, b = M_PI * take_choice(in, 9) / 8;
        x[0] = cos(a) * sin(b), x[1] = sin(a) * sin(b), x[2] = cos(b);
        return;
    case 3: /* a ball */
        for (int k = 0; k < 3; ++k) x[k] = take_in(in, -1, 1);
        for (int k = 0; k < 3; ++k) norm += x[k] * x[k];
        for (int k = 0; k < 3; ++k) x[k] /= norm > 0 ? sqrt(norm) : 1;
        return;
    case 4:
        if (c->count >= 4 && take_choice(in, 2)) {
            take_between(in, c, x);
            return;
        }
        break;
    default: break;
    }
    for (int k = 0; k < 3; ++k) x[k] = take_in(in, -1, 1);
}

static struct cloud take_cloud(struct bytes *in)
{
    struct cloud c = {.count = 0};
    const int count = 4 + (take_rarely(in, 8) ? take_choice(in, 256) : take_choice(in, 40)), kind = take_choice(in, 6);
    const double noise = take_choice(in, 3) ? 0 : take_scale(in, 1e-17, 1e-2);
    const double size = take_choice(in, 4) == 3 ? take_scale(in, 1e-6, 1e5) : 1;
    double scale[3], at[3] = {0};
    for (int k = 0; k < 3; ++k) scale[k] = size * (take_choice(in, 2) ? take_scale(in, 1e-7, 1) : 1);
    if (take_choice(in, 3) == 2)
        for (int k = 0; k < 3; ++k) at[k] = take_in(in, -100, 100) * size;
    for (int i = 0; i < count; ++i) {
        double x[3];
        take_point(in, kind, &c, x);
        add_point(&c, x[0], x[1], x[2]);
    }
    for (int i = 0; i < count && noise > 0; ++i)
        for (int k = 0; k < 3; ++k) c.x[3 * i + k] += noise * take_in(in, -1, 1);
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) c.x[3 * i + k] = at[k] + scale[k] * c.x[3 * i + k];
    if (take_choice(in, 2)) {
        double turn[4];
        take_orientation(in, turn);
        const double norm = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]);
        if (fabs(norm - 1) < 1e-3) place_cloud(&c, turn, 0, 0, 0);
    }
    return c;
}

static double extent_of(const struct cloud *c)
{
    double extent = 0;
    for (int k = 0; k < 3; ++k) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < c->count; ++i) {
            low = fmin(low, c->x[3 * i + (size_t)k]);
            high = fmax(high, c->x[3 * i + (size_t)k]);
        }
        extent = fmax(extent, high - low);
    }
    return extent;
}

/* Moments that bodies may have: world.h. */
static void check_mass(const sadmm_hull *hull)
{
    sadmm_mass mass;
    MUST(sadmm_hull_mass(hull, 1000, &mass) == SADMM_OK, "%s", sadmm_last_message());
    MUST(mass.mass > 0 && all_finite(mass.centre, 3) && all_finite(mass.orientation, 4), "%g kg", mass.mass);
    const double *I = mass.inertia;
    for (int k = 0; k < 3; ++k) {
        MUST(I[k] > 0, "%g", I[k]);
        MUST(I[k] <= (I[(k + 1) % 3] + I[(k + 2) % 3]) * (1 + 1e-9), "%g %g %g", I[0], I[1], I[2]);
    }
}

static void check_backwards(const struct cloud *c, double merge, double convex_radius, const sadmm_hull *hull)
{
    struct cloud back = {.count = 0};
    sadmm_hull *other = NULL;
    for (size_t i = c->count; i-- > 0;) add_point(&back, c->x[3 * i], c->x[3 * i + 1], c->x[3 * i + 2]);
    MUST(try_round_hull(&back, merge, convex_radius, &other) == SADMM_OK, "%s", sadmm_last_message());
    MUST(other->vertex_count == hull->vertex_count && other->face_count == hull->face_count, "%d faces and %d",
         (int)other->face_count, (int)hull->face_count);
    MUST(other->volume == hull->volume && memcmp(other->half, hull->half, sizeof hull->half) == 0 &&
             memcmp(other->orientation, hull->orientation, sizeof hull->orientation) == 0,
         "%.17g m^3 and %.17g", other->volume, hull->volume);
    sadmm_hull_destroy(other);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = bytes_of(data, size);
    const double merge = take_choice(&in, 4) ? 1e-6 : take_choice(&in, 2) ? take_scale(&in, 1e-12, 1e-2) : 0;
    const struct cloud c = take_cloud(&in);
    sadmm_hull *hull = NULL;
    const double convex_radius = take_rarely(&in, 4) ? take_scale(&in, 1e-9, 10) : 0;
    const sadmm_status status = try_round_hull(&c, merge, convex_radius, &hull);
    if (status != SADMM_OK) {
        MUST(status == SADMM_ERROR_INVALID_ARGUMENT, "%s", sadmm_status_name(status));
        MUST(strstr(sadmm_last_message(), "lie within") || strstr(sadmm_last_message(), "def->points["), "%s",
             sadmm_last_message());
        MUST(!hull, "%s", sadmm_last_message());
        return 0;
    }
    /* Where points are hard on qhull more faces are joined than asked for, by up to 1e-5 of the extent. */
    check_hull(hull, &c, (4 * fmax(merge, 1e-5) + 1e-9) * extent_of(&c));
    check_mass(hull);
    check_backwards(&c, merge, convex_radius, hull);
    sadmm_hull_destroy(hull);
    return 0;
}

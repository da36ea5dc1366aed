#include "system_terms.h"

#include <string.h>

#include "body_trapezoid.h"
#include "core/math/packed6.h"
#include "system_math.h"

static void pack(const double A[36], double out[PACKED6])
{
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k) *out++ = A[6 * r + k];
}

static void pack_rigid(double mass, sym3 I, double out[PACKED6])
{
    memset(out, 0, PACKED6 * sizeof *out);
    out[0] = out[2] = out[5] = mass;
    out[9] = I.xx, out[14] = I.yy, out[20] = I.zz;
    out[13] = I.xy, out[18] = I.xz, out[19] = I.yz;
}

void sadmm_body_terms(const struct sadmm_system *system, const struct sadmm_settings *settings, size_t first,
                      size_t count, double *A, double *b, struct sadmm_trapezoid *trapezoids)
{
    const struct sadmm_rigid *bodies = system->rigid;
    if (!bodies) memcpy(b, system->b + 6 * first, 6 * count * sizeof *b);
    for (size_t i = 0; i < count && !bodies; ++i) pack(system->A + 36 * (first + i), A + PACKED6 * i);
    for (size_t i = 0; i < count && bodies; ++i) {
        const struct spin_system spin = spin_of_system(&bodies[first + i], settings->dt);
        double mass;
        const sym3 I = sadmm_rigid_body_at(&bodies[first + i], &spin, settings, &mass, b + 6 * i);
        q_store(spin.orientation, trapezoids[first + i].halfway);
        v3_store(spin.angular, trapezoids[first + i].spin);
        pack_rigid(mass, I, A + PACKED6 * i);
        if (system->support_motion)
            sadmm_subtract_support_motion(mass, I, system->support_motion + 6 * (first + i), b + 6 * i);
    }
}

double sadmm_point_error(const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points, int32_t k)
{
    return sadmm_contact_e(system, settings, pair, points, k);
}

void sadmm_kinematic_motion(const struct sadmm_system *system, const struct sadmm_contact_pair *pair, double motion[6])
{
    sadmm_kinematic_about_other(system, pair, &system->contacts->points[pair->first], motion);
}

void sadmm_find_trapezoids(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                           const struct sadmm_settings *settings, struct sadmm_trapezoid *trapezoids)
{
    for (size_t i = 0; i < count; ++i) {
        struct sadmm_trapezoid *out = &trapezoids[i];
        double before[6];
        memcpy(before, bodies[i].velocity, 3 * sizeof *before);
        memcpy(before + 3, out->spin, 3 * sizeof *before);
        body_trapezoid(&bodies[i], before, velocity + 6 * i, out->correction);
        out->kind = TRAPEZOID_OWN;
        out->linear = size3(out->correction);
        out->angular = size3(out->correction + 3);
        out->moves_linear = trapezoid_speed_part(bodies[i].velocity, velocity + 6 * i, 0);
        out->moves_angular = trapezoid_speed_part(bodies[i].velocity, velocity + 6 * i, 1);
        out->rest = trapezoid_rest_speed(settings->gravity, bodies[i].gravity_scale, bodies[i].wrench, bodies[i].mass,
                                         settings->dt);
        out->touch = forces_touch(&bodies[i]);
    }
}

void sadmm_advance_later(const struct sadmm_rigid *body, struct sadmm_rigid *next)
{
    *next = *body;
    rolling_forget(next);
    next->was_hit = 0;
}

static void advance(const struct sadmm_rigid *body, const double velocity[6], const struct sadmm_trapezoid *trapezoid,
                    double dt, struct sadmm_rigid *next)
{
    double mean[6];
    for (int k = 0; k < 6; ++k) mean[k] = velocity[k] - trapezoid->correction[k];
    sadmm_advance_later(body, next);
    spin_move_from(body, trapezoid->halfway, velocity, mean, trapezoid->kind != TRAPEZOID_OWN, dt, next->position,
                   next->orientation, next->velocity);
    next->mean = body_moves_by_mean(body, trapezoid->kind);
}

void sadmm_advance(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                   const struct sadmm_trapezoid *trapezoids, double dt, struct sadmm_rigid *next)
{
    for (size_t i = 0; i < count; ++i) advance(&bodies[i], velocity + 6 * i, &trapezoids[i], dt, &next[i]);
}

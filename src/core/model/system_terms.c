#include "system_terms.h"

#include "core/math/lead.h"
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
                      size_t count, double *A, double *b)
{
    const struct sadmm_rigid *bodies = system->rigid;
    if (!bodies) memcpy(b, system->b + 6 * first, 6 * count * sizeof *b);
    for (size_t i = 0; i < count && !bodies; ++i) pack(system->A + 36 * (first + i), A + PACKED6 * i);
    for (size_t i = 0; i < count && bodies; ++i) {
        double mass;
        const double *stiffening = system->stiffening ? system->stiffening + 6 * (first + i) : NULL;
        const sym3 I = sadmm_rigid_body(&bodies[first + i], stiffening, settings, &mass, b + 6 * i);
        pack_rigid(mass, I, A + PACKED6 * i);
        if (system->carried) sadmm_take_carried(mass, I, system->carried + 6 * (first + i), b + 6 * i);
    }
}

double sadmm_point_error(const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points, int32_t k)
{
    return sadmm_contact_e(system, settings, pair, points, k);
}

void sadmm_driven_motion(const struct sadmm_system *system, const struct sadmm_contact_pair *pair, double motion[6])
{
    sadmm_driven_about_other(system, pair, &system->contacts->points[pair->first], motion);
}

void sadmm_find_leads(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                      const struct sadmm_settings *settings, struct sadmm_lead *leads)
{
    for (size_t i = 0; i < count; ++i) {
        struct sadmm_lead *out = &leads[i];
        lead_own(bodies[i].velocity, velocity + 6 * i, rigid_is_isotropic(v3_load(bodies[i].inertia)), out->lead);
        out->linear = size3(out->lead);
        out->angular = size3(out->lead + 3);
        out->moves_linear = lead_speed_part(bodies[i].velocity, velocity + 6 * i, 0);
        out->moves_angular = lead_speed_part(bodies[i].velocity, velocity + 6 * i, 1);
        out->rest = lead_rest_speed(settings->gravity, bodies[i].gravity_scale, bodies[i].wrench, bodies[i].mass,
                                    settings->dt);
        out->touch = forces_differ(&bodies[i]) ? TOUCH_DIFFERS : 0;
    }
}

static void advance(const struct sadmm_rigid *body, const double velocity[6], const double lead[6], double dt,
                    struct sadmm_rigid *next)
{
    double mean[6];
    for (int k = 0; k < 6; ++k) mean[k] = velocity[k] - lead[k];
    const vec3 position = rigid_move(v3_load(body->position), v3_load(mean), dt);
    const quat orientation = rigid_turn(q_load(body->orientation), v3_load(mean + 3), dt);
    *next = *body;
    v3_store(position, next->position);
    q_store(orientation, next->orientation);
    memcpy(next->velocity, velocity, sizeof next->velocity);
}

void sadmm_advance(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                   const struct sadmm_lead *leads, double dt, struct sadmm_rigid *next)
{
    for (size_t i = 0; i < count; ++i) advance(&bodies[i], velocity + 6 * i, leads[i].lead, dt, &next[i]);
}

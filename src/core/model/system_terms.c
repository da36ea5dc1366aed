#include "system_terms.h"

#include "core/math/lead.h"
#include "system_math.h"

void sadmm_body_terms(const struct sadmm_system *system, const struct sadmm_settings *settings, int32_t body,
                      double A[36], double b[6])
{
    sadmm_system_body(system, settings, body, A, b);
}

double sadmm_point_error(const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points, int32_t k)
{
    return sadmm_contact_e(system, settings, pair, points, k);
}

void sadmm_body_lead(const struct sadmm_rigid *body, const double velocity[6], double lead[6])
{
    lead_own(body->velocity, velocity, rigid_is_isotropic(v3_load(body->inertia)), lead);
}

void sadmm_rigid_advance(const struct sadmm_rigid *body, const double velocity[6], const double lead[6], double dt,
                         struct sadmm_rigid *next)
{
    struct sadmm_rigid moved = *body;
    double mean[6];
    memcpy(moved.velocity, velocity, sizeof moved.velocity);
    for (int k = 0; k < 6; ++k) mean[k] = velocity[k] - lead[k];
    v3_store(rigid_move(v3_load(body->position), v3_load(mean), dt), moved.position);
    q_store(rigid_turn(q_load(body->orientation), v3_load(mean + 3), dt), moved.orientation);
    *next = moved;
}

/* After the last iteration: momentum that no contact may change is restored, in either method; in the method `fast` no
 * island keeps more energy than it may have (math/energy_limit.h), in `paper` those that do are counted. Energies and
 * the work of contacts are added up at the bodies that name the islands. */
#include <float.h>
#include <string.h>

#include "core/math/dense6.h"
#include "literal.h"

/* x . A^-1 y */
static double inverse_form(const struct ref_body *body, const double x[6], const double y[6])
{
    double L[36], z[6];
    dense6_cholesky(body->A, L);
    dense6_solve(L, y, z);
    return dense6_dot(x, z);
}

static void add_up_energies(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        memset(&c->bodies[i].energies, 0, sizeof c->bodies[i].energies);
        c->bodies[i].along = 0;
    }
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        const struct ref_body *body = &c->bodies[i];
        struct island_energies *sum = &c->bodies[body->label].energies;
        double momentum[6];
        dense6_mul(body->A, body->v, momentum);
        sum->now += dense6_dot(momentum, body->v) / 2;
        sum->free += inverse_form(body, body->b, body->b) / 2;
        c->bodies[body->label].along += dense6_dot(body->v, body->b) / 2;
    }
    sadmm_ref_sum_impulses(c);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        const struct ref_body *body = &c->bodies[i];
        struct island_energies *sum = &c->bodies[body->label].energies;
        sum->drive -= inverse_form(body, body->impulse, body->b);
        sum->response += inverse_form(body, body->impulse, body->impulse);
    }
    for (size_t k = 0; k < c->system->contacts->point_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        int32_t body = constraint->side[0].body >= 0 ? constraint->side[0].body : constraint->side[1].body;
        struct island_energies *sum = &c->bodies[c->bodies[body].label].energies;
        sum->work += fmax(0, -constraint->e[0]) * constraint->lambda[0];
        sum->drive -= constraint->e[0] * constraint->lambda[0];
    }
    for (size_t p = 0; p < c->system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[p];
        if (sadmm_pair_gives_energy(c->system, pair))
            c->bodies[c->bodies[pair->body_a >= 0 ? pair->body_a : pair->body_b].label].energies.kinematic = 1;
    }
}

/* By what an island is slowed down. */
static double factor_of(struct ref_body *island, bool rebounds)
{
    const struct momentum_energies rigid = momentum_energies_of(&island->motions);
    if (island->rows) return 1; /* the energies are those of contacts alone */
    if (island->floating) energy_limit_subtract_rigid(&island->energies, &island->along, &rigid);
    double factor = energy_limit_factor(&island->energies, DBL_EPSILON);
    if (rebounds) factor = fmin(factor, energy_limit_rebound_factor(&island->energies, island->along, DBL_EPSILON));
    return factor;
}

/* The method `fast` has them from its weights. */
static void name_islands(struct sadmm_context *c)
{
    sadmm_ref_label_islands(c);
    for (int32_t i = 0; i < c->system->body_count; ++i) c->bodies[i].rows = false;
    for (size_t k = c->system->contacts->point_count; k < c->constraint_count; ++k) {
        const struct ref_side *side = c->constraints[k].side;
        c->bodies[c->bodies[side[0].body >= 0 ? side[0].body : side[1].body].label].rows = true;
    }
}

sadmm_status sadmm_ref_limit_energy(struct sadmm_context *c, int32_t *limited, struct sadmm_error *error)
{
    (void)error;
    const bool fast = c->settings->method == SADMM_METHOD_FAST;
    *limited = 0;
    if (!fast) name_islands(c);
    sadmm_ref_find_motions(c);
    add_up_energies(c);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *island = &c->bodies[i];
        if (island->label != i) continue;
        const bool rebounds = fast && energy_limit_tests_rebound(island->warm, c->settings->iterations);
        const double factor = factor_of(island, rebounds);
        island->slow_down = fast ? factor : 1;
        *limited += factor < 1;
    }
    for (int32_t i = 0; i < c->system->body_count; ++i)
        sadmm_ref_move_island(c, i, c->bodies[c->bodies[i].label].slow_down);
    return SADMM_OK;
}

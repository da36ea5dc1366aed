/* The kernel table of the literal backend, its context, and what surrounds the iteration. */
#include <string.h>

#include "core/solve/backends.h"
#include "core/base/memory.h"
#include "core/model/body_trapezoid.h"
#include "core/model/system_math.h"
#include "literal.h"

static sadmm_status create(int device, struct sadmm_context **out, struct sadmm_error *error)
{
    (void)device;
    *out = sadmm_alloc(1, sizeof **out);
    return *out ? SADMM_OK : sadmm_fail_memory(error, "the literal backend");
}

static void destroy(struct sadmm_context *c)
{
    if (!c) return;
    sadmm_free(c->bodies);
    sadmm_free(c->constraints);
    sadmm_free(c);
}

static sadmm_status begin(struct sadmm_context *c, const struct sadmm_system *system, const struct sadmm_plan *plan,
                          const struct sadmm_settings *settings, struct sadmm_error *error)
{
    size_t bodies = (size_t)system->body_count;
    size_t constraints = system->contacts->point_count + sadmm_row_constraint_count(system);
    if (!SADMM_GROW(c->bodies, 0, bodies) || !SADMM_GROW(c->constraints, 0, constraints))
        return sadmm_fail_memory(error, "the literal backend");
    c->system = system;
    c->plan = plan;
    c->settings = settings;
    c->constraint_count = constraints;
    return SADMM_OK;
}

static sadmm_status read_solution(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    const struct sadmm_system *system = c->system;
    for (int32_t i = 0; i < system->body_count; ++i)
        memcpy(system->velocity + 6 * (size_t)i, c->bodies[i].v, sizeof c->bodies[i].v);

    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        mat3 frame = sadmm_contact_frame(pair->normal);
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const double *lambda = c->constraints[k].lambda; /* rows that do not exist are 0 */
            v3_store(m3_tmul(frame, v3_load(lambda)), system->contacts->points[k].impulse);
        }
    }
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) {
        const struct sadmm_row_constraint *about = &system->rows->constraints[k];
        memcpy(system->rows->lambda + about->first, c->constraints[system->contacts->point_count + k].lambda,
               (size_t)about->count * sizeof(double));
    }
    return SADMM_OK;
}

static sadmm_status read_penalty(struct sadmm_context *c, double *beta, struct sadmm_error *error)
{
    (void)error;
    for (int32_t i = 0; i < c->system->body_count; ++i) beta[i] = c->bodies[i].beta;
    return SADMM_OK;
}

/* Of the bodies and the island of a contact point. */
static void touch_point(struct sadmm_context *c, const struct sadmm_contact_pair *pair, int32_t k)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    const struct ref_constraint *constraint = &c->constraints[k];
    const bool inner = constraint->side[0].body >= 0 && constraint->side[1].body >= 0;
    struct trapezoid_touch touch = {body_contact_touch(inner, constraint->mu), {0, 0}};
    const struct rolling_halfway at =
        rolling_halfway_of(
        pair->normal, &contacts->points[k], sadmm_migration_of(contacts->points, contacts->migrations, k));
    static const double still[6];
    const struct sadmm_contact_point *point = &contacts->points[k];
    const double *v[2] = {still, still}, *own[2] = {still, still};
    double correction[2], size[2] = {0, 0}, moves[2] = {0, 0}, rest[2] = {0, 0};
    for (int s = 0; s < 2; ++s) {
        const struct ref_side *side = &constraint->side[s];
        if (side->body < 0) continue;
        const double *arm = s ? point->arm_b : point->arm_a;
        v[s] = c->bodies[side->body].v;
        own[s] = c->bodies[side->body].correction;
        size[s] = trapezoid_size(own[s], arm);
        moves[s] = trapezoid_speed(c->system->rigid[side->body].velocity, v[s], arm);
        const struct sadmm_rigid *rigid = &c->system->rigid[side->body];
        rest[s] = trapezoid_rest_speed(c->settings->gravity, rigid->gravity_scale, rigid->wrench, rigid->mass,
                                       c->settings->dt);
        touch.island |= forces_touch(rigid);
    }
    const struct trapezoid_separation separation = body_point_way(&at, point, v, own, correction);
    trapezoid_add_point(&touch, separation,
                        constraint->lambda[0], correction, size, moves, rest,
                        c->settings->dt, c->settings->slop);
    for (int s = 0; s < 2; ++s) {
        if (constraint->side[s].body < 0) continue;
        struct ref_body *body = &c->bodies[constraint->side[s].body];
        body->touch |= touch.body[s];
        c->bodies[body->label].island_touch |= touch.island;
    }
}

/* Of bodies and islands, what their contacts say of the trapezoid correction. */
static void touch(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        double before[6];
        body->touch = body->island_touch = 0;
        spin_before(&c->system->rigid[i], c->settings->dt, before);
        body_trapezoid(&c->system->rigid[i], before, body->v, body->correction);
    }
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        if (!sadmm_pair_is_kinematic(c->system, pair)) continue;
        const int32_t body = pair->body_a >= 0 ? pair->body_a : pair->body_b;
        c->bodies[c->bodies[body].label].island_touch |= TOUCH_PENETRATES;
    }
    for (size_t p = 0; p < contacts->pair_count; ++p)
        for (int32_t k = 0; k < contacts->pairs[p].count; ++k)
            touch_point(c, &contacts->pairs[p], contacts->pairs[p].first + k);
}

/* Q: the primal iterate v, less its trapezoid correction. */
static sadmm_status integrate(struct sadmm_context *c, struct sadmm_rigid *next, struct sadmm_error *error)
{
    double dt = c->settings->dt;
    if (!c->system->rigid)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "integrate: the system gives A and b, not rigid bodies");
    for (int32_t i = 0; i < c->system->body_count && c->system->support_motion; ++i)
        for (int k = 0; k < 6; ++k) c->bodies[i].v[k] += c->system->support_motion[6 * (size_t)i + (size_t)k];
    sadmm_ref_label_islands(c);
    touch(c);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        const struct ref_body *from = &c->bodies[i];
        const struct sadmm_rigid *start = &c->system->rigid[i];
        const enum trapezoid_kind kind =
            body_trapezoid_kind(start, c->bodies[from->label].island_touch, from->touch);
        double correction[6] = {0}, mean[6];
        if (kind == TRAPEZOID_SHARED) trapezoid_shared(c->settings->gravity, dt, correction);
        if (kind == TRAPEZOID_OWN) memcpy(correction, from->correction, sizeof correction);
        for (int k = 0; k < 6; ++k) mean[k] = from->v[k] - correction[k];
        next[i] = *start;
        spin_move(start, from->v, mean, kind != TRAPEZOID_OWN, dt, next[i].position, next[i].orientation,
                  next[i].velocity);
        rolling_forget(&next[i]);
        next[i].was_hit = 0;
        next[i].mean = body_moves_by_mean(start, kind);
    }
    return SADMM_OK;
}

/* R, (12): F_i = - sum over the contacts given by geometry (the world's) of J_{i,k}^T u_{i,k} / dt. */
static sadmm_status recover_wrenches(struct sadmm_context *c, double *wrench, struct sadmm_error *error)
{
    (void)error;
    memset(wrench, 0, 6 * (size_t)c->system->body_count * sizeof *wrench);
    for (size_t k = 0; k < c->system->contacts->point_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        for (int s = 0; s < 2; ++s) {
            const struct ref_side *side = &constraint->side[s];
            if (side->body < 0) continue;
            double *F = wrench + 6 * (size_t)side->body;
            for (int r = 0; r < constraint->rows; ++r)
                for (int j = 0; j < 6; ++j) F[j] -= side->J[6 * r + j] * side->u[r] / c->settings->dt;
        }
    }
    return SADMM_OK;
}

static bool is_fast(const struct sadmm_context *c) { return c->settings->method == SADMM_METHOD_FAST; }

static sadmm_status init_penalty(struct sadmm_context *c, struct sadmm_error *error)
{
    return is_fast(c) ? sadmm_ref_init_weights(c, error) : sadmm_ref_init_penalty(c, error);
}

static sadmm_status iterate(struct sadmm_context *c, int count, bool goes_on, bool measure, struct sadmm_error *error)
{
    sadmm_status status = SADMM_OK;
    if (is_fast(c)) return sadmm_ref_iterate_fast(c, count, goes_on);
    for (int i = 0; i < count && status == SADMM_OK; ++i) {
        status = sadmm_ref_update_velocity(c, error);
        if (status == SADMM_OK) status = sadmm_ref_update_constraints(c, measure && i + 1 == count, error);
    }
    return status;
}

static sadmm_status measure_residuals(struct sadmm_context *c, struct sadmm_residual *residual,
                                      struct sadmm_error *error)
{
    return is_fast(c) ? sadmm_ref_measure_fast(c, residual) : sadmm_ref_measure_residuals(c, residual, error);
}

static const struct sadmm_kernels kernels_ref = {
    .backend = SADMM_BACKEND_REF,
    .precision = SADMM_F64,
    .variant = "literal",
    .create = create,
    .destroy = destroy,
    .begin = begin,
    .assemble_bodies = sadmm_ref_assemble_bodies,
    .assemble_contacts = sadmm_ref_assemble_contacts,
    .assemble_rows = sadmm_ref_assemble_rows,
    .init_penalty = init_penalty,
    .factorize = sadmm_ref_factorize,
    .update_velocity = sadmm_ref_update_velocity,
    .update_constraints = sadmm_ref_update_constraints,
    .update_weights = sadmm_ref_update_weights,
    .iterate = iterate,
    .measure_residuals = measure_residuals,
    .update_penalty = sadmm_ref_update_penalty,
    .limit_energy = sadmm_ref_limit_energy,
    .read_solution = read_solution,
    .read_penalty = read_penalty,
    .integrate = integrate,
    .recover_wrenches = recover_wrenches,
};

const struct sadmm_kernels *sadmm_ref_find(sadmm_precision precision, const char **reason)
{
    if (precision != SADMM_F64) {
        *reason = "the literal form is the oracle and exists in double precision only";
        return NULL;
    }
    *reason = "runs on any CPU, one thread";
    return &kernels_ref;
}

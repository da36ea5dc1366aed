/* After the last iteration: momentum that no contact may change is restored (cpu_momentum.c); in the method `fast` no
 * island keeps more energy than it may have (math/energy_limit.h), in `paper` those that do are counted. */
#include "core/math/dense6.h"
#include "core/math/relax.h"
#include "cpu_rows.h"

/* x . M x of a rigid body's A or A^-1. */
static double rigid_form(const double M[PACKED6], const double x[6])
{
    return M[0] * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) + M[9] * x[3] * x[3] + M[14] * x[4] * x[4] +
           M[20] * x[5] * x[5] + 2 * (M[13] * x[3] * x[4] + M[18] * x[3] * x[5] + M[19] * x[4] * x[5]);
}

/* M x */
static void rigid_product(const double M[PACKED6], const double x[6], double y[6])
{
    for (int k = 0; k < 3; ++k) y[k] = M[0] * x[k];
    y[3] = M[9] * x[3] + M[13] * x[4] + M[18] * x[5];
    y[4] = M[13] * x[3] + M[14] * x[4] + M[19] * x[5];
    y[5] = M[18] * x[3] + M[19] * x[4] + M[20] * x[5];
}

/* A body's terms: now, free, along. */
static void energies(const struct sadmm_context *c, size_t i, double terms[3])
{
    double b[6], v[6];
    cpu_load_b(c, i, b);
    cpu_load_v(c, i, v);
    terms[0] = rigid_form(&c->A[i * PACKED6], v) / 2;
    terms[1] = rigid_form(&c->A_inverse[i * PACKED6], b) / 2;
    terms[2] = dense6_dot(v, b) / 2;
}

/* Of a pair: work of its contacts that push apart, and what e adds to the drive. */
static void add_pair(const struct sadmm_context *c, size_t record, struct island_energies *sum)
{
    const struct pair_block *block = &c->pair_blocks[record / (size_t)LANES];
    size_t l = record % (size_t)LANES;
    double work = 0, drive = 0;
    for (int k = 0; k < c->system->contacts->pairs[block->pair[l]].count; ++k) {
        double error, impulse;
        if (c->plan.contact_rows == 3) {
            const struct point_slot *slot = (const struct point_slot *)c->slots + block->first + k;
            error = (double)slot->error[l];
            impulse = (double)(block->normal.x[l] * slot->lambda.x[l] + block->normal.y[l] * slot->lambda.y[l] +
                               block->normal.z[l] * slot->lambda.z[l]);
        } else {
            const struct normal_slot *slot = (const struct normal_slot *)c->slots + block->first + k;
            error = (double)slot->error[l];
            impulse = (double)slot->lambda[l];
        }
        work += max_of(0.0, -error) * impulse;
        drive -= error * impulse;
    }
    sum->work += work;
    sum->drive += drive;
}

static bool tests_rebound(const struct sadmm_context *c, const struct cpu_island *island)
{
    return c->fast && energy_limit_tests_rebound(island->warm, c->settings.iterations);
}

/* Sums over islands in the order of bodies, whatever the threads. */
static bool any_candidate(struct sadmm_context *c)
{
    bool any = false;
    for (int32_t i = 0; i < c->bodies; ++i) {
        memset(&c->islands[i].energies, 0, sizeof c->islands[i].energies);
        c->islands[i].along = 0;
    }
    for (int32_t i = 0; i < c->bodies; ++i) {
        struct cpu_island *sum = &c->islands[c->label[i]];
        sum->energies.now += c->body_sums[BODY_SUMS * i];
        sum->energies.free += c->body_sums[BODY_SUMS * i + 1];
        sum->along += c->body_sums[BODY_SUMS * i + 2];
    }
    for (int32_t k = 0; k < c->floating_count; ++k) {
        const struct momentum_energies rigid = momentum_energies_of(&c->floating[k].motions);
        struct cpu_island *island = &c->islands[c->label[c->floating_bodies[c->floating[k].first_body]]];
        energy_limit_subtract_rigid(&island->energies, &island->along, &rigid);
    }
    for (size_t p = 0; c->system->kinematic_count > 0 && p < c->system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[p];
        if (sadmm_pair_gives_energy(c->system, pair))
            cpu_island_of(c, pair->body_a, pair->body_b)->energies.kinematic = 1;
    }
    for (int32_t i = 0; i < c->bodies; ++i) {
        const struct cpu_island *island = &c->islands[i];
        if (c->label[i] != i || island->rows || island->energies.kinematic) continue;
        if (energy_limit_is_rounding(&island->energies, (double)SADMM_EPSILON)) continue;
        any = any || energy_limit_exceeded(island->energies.now, island->energies.free) ||
              (tests_rebound(c, island) &&
               energy_limit_rebounds(island->energies.now, island->energies.free, island->along,
                                     (double)SADMM_EPSILON));
    }
    return any;
}

static void add_impulses(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->bodies; ++i) {
        struct island_energies *sum = &c->islands[c->label[i]].energies;
        const double *terms = &c->body_sums[BODY_SUMS * i];
        sum->drive += terms[0];
        sum->response += terms[1];
    }
    for (size_t r = 0; r < c->pair_block_count * (size_t)LANES; ++r) {
        if (c->pair_blocks[r / (size_t)LANES].pair[r % (size_t)LANES] < 0) continue;
        const struct sadmm_contact_pair *pair = cpu_pair(c, r);
        add_pair(c, r, &cpu_island_of(c, pair->body_a, pair->body_b)->energies);
    }
}

static void energies_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) energies(c, i, &c->body_sums[BODY_SUMS * i]);
}

/* A body's terms: of drive and response. `wrenches` hold J^T lambda. */
static void impulse_terms(const struct sadmm_context *c, size_t i, double terms[2])
{
    double b[6], g[6], change[6];
    row8d sum = {0};
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) sum += cpu_wrench(c, c->incident[at]);
    for (int k = 0; k < 6; ++k) g[k] = sum[k];
    cpu_load_b(c, i, b);
    rigid_product(&c->A_inverse[i * PACKED6], g, change);
    terms[0] = -dense6_dot(change, b);
    terms[1] = dense6_dot(change, g);
}

static void impulses_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) impulse_terms(c, i, &c->body_sums[BODY_SUMS * i]);
}

/* By what the island of body i is slowed down. */
static double factor_of(const struct sadmm_context *c, int32_t i)
{
    const struct cpu_island *island = &c->islands[c->label[i]];
    if (island->rows) return 1; /* the energies are those of contacts alone */
    const double factor = energy_limit_factor(&island->energies, (double)SADMM_EPSILON);
    if (!tests_rebound(c, island)) return factor;
    return min_of(factor, energy_limit_rebound_factor(&island->energies, island->along, (double)SADMM_EPSILON));
}

static void invert_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) CPU(invert)(c, &c->A[i * PACKED6], &c->A_inverse[i * PACKED6]);
}

/* What the method `fast` has from its weights. */
static void prepare_paper(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->bodies; ++i) c->islands[i].rows = false;
    for (size_t k = 0; k < sadmm_row_constraint_count(c->system); ++k)
        cpu_island_of(c, c->system->rows->constraints[k].body_a, c->system->rows->constraints[k].body_b)->rows = true;
    cpu_parallel(c, invert_share, c);
}

static void limit_energies(struct sadmm_context *c, int32_t *limited)
{
    cpu_parallel(c, energies_share, c);
    if (!any_candidate(c)) return;
    CPU(sum_wrenches)(c);
    cpu_parallel(c, impulses_share, c);
    add_impulses(c);
    for (int32_t i = 0; i < c->bodies; ++i) {
        const double factor = factor_of(c, i);
        const int32_t floating = c->floating_of[c->label[i]];
        if (factor == 1) continue;
        *limited += c->label[i] == i;
        if (!c->fast) continue;
        if (floating >= 0) c->floating[floating].slow_down = factor;
        else
            for (int k = 0; k < 6; ++k) c->state[(size_t)i * ROW + (size_t)k] *= (real)factor;
    }
}

sadmm_status CPU(limit_energy)(struct sadmm_context *c, int32_t *limited, struct sadmm_error *error)
{
    (void)error;
    *limited = 0;
    CPU(find_motions)(c);
    if (!c->fast) prepare_paper(c);
    limit_energies(c, limited);
    CPU(move_floating)(c);
    /* residuals are recomputed, should anything follow */
    if (c->fast && (*limited > 0 || c->floating_count > 0)) c->exact_since = RELAX_RESIDUAL_PERIOD;
    return SADMM_OK;
}

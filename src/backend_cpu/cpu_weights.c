/* Kernels E-G of the method `fast`: one weight a constraint (math/weight.h), shared by the points of a pair, and
 * C_i = sum J^T B J. beta is 1 then, so that factor and Step 1 are those of the method `paper`.
 *
 * In double from the system's raw data; only the impulses are in this precision. Sums over a body go in the order of
 * its records, sums over an island in the order of bodies. */
#include "core/math/array3.h"
#include "core/math/weight.h"
#include "cpu_rows.h"

/* A^-1, packed. A rigid body's is inverted by blocks. */
void CPU(invert)(const struct sadmm_context *c, const double A[PACKED6], double out[PACKED6])
{
    if (CPU(has_rigid_mass)(c, A)) {
        packed_invert_rigid(A, out);
        return;
    }
    double M[36];
    for (int r = 0, at = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k, ++at) M[6 * r + k] = M[6 * k + r] = A[at];
    packed_invert(M, out);
}

/* Sums over a pair's points on one of its bodies: of arms where contacts have three rows, else of J^T J. */
static struct arm_sums pair_arms(const struct sadmm_context *c, const struct sadmm_contact_pair *pair, int side)
{
    const struct sadmm_contact_point *points = &c->system->contacts->points[pair->first];
    vec3d sum = {0}, squares = {0}, products = {0}; /* of products: xy, yz, zx */
    for (int k = 0; k < pair->count; ++k) {
        const vec3d r = vec3d_load(side ? points[k].arm_b : points[k].arm_a);
        sum += r;
        squares += r * r;
        products += r * vec3d_yzx(r);
    }
    return (struct arm_sums){pair->count,
                             {sum[0], sum[1], sum[2]},
                             {squares[0], squares[1], squares[2], products[0], products[2], products[1]}};
}

static void pair_rows(const struct sadmm_context *c, const struct sadmm_contact_pair *pair, int side, double S[PACKED6])
{
    double row[6];
    memset(S, 0, PACKED6 * sizeof *S);
    for (int k = 0; k < pair->count; ++k) {
        const struct sadmm_contact_point *point = &c->system->contacts->points[pair->first + k];
        normal_row(pair->normal, side ? point->arm_b : point->arm_a, row);
        packed_add_row(S, row, 1);
    }
}

/* ---- responses: J A^-1 J^T, 1/kg, once a step -------------------------------------------------------------------- */

/* Mean over a pair's points and rows. */
static double pair_response(struct sadmm_context *c, size_t record)
{
    const struct sadmm_contact_pair *pair = cpu_pair(c, record);
    const int32_t bodies[2] = {pair->body_a, pair->body_b};
    double w = 0, S[PACKED6];
    for (int side = 0; side < 2; ++side) {
        if (bodies[side] < 0) continue;
        const double *inverse = &c->A_inverse[(size_t)bodies[side] * PACKED6];
        if (c->plan.contact_rows == 1) {
            pair_rows(c, pair, side, S);
            w += packed_dot(inverse, S);
            continue;
        }
        const struct arm_sums sums = pair_arms(c, pair, side);
        c->pair_arms[2 * record + (size_t)side] = sums;
        if (c->plan.rigid || CPU(has_rigid_mass)(c, &c->A[(size_t)bodies[side] * PACKED6])) {
            w += packed_dot_arms(inverse, &sums);
            continue;
        }
        memset(S, 0, sizeof S);
        add_arm_sums(S, &sums);
        w += packed_dot(inverse, S);
    }
    return w / (c->plan.contact_rows * pair->count);
}

/* ---- weights ----------------------------------------------------------------------------------------------------- */

/* V of every island, kept at its label; at first whether it starts warm. `wrenches` hold J^T lambda. */
static void add_up_loads(struct sadmm_context *c)
{
    const bool first = c->weight_updates == 0;
    for (int32_t i = 0; i < c->bodies; ++i) {
        c->islands[i].sums = (struct weight_sums){0};
        if (first) c->islands[i].balance = 0;
    }
    for (int32_t i = 0; i < c->bodies; ++i) {
        struct weight_sums *sums = &c->islands[c->label[i]].sums;
        sums->energy += c->body_sums[BODY_SUMS * i];
        sums->kinetic += c->body_sums[BODY_SUMS * i + 1];
        sums->push += c->body_sums[BODY_SUMS * i + 2];
        sums->mass += cpu_body_mass(c, i);
        if (first) c->islands[c->label[i]].balance += c->body_sums[BODY_SUMS * i + 3];
    }
    for (int32_t i = 0; i < c->bodies; ++i) {
        struct cpu_island *island = &c->islands[i];
        if (c->label[i] != i) continue;
        if (first) island->warm = plan_may_start_warm(&c->plan, &c->settings) && weight_starts_warm(island->balance);
        c->any_cold = c->any_cold || !island->warm;
        c->any_warm = c->any_warm || island->warm;
        weight_update_speed(&island->weights, &island->sums,
                            weight_spring_iterations(island->warm, c->plan.rigid, c->settings.iterations));
    }
}

/* A body's part of its island's sums. */
static void add_up_body(const struct sadmm_context *c, size_t i, double sums[BODY_SUMS])
{
    double g[6], v[6], push = 0, balance = 0;
    row8d sum = {0};
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
        const row8d wrench = cpu_wrench(c, c->incident[at]);
        const double f[3] = {wrench[0], wrench[1], wrench[2]}, m[3] = {wrench[3], wrench[4], wrench[5]},
                     force = length3(f);
        sum += wrench;
        push += force;
        if (c->weight_updates > 0) continue;
        int side;
        const double share = cpu_is_shared(c, cpu_record(c, at, &side)) ? 0.5 : 1;
        balance += force > 0 || length3(m) > 0 ? share : -share;
    }
    for (int k = 0; k < 6; ++k) g[k] = sum[k];
    cpu_load_v(c, i, v);
    sums[0] = cpu_form(c, i, &c->A_inverse[i * PACKED6], g);
    sums[1] = cpu_form(c, i, &c->A[i * PACKED6], v);
    sums[2] = push;
    sums[3] = balance;
}

/* Sums of the sizes of the impulses of a block's pairs. Where a pair has no point lambda is 0. */
static void add_up_impulses(const struct sadmm_context *c, const struct pair_block *block, double sums[LANES])
{
    for (int l = 0; l < LANES; ++l) sums[l] = 0;
    for (int k = 0; k < block->slots; ++k) {
        if (c->plan.contact_rows == 3) {
            const vec f = ((const struct point_slot *)c->slots + block->first + k)->lambda;
            for (int l = 0; l < LANES; ++l) {
                const double impulse[3] = {(double)f.x[l], (double)f.y[l], (double)f.z[l]};
                sums[l] += length3(impulse);
            }
        } else {
            const lanes f = ((const struct normal_slot *)c->slots + block->first + k)->lambda;
            for (int l = 0; l < LANES; ++l) sums[l] += fabs((double)f[l]);
        }
    }
}

/* The contacts of deep stacks close small separations slowly. */
static void ease_separations(struct sadmm_context *c, size_t index)
{
    const struct pair_block *block = &c->pair_blocks[index];
    double slop = c->settings.slop / c->settings.dt;
    for (int l = 0; l < LANES; ++l) {
        if (block->pair[l] < 0) continue;
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[block->pair[l]];
        double share = cpu_island_of(c, pair->body_a, pair->body_b)->weights.separation_share;
        for (int k = 0; k < pair->count && share < 1; ++k) {
            real *error = c->plan.contact_rows == 3
                              ? (real *)&((struct point_slot *)c->slots + block->first + k)->error
                              : (real *)&((struct normal_slot *)c->slots + block->first + k)->error;
            error[l] = (real)weight_separation_error((double)error[l], share, slop);
        }
    }
}

/* weight_most of a pair. */
static double most_of(const struct sadmm_context *c, const struct sadmm_contact_pair *pair)
{
    const int32_t bodies[2] = {pair->body_a, pair->body_b};
    double mass[2] = {0, 0};
    int constraints[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
        if (bodies[side] < 0) continue;
        constraints[side] = c->offsets[bodies[side] + 1] - c->offsets[bodies[side]];
        mass[side] = cpu_body_mass(c, bodies[side]);
    }
    return weight_most(constraints, mass, pair->count);
}

static void weigh_pair_block(struct sadmm_context *c, size_t index)
{
    struct pair_block *block = &c->pair_blocks[index];
    double sums[LANES];
    add_up_impulses(c, block, sums);
    for (int l = 0; l < LANES; ++l) {
        if (block->pair[l] < 0) continue;
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[block->pair[l]];
        const struct cpu_island *island = cpu_island_of(c, pair->body_a, pair->body_b);
        if (!cpu_is_weighed(c, island)) continue;
        double *B = &c->pair_weight[index * (size_t)LANES + (size_t)l];
        double load = sums[l] / pair->count;
        double response = c->pair_response[index * (size_t)LANES + (size_t)l];
        *B = island->scale_weights > 0 ? *B * island->scale_weights
                                       : weight_of_pair(&island->weights, load, most_of(c, pair), response);
        block->inv_s[l] = (real)(pair->body_a >= 0 && pair->body_b >= 0 ? *B / 2 : *B);
    }
}

/* ---- C_i = sum J^T B J ------------------------------------------------------------------------------------------- */

static void add_rows(const struct sadmm_context *c, size_t record, int side, double C[PACKED6])
{
    int lane;
    const struct row_block *block = cpu_row_block(c, record, &lane);
    const struct row_weight *weights = c->row_weights + c->system->rows->constraints[block->constraint[lane]].first;
    double row[6], along[6] = {0};
    for (int r = 0; r < cpu_row_count(c, block, lane); ++r) {
        cpu_load_row(c, block, lane, side, r, row);
        packed_add_row(C, row, weights[r].weight);
        for (int j = 0; j < 6; ++j) along[j] += weights[r].along * row[j];
    }
    packed_add_row(C, along, 1);
}

static void add_weighted_arms(struct arm_sums *to, const struct arm_sums *arms, double weight)
{
    to->count += weight * arms->count;
    for (int k = 0; k < 3; ++k) to->r[k] += weight * arms->r[k];
    for (int k = 0; k < 6; ++k) to->rr[k] += weight * arms->rr[k];
}

static void assemble_C(struct sadmm_context *c, size_t i)
{
    double *C = &c->C[i * PACKED6], S[PACKED6];
    struct arm_sums weighted = {0};
    memset(C, 0, PACKED6 * sizeof *C);
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
        int side;
        const size_t record = cpu_record(c, at, &side);
        if (record >= cpu_pair_records(c)) {
            add_rows(c, record, side, C);
        } else if (c->plan.contact_rows == 3) {
            add_weighted_arms(&weighted, &c->pair_arms[2 * record + (size_t)side], c->pair_weight[record]);
        } else {
            pair_rows(c, cpu_pair(c, record), side, S);
            for (int k = 0; k < PACKED6; ++k) C[k] += c->pair_weight[record] * S[k];
        }
    }
    add_arm_sums(C, &weighted);
    c->beta[i] = 1;
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

static void update_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    const bool scales = c->weight_updates >= WEIGHT_FIRST_SCALE;
    /* world level: separations, a slop and a step */
    const bool eases = c->weight_updates == 0 && plan_may_start_warm(&c->plan, &c->settings) && c->plan.rigid;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) add_up_body(c, i, &c->body_sums[BODY_SUMS * i]);
    if (scales) CPU(add_up_imbalance)(c, thread, threads);
    sadmm_barrier_wait(&c->barrier, threads);
    if (thread == 0) add_up_loads(c);
    if (thread == 0 && scales) CPU(update_weight_scales)(c);
    sadmm_barrier_wait(&c->barrier, threads);
    sadmm_share(c->pair_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) weigh_pair_block(c, k);
    for (size_t k = begin; k < end && eases; ++k) ease_separations(c, k);
    sadmm_share(c->row_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) CPU(weigh_rows)(c, k);
    sadmm_barrier_wait(&c->barrier, threads);
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i)
        if (cpu_is_weighed(c, &c->islands[c->label[i]])) assemble_C(c, i);
    CPU(recompute_residuals)(c, begin, end);
}

sadmm_status CPU(update_weights)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    if (++c->weight_updates > 0 && !c->any_cold) return SADMM_OK;
    CPU(sum_wrenches)(c);
    cpu_parallel(c, update_share, c);
    return SADMM_OK;
}

static void respond_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) CPU(invert)(c, &c->A[i * PACKED6], &c->A_inverse[i * PACKED6]);
    sadmm_barrier_wait(&c->barrier, threads);
    size_t pair_records = c->pair_block_count * (size_t)LANES;
    sadmm_share(pair_records, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k)
        if (c->pair_blocks[k / (size_t)LANES].pair[k % (size_t)LANES] >= 0)
            c->pair_response[k] = pair_response(c, k);
    sadmm_share(c->row_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) CPU(respond_rows)(c, k);
}

sadmm_status CPU(init_weights)(struct sadmm_context *c, struct sadmm_error *error)
{
    cpu_parallel(c, respond_share, c);
    for (int32_t i = 0; i < c->bodies; ++i) {
        c->islands[i].weights = weight_new_island();
        c->islands[i].scale_weights = 0;
        c->islands[i].rows = false;
    }
    for (size_t k = 0; k < sadmm_row_constraint_count(c->system); ++k)
        cpu_island_of(c, c->system->rows->constraints[k].body_a, c->system->rows->constraints[k].body_b)->rows = true;
    c->weight_updates = -1; /* the first weights are none */
    c->exact_since = 0;
    c->step1_done = c->measured = c->any_cold = c->any_warm = false;
    return CPU(update_weights)(c, error);
}

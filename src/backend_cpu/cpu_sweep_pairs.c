/* Steps 2-4 (kernels L-N) of geometric contacts, LANES pairs at a time. Written once, specialised at compile time by
 * the number of contact rows and by what the sweep is for. */
#include "cpu_rows.h"

/* What a pair adds up over its points: force and torque about a, of lambda-like vectors. */
struct pair_sum {
    vec force, torque;
};

static inline void add_to(struct pair_sum *sum, vec arm, vec impulse)
{
    sum->force = add(sum->force, impulse);
    sum->torque = add(sum->torque, cross(arm, impulse));
}

static inline void write_wrenches(const struct sadmm_context *c, real *wrenches, size_t block,
                                  const struct pair_sum *sum, vec d)
{
    vec f = sum->force, ta = sum->torque, tb = add(ta, cross(d, f));
    size_t record = block * (size_t)LANES;
    const lanes zero = {0};
    const lanes on_a[ROW] = {-f.x, -f.y, -f.z, -ta.x, -ta.y, -ta.z, zero, zero};
    const lanes on_b[ROW] = {f.x, f.y, f.z, tb.x, tb.y, tb.z, zero, zero};
    store_rows(wrenches + record * ROW, on_a);
    store_rows(wrenches + (c->record_count + record) * ROW, on_b);
}

/* Largest |d lambda| over the rows of the contact frame (math/vec3.h, v3_tangents). */
static inline lanes frame_max(vec change, vec n)
{
    lanes sign = pick(n.z < 0, fill(-1), fill(1)), a = -1 / (sign + n.z), b = n.x * n.y * a;
    vec t1 = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, t2 = {b, sign + n.y * n.y * a, -n.y};
    return larger(magnitude(dot(change, n)), larger(magnitude(dot(change, t1)), magnitude(dot(change, t2))));
}

static inline lanes larger_inv_beta(const struct sadmm_context *c, const struct pair_block *block)
{
    lanes out = {0}; /* gcc 13 sees no value else */
    for (int l = 0; l < LANES && c->fast; ++l) {
        bool both = block->body_a[l] < c->bodies && block->body_b[l] < c->bodies;
        out[l] = block->inv_s[l] > 0 ? 1 / ((both ? 2 : 1) * block->inv_s[l]) : 0;
    }
    for (int l = 0; l < LANES && !c->fast; ++l)
        out[l] = real_max(cpu_inv_beta(c, block->body_a[l]), cpu_inv_beta(c, block->body_b[l]));
    return out;
}

/* Relative motion of the pair: u = v_b - v_a + w_b x d, w = w_b - w_a. */
static inline void pair_motion(const struct sadmm_context *c, const struct pair_block *block, vec *u, vec *w)
{
    const row8 *state = (const row8 *)c->state;
    lanes a[ROW], b[ROW];
#define ROW_A(l) state[block->body_a[l]]
#define ROW_B(l) state[block->body_b[l]]
    LOAD_ROWS(a, ROW_A);
    LOAD_ROWS(b, ROW_B);
#undef ROW_A
#undef ROW_B
    vec wb = {b[3], b[4], b[5]}, turn = cross(wb, block->d);
    *u = (vec){b[0] - a[0] + turn.x, b[1] - a[1] + turn.y, b[2] - a[2] + turn.z};
    *w = (vec){b[3] - a[3], b[4] - a[4], b[5] - a[5]};
}

/* The bodies of a block to come: their rows are the sweep's only scattered reads. */
static inline void prefetch_bodies(const struct sadmm_context *c, size_t index)
{
    if (index >= c->pair_block_count) return;
    const struct pair_block *block = &c->pair_blocks[index];
    for (int l = 0; l < LANES; ++l) {
        __builtin_prefetch(c->state + (size_t)block->body_a[l] * ROW);
        __builtin_prefetch(c->state + (size_t)block->body_b[l] * ROW);
    }
}

static inline __attribute__((always_inline)) void sweep_block(struct sadmm_context *c, size_t index, int rows,
                                                              enum cpu_sweep sweep, lanes relaxation, double *primal)
{
    const struct pair_block *block = &c->pair_blocks[index];
    vec n = block->normal, u = {0}, w = {0};
    lanes mu = block->friction, inv_s = block->inv_s, change_max = {0};
    const lanes zero = {0};
    struct pair_sum next = {0}, change = {0};

    if (sweep != CPU_SWEEP_START) {
        prefetch_bodies(c, index + 2);
        pair_motion(c, block, &u, &w);
    }
    if (rows == 3) {
        struct point_slot *slot = (struct point_slot *)c->slots + block->first;
        for (int k = 0; k < block->slots; ++k, ++slot) {
            vec arm = slot->arm, old = slot->lambda;
            if (sweep == CPU_SWEEP_START) {
                add_to(&next, arm, old);
                continue;
            }
            vec x = add(u, cross(w, arm)), e = scale(n, slot->error);
            vec step = scale(add(x, e), inv_s), y = sub(old, step);
            lanes yn = dot(n, y);
            vec t = sub(y, scale(n, yn));
            const struct lane_law law = lane_law_of(yn, dot(t, t), mu);
            vec lambda = add(scale(n, law.push), scale(t, law.shrink)), delta = sub(lambda, old);
            if (cpu_sweep_passes_changes(sweep)) {
                /* where it sticks, lambda^ - lambda is -step, without the rounding of either */
                delta = pick_vec(law.moves, delta, (vec){-step.x, -step.y, -step.z});
                lambda = pick_vec(law.moves, lambda, y);
            }
            if (sweep == CPU_SWEEP_RELAX) slot->lambda = add(old, scale(delta, relaxation));
            else if (sweep == CPU_SWEEP_RELAX_WARM)
                slot->lambda = pick_vec(relaxation > 1, add(old, scale(delta, relaxation)), lambda);
            else slot->lambda = lambda;
            if (cpu_sweep_measures(sweep)) change_max = larger(change_max, frame_max(delta, n));
            if (cpu_sweep_passes_changes(sweep)) {
                add_to(&next, arm, delta);
            } else if (sweep == CPU_SWEEP_MEASURE) {
                add_to(&next, arm, lambda);
                add_to(&change, arm, delta);
            } else {
                add_to(&next, arm, add(lambda, delta));
            }
        }
    } else {
        struct normal_slot *slot = (struct normal_slot *)c->slots + block->first;
        for (int k = 0; k < block->slots; ++k, ++slot) {
            vec arm = slot->arm;
            lanes old = slot->lambda;
            if (sweep == CPU_SWEEP_START) {
                add_to(&next, arm, scale(n, old));
                continue;
            }
            lanes step = (dot(n, add(u, cross(w, arm))) + slot->error) * inv_s, y = old - step;
            lanes lambda = pick(y > 0, y, zero);
            lanes delta = lambda - old;
            if (cpu_sweep_passes_changes(sweep)) delta = pick(y > 0, -step, -old);
            if (sweep == CPU_SWEEP_RELAX) slot->lambda = old + relaxation * delta;
            else if (sweep == CPU_SWEEP_RELAX_WARM)
                slot->lambda = pick(relaxation > 1, old + relaxation * delta, lambda);
            else slot->lambda = lambda;
            if (cpu_sweep_measures(sweep)) change_max = larger(change_max, magnitude(delta));
            if (cpu_sweep_passes_changes(sweep)) {
                add_to(&next, arm, scale(n, delta));
            } else if (sweep == CPU_SWEEP_MEASURE) {
                add_to(&next, arm, scale(n, lambda));
                add_to(&change, arm, scale(n, delta));
            } else {
                add_to(&next, arm, scale(n, lambda + delta));
            }
        }
    }
    write_wrenches(c, c->wrenches, index, &next, block->d);
    if (sweep == CPU_SWEEP_MEASURE) write_wrenches(c, c->change, index, &change, block->d);
    if (cpu_sweep_measures(sweep))
        *primal = fmax(*primal, (double)horizontal_max(change_max * larger_inv_beta(c, block)));
}

void CPU(sweep_pairs)(struct sadmm_context *c, size_t begin, size_t end, enum cpu_sweep sweep, double *primal)
{
    const lanes all = fill((real)c->settings.relaxation);
#define SWEEP(rows, kind)                                                                                \
    case kind:                                                                                           \
        for (size_t k = begin; k < end; ++k) {                                                           \
            const struct pair_block *block = &c->pair_blocks[k];                                         \
            const lanes relaxation = kind == CPU_SWEEP_RELAX_WARM                                        \
                                         ? cpu_relaxation_if_warm(c, block->body_a, block->body_b)       \
                                         : all;                                                          \
            sweep_block(c, k, rows, kind, relaxation, primal);                                           \
        }                                                                                                \
        break
#define SWEEPS(rows)                                                                                        \
    switch (sweep) {                                                                                        \
        SWEEP(rows, CPU_SWEEP_START);                                                                       \
        SWEEP(rows, CPU_SWEEP_ITERATE);                                                                     \
        SWEEP(rows, CPU_SWEEP_MEASURE);                                                                     \
        SWEEP(rows, CPU_SWEEP_RELAX);                                                                       \
        SWEEP(rows, CPU_SWEEP_PLAIN);                                                                       \
        SWEEP(rows, CPU_SWEEP_RELAX_WARM);                                                                  \
        SWEEP(rows, CPU_SWEEP_PLAIN_MEASURE);                                                               \
    }
    if (c->plan.contact_rows == 3) SWEEPS(3)
    else SWEEPS(1)
#undef SWEEPS
#undef SWEEP
}

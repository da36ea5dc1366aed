/* After the last iteration: momentum of floating islands that no contact may change (math/momentum.h). In double, from
 * the system's raw data and this precision's b and v; an island's sums go in the order of its bodies and pairs. */
#include "cpu_rows.h"

/* Where body i is from the body that names its island. */
static void place_of(const struct sadmm_context *c, int32_t i, double d[3])
{
    const double *at = c->system->rigid[i].position, *origin = c->system->rigid[c->label[i]].position;
    for (int k = 0; k < 3; ++k) d[k] = at[k] - origin[k];
}

static void add_pair(const struct sadmm_context *c, const struct sadmm_contact_pair *pair, double gram[PACKED6 + 1])
{
    const bool on_a = pair->body_a >= 0;
    double d[3];
    place_of(c, on_a ? pair->body_a : pair->body_b, d);
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct sadmm_contact_point *point = &c->system->contacts->points[k];
        const double *arm = on_a ? point->arm_a : point->arm_b, r[3] = {d[0] + arm[0], d[1] + arm[1], d[2] + arm[2]};
        momentum_add_contact(gram, pair->normal, pair->friction, r);
    }
}

static void find_motions(struct sadmm_context *c, struct cpu_floating *island)
{
    struct momentum_sums sums = {0};
    for (int32_t k = island->first_body; k < island->end_body; ++k) {
        const size_t i = (size_t)c->floating_bodies[k];
        double d[3], v[6], b[6];
        place_of(c, (int32_t)i, d);
        cpu_load_v(c, i, v);
        cpu_load_b(c, i, b);
        momentum_add_body(&sums, d, &c->A[i * PACKED6], v, b);
    }
    for (int32_t k = island->first_pair; k < island->end_pair; ++k)
        add_pair(c, &c->system->contacts->pairs[c->floating_pairs[k]], sums.gram);
    momentum_find_motions(&sums, &island->motions);
    island->slow_down = 1;
}

static void move(struct sadmm_context *c, const struct cpu_floating *island)
{
    double q[6];
    momentum_restoring(&island->motions, island->slow_down, q);
    for (int32_t k = island->first_body; k < island->end_body; ++k) {
        const size_t i = (size_t)c->floating_bodies[k];
        double d[3], v[6];
        place_of(c, (int32_t)i, d);
        cpu_load_v(c, i, v);
        momentum_move(q, island->slow_down, d, v);
        for (size_t j = 0; j < 6; ++j) c->state[i * ROW + j] = (real)v[j];
    }
}

static void find_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    sadmm_share((size_t)c->floating_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) find_motions(c, &c->floating[k]);
}

static void move_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    sadmm_share((size_t)c->floating_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) move(c, &c->floating[k]);
}

void CPU(find_motions)(struct sadmm_context *c)
{
    if (c->floating_count > 0) cpu_parallel(c, find_share, c);
}

void CPU(move_floating)(struct sadmm_context *c)
{
    if (c->floating_count > 0) cpu_parallel(c, move_share, c);
}

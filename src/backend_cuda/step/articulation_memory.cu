/* Articulations (step/articulation.cu): their structures and work go to the device. */
#include <string.h>

#include <algorithm>

#include "backend_cuda/device/double.h"

#include "core/model/gear_law.h"
#include "core/base/memory.h"
#include "core/model/joint_law.h"
#include "core/solve/articulation.h"
#include "core/solve/articulation_order.h"
#include "world.h"

/* In BUFFER_ARTICULATIONS, in this order: what the host gives; then what is the device's own, in doubles. */
struct articulation_memory {
    struct cuda_articulation_part *parts;
    struct cuda_articulation_range *ranges;
    int32_t *is_articulated, *entry, *members, *folds, *kept, *structures;
    uint8_t *kept_state; /* rows */
    size_t given;        /* bytes until here */
    struct cuda_articulation_body *bodies;
    double *work;
    size_t bytes;
};

static struct articulation_memory memory_at(char *at, const struct cuda_step *s)
{
    const size_t rows = (size_t)s->joint_constraints * SADMM_MAX_ROWS;
    struct articulation_memory m;
    m.parts = (struct cuda_articulation_part *)at;
    m.ranges = (struct cuda_articulation_range *)(m.parts + s->articulations);
    m.is_articulated = (int32_t *)(m.ranges + s->articulations);
    m.entry = m.is_articulated + s->bodies + s->joint_constraints;
    m.members = m.entry + s->bodies;
    m.folds = m.members + s->bodies;
    m.kept = m.folds + s->articulations;
    m.structures = m.kept + s->articulations;
    m.kept_state = (uint8_t *)(m.structures + s->articulation_numbers);
    m.given = ((size_t)((char *)(m.kept_state + rows) - at) + sizeof(double) - 1) / sizeof(double) * sizeof(double);
    m.bodies = (struct cuda_articulation_body *)(at + m.given);
    m.work = (double *)(m.bodies + s->bodies);
    m.bytes = (size_t)((char *)(m.work + s->articulation_work) - at);
    return m;
}

static bool make_order(const struct sadmm_resident_world *world, int32_t constraints,
                       struct sadmm_articulation_order *order)
{
    int32_t *bodies = (int32_t *)sadmm_alloc(2 * (size_t)constraints + 1, sizeof *bodies), at = 0;
    if (!bodies) return false;
    for (int32_t j = 0; j < world->joint_count; ++j)
        for (int32_t k = 0; k < world->joints[j].constraints; ++k)
            for (int s = 0; s < 2; ++s) bodies[at++] = world->joints[j].body[s];
    for (int32_t g = 0; g < world->gear_count; ++g)
        for (int s = 0; s < 2; ++s) bodies[at++] = world->gears[g].body[s];
    const bool made = sadmm_articulation_order_make(order, bodies, constraints, world->body_count,
                                                    SADMM_ARTICULATION_AROUND);
    sadmm_free(bodies);
    return made;
}

/* How much there is of all, and how much memory of its own a block needs, where every part fits there. */
static void measure(struct sadmm_context *c, const struct sadmm_articulation_order *order)
{
    struct cuda_step *s = c->step;
    size_t most = 0;
    s->articulations = order->parts;
    s->articulation_numbers = order->first[order->parts];
    s->articulation_work = 0;
    int32_t columns = 0;
    for (int32_t k = 0; k < order->parts; ++k) {
        const struct articulation_structure part = sadmm_articulation_part(order, k);
        const size_t work = articulation_work_size(&part),
                     numbers = articulation_numbers_size((int32_t)(order->first[k + 1] - order->first[k]));
        s->articulation_work += work;
        columns += part.columns;
        most = std::max(most, (work + numbers) * sizeof(double));
    }
    s->all_articulated = columns == s->joint_constraints;
    s->articulation_bytes = most + CUDA(articulation_shared_size)() <= (size_t)c->shared_limit ? most : 0;
}

/* What the host gives. */
static void fill(const struct cuda_step *s, const struct sadmm_articulation_order *order,
                 const struct articulation_memory *m)
{
    size_t work = 0;
    int32_t members = 0;
    memcpy(m->structures, order->numbers, s->articulation_numbers * sizeof *order->numbers);
    for (int32_t k = 0; k < order->parts; ++k) {
        const struct articulation_structure part = sadmm_articulation_part(order, k);
        const int32_t label = 1 + *std::min_element(part.body, part.body + part.bodies);
        const struct cuda_articulation_part at = {(int64_t)order->first[k], (int64_t)work,
                                                  (int32_t)(order->first[k + 1] - order->first[k]), label, members,
                                                  part.bodies, articulation_has_loop(&part), 0};
        m->parts[k] = at;
        memcpy(m->members + members, part.body, (size_t)part.bodies * sizeof *part.body);
        std::sort(m->members + members, m->members + members + part.bodies);
        members += part.bodies;
        work += articulation_work_size(&part);
        for (int32_t e = 0; e < part.bodies; ++e) {
            m->is_articulated[part.body[e]] = label;
            m->entry[part.body[e]] = e;
        }
        for (int32_t p = 0; p < part.columns; ++p) m->is_articulated[s->bodies + part.constraint[p]] = 1;
    }
}

static sadmm_status load_order(struct sadmm_context *c, const struct sadmm_articulation_order *order,
                               struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    measure(c, order);
    const struct articulation_memory size = memory_at(nullptr, s);
    TRY(CUDA(reserve)(c, BUFFER_ARTICULATIONS, size.bytes, error));
    char *host = (char *)sadmm_alloc(size.given, 1);
    if (!host) return sadmm_fail_memory(error, "the cuda backend's articulations");
    const struct articulation_memory m = memory_at(host, s);
    fill(s, order, &m);
    const sadmm_status status = CUDA(put)(c, buffer<char>(c, BUFFER_ARTICULATIONS), host, size.given, error);
    sadmm_free(host);
    return status == SADMM_OK ? CUDA(load_ncp)(c, c->step->joint_constraints - c->step->gears, order, error) : status;
}

sadmm_status CUDA(reserve_articulations)(struct sadmm_context *c, struct sadmm_error *error)
{
    const size_t sides = 2 * (size_t)c->view.contacts.pair_capacity;
    if (c->step->articulations == 0 || !articulations_are_small(c)) return SADMM_OK;
    return CUDA(reserve)(c, BUFFER_ARTICULATION_SIDES,
                         sides * (sizeof(struct cuda_articulation_side) + sizeof(int32_t)), error);
}

sadmm_status CUDA(load_articulations)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                                      struct sadmm_error *error)
{
    struct sadmm_articulation_order order = {};
    c->step->articulations = 0;
    c->step->articulation_bytes = 0;
    if (world->joint_count == 0) return SADMM_OK;
    if (!make_order(world, c->step->joint_constraints, &order))
        return sadmm_fail_memory(error, "the cuda backend's articulations");
    const sadmm_status status = load_order(c, &order, error);
    sadmm_articulation_order_free(&order);
    return status;
}

void CUDA(view_articulations)(struct sadmm_context *c)
{
    if (c->step->joints == 0) return;
    const struct articulation_memory m = memory_at(buffer<char>(c, BUFFER_ARTICULATIONS), c->step);
    struct joint_view *joints = &c->view.joints;
    joints->bodies = m.bodies;
    joints->work = m.work;
    joints->parts = m.parts;
    joints->is_articulated = m.is_articulated;
    joints->folds = m.folds;
    joints->kept = m.kept;
    joints->structures = m.structures;
    joints->kept_state = m.kept_state;
    joints->ranges = m.ranges;
    joints->entry = m.entry;
    joints->members = m.members;
    joints->sides = buffer<struct cuda_articulation_side>(c, BUFFER_ARTICULATION_SIDES);
    joints->pair_parts = (int32_t *)(joints->sides + 2 * (size_t)c->view.contacts.pair_capacity);
}

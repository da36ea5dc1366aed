/* Speculation of whole steps on the device: a step is planned before it is known, from the statistics of an earlier one
 * (world.h). Where there is none its contacts are found first. A speculation that is wrong costs time, never a
 * result. */
#include <algorithm>

#include "backend_cuda/graph/graph.h"
#include "backend_cuda/iterate/iterate.h"
#include "core/solve/plan.h"
#include "world.h"

static sadmm_status copy_out(struct sadmm_context *c, void *to, const void *from, size_t bytes,
                             struct sadmm_error *error)
{
    if (bytes > 0)
        CUDA_CALL(c, cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, c->stream),
                  "cudaMemcpyAsync from the device");
    return SADMM_OK;
}

/* Counts and statistics of the next step's contacts, read by the host. */
struct speculated_step {
    struct cuda_live live;
    struct cuda_graph_statistics statistics;
    struct sadmm_cuda_contact_counts counts;
    struct cuda_joint_counts joints;
};

void CUDA(plan_hits)(struct sadmm_context *c)
{
    c->step->hits_planned = true;
    c->step->calm = 0;
}

static sadmm_status reserve_hits(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(CUDA(reserve)(c, BUFFER_WORLD_HIT, 2 * (size_t)c->step->bodies * sizeof(struct sadmm_rigid), error));
    return COLLISION(reserve_hits)(c->step->collision, error);
}

static sadmm_status speculate_contacts(struct sadmm_context *c, struct speculated_step *out, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    TRY(CUDA(reserve)(c, PINNED_OUT, sizeof *out, error));
    struct speculated_step *staged = buffer<struct speculated_step>(c, PINNED_OUT);
    for (;;) {
        TRY(COLLISION(reserve)(s->collision, c->settings.substeps > 1, &s->candidate_capacity, &s->point_capacity,
                               error));
        if (takes_hits(c)) TRY(reserve_hits(c, error));
        CUDA(view_counts)(c, s->candidate_capacity);
        TRY(CUDA(reserve_layout)(c, error));
        CUDA(view_into)(c, s->into, 0);
        TRY(CUDA(clear_abort)(c, error));
        TRY(CUDA(launch_start)(c, error));
        TRY(CUDA(launch_joint_rows)(c, error));
        TRY(CUDA(enqueue_hits)(c, 0, error));
        TRY(CUDA(enqueue_find)(c, 0, error));
        TRY(CUDA(enqueue_statistics)(c, true, error));
        TRY(copy_out(c, &staged->live, c->view.model.live, sizeof staged->live, error));
        TRY(copy_out(c, &staged->statistics, c->view.model.statistics, sizeof staged->statistics, error));
        TRY(copy_out(c, &staged->counts, c->view.step.counts, sizeof staged->counts, error));
        TRY(copy_out(c, &staged->joints, &c->view.step.control->joints, sizeof staged->joints, error));
        TRY(CUDA(wait)(c, error));
        *out = *staged;
        if (out->live.abort_code == ABORT_HITS) {
            CUDA(plan_hits)(c);
            continue;
        }
        if (out->live.abort_code != ABORT_CAPACITY) return SADMM_OK;
        s->candidate_capacity = std::max(s->candidate_capacity, generous(out->counts.candidates));
        /* points are counted only where all candidates fitted */
        if (out->counts.candidates <= c->view.step.candidate_capacity)
            s->point_capacity = std::max(s->point_capacity, generous(out->counts.points));
    }
}

struct substep_plan CUDA(plan_of)(const struct sadmm_context *c, int32_t pairs, int32_t points,
                                  const struct cuda_graph_statistics *statistics,
                                  const struct cuda_joint_counts *joints)
{
    const struct cuda_step *s = c->step;
    struct sadmm_plan plan = {};
    plan.bodies = s->bodies;
    plan.pairs = pairs;
    plan.points = s->copies > 0 ? std::max(points, 1) : points;
    plan.row_constraints = joints->constraints;
    plan.contact_rows =
        s->copies > 0 ? (int)PLAN_CONTACT_ROWS_OF_COPIES : plan_contact_rows(plan.points, statistics->rough);
    plan.rigid = true;
    plan.gyroscopic = c->plan.gyroscopic; /* since load */
    plan.threads = 1;
    sadmm_plan_complete(&plan, &c->settings,
                        plan_mostly_warm(plan.pairs + joints->constraints, statistics->warm + joints->warm), s->cold);
    const int32_t warm = sadmm_plan_depends_on_warmth(&c->settings) ? plan.warm : -1;
    const struct substep_plan out = {plan, plan.contact_rows, warm, s->joints > 0 ? joints->constraints > 0 : -1};
    return out;
}

void CUDA(merge_statistics)(struct cuda_graph_statistics *a, const struct cuda_graph_statistics *b)
{
    /* bounds of the largest parts follow from these */
    a->sides = std::max(a->sides, b->sides);
    a->degree = std::max(a->degree, b->degree);
    a->island_sides = std::max(a->island_sides, b->island_sides);
    a->island_bodies = std::max(a->island_bodies, b->island_bodies);
    a->point_slots = std::max(a->point_slots, b->point_slots);
}

/* Where most constraints are cold some islands are; whether any is will be known once they are weighed. */
static void see_start(struct sadmm_context *c, const struct speculated_step *seen)
{
    struct cuda_step *s = c->step;
    const bool warm = plan_mostly_warm(seen->live.pairs + seen->joints.constraints,
                                       seen->statistics.warm + seen->joints.warm);
    s->cold = updates_weights(c) && (s->cold || !c->settings.warm_start || !warm);
    if (!warm) s->warm = 0;
}

/* Plans of the sub-steps, and the most that any of them is known to need. */
static void plan_substeps(struct sadmm_context *c, struct speculated_step *seen)
{
    struct cuda_step *s = c->step;
    const int substeps = c->settings.substeps;
    struct learned *learned = &s->learned;
    if (learned->step != s->enqueued) learned->step = -1;
    const int known = learned->step >= 0 && learned->substep < substeps ? learned->substep : 0;
    s->plans[0] = CUDA(plan_of)(c, seen->live.pairs, seen->live.points, &seen->statistics, &seen->joints);
    for (int k = known + 1; k < substeps; ++k) s->plans[k] = s->plans[known];
    c->plan = s->plans[0].plan;
    for (int k = 1; k < substeps; ++k) {
        c->plan.residuals = c->plan.residuals || s->plans[k].plan.residuals;
        c->plan.momentum = c->plan.momentum || s->plans[k].plan.momentum; /* the first contact may come later */
    }
    if (known == 0) return;
    seen->counts.pairs = (int32_t)std::max((int64_t)seen->counts.pairs, learned->pairs);
    CUDA(merge_statistics)(&seen->statistics, &learned->statistics);
}

/* The layout once, for what its parts are really like. Not where later sub-steps are known to differ. */
static sadmm_status tighten(struct sadmm_context *c, const struct speculated_step *seen, struct sadmm_error *error)
{
    if (c->partition.tier == SADMM_CUDA_TIER_STREAM || c->step->learned.step >= 0) return SADMM_OK;
    struct speculated_step *staged = buffer<struct speculated_step>(c, PINNED_OUT);
    staged->live = seen->live;
    CUDA_CALL(
        c, cudaMemcpyAsync(c->view.model.live, &staged->live, sizeof staged->live, cudaMemcpyHostToDevice, c->stream),
        "cudaMemcpyAsync to the device");
    TRY(CUDA(enqueue_statistics_and_layout)(c, true, &c->partition, error));
    TRY(copy_out(c, &staged->live, c->view.model.live, sizeof staged->live, error));
    TRY(copy_out(c, &staged->statistics, c->view.model.statistics, sizeof staged->statistics, error));
    TRY(CUDA(wait)(c, error));
    struct cuda_graph_statistics statistics = staged->statistics;
    statistics.point_slots = c->statistics.point_slots;
    if (staged->live.abort_code == ABORT_NONE) CUDA(tighten_partition)(c, &statistics, &c->partition);
    return CUDA(clear_abort)(c, error);
}

bool CUDA(may_be_apart)(const struct sadmm_context *c)
{
    const struct cuda_step *s = c->step;
    return s->joints > 0 && s->all_articulated && s->kinematic == 0 && c->settings.warm_start && !c->plan.residuals &&
           !stop_rule_checked(c) && !solves_ncp(c);
}

sadmm_status CUDA(speculate)(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    struct speculated_step seen;
    for (s->apart = s->untouched >= s->backoff;; s->apart = false) {
        TRY(speculate_contacts(c, &seen, error));
        see_start(c, &seen);
        plan_substeps(c, &seen);
        if (!s->apart || CUDA(may_be_apart)(c)) break; /* settings may be other than they were */
    }
    s->speculation.apart = s->apart;
    s->speculation.contact_rows = s->plans[0].contact_rows;
    s->speculation.copies = s->copies > 0;
    s->speculation.point_slots = seen.statistics.point_slots <= 1   ? 1
                                 : seen.statistics.point_slots <= 4 ? 4
                                                                    : SADMM_MAX_POINTS;
    s->speculation.warm = s->plans[0].warm;
    s->speculation.cold = s->cold || !updates_weights(c);
    s->speculation.unsolved = s->unsolved;
    s->speculation.rows = s->plans[0].rows;
    CUDA(view_counts)(c, generous(seen.counts.pairs));
    c->view.model.points = 0; /* results are read elsewhere */
    seen.statistics.point_slots = s->speculation.point_slots;
    c->statistics = seen.statistics;
    TRY(CUDA(choose_partition)(c, &seen.statistics, &c->partition, error));
    TRY(CUDA(reserve_layout)(c, error));
    TRY(tighten(c, &seen, error));
    TRY(CUDA(reserve_solver)(c, error));
    TRY(CUDA(reserve_articulations)(c, error));
    TRY(CUDA(reserve_ncp)(c, error));
    TRY(CUDA(reserve_push)(c, error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_IMPULSE, 3 * (size_t)s->point_capacity * sizeof(double), error));
    s->planned = true;
    forget_graphs(s);
    return SADMM_OK;
}

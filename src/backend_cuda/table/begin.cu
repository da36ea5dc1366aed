/* begin: raw data to the device; statistics, tier and layout (device/layout.h); arrays for the solve
 * (device/arrays.cu). */
#include <string.h>

#include "backend_cuda/assemble/assemble.h"
#include "backend_cuda/graph/graph.h"
#include "backend_cuda/iterate/iterate.h"

/* ---- raw data -------------------------------------------------------------------------------------------------- */

/* Raw data, as core has it. Bodies: rigid, or A then b; then velocities, those of kinematic bodies, and the motion of
 * bodies' supports. Blocks, then their multipliers. */
static sadmm_status reserve_raw(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    size_t n = (size_t)v->model.bodies;
    size_t body = c->plan.rigid ? sizeof(struct sadmm_rigid) : 42 * sizeof(double);
    size_t bodies = n * (body + (c->system->support_motion ? 12 : 6) * sizeof(double)) +
                    6 * (size_t)c->system->kinematic_count * sizeof(double),
           pairs = (size_t)v->contacts.pair_capacity * sizeof(struct sadmm_contact_pair);
    size_t points = (size_t)v->model.points * sizeof(struct sadmm_contact_point);
    size_t migrations = c->system->contacts->migrating > 0
                            ? (size_t)v->model.points * sizeof(struct sadmm_contact_migration)
                            : 0;
    size_t row_bytes = CUDA(raw_row_bytes)(v->rows.count);
    const cuda_capacity wanted[] = {
        {BUFFER_RAW_BODIES, bodies}, {BUFFER_RAW_PAIRS, pairs}, {BUFFER_RAW_POINTS, points},
        {BUFFER_RAW_ROWS, row_bytes}, {PINNED_BODIES, bodies},   {PINNED_PAIRS, pairs},
        {PINNED_POINTS, points},     {PINNED_ROWS, row_bytes},   {BUFFER_RAW_MIGRATIONS, migrations},
        {PINNED_MIGRATIONS, migrations},
    };
    TRY(reserve_all(c, wanted, error));
    void *const none = nullptr;
    cuda_buffer *b = c->buffers;
    v->raw.system = *c->system;
    v->raw.system.contacts = nullptr;
    v->raw.system.rows = nullptr;
    char *raw = (char *)b[BUFFER_RAW_BODIES].data;
    v->raw.system.rigid = (const struct sadmm_rigid *)(c->plan.rigid ? raw : none);
    v->raw.system.A = (const double *)(c->plan.rigid ? none : raw);
    v->raw.system.b = c->plan.rigid ? nullptr : v->raw.system.A + 36 * n;
    v->raw.system.velocity = (double *)(raw + n * body);
    v->raw.system.kinematic = v->raw.system.velocity + 6 * n;
    if (c->system->support_motion)
        v->raw.system.support_motion = v->raw.system.kinematic + 6 * (size_t)c->system->kinematic_count;
    CUDA(bind_raw_rows)(c, b[BUFFER_RAW_ROWS].data);
    v->raw.pairs = (struct sadmm_contact_pair *)b[BUFFER_RAW_PAIRS].data;
    v->raw.points = (struct sadmm_contact_point *)b[BUFFER_RAW_POINTS].data;
    v->raw.migrations = (struct sadmm_contact_migration *)b[BUFFER_RAW_MIGRATIONS].data;
    return SADMM_OK;
}

/* ---- begin ----------------------------------------------------------------------------------------------------- */

/* The view's counts. */
static void count(struct sadmm_context *c)
{
    cuda_view *v = &c->view;
    v->model.bodies = c->plan.bodies;
    v->contacts.pair_capacity = (c->plan.pairs + WARP - 1) / WARP * WARP;
    v->model.points = c->plan.points;
    v->rows.count = (int32_t)sadmm_row_constraint_count(c->system);
    v->joints.count = 0;
    v->kinematic.count = 0;
    v->model.contact_rows = c->plan.contact_rows == 1 ? 1 : 3; /* as in whole steps, which may have none as well */
    v->model.warm_start = c->plan.warm_start;
    c->bounces = false;
    for (size_t p = 0; p < c->system->contacts->pair_count; ++p)
        c->bounces = c->bounces || c->system->contacts->pairs[p].restitution > 0;
}

static sadmm_status upload_raw(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_system *system = c->system;
    const struct sadmm_contact_set *contacts = system->contacts;
    const cuda_view *v = &c->view;
    TRY(CUDA(upload)(c, (void *)v->raw.pairs, PINNED_PAIRS, 0, contacts->pairs,
                     contacts->pair_count * sizeof *contacts->pairs, error));
    TRY(CUDA(upload)(c, (void *)v->raw.points, PINNED_POINTS, 0, contacts->points,
                     contacts->point_count * sizeof *contacts->points, error));
    if (contacts->migrating > 0)
        TRY(CUDA(upload)(c, (void *)v->raw.migrations, PINNED_MIGRATIONS, 0, contacts->migrations,
                         contacts->point_count * sizeof *contacts->migrations, error));
    return CUDA(upload_rows)(c, error);
}

/* Parts that turn out to be too large: STREAM has none. */
static sadmm_status lay_out(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_partition *partition = &c->partition;
    struct cuda_known known;
    TRY(CUDA(enqueue_layout)(c, partition, error));
    if (partition->tier == SADMM_CUDA_TIER_STREAM) return SADMM_OK;
    TRY(CUDA(download_known)(c, &known, error));
    c->statistics = known.statistics;
    if (known.live.abort_code == ABORT_NONE) return SADMM_OK;
    if (c->wanted != SADMM_CUDA_TIER_AUTO)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                          "the cuda tier asked for: a thread block would get %d sides and %d bodies: at most %d and %d",
                          known.statistics.part_sides, known.statistics.part_bodies, partition->most_sides,
                          partition->most_bodies);
    *partition = {};
    partition->tier = SADMM_CUDA_TIER_STREAM;
    partition->islands = c->fast || c->plan.momentum;
    TRY(CUDA(upload_live)(c, ABORT_NONE, error));
    return CUDA(enqueue_layout)(c, partition, error);
}

extern "C" sadmm_status CUDA(begin)(struct sadmm_context *c, const struct sadmm_system *system,
                                    const struct sadmm_plan *plan, const struct sadmm_settings *settings,
                                    struct sadmm_error *error)
{
    int64_t records = (int64_t)plan->pairs + plan->row_constraints + WARP;
    if (records > INT32_MAX / (4 * ROW))
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld constraints: at most %d", (long long)(records - WARP),
                          INT32_MAX / (4 * ROW) - WARP);
    if (plan->bodies > INT32_MAX / LINE_GENERAL)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d bodies: at most %d", plan->bodies, INT32_MAX / LINE_GENERAL);
    CUDA_ENTER(c);
    TRY(CUDA(wait)(c, error)); /* the staging buffers are about to be written */
    c->system = system;
    c->plan = *plan;
    c->starting = true;
    c->placed = c->measured = c->rescaled = c->step1_done = c->prologue = false;
    c->refused = 0;
    c->graph_valid = false;
    TRY(CUDA(use_settings)(c, settings, error));
    count(c);
    TRY(reserve_raw(c, error));
    TRY(CUDA(reserve_layout)(c, error));
    TRY(upload_raw(c, error));
    TRY(CUDA(upload_live)(c, ABORT_NONE, error));
    bool islands = c->fast || plan->momentum ||
                   (c->wanted != SADMM_CUDA_TIER_GRID && c->wanted != SADMM_CUDA_TIER_STREAM);
    struct cuda_known known;
    TRY(CUDA(enqueue_statistics)(c, islands, error));
    TRY(CUDA(download_known)(c, &known, error));
    c->statistics = known.statistics;
    TRY(CUDA(choose_partition)(c, &c->statistics, &c->partition, error));
    TRY(CUDA(reserve_solver)(c, error));
    return lay_out(c, error);
}

/* The pipeline's entries: contact sets to and fro, finds.
 *
 * Pinned memory is written only while nothing reads it: every entry that leaves work on the stream behind sets
 * `pending`, and the next one waits first.
 */
#include <string.h>

#include <algorithm>

#include "backend_cuda/device/parallel.h"
#include "memory.h"
#include "pipeline.h"

/* Shapes from which the tree pays, and stores by the warp (fewer wait 1.4 us for them); shapes that a shape of an
 * environment may meet, up to which it is tested against all of them; capacity from which the radix sort pays. */
enum { TREE_FROM = 6144, BY_WARP_FROM = 16384, GROUP_LEAVES = 64 };
static const int64_t RADIX_FROM = 16385;

static sadmm_status make_branch(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    ENTER(c);
    CUDA_CALL(c, cudaStreamCreateWithFlags(&c->side, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
    CUDA_CALL(c, cudaEventCreateWithFlags(&c->made, cudaEventDisableTiming), "cudaEventCreateWithFlags");
    CUDA_CALL(c, cudaEventCreateWithFlags(&c->hidden, cudaEventDisableTiming), "cudaEventCreateWithFlags");
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(create)(int device, struct sadmm_cuda_collision **out, struct sadmm_error *error)
{
    int count = 0;
    *out = nullptr;
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code != cudaSuccess || count == 0) {
        (void)cudaGetLastError();
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "no CUDA device: %s",
                          code != cudaSuccess ? cudaGetErrorString(code) : "the driver lists none");
    }
    if (device < 0 || device >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "device = %d: must be in [0, %d]", device, count - 1);
    struct sadmm_cuda_collision *c = (struct sadmm_cuda_collision *)sadmm_alloc(1, sizeof *c);
    if (!c) return sadmm_fail_memory(error, "collision detection on the device");
    c->device = device;
    c->tree_from = TREE_FROM;
    c->group_leaves = GROUP_LEAVES;
    c->by_warp_from = BY_WARP_FROM;
    c->radix_from = RADIX_FROM;
    for (size_t &bytes : c->input_bytes) bytes = SIZE_MAX;
    const sadmm_status status = make_branch(c, error);
    if (status != SADMM_OK) {
        COLLISION(destroy)(c);
        return status;
    }
    COLLISION(broad_phase_kernels)(&c->kernels);
    COLLISION(sort_kernels)(&c->kernels);
    COLLISION(narrow_phase_kernels)(&c->kernels);
    COLLISION(narrow_hulls_kernels)(&c->kernels);
    COLLISION(narrow_meshes_kernels)(&c->kernels);
    COLLISION(mesh_kernels)(&c->kernels);
    COLLISION(narrow_smooth_kernels)(&c->kernels);
    COLLISION(seam_kernels)(&c->kernels);
    COLLISION(matching_kernels)(&c->kernels);
    COLLISION(hits_take_kernels)(&c->hits_kernels);
    COLLISION(hits_contacts_kernels)(&c->hits_kernels);
    *out = c;
    return SADMM_OK;
}

extern "C" void COLLISION(destroy)(struct sadmm_cuda_collision *c)
{
    if (!c) return;
    {
        current_device scope(c->device);
        if (c->pending) (void)cudaStreamSynchronize(c->stream);
        for (int name = 0; name < BUFFERS; ++name) release(c, name);
        if (c->hidden) (void)cudaEventDestroy(c->hidden);
        if (c->made) (void)cudaEventDestroy(c->made);
        if (c->side) (void)cudaStreamDestroy(c->side);
        (void)cudaGetLastError();
    }
    sadmm_free(c->present);
    sadmm_free(c->planes);
    sadmm_free(c->grouped);
    sadmm_free(c->radii);
    sadmm_seams_free(&c->seams);
    COLLISION(free_hits)(c);
    sadmm_free(c);
}

extern "C" sadmm_status COLLISION(upload)(struct sadmm_cuda_collision *c, void *stream,
                                          const struct sadmm_contact_set *set, struct sadmm_error *error)
{
    const int which = 1 - c->current;
    c->can_undo = false;
    if (set->pair_count > (size_t)MOST_CANDIDATES || set->point_count > (size_t)INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu pairs with %zu points: at most %d pairs can be indexed",
                          set->pair_count, set->point_count, (int)MOST_CANDIDATES);
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(COLLISION(reserve_set)(c, which, set->pair_count, set->point_count, error));
    TRY(reserve(c, PINNED_PAIRS, set->pair_count, sizeof *set->pairs, error));
    TRY(reserve(c, PINNED_POINTS, set->point_count, sizeof *set->points, error));
    TRY(reserve(c, PINNED_PAIR_KEYS, set->pair_count, sizeof(uint64_t), error));
    TRY(reserve(c, PINNED_COUNTS, 1, sizeof(struct sadmm_cuda_contact_counts), error));

    const struct collision_set to = set_of(c, which);
    struct sadmm_cuda_contact_counts *counts = in<struct sadmm_cuda_contact_counts>(c, PINNED_COUNTS);
    uint64_t *keys = in<uint64_t>(c, PINNED_PAIR_KEYS);
    counts->candidates = (int64_t)set->pair_count;
    counts->pairs = (int32_t)set->pair_count;
    counts->points = (int32_t)set->point_count;
    counts->dt = set->dt;
    for (size_t i = 0; i < set->pair_count; ++i)
        keys[i] = contact_shapes(&set->pairs[i]);
    if (set->pair_count > 0) memcpy(in<void>(c, PINNED_PAIRS), set->pairs, set->pair_count * sizeof *set->pairs);
    if (set->point_count > 0) memcpy(in<void>(c, PINNED_POINTS), set->points, set->point_count * sizeof *set->points);
    TRY(copy(c, to.pairs, in<void>(c, PINNED_PAIRS), set->pair_count * sizeof *set->pairs, true, error));
    TRY(copy(c, to.points, in<void>(c, PINNED_POINTS), set->point_count * sizeof *set->points, true, error));
    if (set->migrating > 0) {
        const size_t bytes = set->point_count * sizeof *set->migrations;
        TRY(reserve(c, PINNED_MIGRATIONS, bytes, 1, error));
        memcpy(in<void>(c, PINNED_MIGRATIONS), set->migrations, bytes);
        TRY(copy(c, to.migrations, in<void>(c, PINNED_MIGRATIONS), bytes, true, error));
    }
    TRY(copy(c, to.keys, keys, set->pair_count * sizeof *keys, true, error));
    TRY(copy(c, to.counts, counts, sizeof *counts, true, error));
    c->current = which;
    c->counts[which].pairs = counts->pairs;
    c->counts[which].points = counts->points;
    c->counts[which].dt = counts->dt;
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(find)(struct sadmm_cuda_collision *c, void *stream,
                                        const struct sadmm_collision_input *input, struct sadmm_cuda_contacts *out,
                                        struct sadmm_error *error)
{
    struct sadmm_cuda_contact_counts counts;
    c->can_undo = false;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(reserve(c, PINNED_COUNTS, 1, sizeof counts, error));
    TRY(COLLISION(take_input)(c, input, nullptr, error));
    TRY(COLLISION(run_stages)(c, input->shape_count, &counts, error));
    c->pending = false; /* run_stages has waited */
    c->current = 1 - c->current;
    c->counts[c->current].pairs = counts.pairs;
    c->counts[c->current].points = counts.points;
    c->counts[c->current].dt = counts.dt;
    c->can_undo = true;
    ++c->stats.finds;
    if (out) {
        const struct collision_set set = set_of(c, c->current);
        out->pairs = set.pairs;
        out->points = set.points;
        out->migrations = set.migrations;
        out->device_counts = set.counts;
        out->counts = counts;
    }
    return SADMM_OK;
}

/* Of points that have been downloaded, those that have one. */
static sadmm_status download_migrations(struct sadmm_cuda_collision *c, size_t points,
                                        struct sadmm_contact_set *contacts, size_t *migrating,
                                        struct sadmm_error *error)
{
    const struct sadmm_contact_point *from = in<struct sadmm_contact_point>(c, PINNED_POINTS);
    const size_t bytes = points * sizeof *contacts->migrations;
    *migrating = 0;
    for (size_t k = 0; k < points; ++k) *migrating += from[k].migrates != MIGRATES_NOT;
    if (*migrating == 0) return SADMM_OK;
    TRY(reserve(c, PINNED_MIGRATIONS, bytes, 1, error));
    TRY(copy(c, in<void>(c, PINNED_MIGRATIONS), set_of(c, c->current).migrations, bytes, false, error));
    TRY(wait(c, error));
    if (!sadmm_contact_set_reserve_migrations(contacts, points)) return sadmm_fail_memory(error, "contacts");
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(download)(struct sadmm_cuda_collision *c, void *stream,
                                            struct sadmm_contact_set *contacts, struct sadmm_error *error)
{
    const struct contact_counts counts = c->counts[c->current];
    const size_t pairs = (size_t)counts.pairs, points = (size_t)counts.points;
    const struct collision_set from = set_of(c, c->current);
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(reserve(c, PINNED_PAIRS, pairs, sizeof *contacts->pairs, error));
    TRY(reserve(c, PINNED_POINTS, points, sizeof *contacts->points, error));
    TRY(copy(c, in<void>(c, PINNED_PAIRS), from.pairs, pairs * sizeof *contacts->pairs, false, error));
    TRY(copy(c, in<void>(c, PINNED_POINTS), from.points, points * sizeof *contacts->points, false, error));
    TRY(wait(c, error));
    if (!SADMM_GROW(contacts->pairs, contacts->pair_count, pairs) ||
        !SADMM_GROW(contacts->points, contacts->point_count, points))
        return sadmm_fail_memory(error, "contacts");
    size_t migrating;
    TRY(download_migrations(c, points, contacts, &migrating, error));
    if (migrating > 0)
        memcpy(contacts->migrations, in<void>(c, PINNED_MIGRATIONS), points * sizeof *contacts->migrations);
    contacts->migrating = migrating;
    if (pairs > 0) memcpy(contacts->pairs, in<void>(c, PINNED_PAIRS), pairs * sizeof *contacts->pairs);
    if (points > 0) memcpy(contacts->points, in<void>(c, PINNED_POINTS), points * sizeof *contacts->points);
    contacts->pair_count = pairs;
    contacts->point_count = points;
    contacts->dt = counts.dt;
    return SADMM_OK;
}

extern "C" struct sadmm_cuda_contacts COLLISION(set)(const struct sadmm_cuda_collision *c, int which)
{
    const struct collision_set set = set_of(c, which);
    struct sadmm_cuda_contacts out = {set.pairs, set.points, set.migrations, set.counts, {}};
    return out;
}

extern "C" void COLLISION(set_current)(struct sadmm_cuda_collision *c, int current,
                                       struct sadmm_cuda_contact_counts counts)
{
    c->current = current;
    c->counts[current].pairs = counts.pairs;
    c->counts[current].points = counts.points;
    c->counts[current].dt = counts.dt;
    c->can_undo = false;
    c->pending = false;
}

extern "C" int COLLISION(current)(const struct sadmm_cuda_collision *c) { return c->current; }

extern "C" void COLLISION(undo)(struct sadmm_cuda_collision *c)
{
    if (!c->can_undo) return;
    c->can_undo = false;
    c->current = 1 - c->current;
}

extern "C" size_t COLLISION(memory)(const struct sadmm_cuda_collision *c)
{
    size_t bytes = 0;
    for (int name = 0; name < PINNED_SHAPES; ++name) bytes += c->buffers[name].capacity;
    return bytes;
}

extern "C" struct sadmm_cuda_collision_stats COLLISION(stats)(const struct sadmm_cuda_collision *c)
{
    struct sadmm_cuda_collision_stats stats = c->stats;
    stats.candidate_capacity = c->candidate_capacity;
    stats.point_capacity = c->point_capacity;
#ifdef SADMM_CUDA_EMULATED
    stats.visits = node_visits;
#endif
    return stats;
}

extern "C" void COLLISION(tune)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_collision_tuning *tuning)
{
    c->tree_from = tuning->tree_from > 0 ? tuning->tree_from : TREE_FROM;
    c->group_leaves = tuning->group_leaves != 0 ? tuning->group_leaves : GROUP_LEAVES;
    c->by_warp_from = tuning->by_warp_from > 0 ? tuning->by_warp_from : BY_WARP_FROM;
    c->radix_from = tuning->radix_from > 0 ? tuning->radix_from : RADIX_FROM;
    if (tuning->first_capacity > 0)
        c->candidate_capacity = c->point_capacity = std::min(tuning->first_capacity, MOST_CANDIDATES);
}

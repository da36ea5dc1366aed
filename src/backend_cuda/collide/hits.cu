/* Hits (hits.h) on the host's side: memory, launches, what has happened. */
#include <algorithm>

#include "memory.h"

/* ---- groups ------------------------------------------------------------------------------------------------------ */

namespace {
/* What load_hits uploads, and the keys it is made by. */
struct group_lists {
    uint64_t *keys; /* environment << 32 | body slot, or group << 32 | leaf */
    int32_t *bodies, *leaves, *of, *shared;
    struct hit_group *groups;
    size_t body_count, leaf_count, shared_count, count;
    group_lists() : keys(), bodies(), leaves(), of(), shared(), groups(), body_count(), leaf_count(), shared_count(), count() {}
    ~group_lists()
    {
        void *blocks[] = {keys, bodies, leaves, of, shared, groups};
        for (void *block : blocks) sadmm_free(block);
    }
    group_lists(const group_lists &) = delete;
    group_lists &operator=(const group_lists &) = delete;
    bool reserve(size_t slots, size_t leaf_slots)
    {
        keys = (uint64_t *)sadmm_alloc(std::max(slots, leaf_slots) + 1, sizeof *keys);
        bodies = (int32_t *)sadmm_alloc(slots + 1, sizeof *bodies);
        of = (int32_t *)sadmm_alloc(slots + 1, sizeof *of);
        leaves = (int32_t *)sadmm_alloc(leaf_slots + 1, sizeof *leaves);
        shared = (int32_t *)sadmm_alloc(leaf_slots + 1, sizeof *shared);
        groups = (struct hit_group *)sadmm_alloc(slots + 1, sizeof *groups);
        return keys && bodies && of && leaves && shared && groups;
    }
};
} // namespace

/* Does everything that moves belong to an environment? */
static bool is_grouped(const struct sadmm_collision_input *input)
{
    for (size_t slot = 0; slot < input->body_count; ++slot)
        if (input->bodies[slot].system_body != -1 && input->bodies[slot].environment < 0) return false;
    return true;
}

static void group_bodies(const struct sadmm_collision_input *input, struct group_lists *lists)
{
    const bool grouped = is_grouped(input);
    size_t count = 0;
    for (size_t slot = 0; slot < input->body_count; ++slot) {
        const int32_t environment = grouped ? input->bodies[slot].environment : 0;
        lists->of[slot] = -1;
        if (environment >= 0) lists->keys[count++] = ordered_key((uint32_t)environment, (uint32_t)slot);
    }
    std::sort(lists->keys, lists->keys + count);
    for (size_t i = 0; i < count; ++i) {
        const int32_t slot = (int32_t)(uint32_t)lists->keys[i];
        if (i == 0 || lists->keys[i] >> 32 != lists->keys[i - 1] >> 32)
            lists->groups[lists->count++].body_first = (int32_t)i;
        ++lists->groups[lists->count - 1].body_count;
        lists->of[slot] = (int32_t)lists->count - 1;
        lists->bodies[i] = slot;
    }
    lists->body_count = count;
}

static void group_leaves(const struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                         struct group_lists *lists)
{
    size_t count = 0;
    for (size_t i = 0; i < (size_t)c->view.leaf_count; ++i) {
        const int32_t group = lists->of[input->shapes[c->present[i]].body];
        if (group < 0) lists->shared[lists->shared_count++] = (int32_t)i;
        else lists->keys[count++] = ordered_key((uint32_t)group, (uint32_t)i);
    }
    std::sort(lists->keys, lists->keys + count);
    for (size_t i = 0; i < count; ++i) {
        ++lists->groups[lists->keys[i] >> 32].leaf_count;
        lists->leaves[i] = (int32_t)(uint32_t)lists->keys[i];
    }
    lists->leaf_count = count;
}

/* Where each has its room; what all have, at least 1. */
static void give_room(const struct sadmm_cuda_collision *c, struct group_lists *lists, size_t *room, size_t *near,
                      size_t *records)
{
    const size_t all = lists->shared_count + (size_t)c->view.plane_count;
    size_t leaves = 0;
    *room = *near = *records = 0;
    for (size_t g = 0; g < lists->count; ++g) {
        struct hit_group *group = &lists->groups[g];
        group->leaf_first = (int32_t)leaves;
        group->room_first = (int32_t)*room;
        group->near_first = (int32_t)*near;
        group->record_first = (int32_t)*records;
        group->room = HIT_ROOM + HIT_ROOM_A_SHAPE * group->leaf_count;
        group->record_room = HIT_RECORDS + HIT_RECORDS_A_BODY * group->body_count;
        leaves += (size_t)group->leaf_count;
        *room += (size_t)group->room;
        *near += (size_t)group->leaf_count + all;
        *records += (size_t)group->record_room;
    }
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

sadmm_status COLLISION(reserve_hits)(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    if (!c->takes_hits) return SADMM_OK;
    TRY(reserve(c, HIT_LISTED, (size_t)c->candidate_capacity, sizeof *c->hits.listed, error));
    c->hits.listed = in<int32_t>(c, HIT_LISTED);
    return SADMM_OK;
}

static sadmm_status reserve_groups(struct sadmm_cuda_collision *c, const struct group_lists &lists, size_t room,
                                   size_t near, size_t records, struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    TRY(reserve(c, HIT_GROUPS, lists.count, sizeof *h->groups, error));
    TRY(reserve(c, HIT_PROGRESS, lists.count, sizeof *h->progress, error));
    TRY(reserve(c, HIT_GROUP_BODIES, lists.body_count, sizeof *h->group_bodies, error));
    TRY(reserve(c, HIT_GROUP_LEAVES, lists.leaf_count + 1, sizeof *h->group_leaves, error));
    TRY(reserve(c, HIT_SHARED_LEAVES, lists.shared_count + 1, sizeof *h->shared_leaves, error));
    TRY(reserve(c, HIT_GROUP_OF, (size_t)c->view.body_count, sizeof *h->group_of, error));
    TRY(reserve(c, HIT_FORESEEN, room, sizeof *h->foreseen, error));
    TRY(reserve(c, HIT_NEAR, near + 1, sizeof *h->near, error));
    TRY(reserve(c, HIT_TAKEN, records, sizeof *h->taken, error));
    TRY(reserve(c, HIT_RECORDS_OF_STEPS, 2 * records, sizeof *h->records, error));
    h->groups = in<struct hit_group>(c, HIT_GROUPS);
    h->progress = in<struct hit_progress>(c, HIT_PROGRESS);
    h->group_bodies = in<int32_t>(c, HIT_GROUP_BODIES);
    h->group_leaves = in<int32_t>(c, HIT_GROUP_LEAVES);
    h->shared_leaves = in<int32_t>(c, HIT_SHARED_LEAVES);
    h->group_of = in<int32_t>(c, HIT_GROUP_OF);
    h->foreseen = in<struct foreseen_hit>(c, HIT_FORESEEN);
    h->near = in<uint64_t>(c, HIT_NEAR);
    h->taken = in<struct sadmm_world_hit>(c, HIT_TAKEN);
    h->records = in<struct sadmm_world_hit>(c, HIT_RECORDS_OF_STEPS);
    h->group_count = (int32_t)lists.count;
    h->shared_leaf_count = (int32_t)lists.shared_count;
    h->record_capacity = (int32_t)records;
    return SADMM_OK;
}

static sadmm_status upload_groups(struct sadmm_cuda_collision *c, const struct group_lists &lists,
                                  struct sadmm_error *error)
{
    const size_t number = sizeof(int32_t);
    CUDA_CALL(c, cudaMemsetAsync(c->hits.progress, 0, lists.count * sizeof *c->hits.progress, c->stream),
              "cudaMemsetAsync(hits)");
    TRY(copy(c, in<void>(c, HIT_GROUPS), lists.groups, lists.count * sizeof *lists.groups, true, error));
    TRY(copy(c, in<void>(c, HIT_GROUP_BODIES), lists.bodies, lists.body_count * number, true, error));
    TRY(copy(c, in<void>(c, HIT_GROUP_LEAVES), lists.leaves, lists.leaf_count * number, true, error));
    TRY(copy(c, in<void>(c, HIT_SHARED_LEAVES), lists.shared, lists.shared_count * number, true, error));
    TRY(copy(c, in<void>(c, HIT_GROUP_OF), lists.of, (size_t)c->view.body_count * number, true, error));
    return wait(c, error); /* the lists go */
}

static sadmm_status make_groups(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                struct sadmm_error *error)
{
    struct group_lists lists;
    size_t room, near, records;
    if (!lists.reserve(input->body_count, (size_t)c->view.leaf_count)) return sadmm_fail_memory(error, "hits");
    group_bodies(input, &lists);
    group_leaves(c, input, &lists);
    give_room(c, &lists, &room, &near, &records);
    c->takes_hits = lists.count > 0 && std::max(std::max(room, near), 2 * records) <= (size_t)INT32_MAX;
    if (!c->takes_hits) return SADMM_OK;
    TRY(reserve_groups(c, lists, room, near, records, error));
    return upload_groups(c, lists, error);
}

static sadmm_status reserve_bodies(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    const size_t slots = (size_t)c->view.body_count;
    TRY(reserve(c, HIT_STATE, 1, sizeof *h->state, error));
    TRY(reserve(c, HIT_MARKS, slots, sizeof *h->marks, error));
    TRY(reserve(c, HIT_HELD, slots, sizeof *h->held, error));
    TRY(reserve(c, HIT_KINDS, slots, sizeof *h->kinds, error));
    TRY(reserve(c, HIT_FLYERS, slots, sizeof(struct flyer), error));
    TRY(reserve(c, HIT_SINCE, slots, sizeof *h->since, error));
    TRY(reserve(c, HIT_IMPULSES, 6 * slots, sizeof *h->impulse, error));
    TRY(reserve(c, HIT_BOXES, (size_t)c->view.leaf_count, sizeof *h->boxes, error));
    h->state = in<struct hits_state>(c, HIT_STATE);
    h->marks = in<struct hit_marks>(c, HIT_MARKS);
    h->held = in<unsigned char>(c, HIT_HELD);
    h->kinds = in<unsigned char>(c, HIT_KINDS);
    h->flyers = in<struct flyer>(c, HIT_FLYERS);
    h->since = in<double>(c, HIT_SINCE);
    h->impulse = in<double>(c, HIT_IMPULSES);
    h->boxes = in<struct sadmm_box3>(c, HIT_BOXES);
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(load_hits)(struct sadmm_cuda_collision *c, void *stream,
                                             const struct sadmm_collision_input *input, const unsigned char *held,
                                             struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    const size_t slots = (size_t)c->view.body_count;
    c->takes_hits = held && slots > 0 && c->view.leaf_count > 0;
    if (!c->takes_hits) return SADMM_OK;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(make_groups(c, input, error));
    if (!c->takes_hits) return SADMM_OK;
    h->shape_count = (int32_t)(c->input_bytes[0] / sizeof *c->view.shapes);
    TRY(reserve_bodies(c, error));
    CUDA_CALL(c, cudaMemsetAsync(h->state, 0, sizeof *h->state, c->stream), "cudaMemsetAsync(hits)");
    CUDA_CALL(c, cudaMemsetAsync(h->marks, 0, slots * sizeof *h->marks, c->stream), "cudaMemsetAsync(hits)");
    TRY(copy(c, in<void>(c, HIT_HELD), held, slots, true, error));
    return wait(c, error);
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

extern "C" bool COLLISION(takes_hits)(const struct sadmm_cuda_collision *c) { return c->takes_hits; }

static void view_hits(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step)
{
    c->hits.c = c->view;
    c->hits.step = *step;
    c->hits.few = c->view.candidate_capacity < c->radix_from;
}

static sadmm_status launch_hits(struct sadmm_cuda_collision *c, const struct hits_launch &what, int64_t threads,
                                struct sadmm_error *error)
{
    c->kernel = what.name;
    return launch_view(c, what, c->hits, threads, error);
}

/* Of strided kernels: not more threads than this. */
static const int64_t MOST_THREADS = 1 << 16;

sadmm_status COLLISION(take_hits)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step,
                                  struct sadmm_error *error)
{
    const struct hits_kernels *k = &c->hits_kernels;
    const int64_t candidates = c->view.candidate_capacity;
    view_hits(c, step);
    TRY(launch_hits(c, k->list, std::min(candidates, MOST_THREADS), error));
    TRY(launch_hits(c, k->foresee, std::min<int64_t>(candidates, FORESEE_BLOCKS * FORESEE_THREADS), error));
    TRY(launch_hits(c, k->take, (int64_t)TAKE_THREADS * std::min<int32_t>(c->hits.group_count, TAKE_BLOCKS), error));
    return launch_hits(c, k->replace, std::min(std::max<int64_t>(c->view.leaf_count, 1), MOST_THREADS), error);
}

sadmm_status COLLISION(narrow_hits)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step,
                                    struct sadmm_error *error)
{
    view_hits(c, step);
    return launch_hits(c, c->hits_kernels.later, std::min<int64_t>(c->view.candidate_capacity, MOST_THREADS), error);
}

sadmm_status COLLISION(reopen_hits)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step,
                                    struct sadmm_error *error)
{
    view_hits(c, step);
    return launch_hits(c, c->hits_kernels.reopen, std::min<int64_t>(c->view.candidate_capacity, MOST_THREADS), error);
}

extern "C" sadmm_status COLLISION(give_hits)(struct sadmm_cuda_collision *c, void *stream,
                                             const struct sadmm_cuda_hits *step, struct sadmm_error *error)
{
    c->stream = (cudaStream_t)stream;
    view_hits(c, step);
    return launch_hits(c, c->hits_kernels.give, std::min<int64_t>(c->view.body_count, MOST_THREADS), error);
}

extern "C" sadmm_status COLLISION(read_hits)(struct sadmm_cuda_collision *c, void *stream, int into,
                                             struct sadmm_world_hit *out, size_t capacity, size_t *count,
                                             size_t *first, struct sadmm_error *error)
{
    struct hits_state state;
    *count = *first = 0;
    if (!c->takes_hits) return SADMM_OK;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(copy(c, &state, c->hits.state, sizeof state, false, error));
    TRY(wait(c, error));
    *count = (size_t)state.records[into];
    *first = (size_t)state.first[into];
    if (*count == 0 || *count > capacity) return SADMM_OK;
    TRY(copy(c, out, c->hits.records + (size_t)into * (size_t)c->hits.record_capacity, *count * sizeof *out, false,
             error));
    return wait(c, error);
}

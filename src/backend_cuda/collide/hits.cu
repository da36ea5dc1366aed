/* Hits (hits_view.h) on the host's side: memory, launches, what has happened. */
#include <string.h>

#include <algorithm>

#include "memory.h"
#include "pipeline.h"

/* ---- groups ------------------------------------------------------------------------------------------------------ */

/* Of a world as it was loaded: what the device gets once hits are to be taken. */
struct hit_lists {
    uint64_t *keys; /* that the rest is made by: environment << 32 | body slot, or group << 32 | leaf */
    int32_t *bodies, *leaves, *of, *shared;
    struct hit_group *groups;
    unsigned char *held;
    size_t body_count, leaf_count, shared_count, count;
    size_t room, near, records; /* that groups have together */
};

void COLLISION(free_hits)(struct sadmm_cuda_collision *c)
{
    struct hit_lists *lists = c->hit_lists;
    c->hit_lists = nullptr;
    if (!lists) return;
    void *blocks[] = {lists->keys,   lists->bodies, lists->leaves, lists->of,
                      lists->shared, lists->groups, lists->held,   lists};
    for (void *block : blocks) sadmm_free(block);
}

/* Empty ones. False: out of memory. */
static bool make_lists(struct sadmm_cuda_collision *c, size_t slots, size_t leaf_slots)
{
    struct hit_lists *lists = (struct hit_lists *)sadmm_alloc(1, sizeof *lists);
    COLLISION(free_hits)(c);
    if (!lists) return false;
    c->hit_lists = lists;
    lists->keys = (uint64_t *)sadmm_alloc(std::max(slots, leaf_slots) + 1, sizeof *lists->keys);
    lists->bodies = (int32_t *)sadmm_alloc(slots + 1, sizeof *lists->bodies);
    lists->of = (int32_t *)sadmm_alloc(slots + 1, sizeof *lists->of);
    lists->leaves = (int32_t *)sadmm_alloc(leaf_slots + 1, sizeof *lists->leaves);
    lists->shared = (int32_t *)sadmm_alloc(leaf_slots + 1, sizeof *lists->shared);
    lists->groups = (struct hit_group *)sadmm_alloc(slots + 1, sizeof *lists->groups);
    lists->held = (unsigned char *)sadmm_alloc(slots + 1, sizeof *lists->held);
    return lists->keys && lists->bodies && lists->of && lists->leaves && lists->shared && lists->groups && lists->held;
}

static void sort_keys(uint64_t *keys, size_t count)
{
    if (!std::is_sorted(keys, keys + count)) std::sort(keys, keys + count);
}

/* Does everything that moves belong to an environment? */
static bool is_grouped(const struct sadmm_collision_input *input)
{
    for (size_t slot = 0; slot < input->body_count; ++slot)
        if (input->bodies[slot].system_body != -1 && input->bodies[slot].environment < 0) return false;
    return true;
}

static void group_bodies(const struct sadmm_collision_input *input, struct hit_lists *lists)
{
    const bool grouped = is_grouped(input);
    size_t count = 0;
    for (size_t slot = 0; slot < input->body_count; ++slot) {
        const int32_t environment = grouped ? input->bodies[slot].environment : 0;
        lists->of[slot] = -1;
        if (environment >= 0) lists->keys[count++] = ordered_key((uint32_t)environment, (uint32_t)slot);
    }
    sort_keys(lists->keys, count);
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
                         struct hit_lists *lists)
{
    size_t count = 0;
    for (size_t i = 0; i < (size_t)c->view.leaf_count; ++i) {
        const int32_t group = lists->of[input->shapes[c->present[i]].body];
        if (group < 0) lists->shared[lists->shared_count++] = (int32_t)i;
        else lists->keys[count++] = ordered_key((uint32_t)group, (uint32_t)i);
    }
    sort_keys(lists->keys, count);
    for (size_t i = 0; i < count; ++i) {
        ++lists->groups[lists->keys[i] >> 32].leaf_count;
        lists->leaves[i] = (int32_t)(uint32_t)lists->keys[i];
    }
    lists->leaf_count = count;
}

/* Where each has its room. */
static void give_room(const struct sadmm_cuda_collision *c, struct hit_lists *lists)
{
    const size_t all = lists->shared_count + (size_t)c->view.plane_count;
    size_t leaves = 0;
    for (size_t g = 0; g < lists->count; ++g) {
        struct hit_group *group = &lists->groups[g];
        group->leaf_first = (int32_t)leaves;
        group->room_first = (int32_t)lists->room;
        group->near_first = (int32_t)lists->near;
        group->record_first = (int32_t)lists->records;
        group->room = HIT_ROOM + HIT_ROOM_A_SHAPE * group->leaf_count;
        group->record_room = HIT_RECORDS + HIT_RECORDS_A_BODY * group->body_count;
        leaves += (size_t)group->leaf_count;
        lists->room += (size_t)group->room;
        lists->near += (size_t)group->leaf_count + all;
        lists->records += (size_t)group->record_room;
    }
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static sadmm_status reserve_groups(struct sadmm_cuda_collision *c, const struct hit_lists &lists,
                                   struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    TRY(reserve(c, HIT_GROUPS, lists.count, sizeof *h->groups, error));
    TRY(reserve(c, HIT_PROGRESS, lists.count, sizeof *h->progress, error));
    TRY(reserve(c, HIT_GROUP_BODIES, lists.body_count, sizeof *h->group_bodies, error));
    TRY(reserve(c, HIT_GROUP_LEAVES, lists.leaf_count + 1, sizeof *h->group_leaves, error));
    TRY(reserve(c, HIT_SHARED_LEAVES, lists.shared_count + 1, sizeof *h->shared_leaves, error));
    TRY(reserve(c, HIT_GROUP_OF, (size_t)c->view.body_count, sizeof *h->group_of, error));
    TRY(reserve(c, HIT_FORESEEN, lists.room, sizeof *h->foreseen, error));
    TRY(reserve(c, HIT_NEAR, lists.near + 1, sizeof *h->near, error));
    TRY(reserve(c, HIT_TAKEN, lists.records, sizeof *h->taken, error));
    TRY(reserve(c, HIT_RECORDS_OF_STEPS, 2 * lists.records, sizeof *h->records, error));
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
    h->record_capacity = (int32_t)lists.records;
    return SADMM_OK;
}

static sadmm_status upload_lists(struct sadmm_cuda_collision *c, const struct hit_lists &lists,
                                 struct sadmm_error *error)
{
    const size_t number = sizeof(int32_t), slots = (size_t)c->view.body_count;
    struct hits_view *h = &c->hits;
    CUDA_CALL(c, cudaMemsetAsync(h->progress, 0, lists.count * sizeof *h->progress, c->stream),
              "cudaMemsetAsync(hits)");
    CUDA_CALL(c, cudaMemsetAsync(h->state, 0, sizeof *h->state, c->stream), "cudaMemsetAsync(hits)");
    CUDA_CALL(c, cudaMemsetAsync(h->marks, 0, slots * sizeof *h->marks, c->stream), "cudaMemsetAsync(hits)");
    TRY(copy(c, in<void>(c, HIT_GROUPS), lists.groups, lists.count * sizeof *lists.groups, true, error));
    TRY(copy(c, in<void>(c, HIT_GROUP_BODIES), lists.bodies, lists.body_count * number, true, error));
    TRY(copy(c, in<void>(c, HIT_GROUP_LEAVES), lists.leaves, lists.leaf_count * number, true, error));
    TRY(copy(c, in<void>(c, HIT_SHARED_LEAVES), lists.shared, lists.shared_count * number, true, error));
    TRY(copy(c, in<void>(c, HIT_GROUP_OF), lists.of, slots * number, true, error));
    TRY(copy(c, in<void>(c, HIT_HELD), lists.held, slots, true, error));
    return wait(c, error);
}

static sadmm_status reserve_bodies(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    const size_t slots = (size_t)c->view.body_count;
    TRY(reserve(c, HIT_STATE, 1, sizeof *h->state, error));
    TRY(reserve(c, HIT_MARKS, slots, sizeof *h->marks, error));
    TRY(reserve(c, HIT_HELD, slots, sizeof *h->held, error));
    TRY(reserve(c, HIT_KINDS, slots, sizeof *h->kinds, error));
    TRY(reserve(c, HIT_SWEPT_BODIES, slots, sizeof(struct swept_body), error));
    TRY(reserve(c, HIT_SINCE, slots, sizeof *h->since, error));
    TRY(reserve(c, HIT_IMPULSES, 6 * slots, sizeof *h->impulse, error));
    TRY(reserve(c, HIT_BOXES, (size_t)c->view.leaf_count, sizeof *h->boxes, error));
    h->state = in<struct hits_state>(c, HIT_STATE);
    h->marks = in<struct hit_marks>(c, HIT_MARKS);
    h->held = in<unsigned char>(c, HIT_HELD);
    h->kinds = in<unsigned char>(c, HIT_KINDS);
    h->swept_bodies = in<struct swept_body>(c, HIT_SWEPT_BODIES);
    h->since = in<double>(c, HIT_SINCE);
    h->impulse = in<double>(c, HIT_IMPULSES);
    h->boxes = in<struct sadmm_box3>(c, HIT_BOXES);
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(load_hits)(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                             const unsigned char *held, struct sadmm_error *error)
{
    const size_t slots = (size_t)c->view.body_count;
    c->takes_hits = c->hits_ready = false;
    if (slots == 0 || c->view.leaf_count == 0) return SADMM_OK;
    if (!make_lists(c, slots, (size_t)c->view.leaf_count)) return sadmm_fail_memory(error, "hits");
    struct hit_lists *lists = c->hit_lists;
    memcpy(lists->held, held, slots);
    group_bodies(input, lists);
    group_leaves(c, input, lists);
    give_room(c, lists);
    c->takes_hits = lists->count > 0 &&
                    std::max(std::max(lists->room, lists->near), 2 * lists->records) <= (size_t)INT32_MAX;
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(reserve_hits)(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    ENTER(c);
    TRY(reserve(c, HIT_LISTED, (size_t)c->candidate_capacity, sizeof *c->hits.listed, error));
    c->hits.listed = in<int32_t>(c, HIT_LISTED);
    if (c->hits_ready) return SADMM_OK;
    c->hits.shape_count = (int32_t)c->shape_slots;
    TRY(reserve_groups(c, *c->hit_lists, error));
    TRY(reserve_bodies(c, error));
    TRY(upload_lists(c, *c->hit_lists, error));
    c->hits_ready = true;
    return SADMM_OK;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

extern "C" bool COLLISION(takes_hits)(const struct sadmm_cuda_collision *c) { return c->takes_hits; }

static void view_hits(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step)
{
    c->hits.c = c->view;
    c->hits.step = *step;
    c->hits.few = c->view.candidate_capacity < c->radix_from;
    c->hits.takes = false;
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
    c->hits.takes = true;
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

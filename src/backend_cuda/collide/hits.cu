/* Hits (hits.h) on the host's side: memory, launches, what has happened. */
#include <algorithm>

#include "memory.h"

sadmm_status COLLISION(reserve_hits)(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    const size_t candidates = (size_t)c->candidate_capacity, shapes = (size_t)(c->view.leaf_count + c->view.plane_count);
    if (!c->takes_hits) return SADMM_OK;
    h->foreseen_capacity = HIT_ROOM + HIT_ROOM_A_SHAPE * (int64_t)shapes; /* by the world alone: it tells what is left out */
    TRY(reserve(c, HIT_LISTED, candidates, sizeof *h->listed, error));
    TRY(reserve(c, HIT_FORESEEN, (size_t)h->foreseen_capacity, sizeof *h->foreseen, error));
    h->listed = in<int32_t>(c, HIT_LISTED);
    h->foreseen = in<struct foreseen_hit>(c, HIT_FORESEEN);
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(load_hits)(struct sadmm_cuda_collision *c, void *stream, const unsigned char *held,
                                             int32_t dynamic, struct sadmm_error *error)
{
    struct hits_view *h = &c->hits;
    const size_t slots = (size_t)c->view.body_count, leaves = (size_t)c->view.leaf_count,
                 shapes = leaves + (size_t)c->view.plane_count;
    c->takes_hits = held && slots > 0 && leaves > 0 && c->view.mesh_count == 0 && !c->smooth;
    if (!c->takes_hits) return SADMM_OK;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    h->record_capacity = (int32_t)std::min<int64_t>(HIT_RECORDS + (int64_t)HIT_RECORDS_A_BODY * dynamic, INT32_MAX / 2);
    h->shape_count = (int32_t)(c->input_bytes[0] / sizeof *c->view.shapes);
    TRY(reserve(c, HIT_STATE, 1, sizeof *h->state, error));
    TRY(reserve(c, HIT_MARKS, slots, sizeof *h->marks, error));
    TRY(reserve(c, HIT_HELD, slots, sizeof *h->held, error));
    TRY(reserve(c, HIT_KINDS, slots, sizeof *h->kinds, error));
    TRY(reserve(c, HIT_FLYERS, slots, sizeof(struct flyer), error));
    TRY(reserve(c, HIT_SINCE, slots, sizeof *h->since, error));
    TRY(reserve(c, HIT_IMPULSES, 6 * slots, sizeof *h->impulse, error));
    TRY(reserve(c, HIT_BOXES, leaves, sizeof *h->boxes, error));
    TRY(reserve(c, HIT_NEAR, shapes, sizeof *h->near, error));
    TRY(reserve(c, HIT_RECORDS_OF_STEPS, 2 * (size_t)h->record_capacity, sizeof *h->records, error));
    h->state = in<struct hits_state>(c, HIT_STATE);
    h->marks = in<struct hit_marks>(c, HIT_MARKS);
    h->held = in<unsigned char>(c, HIT_HELD);
    h->kinds = in<unsigned char>(c, HIT_KINDS);
    h->flyers = in<struct flyer>(c, HIT_FLYERS);
    h->since = in<double>(c, HIT_SINCE);
    h->impulse = in<double>(c, HIT_IMPULSES);
    h->boxes = in<struct sadmm_box3>(c, HIT_BOXES);
    h->near = in<uint64_t>(c, HIT_NEAR);
    h->records = in<struct sadmm_world_hit>(c, HIT_RECORDS_OF_STEPS);
    CUDA_CALL(c, cudaMemsetAsync(h->state, 0, sizeof *h->state, c->stream), "cudaMemsetAsync(hits)");
    CUDA_CALL(c, cudaMemsetAsync(h->marks, 0, slots * sizeof *h->marks, c->stream), "cudaMemsetAsync(hits)");
    TRY(copy(c, in<void>(c, HIT_HELD), held, slots, true, error));
    return wait(c, error);
}

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
    TRY(launch_hits(c, k->take, TAKE_THREADS, error));
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

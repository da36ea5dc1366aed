/* The pipeline of a step: candidates, narrow phase, and the swap of contact sets.
 *
 * The new set is written beside the old one and the two are exchanged at the end, so a failure changes nothing and a
 * step that fails later can be undone. Threads take consecutive stretches of the sorted candidates and write to sets of
 * their own, which are put together in order: the result does not depend on their number.
 */
#include "collision.h"

#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "core/base/memory.h"
#include "config.h"
#include "pipeline.h"
#include "narrow_phase.h"

/* Fewer candidates a thread than this are not worth waking it. */
enum { PAIRS_PER_THREAD = 256 };

const struct sadmm_broad_phase_kind *sadmm_broad_phase_default(void)
{
#ifdef SADMM_HAVE_FCL
    return &sadmm_broad_phase_fcl;
#else
    return &sadmm_broad_phase_sweep;
#endif
}

const char *sadmm_collision_broad_phase_name(void) { return sadmm_broad_phase_default()->name; }

sadmm_status sadmm_collision_create_with(const struct sadmm_broad_phase_kind *kind, struct sadmm_collision **out,
                                         struct sadmm_error *error)
{
    struct sadmm_collision *collision = sadmm_alloc(1, sizeof *collision);
    sadmm_status status;
    *out = NULL;
    if (!collision) return sadmm_fail_memory(error, "collision detection");
    status = sadmm_candidates_init(&collision->candidates, kind, error);
    if (status != SADMM_OK) {
        sadmm_free(collision);
        return status;
    }
    *out = collision;
    return SADMM_OK;
}

sadmm_status sadmm_collision_create(struct sadmm_collision **out, struct sadmm_error *error)
{
    return sadmm_collision_create_with(sadmm_broad_phase_default(), out, error);
}

void sadmm_collision_destroy(struct sadmm_collision *collision)
{
    if (!collision) return;
    sadmm_candidates_free(&collision->candidates);
    sadmm_contact_set_free(&collision->spare);
    for (size_t i = 0; i < collision->part_count; ++i) sadmm_contact_set_free(&collision->parts[i]);
    sadmm_free(collision->parts);
    sadmm_free(collision);
}

static int thread_count(const struct sadmm_collision_input *input, size_t pairs)
{
#ifdef _OPENMP
    size_t wanted = input->threads > 0 ? (size_t)input->threads : (size_t)omp_get_max_threads();
    size_t useful = pairs / PAIRS_PER_THREAD + 1;
    return (int)(wanted < useful ? wanted : useful);
#else
    (void)input;
    (void)pairs;
    return 1;
#endif
}

static bool reserve_parts(struct sadmm_collision *collision, size_t count)
{
    if (count <= collision->part_count) return true;
    if (!sadmm_grow((void **)&collision->parts, &collision->part_capacity, collision->part_count, count,
                    sizeof *collision->parts))
        return false;
    memset(collision->parts + collision->part_count, 0, (count - collision->part_count) * sizeof *collision->parts);
    collision->part_count = count;
    return true;
}

/* Copy share `share` of `shares` of a part into the set, from its pair `to_pair` and point `to_point` on. */
static void copy_share(struct sadmm_contact_set *set, const struct sadmm_contact_set *part, size_t to_pair, size_t to_point,
                       size_t share, size_t shares)
{
    size_t pair = part->pair_count * share / shares, pair_end = part->pair_count * (share + 1) / shares,
           point = part->point_count * share / shares, point_end = part->point_count * (share + 1) / shares;
    if (point < point_end)
        memcpy(set->points + to_point + point, part->points + point, (point_end - point) * sizeof *set->points);
    for (; pair < pair_end; ++pair) {
        set->pairs[to_pair + pair] = part->pairs[pair];
        set->pairs[to_pair + pair].first += (int32_t)to_point;
    }
}

/* Append the parts to `set`; every thread takes a share of each. */
static bool append_parts(struct sadmm_contact_set *set, const struct sadmm_contact_set *parts, size_t count)
{
    const size_t first_pair = set->pair_count, first_point = set->point_count;
    const int threads = (int)count + 1;
    size_t pairs = first_pair, points = first_point;
    for (size_t t = 0; t < count; ++t) {
        pairs += parts[t].pair_count;
        points += parts[t].point_count;
    }
    if (!sadmm_grow((void **)&set->pairs, &set->pair_capacity, set->pair_count, pairs, sizeof *set->pairs) ||
        !sadmm_grow((void **)&set->points, &set->point_capacity, set->point_count, points, sizeof *set->points))
        return false;
#ifdef _OPENMP
#pragma omp parallel for schedule(static, 1) num_threads(threads) if (threads > 1)
#endif
    for (int share = 0; share < threads; ++share) {
        size_t to_pair = first_pair, to_point = first_point;
        for (size_t t = 0; t < count; ++t) {
            copy_share(set, &parts[t], to_pair, to_point, (size_t)share, (size_t)threads);
            to_pair += parts[t].pair_count;
            to_point += parts[t].point_count;
        }
    }
    set->pair_count = pairs;
    set->point_count = points;
    return true;
}

static bool find_in_threads(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                            const struct sadmm_contact_set *old, int threads)
{
    const struct sadmm_candidates *c = &collision->candidates;
    size_t count = c->list.count;
    bool ok = true;
#ifdef _OPENMP
#pragma omp parallel for schedule(static, 1) num_threads(threads) reduction(&& : ok) if (threads > 1)
#endif
    for (int t = 0; t < threads; ++t) {
        struct sadmm_contact_set *out = t == 0 ? &collision->spare : &collision->parts[t - 1];
        size_t begin = count * (size_t)t / (size_t)threads, end = count * ((size_t)t + 1) / (size_t)threads;
        out->pair_count = out->point_count = 0;
        ok = sadmm_narrow_phase(c, input, begin, end, old, out) && ok;
    }
    collision->spare.dt = input->dt;
    return ok && append_parts(&collision->spare, collision->parts, (size_t)threads - 1);
}

sadmm_status sadmm_collision_find(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                  struct sadmm_contact_set *contacts, struct sadmm_error *error)
{
    struct sadmm_contact_set swap;
    sadmm_status status;
    int threads;

    collision->can_undo = false;
    status = sadmm_candidates_update(&collision->candidates, input, thread_count(input, input->shape_count), error);
    if (status != SADMM_OK) return status;
    if (collision->candidates.list.count > INT32_MAX / SADMM_MAX_POINTS)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu pairs of shapes may touch: at most %d can be indexed",
                          collision->candidates.list.count, (int)(INT32_MAX / SADMM_MAX_POINTS));
    threads = thread_count(input, collision->candidates.list.count);
    if (!reserve_parts(collision, (size_t)threads - 1) || !find_in_threads(collision, input, contacts, threads))
        return sadmm_fail_memory(error, "contacts");
    swap = *contacts;
    *contacts = collision->spare;
    collision->spare = swap;
    collision->can_undo = true;
    return SADMM_OK;
}

void sadmm_collision_undo(struct sadmm_collision *collision, struct sadmm_contact_set *contacts)
{
    struct sadmm_contact_set swap;
    if (!collision->can_undo) return;
    collision->can_undo = false;
    swap = *contacts;
    *contacts = collision->spare;
    collision->spare = swap;
}

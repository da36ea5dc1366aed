/* The pipeline of a step: candidates, narrow phase, and the swap of contact sets.
 *
 * The new set is written beside the old one and the two are exchanged at the end, so a failure changes nothing and a
 * step that fails later can be undone. Threads take consecutive shares of the sorted candidates and write to sets of
 * their own, which are put together in order: the result does not depend on their number.
 */
#include "collision.h"

#include <stdatomic.h>
#include <string.h>

#include "collision/find/find_candidates.h"
#include "collision/find/kernels.h"
#include "collision/find/pipeline.h"
#include "config.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"

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
    sadmm_box_row_free(&collision->row);
    sadmm_contact_set_free(&collision->spare);
    sadmm_contact_set_free(&collision->between);
    for (size_t i = 0; i < collision->part_count; ++i) sadmm_contact_set_free(&collision->parts[i]);
    sadmm_free(collision->parts);
    sadmm_free(collision);
}

static int thread_count(const struct sadmm_collision_input *input, size_t pairs)
{
    const size_t wanted = input->threads > 1 ? (size_t)input->threads : 1, useful = pairs / PAIRS_PER_THREAD + 1;
    return (int)(wanted < useful || sadmm_test_forces_threads() ? wanted : useful);
}

static bool reserve_parts(struct sadmm_collision *collision, size_t count)
{
    if (count <= collision->part_count) return true;
    if (!SADMM_GROW(collision->parts, collision->part_count, count)) return false;
    memset(collision->parts + collision->part_count, 0, (count - collision->part_count) * sizeof *collision->parts);
    collision->part_count = count;
    return true;
}

/* Copy share `share` of `shares` of a part into the set, from its pair `to_pair` and point `to_point` on. */
static void copy_share(struct sadmm_contact_set *set, const struct sadmm_contact_set *part, size_t to_pair,
                       size_t to_point, size_t share, size_t shares)
{
    size_t pair = part->pair_count * share / shares, pair_end = part->pair_count * (share + 1) / shares,
           point = part->point_count * share / shares, point_end = part->point_count * (share + 1) / shares;
    if (point < point_end)
        memcpy(set->points + to_point + point, part->points + point, (point_end - point) * sizeof *set->points);
    for (size_t k = part->migrating > 0 ? point : point_end; k < point_end; ++k)
        if (part->points[k].migrates) set->migrations[to_point + k] = part->migrations[k];
    for (; pair < pair_end; ++pair) {
        set->pairs[to_pair + pair] = part->pairs[pair];
        set->pairs[to_pair + pair].first += (int32_t)to_point;
    }
}

struct appending {
    struct sadmm_contact_set *set;
    const struct sadmm_contact_set *parts;
    size_t count;
};

static void append_share(void *argument, int thread, int threads)
{
    const struct appending *a = (const struct appending *)argument;
    size_t to_pair = a->set->pair_count, to_point = a->set->point_count;
    for (size_t p = 0; p < a->count; ++p) {
        copy_share(a->set, &a->parts[p], to_pair, to_point, (size_t)thread, (size_t)threads);
        to_pair += a->parts[p].pair_count;
        to_point += a->parts[p].point_count;
    }
}

/* Append the parts to `set`; every thread takes a share of each. */
static bool append_parts(struct sadmm_contact_set *set, struct sadmm_team *team, const struct sadmm_contact_set *parts,
                         size_t count)
{
    size_t pairs = set->pair_count, points = set->point_count, migrating = set->migrating;
    for (size_t t = 0; t < count; ++t) {
        pairs += parts[t].pair_count;
        points += parts[t].point_count;
        migrating += parts[t].migrating;
    }
    if (!SADMM_GROW(set->pairs, set->pair_count, pairs) || !SADMM_GROW(set->points, set->point_count, points) ||
        (migrating > 0 && !sadmm_contact_set_reserve_migrations(set, points)))
        return false;
    struct appending appending = {set, parts, count};
    sadmm_parallel(team, (int)count + 1, append_share, &appending);
    set->pair_count = pairs;
    set->point_count = points;
    set->migrating = migrating;
    return true;
}

struct finding {
    struct sadmm_collision *collision;
    const struct sadmm_collision_input *input;
    const struct sadmm_contact_set *old;
    struct sadmm_contact_set *out; /* of the first thread */
    atomic_bool failed;
};

static void find_share(void *argument, int thread, int threads)
{
    struct finding *f = (struct finding *)argument;
    struct sadmm_contact_set *out = thread == 0 ? f->out : &f->collision->parts[thread - 1];
    size_t begin, end;
    sadmm_share(f->collision->candidates.list.count, thread, threads, &begin, &end);
    out->pair_count = out->point_count = out->migrating = 0;
    if (!f->collision->candidates.kernels->narrow_phase(&f->collision->candidates, f->input, begin, end, f->old, out))
        atomic_store(&f->failed, true);
}

static bool find_in_threads(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                            const struct sadmm_contact_set *old, struct sadmm_contact_set *out, int threads)
{
    struct finding finding = {.collision = collision, .input = input, .old = old, .out = out};
    const int ran = sadmm_parallel(input->team, threads, find_share, &finding);
    out->dt = input->dt;
    return !atomic_load(&finding.failed) && append_parts(out, input->team, collision->parts, (size_t)ran - 1);
}

static void exchange(struct sadmm_contact_set *a, struct sadmm_contact_set *b)
{
    const struct sadmm_contact_set swap = *a;
    *a = *b;
    *b = swap;
}

static sadmm_status update_candidates(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                      struct sadmm_error *error)
{
    return sadmm_candidates_update(&collision->candidates, input, thread_count(input, input->shape_count), error);
}

sadmm_status sadmm_collision_find_candidates(struct sadmm_collision *collision,
                                             const struct sadmm_collision_input *input, struct sadmm_error *error)
{
    collision->has_candidates = collision->row.made = false;
    TRY(update_candidates(collision, input, error));
    collision->has_candidates = true;
    return SADMM_OK;
}

void sadmm_collision_drop_candidates(struct sadmm_collision *collision) { collision->has_candidates = false; }

/* The new set into `out`, which then takes the place of `contacts`. */
static sadmm_status find_into(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                              struct sadmm_contact_set *out, struct sadmm_contact_set *contacts,
                              struct sadmm_error *error)
{
    int threads;

    if (!collision->has_candidates) TRY(update_candidates(collision, input, error));
    collision->has_candidates = false;
    if (collision->candidates.list.count > INT32_MAX / SADMM_MAX_POINTS)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu pairs of shapes may touch: at most %d can be indexed",
                          collision->candidates.list.count, (int)(INT32_MAX / SADMM_MAX_POINTS));
    threads = thread_count(input, collision->candidates.list.count);
    if (!reserve_parts(collision, (size_t)threads - 1) || !find_in_threads(collision, input, contacts, out, threads))
        return sadmm_fail_memory(error, "contacts");
    if (out->point_count > INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu contact points: at most %d can be indexed",
                          out->point_count, (int)INT32_MAX);
    exchange(contacts, out);
    return SADMM_OK;
}

sadmm_status sadmm_collision_find(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                  struct sadmm_contact_set *contacts, struct sadmm_error *error)
{
    collision->can_undo = false;
    TRY(find_into(collision, input, &collision->spare, contacts, error));
    collision->can_undo = true;
    return SADMM_OK;
}

sadmm_status sadmm_collision_find_again(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                        struct sadmm_contact_set *contacts, struct sadmm_error *error)
{
    return find_into(collision, input, &collision->between, contacts, error);
}

void sadmm_collision_undo(struct sadmm_collision *collision, struct sadmm_contact_set *contacts)
{
    if (!collision->can_undo) return;
    collision->can_undo = false;
    exchange(contacts, &collision->spare);
}

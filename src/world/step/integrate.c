/* States after a (sub-)step that no backend has solved: every island is solved before any iteration. Bodies with joints
 * are moved once more, together (joint_move.c). */
#include "integrate.h"

#include <string.h>

#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/model/pair_touch.h"
#include "core/model/spin.h"

/* Bodies of islands with joints are moved later, together. */
static bool moves_alone(const struct sadmm_ncp *ncp, int32_t body) { return !sadmm_ncp_has_rows(ncp, body); }

/* Of bodies by themselves; the last is what does not move. */
static void find_trapezoids(const sadmm_world *world, const struct sadmm_system *system, const sadmm_settings *settings,
                            const struct sadmm_ncp *ncp, struct sadmm_trapezoid *trapezoids)
{
    const size_t n = (size_t)world->dynamic_count;
    for (size_t i = 0; i < n; ++i) {
        if (!moves_alone(ncp, (int32_t)i)) continue;
        const struct spin_system spin = system->spins ? system->spins[i]
                                                      : spin_of_system(&world->start.rigid[i], settings->dt);
        q_store(spin.orientation, trapezoids[i].halfway);
        v3_store(spin.angular, trapezoids[i].spin);
        sadmm_find_trapezoids(1, &world->start.rigid[i], world->velocity + 6 * i, settings, &trapezoids[i]);
    }
    memset(&trapezoids[n], 0, sizeof trapezoids[n]);
}

static int bits_of(const int32_t *touch, int32_t body) { return body >= 0 ? touch[body] : TOUCH_OF_STATIC; }

static void touch_pair(const struct sadmm_system *system, const sadmm_settings *settings, const int32_t *label,
                       const struct sadmm_contact_pair *pair, const struct sadmm_trapezoid *trapezoids, int32_t *touch)
{
    const int32_t n = system->body_count, a = pair->body_a, b = pair->body_b, island = label[a >= 0 ? a : b];
    const struct trapezoid_touch known = {touch[island], {bits_of(touch, a), bits_of(touch, b)}},
                                 found = sadmm_pair_touch(system, settings, pair, &trapezoids[a >= 0 ? a : n],
                                                          &trapezoids[b >= 0 ? b : n], known);
    touch[island] |= found.island;
    if (a >= 0) touch[a] |= found.body[0];
    if (b >= 0) touch[b] |= found.body[1];
}

sadmm_status sadmm_world_integrate(sadmm_world *world, const struct sadmm_system *system,
                                   const sadmm_settings *settings, const struct sadmm_ncp *ncp)
{
    const size_t n = (size_t)world->dynamic_count;
    const int32_t *label = sadmm_ncp_islands(ncp);
    const struct sadmm_contact_set *contacts = system->contacts;
    if (!SADMM_GROW(world->trapezoids, 0, n + 1) || !SADMM_GROW(world->touch, 0, n))
        return sadmm_fail_memory(&world->error, "the motion of bodies");
    find_trapezoids(world, system, settings, ncp, world->trapezoids);
    memset(world->touch, 0, n * sizeof *world->touch);
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        if (moves_alone(ncp, pair->body_a >= 0 ? pair->body_a : pair->body_b))
            touch_pair(system, settings, label, pair, world->trapezoids, world->touch);
    }
    for (size_t i = 0; i < n; ++i) {
        const struct sadmm_rigid *start = &world->start.rigid[i];
        if (!moves_alone(ncp, (int32_t)i)) {
            sadmm_advance_later(start, &world->next[i]);
            continue;
        }
        if (contacts->pair_count > 0)
            sadmm_choose_trapezoid(start, settings, world->touch[label[i]], world->touch[i], &world->trapezoids[i]);
        sadmm_advance(1, start, world->velocity + 6 * i, &world->trapezoids[i], settings->dt, &world->next[i]);
    }
    return SADMM_OK;
}

/* States after a (sub-)step that no backend has solved: every island is solved before any iteration. Bodies with joints
 * are moved once more, together (joint_move.c). */
#include "integrate.h"

#include <string.h>

#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/model/pair_touch.h"
#include "core/model/spin.h"

/* Of bodies by themselves; the last is what does not move. */
static void find_trapezoids(const sadmm_world *world, const sadmm_settings *settings,
                            struct sadmm_trapezoid *trapezoids)
{
    const size_t n = (size_t)world->dynamic_count;
    for (size_t i = 0; i < n; ++i) {
        const struct spin_system spin = spin_of_system(&world->start.rigid[i], settings->dt);
        q_store(spin.orientation, trapezoids[i].halfway);
        v3_store(spin.angular, trapezoids[i].spin);
    }
    sadmm_find_trapezoids(n, world->start.rigid, world->velocity, settings, trapezoids);
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
                                   const sadmm_settings *settings, const int32_t *label)
{
    const size_t n = (size_t)world->dynamic_count;
    if (!SADMM_GROW(world->trapezoids, 0, n + 1) || !SADMM_GROW(world->touch, 0, n))
        return sadmm_fail_memory(&world->error, "the motion of bodies");
    find_trapezoids(world, settings, world->trapezoids);
    memset(world->touch, 0, n * sizeof *world->touch);
    for (size_t p = 0; p < system->contacts->pair_count; ++p)
        touch_pair(system, settings, label, &system->contacts->pairs[p], world->trapezoids, world->touch);
    for (size_t i = 0; i < n && system->contacts->pair_count > 0; ++i)
        sadmm_choose_trapezoid(&world->start.rigid[i], settings, world->touch[label[i]], world->touch[i],
                               &world->trapezoids[i]);
    sadmm_advance(n, world->start.rigid, world->velocity, world->trapezoids, settings->dt, world->next);
    return SADMM_OK;
}

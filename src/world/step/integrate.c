/* States after a (sub-)step that no backend has solved: every island is solved before any iteration, so that no contact
 * keeps a body without joints from its trapezoid correction (others: joint_move.c). */
#include "integrate.h"

#include "core/model/spin.h"
#include "core/model/system_terms.h"

void sadmm_world_integrate(sadmm_world *world, const sadmm_settings *settings)
{
    for (size_t i = 0; i < (size_t)world->dynamic_count; ++i) {
        const struct sadmm_rigid *body = &world->start.rigid[i];
        const struct spin_system spin = spin_of_system(body, settings->dt);
        struct sadmm_trapezoid trapezoid;
        q_store(spin.orientation, trapezoid.halfway);
        v3_store(spin.angular, trapezoid.spin);
        sadmm_find_trapezoids(1, body, world->velocity + 6 * i, settings, &trapezoid);
        sadmm_advance(1, body, world->velocity + 6 * i, &trapezoid, settings->dt, &world->next[i]);
    }
}

#include "wrenches.h"

#include <string.h>

#include "core/model/articulation.h"

void sadmm_world_find_wrenches(sadmm_world *world, const sadmm_settings *settings)
{
    memset(world->wrench, 0, 6 * (size_t)world->dynamic_count * sizeof *world->wrench);
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        for (int side = 0; side < 2; ++side) {
            const int32_t body = side ? pair->body_b : pair->body_a;
            if (body < 0) continue;
            for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
                const struct sadmm_contact_point *point = &world->contacts.points[k];
                for (int j = 0; j < 6; ++j)
                    world->wrench[6 * (size_t)body + (size_t)j] +=
                        articulation_point_load(side ? point->arm_b : point->arm_a, point->impulse, side, j) /
                            settings->dt;
            }
        }
    }
}

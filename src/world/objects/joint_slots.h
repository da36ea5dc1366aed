/* Joints in their slots: lists of the joints of a body and the gears of a joint, pairs that do not meet, spring
 * tables. */
#ifndef SADMM_WORLD_OBJECTS_JOINT_SLOTS_H
#define SADMM_WORLD_OBJECTS_JOINT_SLOTS_H

#include "world/state/world_state.h"

/* A joint in a slot is on its bodies' lists, a gear on its joints', from here on. */
void sadmm_world_link_joint(sadmm_world *world, size_t slot);
void sadmm_world_link_gear(sadmm_world *world, size_t slot);
/* Put a joint that has been checked into a slot. */
sadmm_status sadmm_world_insert_joint(sadmm_world *world, const struct sadmm_world_joint *joint, size_t *slot);
/* With the gears on it. */
void sadmm_world_kill_joint(sadmm_world *world, size_t slot);
void sadmm_world_kill_gear(sadmm_world *world, size_t slot);
/* The joints of a body that is removed. */
void sadmm_world_kill_joints_of(sadmm_world *world, int32_t body);
/* The spring table of a coordinate, which the joint owns from here on, in place of the one it has; NULL: none. */
void sadmm_world_put_table(sadmm_world *world, size_t slot, int index, double *table, int32_t count);
void sadmm_world_free_tables(sadmm_world *world); /* all */

#endif

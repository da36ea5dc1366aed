/* Joints as constraint rows. */
#ifndef SADMM_WORLD_STEP_JOINT_ROWS_H
#define SADMM_WORLD_STEP_JOINT_ROWS_H

#include "world/state/world_state.h"

/* Pairs of bodies that are not to meet, into `filtered_pairs`, and frictions of pairs as lists; the joints of the step
 * as a list, and what they kept of the last step into what they keep of this one. */
sadmm_status sadmm_world_begin_joints(sadmm_world *world);
/* The most constraints that a joint's rows may take; those of couplings have room for all of their drives. */
int32_t sadmm_joint_constraints(const struct sadmm_world_joint *joint);
/* Rows of the (sub-)step's joints into `start`, from the bodies there. */
sadmm_status sadmm_world_make_rows(sadmm_world *world, const sadmm_settings *settings);
/* The solution's multipliers into what joints keep. */
void sadmm_world_keep_rows(sadmm_world *world, const sadmm_settings *settings);
/* The step is done. */
void sadmm_world_commit_joints(sadmm_world *world);

#endif

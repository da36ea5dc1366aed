/* Joints, gears and couplings in a saved world; after bodies and shapes. */
#ifndef SADMM_WORLD_SAVE_SAVE_JOINTS_H
#define SADMM_WORLD_SAVE_SAVE_JOINTS_H

#include "core/base/archive.h"
#include "world/state/world_state.h"

void sadmm_archive_joints(struct sadmm_archive *archive, sadmm_world *world);

#endif

/* The last step of a world into an archive, or out of it. */
#ifndef SADMM_WORLD_SAVE_SAVE_STEP_H
#define SADMM_WORLD_SAVE_SAVE_STEP_H

#include "core/base/archive.h"
#include "world/state/world_state.h"

/* After the objects. */
void sadmm_archive_step(struct sadmm_archive *archive, sadmm_world *world);

#endif

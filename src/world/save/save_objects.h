/* Settings and objects of a world into an archive, or out of it. */
#ifndef SADMM_WORLD_SAVE_SAVE_OBJECTS_H
#define SADMM_WORLD_SAVE_SAVE_OBJECTS_H

#include "core/base/archive.h"
#include "world/state/world_state.h"

void sadmm_archive_settings(struct sadmm_archive *archive, sadmm_settings *settings);
/* Of the definition all but `tasks`, which is the caller's. */
void sadmm_archive_objects(struct sadmm_archive *archive, sadmm_world *world);

#endif

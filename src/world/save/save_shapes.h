/* Shapes in a saved world, with the hulls and meshes that they share; after bodies. */
#ifndef SADMM_WORLD_SAVE_SAVE_SHAPES_H
#define SADMM_WORLD_SAVE_SAVE_SHAPES_H

#include "core/base/archive.h"
#include "world/state/world_state.h"

void sadmm_archive_shapes(struct sadmm_archive *archive, sadmm_world *world);

#endif

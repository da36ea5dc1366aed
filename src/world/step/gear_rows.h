/* Gears as constraint rows. */
#ifndef SADMM_WORLD_STEP_GEAR_ROWS_H
#define SADMM_WORLD_STEP_GEAR_ROWS_H

#include "world/state/world_state.h"

void sadmm_world_begin_gears(sadmm_world *world);
/* Can it turn its wheels where they are? Asked of one whose joints are among up to three dynamic bodies. */
bool sadmm_world_gear_reaches(const sadmm_world *world, const struct sadmm_world_gear *gear);
/* After those of joints. */
sadmm_status sadmm_world_make_gear_rows(sadmm_world *world, const sadmm_settings *settings);
void sadmm_world_keep_gear_rows(sadmm_world *world, double dt);
void sadmm_world_commit_gears(sadmm_world *world);

#endif

/* What is drawn of a world besides its shapes: joints, couplings, contacts, bodies and what connects them. */
#ifndef SADMM_WORLD_DRAW_DRAW_MARKS_H
#define SADMM_WORLD_DRAW_DRAW_MARKS_H

#include "subadmm/draw.h"
#include "world/state/world_state.h"

/* Is a body of the environment that is drawn? -1, the static world, is. */
bool sadmm_draw_sees_body(const sadmm_world *world, const sadmm_draw *draw, int32_t slot);
/* Is a point in the box that is drawn? */
bool sadmm_draw_sees_point(const sadmm_draw *draw, const double x[3]);

void sadmm_draw_bodies(const sadmm_world *world, const sadmm_draw *draw);
void sadmm_draw_joints(const sadmm_world *world, const sadmm_draw *draw);
void sadmm_draw_couplings(const sadmm_world *world, const sadmm_draw *draw);
void sadmm_draw_contacts(const sadmm_world *world, const sadmm_draw *draw);
void sadmm_draw_islands(const sadmm_world *world, const sadmm_draw *draw);

#endif

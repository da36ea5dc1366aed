/* A world that a backend keeps. */
#ifndef SADMM_WORLD_RESIDENT_RESIDENT_H
#define SADMM_WORLD_RESIDENT_RESIDENT_H

#include "world/state/world_state.h"

/* Can this step be made by a backend that keeps the world? */
bool sadmm_world_may_reside(const sadmm_world *world);
/* Enqueue a step; `wait`: until it is done, with its report. */
sadmm_status sadmm_world_resident_step(sadmm_world *world, bool wait);
/* Until every enqueued step is done. The error of a step that failed is returned once. */
sadmm_status sadmm_world_synchronise(sadmm_world *world);
/* The same for calls that return no status: the error stays for the next one that does. */
void sadmm_world_synchronise_quietly(sadmm_world *world);
/* Download the bodies (or contacts and everything else) of the last step, where the backend is ahead. */
sadmm_status sadmm_world_download_bodies(sadmm_world *world);
sadmm_status sadmm_world_download_contacts(sadmm_world *world);
/* Which pairs of the last step touch, where the contacts are behind and no step is running: of every one of the
 * report's pairs. */
sadmm_status sadmm_world_read_touching(sadmm_world *world, struct sadmm_touching_shapes *touching);
sadmm_status sadmm_world_download_joints(sadmm_world *world);
/* All of it, and from here on the host's world is the one that counts: before anything but a state or a wrench is
 * changed. */
sadmm_status sadmm_world_detach(sadmm_world *world);
/* A dynamic body's state or wrench has been set, or a kinematic one's state or target: the next step takes it along. */
void sadmm_world_update(sadmm_world *world, struct sadmm_world_body *body, enum sadmm_update_kind kind);
/* Passes `status` on. After SADMM_ERROR_DEVICE the backend's context is given up, the host's world counts again, and
 * the next step begins with a new context. */
sadmm_status sadmm_world_contain(sadmm_world *world, sadmm_status status);

#endif

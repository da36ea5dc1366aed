/* What steps change of a world, as bytes: the state of an environment. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_STATE_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_STATE_H

#include "world/state/world_state.h"

struct sadmm_environment_state {
    unsigned char *bytes; /* a growable block */
    size_t size;
};

/* The state of a world that the host steps. Errors: OUT_OF_MEMORY; `state` is as it was. */
sadmm_status sadmm_environment_state_store(sadmm_world *world, struct sadmm_environment_state *state);
/* The world is as it was when the state was stored, of this world or of another one with the same objects. Contacts
 * cannot be read before its next step. Errors: OUT_OF_MEMORY; load another state then. */
sadmm_status sadmm_environment_state_load(sadmm_world *world, const struct sadmm_environment_state *state);
/* What follows where a world was given the state of an environment in another way. */
void sadmm_environment_state_taken(sadmm_world *world);
/* to = from. Errors: OUT_OF_MEMORY; `to` is as it was. */
sadmm_status sadmm_environment_state_copy(struct sadmm_environment_state *to,
                                          const struct sadmm_environment_state *from, struct sadmm_error *error);
void sadmm_environment_state_free(struct sadmm_environment_state *state);

#endif

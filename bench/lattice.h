/* A contact problem of any size with a known shape: layers of cubes at rest, every other layer shifted by half a cube,
 * so that each cube lies on two (4 points each), the lowest layer on the ground (4 points). About 8 contacts a body. */
#ifndef BENCH_LATTICE_H
#define BENCH_LATTICE_H

#include "core/model/system.h"

struct lattice {
    struct sadmm_system system;
    struct sadmm_contact_set contacts;
    struct sadmm_rigid *bodies;
};

/* At least `contacts` points. False when memory runs out. */
bool lattice_create(struct lattice *lattice, long contacts);
void lattice_destroy(struct lattice *lattice);
/* Back to rest with zero impulses. */
void lattice_reset(struct lattice *lattice);

#endif

/* World level: save the whole state of a world to a buffer and restore it, to the last bit.
 *
 * A buffer holds everything that the next step depends on and everything that can be read: settings, bodies, shapes
 * with their hulls and meshes, joints, gears, couplings, all names, forces, the contacts of the last step with their
 * impulses, caches of collision detection and joints, the report, all ids. A restored world makes the same steps as the
 * saved one, bit for bit, on the same backend, precision and kind of machine, in this process or another.
 *
 * A buffer has no pointers, and is only valid for the build that made it (sadmm_build_commit, sadmm_build_compiler,
 * sadmm_version) and its byte order; use scene files to exchange worlds. A checksum detects damage, but is no
 * signature: do not restore buffers from untrusted sources.
 *
 * Threads and errors: as world.h says.
 */
#ifndef SUBADMM_SAVE_H
#define SUBADMM_SAVE_H

#include <stddef.h>

#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Write the state after the steps begun so far, with all changes since, to `buffer` of `capacity` bytes. *size: bytes
 * written, or needed. The same state gives the same bytes. With buffer NULL and capacity 0 only *size is set. On CUDA
 * the state is copied from the device, which continues from there. Errors: INVALID_ARGUMENT (capacity less than *size,
 * which is set; nothing is written), OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_save(sadmm_world *world, void *buffer, size_t capacity, size_t *size);

/* Replace everything in `world`, except its `tasks`, by what was saved. Ids are those of the saved world; do not use
 * earlier ids of this world any more (they may name other objects). User data (sadmm_world_set_body_user_data, and the
 * same of shapes, joints, gears and couplings) stays with the objects that had the same id before; others have NULL.
 * `buffer`: `size` bytes, wherever they are (no alignment). Errors, with nothing changed: INVALID_ARGUMENT (not a saved
 * world, of another build, cut short, damaged), UNAVAILABLE (its backend), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_restore(sadmm_world *world, const void *buffer, size_t size);

#ifdef __cplusplus
}
#endif
#endif

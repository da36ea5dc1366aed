/* World level: the whole state of a world in a buffer, and back, to the last bit.
 *
 * A buffer holds everything that the next step depends on and everything that can be read: settings, bodies, shapes with
 * their hulls and meshes, joints, gears, couplings, forces, the contacts of the last step with their impulses, what
 * contact finding and joints remember, the report, all ids. A world that is restored makes the same steps to the same
 * bits as the one that was saved, on the same backend, precision and kind of machine, in this process or another one.
 *
 * It is bytes without pointers, for the build that made it (sadmm_build_commit, sadmm_build_compiler, sadmm_version) and
 * its byte order; files for people and other programs are scene files. A checksum finds damage. It is no signature: do
 * not restore what somebody made who is not trusted.
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

/* Write the state after the steps begun so far, with what was set since, into `buffer`, which has room for `capacity`
 * bytes. *size: bytes written, or needed. The same state gives the same bytes. With buffer NULL and capacity 0 nothing is
 * written. On CUDA the state is copied from the device, which goes on from there. Errors: INVALID_ARGUMENT (capacity less
 * than *size, which is set; nothing is written), OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_save(sadmm_world *world, void *buffer, size_t capacity, size_t *size);

/* Make `world` what was saved, of whatever it was: everything but its `tasks`. Ids are those that the saved world had:
 * ids of the world before are not to be used any more, though one may by chance be that of a new object. Pointers of
 * sadmm_world_set_body_user_data stay with the bodies that had the same id before; others have NULL. `buffer`: `size`
 * bytes, wherever they are (no alignment). Errors, with nothing changed: INVALID_ARGUMENT (not a saved world, of another
 * build, cut short, damaged), UNAVAILABLE (its backend), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_restore(sadmm_world *world, const void *buffer, size_t size);

#ifdef __cplusplus
}
#endif
#endif

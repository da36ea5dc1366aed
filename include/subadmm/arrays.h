/* World level: states of many objects in one call, for learning loops, viewers and bindings.
 *
 * An array (array_kinds.h) has a row for each body, shape, joint or coupling, in the order of sadmm_world_body_at
 * (shape_at, joint_at, coupling_at), or one for the world, and a fixed number of columns; doubles, row-major.
 * sadmm_world_body_at gives the id of a row, sadmm_world_body_index the row of an id. Rows stay the same until
 * something is added or removed. For contacts see sadmm_world_contacts; for arrays of many copies of a world see
 * environments.h.
 *
 * Threads and errors: as world.h says.
 */
#ifndef SUBADMM_ARRAYS_H
#define SUBADMM_ARRAYS_H

#include "array_kinds.h"
#include "coupling.h"
#include "joint.h"
#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The name of an array, "body_state" for SADMM_ARRAY_BODY_STATE; "" for an unknown one. Thread-safe. */
SADMM_API const char *sadmm_array_name(sadmm_array array);
/* Columns of an array; 0 for an unknown one. Thread-safe. */
SADMM_API int32_t sadmm_array_columns(sadmm_array array);
/* Whether the array can be set. Thread-safe. */
SADMM_API bool sadmm_array_is_settable(sadmm_array array);
/* Rows of an array: the number of bodies, shapes, joints or couplings, or 1; 0 for an unknown array or a NULL world. */
SADMM_API int32_t sadmm_world_array_rows(const sadmm_world *world, sadmm_array array);

/* Rows [first, first + count) into `values` (count x columns). Errors: INVALID_ARGUMENT (array, range; values may be
 * NULL where count is 0), UNAVAILABLE (above), DEVICE. */
SADMM_API sadmm_status sadmm_world_get_array(sadmm_world *world, sadmm_array array, int32_t first, int32_t count,
                                             double *values);
/* Set rows [first, first + count), each as the call named above does, with its ranges: all of them, or, after an error
 * in any, none. The message says which row. Errors: INVALID_ARGUMENT (array, range, values), those of the calls named,
 * DEVICE. */
SADMM_API sadmm_status sadmm_world_set_array(sadmm_world *world, sadmm_array array, int32_t first, int32_t count,
                                             const double *values);

/* The inverse of sadmm_world_body_at (shape_at, joint_at, coupling_at). Takes linear time. Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_body_index(sadmm_world *world, sadmm_body_id id, int32_t *index);
SADMM_API sadmm_status sadmm_world_shape_index(sadmm_world *world, sadmm_shape_id id, int32_t *index);
SADMM_API sadmm_status sadmm_world_joint_index(sadmm_world *world, sadmm_joint_id id, int32_t *index);
SADMM_API sadmm_status sadmm_world_coupling_index(sadmm_world *world, sadmm_coupling_id id, int32_t *index);

/* ---- in a device's memory ------------------------------------------------------------------------------------ */

/* An array in the memory of the device. Read only. */
typedef struct sadmm_device_array {
    const double *values;  /* device pointer: column k of row r is values[r * stride + k] */
    int64_t rows, columns; /* a row a dynamic body: sadmm_world_dynamic_bodies says which */
    int64_t stride;        /* doubles from row to row */
    int device;            /* its index, as in sadmm_world_def */
    void *stream; /* CUDA: the stream (cudaStream_t) of the steps. The values are valid at once on every stream,
                             because the call waits for steps begun */
} sadmm_device_array;

/* BODY_STATE or BODY_CONTACT_WRENCH of the dynamic bodies after the steps begun so far, without a copy. Valid until the
 * next call on the world that changes something. What reads it must end before the next step, or run on `stream`.
 * Errors: INVALID_ARGUMENT (another array), UNAVAILABLE (the backend has no device memory; the world is not on the
 * device: before its first steps, after a change other than of states or wrenches, or if the host does its steps; a
 * state was set since the last step; BODY_CONTACT_WRENCH: as above), DEVICE. */
SADMM_API sadmm_status sadmm_world_device_array(sadmm_world *world, sadmm_array array, sadmm_device_array *out);
/* Write the index (sadmm_world_body_at) of every dynamic body, ascending, to `indices`, which has room for `capacity`;
 * *count: their number. Errors: INVALID_ARGUMENT (capacity less than that; indices may be NULL where it is 0, to ask
 * for *count alone). */
SADMM_API sadmm_status sadmm_world_dynamic_bodies(sadmm_world *world, int32_t *indices, int32_t capacity,
                                                  int32_t *count);

#ifdef __cplusplus
}
#endif
#endif

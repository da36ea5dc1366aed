/* World level: environments, many copies of one world that do not know of each other, for learning loops and parameter
 * studies.
 *
 * Each environment makes the same steps, to the last bit, as a world of its own would that began as the template and
 * was given the same numbers, whatever the others do, on however many threads, in whatever order. All have the bodies,
 * shapes, joints, gears and couplings of the template; what steps change is stored once an environment, and numbers
 * that differ from the template's only where there is an array of them. There is no spacing: every environment is at
 * the template's place.
 *
 * Arrays are those of arrays.h with one more dimension: environments x rows x columns. An environment whose step fails
 * (a velocity that is not finite, a number in an input array that is out of range) is left as it was before that step,
 * is marked, makes no further steps until it is reset, and does not keep the others from making theirs.
 *
 * Where the template's steps are made on the CPU, environments are shared out over settings.threads of the template's
 * (0: all cores), or its `tasks`. On CUDA all are on the template's device and make each step together; bound arrays
 * are in its memory. There a first step begins without impulses, as every later one does with new contacts, where a
 * world's first step on CUDA has some initialised; contacts, rays and saves go by way of the host; and errors that
 * every call has besides its own are OUT_OF_MEMORY and DEVICE (after which all environments are to be made anew).
 * AUTO: on what has made the template's steps; the CPU where there were none.
 *
 * Threads: use environments from one thread at a time. Errors that every call has besides its own: INVALID_ARGUMENT
 * where a pointer is NULL that must not be.
 */
#ifndef SUBADMM_ENVIRONMENTS_H
#define SUBADMM_ENVIRONMENTS_H

#include <stddef.h>

#include "arrays.h"
#include "query.h"
#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_environments sadmm_environments;

/* `count` copies, in [1, 2^20], of the template `world` as it is now, impulses for warm starting included. The world
 * does not change, and may be destroyed. Errors: INVALID_ARGUMENT (count), OUT_OF_MEMORY, LIMIT (more objects than a
 * world holds, on CUDA); UNAVAILABLE (on CUDA: bodies of the template are in several environments of its own, and
 * others in -1; a shape has a surface velocity); those of steps begun (world.h). The message is the world's. */
SADMM_API sadmm_status sadmm_world_replicate(sadmm_world *world, int32_t count, sadmm_environments **out);
SADMM_API void sadmm_environments_destroy(sadmm_environments *environments); /* NULL is fine */
/* The message of the last failed call, "" when none failed or environments is NULL; valid until the next call. */
SADMM_API const char *sadmm_environments_message(const sadmm_environments *environments);
SADMM_API int32_t sadmm_environments_count(const sadmm_environments *environments); /* of NULL: 0 */
/* Bytes of all that is stored, over the number of environments: states, those that are kept, arrays, contacts that are
 * recorded; on CUDA also the device's memory of the world that they are in, once it has made a step. Of NULL: 0. */
SADMM_API size_t sadmm_environments_memory(const sadmm_environments *environments);

/* `steps` time steps, >= 1, of settings.dt each, in every environment that is not marked. Input arrays are read once,
 * before the first of them; output arrays are written once, after the last. Errors: INVALID_ARGUMENT (steps),
 * OUT_OF_MEMORY, LIMIT (of any environment, which is marked; the others have made their steps); on CUDA NON_FINITE
 * (an environment fails even as the template was; none is marked for it) and DEVICE. */
SADMM_API sadmm_status sadmm_environments_step(sadmm_environments *environments, int32_t steps);

/* The settings of all; gravity is that of an input array where there is one, and no more threads than the template's
 * settings asked for. Errors: INVALID_ARGUMENT (nothing changes; on CUDA also where gravity is such an array and the
 * host would drive the steps, as bind says). */
SADMM_API sadmm_status sadmm_environments_set_settings(sadmm_environments *environments,
                                                       const sadmm_settings *settings);
SADMM_API void sadmm_environments_settings_sized(const sadmm_environments *environments, sadmm_settings *settings,
                                                 size_t size);
static inline sadmm_settings sadmm_environments_settings(const sadmm_environments *environments)
{
    sadmm_settings settings;
    sadmm_environments_settings_sized(environments, &settings, sizeof settings);
    return settings;
}

/* ---- states -------------------------------------------------------------------------------------------------- */

/* State 0 is the template's. `which`: `count` environments, each at most once; NULL: all, and count is ignored. */

/* Each of these begins again with a state: states[k], or 0 where states is NULL. All that steps change is as it was,
 * warm start and the report included, so that the same steps follow, bit for bit; what input arrays have stays. Marks
 * are taken away. Errors: INVALID_ARGUMENT (range; an environment twice; nothing changes), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_environments_reset(sadmm_environments *environments, const int32_t *which, int32_t count,
                                                const int32_t *states);
/* Keep the state of an environment to reset to; *state: its number. Errors: INVALID_ARGUMENT (range; it is marked),
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_environments_keep(sadmm_environments *environments, int32_t environment, int32_t *state);
/* Forget a state that was kept; its number is not used again. Errors: INVALID_ARGUMENT (range; 0; it was forgotten). */
SADMM_API sadmm_status sadmm_environments_forget(sadmm_environments *environments, int32_t state);
/* As sadmm_world_save of the environment as it is now, to restore into a world: to look at it, to query it, to go on
 * with it. It has no contacts before its next step. Of one that is marked, inputs that are out of range are the
 * template's. Errors: those of sadmm_world_save, INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_environments_save(sadmm_environments *environments, int32_t environment, void *buffer,
                                               size_t capacity, size_t *size);

/* ---- arrays -------------------------------------------------------------------------------------------------- */

/* Rows and columns of an array are those of arrays.h: sadmm_environments_rows of them, sadmm_array_columns. Where
 * sadmm_world_get_array says UNAVAILABLE numbers are 0. */
SADMM_API int32_t sadmm_environments_rows(const sadmm_environments *environments, sadmm_array array); /* NULL: 0 */

/* An array is one of three kinds. State: BODY_STATE, JOINT_POSITION, JOINT_SPEED and COUPLING_TARGET, which steps
 * change; set them by sadmm_environments_set. Input: all others that can be set; neither steps nor
 * sadmm_environments_reset change it. Output: those that are read only. Thread-safe. */
SADMM_API bool sadmm_environments_is_input(sadmm_array array);

/* Rows of the environments `which`, into or from `values` (count x rows x columns). Set: an input array is one from
 * then on, as by sadmm_environments_bind. Errors: INVALID_ARGUMENT (range; set: those of sadmm_world_set_array, with
 * the environment in the message; nothing changes), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_environments_get(sadmm_environments *environments, sadmm_array array, const int32_t *which,
                                              int32_t count, double *values);
SADMM_API sadmm_status sadmm_environments_set(sadmm_environments *environments, sadmm_array array, const int32_t *which,
                                              int32_t count, const double *values);

/* An array in the memory of the environments. */
typedef struct sadmm_environments_array {
    void *values; /* environments x rows x columns, row-major, without gaps */
    int64_t environments, rows, columns;
    sadmm_precision precision; /* F64: double, F32: float */
    int32_t device;            /* `values` are in the memory of this CUDA device; -1: of the host */
} sadmm_environments_array;

/* *out stays valid until the environments are destroyed, at the same place. Output and state: the numbers after each
 * call that steps, resets or sets, once it has returned; do not write to it. Input: write to it between calls;
 * environments have it from the next step on. It begins with what they have now. An input array has one precision, that
 * of the first call. On CUDA most arrays are read and written by the device alone; sizes and places of shapes, frames
 * of joints, and report, go by way of the host, and so does the first restitution that is not 0. Errors:
 * INVALID_ARGUMENT (array, precision; an input array that has the other precision), OUT_OF_MEMORY; UNAVAILABLE (on
 * CUDA: gravity where the host drives the steps, by settings.residual_tolerance, or by tolerance in the method PAPER
 * or with more than 64 checks a step). */
SADMM_API sadmm_status sadmm_environments_bind(sadmm_environments *environments, sadmm_array array,
                                               sadmm_precision precision, sadmm_environments_array *out);

/* CUDA: work that was enqueued on this stream (a cudaStream_t of the device; NULL, as it begins: the default one) ends
 * before a call reads or writes arrays; where these go by way of the host, all work on the device does. Output and
 * state arrays are complete when a call returns. The stream must be there for as long as it is set. On the CPU it says
 * nothing. */
SADMM_API sadmm_status sadmm_environments_set_stream(sadmm_environments *environments, void *stream);

/* ---- contacts and rays --------------------------------------------------------------------------------------- */

/* From now on keep the contacts of the last step of each sadmm_environments_step, or (false) no more. */
SADMM_API sadmm_status sadmm_environments_record_contacts(sadmm_environments *environments, bool record);
/* *contacts: *count contacts of an environment, all that there are, as of sadmm_world_contacts; valid until the next
 * call that steps or resets, sets a state, or ends the recording; what is reset or set has none. Ids are those of the
 * template. Errors: INVALID_ARGUMENT (range), UNAVAILABLE (not recorded). */
SADMM_API sadmm_status sadmm_environments_contacts(sadmm_environments *environments, int32_t environment,
                                                   const sadmm_contact **contacts, int32_t *count);
/* sadmm_world_cast_rays in each of the environments `which`: rays and hits, count x `each`; each: >= 0. Ids in the hits
 * and in the filter are those of the template. Errors: those of sadmm_world_cast_rays, with the environment in the
 * message; INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_environments_cast_rays(sadmm_environments *environments, const int32_t *which,
                                                    int32_t count, int32_t each, const sadmm_ray *rays,
                                                    const sadmm_query_filter *filter, sadmm_ray_hit *hits);

/* ---- marks --------------------------------------------------------------------------------------------------- */

/* Which are marked: count bytes, 1 or 0, one an environment, valid until the environments are destroyed; NULL of
 * NULL. */
SADMM_API const uint8_t *sadmm_environments_marked(const sadmm_environments *environments);
/* Why an environment is marked, "" where it is not, or out of range; valid until the next call. */
SADMM_API const char *sadmm_environments_mark(const sadmm_environments *environments, int32_t environment);

#ifdef __cplusplus
}
#endif
#endif

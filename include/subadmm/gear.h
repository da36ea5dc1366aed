/* World level: gears, which couple one free coordinate of a joint to one of another exactly:
 *
 *     q_1 + ratio q_2 = offset
 *
 * Two toothed wheels that mesh (two revolute joints; ratio = teeth of 2 / teeth of 1), a belt (the same with ratio <
 * 0), a rack on a pinion (a translation 1, a rotation 2; ratio = -radius, m/rad), a pulley (two translations), a screw
 * (the translation and the rotation of one cylindrical joint; ratio = -pitch / 2 pi).
 *
 * A gear applies a force along q_1 and ratio x force along q_2, each between the two bodies of the joint, like a drive.
 * If three of these bodies are dynamic, one must be in both joints: the carrier of two wheels, the hand of two fingers,
 * or the middle body of a chain. The force of the gear then acts between the outer two bodies, as that of teeth does,
 * and the joints bear the carrier. This needs axes about which a force between the outer two bodies turns both: not one
 * common axis of both joints, nor two translations in the same direction. Such a gear is refused; if the axes become so
 * later, the gear is inactive until they no longer are. (Two opposing slides on a moving hand need a wheel in between:
 * a body on a hinge, with two gears.) Full turns are counted, and errors of the ratio do not accumulate: they are
 * corrected like those of locked coordinates. Method: docs/internals/algorithm.md, "Gears and couplings".
 *
 * Threads and errors: as world.h says. Ids are values with a generation, as bodies' are. */
#ifndef SUBADMM_GEAR_H
#define SUBADMM_GEAR_H

#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_gear_def {
    size_t struct_size;          /* set by sadmm_gear_def_default() */
    sadmm_joint_id joint_1;      /* No default */
    int32_t coordinate_1;        /* a free one of joint_1, in [0, 6): any translation or distance; a rotation that is
                                    the only free one or one of two. No default */
    sadmm_joint_id joint_2;      /* may be joint_1, with another coordinate. No default */
    int32_t coordinate_2;        /* likewise */
    double ratio;                /* |ratio| in [1e-9, 1e9], unit of coordinate 1 over that of 2; default 1 */
    double offset;               /* |offset| <= 1e9, unit of coordinate 1, or NaN: the value when the gear is added (in
                                    the same range, and read back); default NaN */
    bool enabled;                /* default true. Inactive if false, or if one of its joints is disabled */
    const char *name;            /* UTF-8; copied, as many whole characters as fit into 63 bytes; NULL = "" */
    void *user_data;             /* the caller's, never used by the library; default NULL */
} sadmm_gear_def;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_gear_def_init(sadmm_gear_def *def, size_t size);
static inline sadmm_gear_def sadmm_gear_def_default(void)
{
    sadmm_gear_def def;
    sadmm_gear_def_init(&def, sizeof def);
    return def;
}

/* *id: the new gear, until it, or one of its joints or their bodies, is removed. An error of the offset is corrected by
 * at most settings.correction_speed of coordinate 1. Errors: STALE_ID, INVALID_ARGUMENT (range; a coordinate that is
 * not free, twice the same one, other dynamic bodies or axes than named above; nothing changes), LIMIT (2^24 gears),
 * OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_add_gear(sadmm_world *world, const sadmm_gear_def *def,
                                            sadmm_gear_id *id /* may be NULL */);
/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_remove_gear(sadmm_world *world, sadmm_gear_id id);
SADMM_API int32_t sadmm_world_gear_count(const sadmm_world *world); /* also those not enabled; of NULL: 0 */
/* The index-th live gear in order of creation slot, index in [0, gear_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_gear_at(sadmm_world *world, int32_t index, sadmm_gear_id *id);
/* Read back the definition as it is now. Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_gear_def_sized(sadmm_world *world, sadmm_gear_id id, sadmm_gear_def *def,
                                                  size_t size);
static inline sadmm_status sadmm_world_gear_def(sadmm_world *world, sadmm_gear_id id, sadmm_gear_def *def)
{
    return sadmm_world_gear_def_sized(world, id, def, sizeof *def);
}
/* The gear that has this name, as sadmm_world_body_named. Errors: INVALID_ARGUMENT (none has it, or several). */
SADMM_API sadmm_status sadmm_world_gear_named(sadmm_world *world, const char *name, sadmm_gear_id *id);
/* Its name; "" as of sadmm_world_body_name. */
SADMM_API const char *sadmm_world_gear_name(const sadmm_world *world, sadmm_gear_id id);
/* The user_data of its definition, or what was set since; as of sadmm_world_set_body_user_data. Errors: STALE_ID,
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_gear_user_data(sadmm_world *world, sadmm_gear_id id, void *data);
SADMM_API void *sadmm_world_gear_user_data(const sadmm_world *world, sadmm_gear_id id);
/* From the next step on; its offset stays. Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_set_gear_enabled(sadmm_world *world, sadmm_gear_id id, bool enabled);

typedef struct sadmm_gear_state {
    double error;                /* q_1 + ratio q_2 - offset at the current poses, unit of coordinate 1 */
    double force_1, force_2;     /* along the coordinates, N or N m; force_2 = ratio force_1. Mean over the last
                                    (sub-)step; 0 before the first step and where the gear did not take part. Not
                                    included in the wrenches of the joints */
} sadmm_gear_state;

/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_gear_state(sadmm_world *world, sadmm_gear_id id, sadmm_gear_state *state);

#ifdef __cplusplus
}
#endif
#endif

/* Ids of a world's objects: small values with a generation. The id of a destroyed object gives SADMM_ERROR_STALE_ID: it
 * names another object only after 2^32 - 1 more of them in its slot.
 */
#ifndef SUBADMM_ID_H
#define SUBADMM_ID_H

#include <stdint.h>

/* index + 1 in `slot`, so that a zeroed id is never valid. */
typedef struct sadmm_body_id { uint32_t slot, generation; } sadmm_body_id;
typedef struct sadmm_shape_id { uint32_t slot, generation; } sadmm_shape_id;
typedef struct sadmm_joint_id { uint32_t slot, generation; } sadmm_joint_id;
typedef struct sadmm_coupling_id { uint32_t slot, generation; } sadmm_coupling_id;
typedef struct sadmm_gear_id { uint32_t slot, generation; } sadmm_gear_id;

#endif

/* Gravity where the world is many equal ones, environments, and each has its own, in the place of the settings'. */
#ifndef SADMM_CUDA_DEVICE_GRAVITY_H
#define SADMM_CUDA_DEVICE_GRAVITY_H

#include <stddef.h>
#include <stdint.h>

enum { GRAVITY_NUMBERS = 4, GRAVITY_SIZE = 3 }; /* a world: the vector, then its size, m/s^2 */

struct cuda_gravities {
    const double *of;       /* worlds x GRAVITY_NUMBERS, device memory; NULL: all have the settings' */
    int32_t bodies, shapes; /* of a world: dynamic bodies, slots of shapes */
};

/* Where there are some: of a dynamic body, */
static __device__ __forceinline__ const double *own_gravity(const struct cuda_gravities &gravities, int32_t body)
{
    return gravities.of + GRAVITY_NUMBERS * (size_t)(body / gravities.bodies);
}
/* of a shape: its size. */
static __device__ __forceinline__ double own_gravity_size(const struct cuda_gravities &gravities, uint32_t slot)
{
    return gravities.of[GRAVITY_NUMBERS * (size_t)(slot / (uint32_t)gravities.shapes) + GRAVITY_SIZE];
}

#endif

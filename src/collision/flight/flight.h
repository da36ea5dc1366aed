/* How a swept body moves within a step, and where two of them touch. */
#ifndef SADMM_COLLISION_FLIGHT_FLIGHT_H
#define SADMM_COLLISION_FLIGHT_FLIGHT_H

#include "collision/base/manifold.h"
#include "collision/shapes/shape.h"

/* A body's motion within a step: its centre of mass is at position + t velocity + t^2/2 acceleration, and it turns from
 * `orientation`, which it has at `at`, by the rate `turn`; `spin`: the angular velocity that impacts see. Where its
 * moments differ, by that as a body does that no torque acts on (math/rigid.h): `spin` is what it has at `at`, and
 * `sway` what its angular velocity differs from `turn` by at most, `bend` what it changes by, rad/s^2. */
struct sadmm_flight {
    double position[3], velocity[3], acceleration[3];
    double orientation[4], turn[3], spin[3];
    double inertia[3], sway, bend; /* 0: it turns by `turn` */
    double rate;                   /* no faster than this, rad/s */
    double at, since;        /* s; before `since` the motion is another one */
};

struct sadmm_flight_pose {
    double position[3], orientation[4], velocity[3], spin[3];
};

/* A shape of a swept body. */
struct sadmm_swept_shape {
    const struct sadmm_shape *shape;
    const struct sadmm_geometry *geometry;
    const struct sadmm_flight *flight;
};

/* Two of them, in the order of pairs (geometry_rank); subshape: of the pair. */
struct sadmm_swept_pair {
    struct sadmm_swept_shape a, b;
    const double *hulls;
    uint32_t subshape;
    double threshold; /* points that approach slower than this are left out, m/s */
    bool lost;        /* out: it took too many tests to decide */
};

/* Where they touch. */
struct sadmm_flight_touch {
    double time;      /* s after the step's start */
    double normal[3]; /* world, from a to b */
    int count;
    double point[SADMM_MANIFOLD_POINTS][3]; /* m, world */
    uint32_t feature[SADMM_MANIFOLD_POINTS];
};

#endif

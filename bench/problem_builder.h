/* A contact problem from bodies, contact points and ball joints given in the world frame. */
#ifndef BENCH_PROBLEM_BUILDER_H
#define BENCH_PROBLEM_BUILDER_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/error.h"
#include "core/math/quat.h"
#include "subadmm/problem.h"

struct built_body {
    double mass;          /* kg */
    vec3 inertia;         /* principal, kg m^2 */
    vec3 position;        /* m */
    quat orientation;     /* principal axes to world */
    vec3 linear, angular; /* velocity at the start of the step, m/s, rad/s */
};

struct problem_builder {
    double dt;    /* s */
    vec3 gravity; /* m/s^2 */
    struct built_body *bodies;
    sadmm_problem_contact *contacts;
    sadmm_problem_block *joints;
    size_t body_count, contact_count, joint_count;
    bool out_of_memory; /* what is added after it is lost; problem_builder_finish says so */
};

/* dt 5 ms, gravity 9.81 m/s^2 down. */
void problem_builder_start(struct problem_builder *builder);
void problem_builder_free(struct problem_builder *builder);

/* A body at rest with its axes along the world's, its inertia that of a solid box; the caller may change it. */
struct built_body *problem_builder_box(struct problem_builder *builder, double mass, vec3 half_extents, vec3 position);

/* `body` lies on `below` (-1: the world) at a world point; the normal points from below to the body. */
void problem_builder_contact(struct problem_builder *builder, int32_t body, int32_t below, vec3 point, vec3 normal,
                             double friction);
/* The four corners of the rectangle [x0, x1] x [y0, y1] at height z, normal up. */
void problem_builder_rectangle(struct problem_builder *builder, int32_t body, int32_t below, const double x[2],
                               const double y[2], double z, double friction);
/* A ball joint between two bodies (b: -1 is the world): three hard rows. */
void problem_builder_ball(struct problem_builder *builder, int32_t a, int32_t b, vec3 point);

/* n . (velocity of b's contact point - a's) for velocities of the bodies (linear, angular). */
double problem_builder_approach(const struct problem_builder *builder, size_t contact, const double *velocities);

/* The problem of one step: b = A (v + dt g), start velocities v. Errors: those of sadmm_problem_*. */
sadmm_status problem_builder_finish(const struct problem_builder *builder, sadmm_problem **out,
                                    struct sadmm_error *error);

#endif

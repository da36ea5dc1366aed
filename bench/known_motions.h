/* Motions of one and two bodies whose answers are known, as many as one likes: shapes, sizes, masses, moments, poses,
 * speeds and time steps are drawn from a number. What `subadmm-bench motion --known` and tests/test_order.c run: every
 * motion with its step, half of it, ... against the laws of rigid bodies (exact_motion.h). */
#ifndef BENCH_KNOWN_MOTIONS_H
#define BENCH_KNOWN_MOTIONS_H

#include "core/base/error.h"
#include "exact_motion.h"
#include "subadmm/joint.h"

enum { KNOWN_LEVELS = 5, KNOWN_FRAMES = 160 };

/* SOLID: a plane or a box; CLOTH: a mesh of triangles or a heightfield, flat, with many of them under a body. */
enum known_ground { GROUND_NONE, GROUND_SOLID, GROUND_CLOTH };

/* What changes at once in a motion. */
enum known_event { EVENT_NONE, EVENT_STOPS, EVENT_GRIPS, EVENT_HITS_GROUND, EVENT_HITS_BALL };

struct known_motion {
    int kind, number;
    double scale;   /* length of the bodies, m; its motion takes some sqrt(scale / g) */
    double seconds, dt; /* at most KNOWN_FRAMES steps */
    double gravity[3], friction, restitution;
    enum known_ground ground;
    bool odd_ground; /* the latter of the two */
    sadmm_shape_def shapes[EXACT_BODIES];
    bool has_shapes, jointed; /* jointed: links are joints */
    double lean[2];  /* the cosine of body 0's z axis to the vertical stays in between; both 0: any */
    enum known_event event;
    double event_time; /* s from the start, of what happens once */
    struct exact_system system;
};

int known_motion_kinds(void);
const char *known_motion_name(int kind);
/* What the error of a step of dt goes with: dt, or its square; 0: steps of any length are exact, to rounding and what
 * the solve leaves. */
int known_motion_order(int kind);
/* The kind's motion of that number. */
void known_motion_make(int kind, int number, struct known_motion *motion);

/* What the library makes of it. */
struct known_result {
    double error[KNOWN_LEVELS]; /* most after any step of dt, m (pose_distance), by halvings of the step */
    double left, most;          /* energy less the motion's, with the step itself, as a share of the largest kinetic
                                   energy: at the end, and most after any step */
};
/* def: backend, precision and settings; time step and gravity are the motion's. opened: NULL, or called with every new
 * world before its first step. levels: 1 .. KNOWN_LEVELS. */
sadmm_status known_motion_run(const struct known_motion *motion, const sadmm_world_def *def,
                              void (*opened)(sadmm_world *world), int levels, struct known_result *result,
                              struct sadmm_error *error);

#endif

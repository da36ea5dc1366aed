/* The laws of rigid bodies that touch, hang and turn, apart from the library: accelerations by the constraints' second
 * derivatives, integrated by the classical method of fourth order. For short steps its states are those of the motion
 * itself, to hold the library's steps to. In double; one or two bodies, whose contacts stay what they are. */
#ifndef BENCH_EXACT_MOTION_H
#define BENCH_EXACT_MOTION_H

#include "subadmm/world.h"

enum { EXACT_BODIES = 2, EXACT_LINKS = 4 };

struct exact_body {
    double mass, inertia[3];
    sadmm_body_state state;
};

/* In the body's frame: a ball, or an ellipsoid (semi-axes size) with axes along the body's; or a circle about `axis`,
 * the edge of a cylinder or cone. */
enum exact_surface_kind { EXACT_BALL, EXACT_ELLIPSOID, EXACT_RIM };
struct exact_surface {
    enum exact_surface_kind kind;
    double centre[3], size[3], axis[3];
};

enum exact_link_kind {
    EXACT_ON_GROUND, /* the surface of b touches z = 0 */
    EXACT_ON_BALL,   /* the balls of a and b touch */
    EXACT_POINT,     /* a point of a and one of b are the same */
    EXACT_AXIS       /* b turns against a about one axis alone */
};
enum exact_hold {
    EXACT_SLIDES,      /* with `friction` against `way` */
    EXACT_GRIPS,       /* no point of contact moves */
    EXACT_GRIPS_ACROSS /* along its way from the world's origin it may: what goes round that on a line of contact */
};
struct exact_link {
    enum exact_link_kind kind;
    enum exact_hold hold;
    int a, b; /* bodies; a: -1: the world */
    double friction, way[3]; /* of b against a: a direction that stays */
    struct exact_surface surface[2]; /* of a, of b */
    double point[2][3];              /* in the frames of a and b */
    double axis[3];                  /* in the frame of a */
};

struct exact_system {
    double gravity[3];
    int body_count, link_count;
    struct exact_body bodies[EXACT_BODIES];
    struct exact_link links[EXACT_LINKS];
    double least_load; /* out, N: least normal force of any contact so far; set it to HUGE_VAL */
};

/* Goes on by h seconds. */
void exact_step(struct exact_system *system, double h);

/* Kinetic and potential energy, J; kinetic: may be NULL. */
double exact_energy(const struct exact_system *system, double *kinetic);

/* The lowest point of a surface, from the body's centre of mass, in the world. */
void exact_lowest(const struct exact_surface *surface, const sadmm_body_state *state, double arm[3]);

#endif

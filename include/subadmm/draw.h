/* World level: what a world is, as lines, triangles, points and texts for a program that draws them.
 *
 * Everything is in the world's frame, m. Colours are 0xRRGGBB. The library draws nothing itself: it calls the functions
 * of sadmm_draw, one after the other on the calling thread. It allocates nothing.
 *
 * Threads: sadmm_world_debug_draw only reads, as calls do that take a const world (world.h): it may run on several
 * threads at once, and beside other such calls, while nothing else is called on the world. Its callbacks may make such
 * calls too, and no others on this world.
 */
#ifndef SUBADMM_DRAW_H
#define SUBADMM_DRAW_H

#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What is drawn: added up in sadmm_draw.flags. Numbers of lines and triangles are with `segments` = n. */
enum {
    SADMM_DRAW_SHAPES = 1 << 0,   /* triangles: surfaces of shapes. A sphere or an ellipsoid has n (n - 2), a capsule
                                     n^2, a cylinder 4 n, a cone 2 n, a box 12, a mesh its own, a plane 2; a hull those
                                     of its faces, with a convex radius also those of its rounds */
    SADMM_DRAW_EDGES = 1 << 1,    /* lines: edges of shapes, outlines of round ones, a grid on planes */
    SADMM_DRAW_BOUNDS = 1 << 2,   /* lines: bounding boxes as of sadmm_world_overlap_box, 12 a shape; none of planes */
    SADMM_DRAW_JOINTS = 1 << 3,   /* lines: the axes of both frames (3 each, x red, y green, z blue), from one origin to
                                     the other, and from each body's centre of mass to its origin; those that are not
                                     enabled in grey */
    SADMM_DRAW_COUPLINGS = 1 << 4, /* lines: the axes of frame and target, and from one origin to the other */
    SADMM_DRAW_CONTACTS = 1 << 5, /* a point and its normal, a line of axis_length, of every contact of the last step */
    SADMM_DRAW_FORCES = 1 << 6,   /* lines: force of every contact of the last step on b, times force_scale */
    SADMM_DRAW_CENTRES = 1 << 7,  /* a point: centre of mass, and lines: principal axes, of dynamic bodies */
    SADMM_DRAW_ISLANDS = 1 << 8,  /* a line between the centres of mass of two dynamic bodies for every pair of shapes
                                     that had contacts in the last step and every enabled joint: what these connect is
                                     an island */
    SADMM_DRAW_NAMES = 1 << 9,    /* texts: names of bodies at their centres of mass, of shapes at their origins, of
                                     joints at the origin of the frame on b */
    SADMM_DRAW_ALL = (1 << 10) - 1
};

/* Of the callbacks, what is NULL is left out. Pointers that they are given are valid during the call. */
typedef struct sadmm_draw {
    size_t struct_size;          /* set by sadmm_draw_default() */
    void *user;                  /* the first argument of all callbacks; default NULL */
    void (*line)(void *user, const double from[3], const double to[3], uint32_t colour);
    /* a, b, c: counter-clockwise seen from outside; normal: outward, unit */
    void (*triangle)(void *user, const double a[3], const double b[3], const double c[3], const double normal[3],
                     uint32_t colour);
    void (*point)(void *user, const double position[3], uint32_t colour);
    void (*text)(void *user, const double position[3], const char *text, uint32_t colour);
    /* The colour of a shape; `usual`: by the type of its body, and for sensors one of their own */
    uint32_t (*shape_colour)(void *user, sadmm_shape_id shape, uint32_t usual);
    uint32_t flags;              /* SADMM_DRAW_SHAPES and so on; default SADMM_DRAW_SHAPES */
    int32_t segments;            /* of a circle, a multiple of 4 in [4, 1024]; default 24. Corners lie on the surface,
                                    triangles at most 10 / segments^2 of the radius (of an ellipsoid, of the largest
                                    semi-axis) below it, so that the volume is at most 30 / segments^2 of itself too
                                    small */
    double force_scale;          /* m/N, in [0, 1e9]; default 0.01 */
    double axis_length;          /* of axes and normals, m, in [0, 1e9]; default 0.1 */
    double plane_size;           /* half the side of the square that is drawn of a plane, around its origin, m, in
                                    [1e-6, 1e9]; default 10 */
    double lowest[3], highest[3]; /* m: what is outside of this box is left out: shapes by their bounding boxes, planes
                                    never, all else by its point or origin; lowest <= highest, may be infinite; default
                                    infinite */
    int32_t environment;         /* of bodies that collide with this environment (sadmm_body_def); >= 0, or -1, the
                                    default: of all */
} sadmm_draw;

/* The defaults named above, callbacks NULL. Thread-safe. */
SADMM_API void sadmm_draw_init(sadmm_draw *draw, size_t size);
static inline sadmm_draw sadmm_draw_default(void)
{
    sadmm_draw draw;
    sadmm_draw_init(&draw, sizeof draw);
    return draw;
}

/* Draw the world after the last step, in the order of slots. Messages of errors: sadmm_last_message. Errors:
 * INVALID_ARGUMENT (NULL, range; nothing is drawn), UNAVAILABLE (a device has steps that were not read back: call
 * sadmm_world_prepare_draw; nothing is drawn). */
SADMM_API sadmm_status sadmm_world_debug_draw(const sadmm_world *world, const sadmm_draw *draw);
/* Wait for the steps begun, and copy what is drawn from the device (CUDA). On other backends there is nothing to do.
 * Errors: those of the steps waited for, OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_prepare_draw(sadmm_world *world);

#ifdef __cplusplus
}
#endif
#endif

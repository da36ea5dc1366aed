/* What a program decides of contacts before they are solved: which there are, and their friction, restitution and
 * surface velocity.
 *
 *     static void one_way(void *context, sadmm_manifold *manifold)
 *     {
 *         const sadmm_body_id *platform = context;
 *         const double up = manifold->body_a.slot == platform->slot ? manifold->normal[2] : -manifold->normal[2];
 *         if (up < 0.7) manifold->enabled = false;
 *     }
 *     sadmm_world_set_manifold_callback(world, one_way, &platform);
 *
 * A manifold is what two shapes have in common: one normal, and points. Two shapes that may touch within the step have
 * one, or several where one of them is a mesh. Two shapes that shall never meet have better ways: category and mask of
 * their definitions, sadmm_world_set_body_pair_contact.
 *
 * The callback is called within sadmm_world_step on the thread that calls that, once for each manifold of each
 * sub-step, in the order of sadmm_world_contacts; and for hits within the step (settings.hits) as they are found, maybe
 * more than once for one hit. It must not call anything on the world but what takes a const world, and must not keep
 * the pointer. Given the same manifolds it should decide the same: then so are steps, to the last bit.
 *
 * Cost: on CUDA contacts are found, and steps driven, by the host in worlds with a callback. Without one it costs
 * nothing. It is not saved (save.h), not copied to environments (environments.h), and stays where a world is restored.
 *
 * Threads: as in world.h, a world is used by one thread at a time.
 */
#ifndef SUBADMM_MANIFOLD_H
#define SUBADMM_MANIFOLD_H

#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SADMM_MOST_MANIFOLD_POINTS = 8 };

typedef struct sadmm_manifold {
    /* What there is; changes of it are not looked at. */
    sadmm_shape_id shape_a, shape_b;
    sadmm_body_id body_a, body_b;
    int32_t triangle;           /* as sadmm_contact.triangle */
    bool begun;                 /* the two shapes had no manifold in the last step */
    bool hit;                   /* a hit within the step, at its moment */
    double normal[3];           /* unit, world, from a to b */
    double speed;               /* how fast they approach along it, at the point where that is fastest, by their
                                   velocities before the step (a hit: before it), m/s; < 0: they part */
    int32_t count;              /* points, in [1, SADMM_MOST_MANIFOLD_POINTS] */
    double positions[SADMM_MOST_MANIFOLD_POINTS][3]; /* m, world: as sadmm_contact.position; of hits where they touch */
    double separations[SADMM_MOST_MANIFOLD_POINTS];  /* m: as sadmm_contact.separation; of hits 0 */

    /* What may be changed, for this step alone. */
    bool enabled;               /* true; false: the points are left out */
    double friction;            /* mu in [0, 1e6]: that of the pair */
    double restitution;         /* in [0, 1]: that of the pair */
    double surface_velocity[3]; /* how b's surface moves against a's beside the motion of the bodies, m/s, world,
                                   |x| <= 1e6: that of the shapes. What of it is along the normal is left out. 0 between
                                   two dynamic bodies */
} sadmm_manifold;

typedef void (*sadmm_manifold_callback)(void *context, sadmm_manifold *manifold);

/* From the next step on; NULL: no callback. The first step begins all manifolds. A step whose callback leaves a number
 * that is out of range ends with INVALID_ARGUMENT, and nothing of it has been done. Errors: those of steps begun
 * (world.h). */
SADMM_API sadmm_status sadmm_world_set_manifold_callback(sadmm_world *world, sadmm_manifold_callback callback,
                                                         void *context);

#ifdef __cplusplus
}
#endif
#endif

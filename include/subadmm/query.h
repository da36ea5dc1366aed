/* Spatial queries: ray casts, shape casts, overlaps, closest points.
 *
 * Queries see all shapes of dynamic, kinematic and static bodies after the steps begun so far. They compute in double;
 * results do not depend on the world's precision, backend or threads, nor on the order in which bodies were added.
 * Bodies beyond the range of their definition (|x| > 1e9 m) may be missed.
 *
 * The first query after a step, or after anything has been added, removed or set, brings a tree of boxes up to date;
 * those that follow use it as it is. Queries change no state and no contact. A
 * world on a device (CUDA) is waited for and its bodies are read back first, as by sadmm_world_body_state; queries run
 * on the host. Worlds that are not asked pay nothing.
 *
 * Threads: use a world from one thread at a time (world.h), also for queries; sadmm_world_cast_rays uses several
 * threads itself.
 *
 * Errors that every call has besides its own: INVALID_ARGUMENT (NULL; a number out of range), those of the steps waited
 * for, OUT_OF_MEMORY, DEVICE. Nothing is written after an error.
 */
#ifndef SUBADMM_QUERY_H
#define SUBADMM_QUERY_H

#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The shapes that a query sees: */
typedef struct sadmm_query_filter {
    size_t struct_size;      /* set by sadmm_query_filter_default() */
    uint32_t body_types;     /* of bodies of these types: 1u << SADMM_BODY_DYNAMIC and so on, added up; in [0, 7];
                                default 7, all */
    sadmm_body_id ignored;   /* not of this body; default all 0: no body is ignored */
    int32_t environment;     /* of bodies that collide with this environment (sadmm_body_def); >= 0, or -1, the default:
                                of any */
    uint32_t category, mask; /* that would collide with a shape with these (sadmm_shape_def); default both 0: any */
    bool from_inside;        /* rays: also shapes that contain the origin, at distance 0; shape casts: also shapes
                                that overlap it where it begins; default true */
    bool from_behind;        /* rays and shape casts: also the back of mesh triangles; default false */
    bool sensors;            /* also sensors; default false */
} sadmm_query_filter;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_query_filter_init(sadmm_query_filter *filter, size_t size);
static inline sadmm_query_filter sadmm_query_filter_default(void)
{
    sadmm_query_filter filter;
    sadmm_query_filter_init(&filter, sizeof filter);
    return filter;
}

/* ---- rays -------------------------------------------------------------------------------------------------------- */

typedef struct sadmm_ray {
    double origin[3];    /* m, world, in [-1e9, 1e9] */
    double direction[3]; /* finite, not all 0; its length does not matter */
    double length;       /* how far to search, m, >= 0; infinite: as far as there is */
} sadmm_ray;

typedef struct sadmm_ray_hit {
    sadmm_shape_id shape; /* all 0: nothing was hit; then the rest is 0, and triangle -1 */
    sadmm_body_id body;   /* the body of the shape */
    double distance;      /* from the origin, m, in [0, length] */
    double point[3];      /* m, world */
    double normal[3];     /* outward, unit, world; inside: against the ray */
    int32_t triangle;     /* of a mesh, as in sadmm_contact; -1: the shape is none */
    bool inside;          /* the origin is inside of the shape: distance is 0, and the point is the origin */
} sadmm_ray_hit;

/* A hit is where a ray enters a shape. Every shape is hit at most once.
 *
 * Solids are closed: a ray that runs along a face or an edge, or touches a round in one point, hits, to within
 * rounding. On an edge or a corner the normal is that of one of the faces there. What the origin is inside of is hit at
 * distance 0, or with filter.from_inside = false not at all. An origin on a surface is outside as long as the ray leads
 * away from it, and may be on either side by rounding: rays that go on from a hit ignore its body, or begin a little
 * above it.
 * A plane is the half-space behind it; from outside, parallel rays do not hit it. A mesh is a surface without an
 * inside, hit from the front; with filter.from_behind from both sides. No ray passes between two triangles that share
 * an edge or a corner. A ray in the plane of a triangle misses it.
 *
 * Accuracy: hit points and distances are exact to 1e-12 of (distance + size of the shape + size of its coordinates),
 * unless the ray grazes the shape within 0.01 rad; for grazing rays, whether they hit is decided to that tolerance. */

/* The nearest hit; among equal distances, the shape with the lowest slot. filter: NULL: the defaults. Errors: STALE_ID
 * (filter->ignored). */
SADMM_API sadmm_status sadmm_world_cast_ray(sadmm_world *world, const sadmm_ray *ray, const sadmm_query_filter *filter,
                                            sadmm_ray_hit *hit);
/* All hits, sorted by distance, then by the slot of the shape. Writes up to `capacity` of them; *count: the number of
 * all hits. capacity: >= 0; hits may be NULL where it is 0. Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_cast_ray_all(sadmm_world *world, const sadmm_ray *ray,
                                                const sadmm_query_filter *filter, int32_t capacity,
                                                sadmm_ray_hit *hits, int32_t *count);
/* sadmm_world_cast_ray for `count` rays: hits[i] is what rays[i] hits, to the bit. On up to settings.threads threads
 * (sadmm_world_def.tasks). count: >= 0; rays and hits may be NULL where it is 0. Errors: STALE_ID; INVALID_ARGUMENT
 * names the first ray that is refused. */
SADMM_API sadmm_status sadmm_world_cast_rays(sadmm_world *world, int32_t count, const sadmm_ray *rays,
                                             const sadmm_query_filter *filter, sadmm_ray_hit *hits);

/* ---- shape casts ------------------------------------------------------------------------------------------------- */

/* What the shape in `def`, on a body at this pose (as in sadmm_world_overlap_shape, but no PLANE), touches first if it
 * moves along `direction` (as of a ray) without turning, by up to `length` m (>= 0; may be infinite); among equal
 * distances, the shape with the lowest slot. Of *hit, `distance` is how far it moves until they touch, in [0, length];
 * `point` is where (of a face or an edge that touches, one of its points), `normal` the other shape's there, outward.
 *
 * What it overlaps where it begins is hit at distance 0, with `inside`, `point` and `normal` as of
 * sadmm_world_closest_to_shape; with filter.from_inside = false not at all, so that it can be moved out. What it only
 * touches there, to within 4e-12 of the sizes and the distance between, is hit if it moves into it, and not as long as
 * it slides along it. A mesh is hit from the front (with filter.from_behind from both sides), and its triangles one by
 * one: what slides over it finds no edges inside of it.
 *
 * Accuracy: distances to 1e-11 of the sizes and the way, unless it grazes what it hits within 0.01 rad; whether it hits
 * what it grazes is decided to that tolerance. Errors: STALE_ID (filter->ignored). */
SADMM_API sadmm_status sadmm_world_cast_shape(sadmm_world *world, const sadmm_shape_def *def, const double position[3],
                                              const double orientation[4], const double direction[3], double length,
                                              const sadmm_query_filter *filter, sadmm_ray_hit *hit);

/* ---- overlaps ---------------------------------------------------------------------------------------------------- */

/* Both write the ids of shapes in the order of their slots, up to `capacity` of them; *count: the number of all.
 * capacity: >= 0; shapes may be NULL where it is 0. filter: NULL: the defaults. Errors: STALE_ID (filter->ignored). */

/* Shapes whose bounding boxes overlap the box from `lowest` to `highest` (m, world, lowest <= highest, may be
 * infinite). Bounding boxes are the smallest along the world's axes; those of hulls and meshes are around the box along
 * the shape's axes. A plane counts as a half-space. */
SADMM_API sadmm_status sadmm_world_overlap_box(sadmm_world *world, const double lowest[3], const double highest[3],
                                               const sadmm_query_filter *filter, int32_t capacity,
                                               sadmm_shape_id *shapes, int32_t *count);
/* Shapes that overlap the shape in `def` on a body at this pose (position: m, in [-1e9, 1e9]; orientation: w x y z, as
 * in sadmm_body_def): those with a distance <= 0 (sadmm_world_closest_to_shape). def: of any type but MESH, ranges as
 * in sadmm_shape_def; only type, size, hull, position and orientation count. Two planes overlap unless they face away
 * from each other, parallel to 1e-12 rad. */
SADMM_API sadmm_status sadmm_world_overlap_shape(sadmm_world *world, const sadmm_shape_def *def,
                                                 const double position[3], const double orientation[4],
                                                 const sadmm_query_filter *filter, int32_t capacity,
                                                 sadmm_shape_id *shapes, int32_t *count);

/* ---- closest points ---------------------------------------------------------------------------------------------- */

typedef struct sadmm_closest_points {
    double distance;  /* m; negative: penetration. b moved by -distance along the normal touches a */
    double normal[3]; /* unit, world, from a to b */
    double a[3], b[3]; /* points on each, m, world: b - a = distance x normal */
    int32_t triangle; /* of a mesh, as in sadmm_contact; -1: neither is one */
} sadmm_closest_points;

/* Distance or penetration depth of two shapes: the shortest translation after which they touch. Category, mask and
 * environment do not matter.
 *
 * Apart: distance to 1e-12, points and normal to 1e-10 of the size (of both shapes and what is between them).
 * Overlapping: distance is what parts the two along the normal, to 1e-12, and is the least for boxes, hulls, spheres
 * and capsules, up to where the expanding polytope ends with 40 points; with cylinders, cones and ellipsoids to 1e-3 of
 * the thinner body or 2 % of the depth; points to 1e-5 of the size (docs/internals/contact-geometry.md, "What is
 * exact"). What touches along a line or a face has one of the pairs of points there.
 *
 * A mesh is a surface, as for contacts: a shape wholly behind it does not overlap it. Among several overlapping
 * triangles the deepest counts; the direction out is to the front of the triangle, or past its sides.
 *
 * Errors: STALE_ID; INVALID_ARGUMENT (a and b the same; two planes; two meshes); NON_FINITE (bodies so far away that
 * the distance overflows). */
SADMM_API sadmm_status sadmm_world_closest_points(sadmm_world *world, sadmm_shape_id a, sadmm_shape_id b,
                                                  sadmm_closest_points *closest);
/* The same with the shape in `def` at a pose as a, as in sadmm_world_overlap_shape. */
SADMM_API sadmm_status sadmm_world_closest_to_shape(sadmm_world *world, const sadmm_shape_def *def,
                                                    const double position[3], const double orientation[4],
                                                    sadmm_shape_id b, sadmm_closest_points *closest);

#ifdef __cplusplus
}
#endif
#endif

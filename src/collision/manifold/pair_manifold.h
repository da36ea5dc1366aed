/* The manifold of any ordered pair of shapes. */
#ifndef SADMM_COLLISION_MANIFOLD_PAIR_MANIFOLD_H
#define SADMM_COLLISION_MANIFOLD_PAIR_MANIFOLD_H

#include "advance.h"
#include "collision/base/manifold.h"
#include "collision/shapes/geometry.h"
#include "collision/shapes/proxy.h"
#include "collision_table.h"
#include "inner_ball.h"
#include "manifold_box.h"
#include "manifold_box_round.h"
#include "manifold_hull.h"
#include "manifold_mesh.h"
#include "manifold_plane.h"
#include "manifold_round.h"

/* Who includes this says where manifolds of smooth bodies are made: here, unless SADMM_WITHOUT_SMOOTH is set (there are
 * none), or SADMM_SMOOTH_ELSEWHERE (the name of a function in another object). What they need keeps compilers from
 * making as much of the rest as they do without it. */
#if defined SADMM_SMOOTH_ELSEWHERE
void SADMM_SMOOTH_ELSEWHERE(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                            const double *hulls, uint32_t subshape, const struct pair_pose *pose, real limit,
                            uint32_t cache, struct manifold *m);
#elif !defined SADMM_WITHOUT_SMOOTH
#include "smooth_manifold.h"
#define SADMM_SMOOTH_ELSEWHERE pair_manifold_of_smooth
#endif

/* Pose of a in b's frame; d: from b's centre to a's origin. The differences are taken in double before anything is
 * rounded to `real`. A plane's origin may be far away: it moves to the foot of the perpendicular from b's centre. R:
 * row-major, shape to world. */
SADMM_INLINE struct pair_pose pose_at(bool a_is_plane, const double Ra[9], const double d[3], const double Rb[9])
{
    const row3_double a0 = r3_load_three(Ra), a1 = r3_load_three(Ra + 3), a2 = r3_load_three(Ra + 6),
                      b0 = r3_load_three(Rb), b1 = r3_load_three(Rb + 3), b2 = r3_load_three(Rb + 6);
    const double height = d[0] * Ra[2] + d[1] * Ra[5] + d[2] * Ra[8];
    double foot[3];
    struct pair_pose pose;
    int i;
    for (i = 0; i < 2; ++i) {
        pose.centre[i] = r3_fill(0);
        pose.tips[i] = false;
    }
    for (i = 0; i < 3; ++i) foot[i] = a_is_plane ? height * Ra[3 * i + 2] : d[i];
    for (i = 0; i < 3; ++i)
        pose.R[i] = r3_round(
            r3_madd_double(r3_madd_double(r3_scale_double(a0, Rb[i]), Rb[3 + i], a1), Rb[6 + i], a2));
    pose.t = r3_round(
        r3_madd_double(r3_madd_double(r3_scale_double(b0, foot[0]), foot[1], b1), foot[2], b2));
    return pose;
}

/* The same with a's origin and b's centre in the world. */
SADMM_INLINE struct pair_pose pair_pose(bool a_is_plane, const double Ra[9], const double xa[3], const double Rb[9],
                                        const double xb[3])
{
    const double d[3] = {xa[0] - xb[0], xa[1] - xb[1], xa[2] - xb[2]};
    return pose_at(a_is_plane, Ra, d, Rb);
}

/* Where the centres of mass are that may tip over a rim. */
SADMM_INLINE void pose_add_centres(const struct sadmm_proxy *a, const struct sadmm_proxy *b, struct pair_pose *pose)
{
    mat3 R;
    int k;
    if (!geometry_is_smooth(&a->geometry) && !geometry_is_smooth(&b->geometry)) return;
    for (k = 0; k < 3; ++k) R.r[k] = r3_vec3(pose->R[k]);
    pose->centre[0] = r3_of(v3_add(m3_mul(R, proxy_centre(a)), r3_vec3(pose->t)));
    pose->centre[1] = r3_of(proxy_centre(b));
    pose->tips[0] = a->system_body >= 0;
    pose->tips[1] = b->system_body >= 0;
}

/* Of two shapes turned to Ra and Rb about xa and xb, and moved on by `time_offset` seconds (midpoint.h). */
SADMM_INLINE struct pair_pose pose_between(const struct sadmm_proxy *a, const double Ra[9], const double xa[3],
                                           const struct sadmm_proxy *b, const double Rb[9], const double xb[3],
                                           double time_offset)
{
    struct pair_pose pose;
    double d[3];
    int i;
    for (i = 0; i < 3; ++i) d[i] = xa[i] - xb[i] - offset_displacement(a, b, time_offset, i);
    pose = pose_at(a->geometry.type == SADMM_SHAPE_PLANE, Ra, d, Rb);
#ifndef SADMM_WITHOUT_SMOOTH
    pose_add_centres(a, b, &pose);
#endif
    return pose;
}

/* Of two shapes as they are placed. */
SADMM_INLINE struct pair_pose turned_pose(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double time_offset)
{
    return pose_between(a, a->R, a->x, b, b->R, b->x, time_offset);
}

SADMM_CALLED struct pair_pose proxies_pose(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double time_offset,
                                           double dt, struct proxy_place *of_b)
{
    struct proxy_place of_a;
    proxy_place_at(a, time_offset, dt, &of_a);
    proxy_place_at(b, time_offset, dt, of_b);
    return pose_between(a, of_a.R, of_a.x, b, of_b->R, of_b->x, time_offset);
}

SADMM_INLINE void pair_manifold_of_hull(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                                        const double *hulls, const struct pair_pose *pose, real limit, uint32_t cache,
                                        struct manifold *m)
{
    switch (SADMM_TYPE_PAIR(shape_a->type, shape_b->type)) {
#define SADMM_MANIFOLD(A, B, call) \
    case SADMM_TYPE_PAIR((int)SADMM_SHAPE_##A, (int)SADMM_SHAPE_##B): call; break;
        SADMM_HULL_TABLE(SADMM_MANIFOLD)
#undef SADMM_MANIFOLD
    default: break;
    }
}

/* Of one subshape of the pair. The rank of a (geometry.h) is not above b's; m->count is 0 when the shapes are apart,
 * and for types that are not listed or meshes (triangle_manifold). hulls: the shape data (hull_data.h); NULL: there are
 * none. */
SADMM_INLINE void pair_manifold(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                                const double *hulls, uint32_t subshape, const struct pair_pose *pose, real limit,
                                uint32_t cache, struct manifold *m)
{
    const vec3 a = v3_load(shape_a->size), b = v3_load(shape_b->size);
    (void)subshape; /* no type has more than one piece, but meshes */
    m->count = 0;
    m->cache = 0;
    if (hulls && shape_b->type == SADMM_SHAPE_HULL) {
        pair_manifold_of_hull(shape_a, shape_b, hulls, pose, limit, cache, m);
        return;
    }
#ifndef SADMM_WITHOUT_SMOOTH
    if (hulls && geometry_is_smooth(shape_b)) {
        SADMM_SMOOTH_ELSEWHERE(shape_a, shape_b, hulls, subshape, pose, limit, cache, m);
        return;
    }
#endif
    switch (SADMM_TYPE_PAIR(shape_a->type, shape_b->type)) {
#define SADMM_MANIFOLD(A, B, call) \
    case SADMM_TYPE_PAIR((int)SADMM_SHAPE_##A, (int)SADMM_SHAPE_##B): call; break;
        SADMM_COLLISION_TABLE(SADMM_MANIFOLD)
#undef SADMM_MANIFOLD
    default: break;
    }
}

/* Of a triangle of the mesh b. */
SADMM_INLINE void triangle_manifold(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                    const double *blocks, uint32_t subshape, const struct pair_pose *pose, real limit,
                                    uint32_t cache, struct manifold *m)
{
#ifndef SADMM_WITHOUT_SMOOTH
    if (geometry_is_smooth(a)) {
        SADMM_SMOOTH_ELSEWHERE(a, b, blocks, subshape, pose, limit, cache, m);
        return;
    }
#endif
    mesh_manifold(a, b, blocks, subshape, pose, limit, cache, m);
}

/* Of the ball of a body (inner_ball.h) and the other shape of a pair, at any distance. The ball is a, or b where a is a
 * plane. */
SADMM_CALLED void ball_manifold(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                                const double *hulls, uint32_t subshape, const struct pair_pose *pose,
                                struct manifold *m)
{
    const real far = SADMM_REAL_MAX / 4, radius = (real)shape_a->size[0];
    const vec3 b = v3_load(shape_b->size);
    if (shape_b->type == SADMM_SHAPE_SPHERE && shape_a->type == SADMM_SHAPE_PLANE)
        manifold_plane_sphere(b.x, pose, far, m);
    else if (shape_b->type == SADMM_SHAPE_SPHERE) manifold_sphere_sphere(radius, b.x, pose, far, m);
    else if (shape_b->type == SADMM_SHAPE_CAPSULE) manifold_sphere_capsule(radius, b.x, b.y, pose, far, m);
    else if (shape_b->type == SADMM_SHAPE_BOX) manifold_sphere_box(radius, b, pose, far, 0, m);
    else if (!hulls) return;
    else if (shape_b->type == SADMM_SHAPE_HULL) hull_manifold(shape_a, shape_b, hulls, pose, far, 0, m);
    else if (geometry_is_mesh(shape_b)) mesh_manifold(shape_a, shape_b, hulls, subshape, pose, far, 0, m);
#ifndef SADMM_WITHOUT_SMOOTH
    else SADMM_SMOOTH_ELSEWHERE(shape_a, shape_b, hulls, subshape, pose, far, 0, m);
#endif
}

/* What is known of two shapes in a step before their manifold is asked for. */
struct pair_start {
    struct pair_pose pose;
    double time_offset, limit;
    bool moves_on; /* the pair is one of those in advance.h */
    struct first_touch touch; /* of one that moves on: pair_start_at; else nothing is known of it */
};

SADMM_INLINE struct pair_start pair_start_of(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double margin,
                                             double gravity, double dt)
{
    const double speed = relative_speed(a->velocity, b->velocity);
    struct pair_start start;
    start.time_offset = proxy_time_offset(a, b, speed, dt);
    start.limit = proxy_limit(a, b, speed, margin, gravity, dt);
    start.moves_on = advance_needed(a, b, start.time_offset, dt);
    start.touch.time_offset = 0;
    start.touch.missed = false;
    start.pose = turned_pose(a, b, start.time_offset);
    return start;
}

/* Of a pair that moves on: where it first touches; what passes by is near, or no contact. */
SADMM_INLINE void pair_start_at(const struct sadmm_proxy *a, const struct sadmm_proxy *b, struct first_touch first,
                                double margin, double gravity, double dt, struct pair_start *start)
{
    struct proxy_place of_b;
    start->touch = first;
    start->time_offset = first.time_offset;
    if (first.missed) start->limit = proxy_near_limit(a, b, margin, gravity, dt);
    start->pose = proxies_pose(a, b, start->time_offset, dt, &of_b);
}

/* Is the pair to have contacts of the balls in its bodies, be it fast or not? m: its manifold without. */
SADMM_INLINE bool pair_sinks(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                             uint32_t subshape, const struct pair_start *start, double gravity, double dt,
                             const struct manifold *m)
{
    return inner_is_asked(a, b, gravity, dt, m) ||
           (hulls && geometry_is_mesh(&b->geometry) && inner_is_behind(a, b, hulls, subshape, &start->pose));
}
SADMM_INLINE bool pair_asks_balls(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                  uint32_t subshape, const struct pair_start *start, double gravity, double dt,
                                  const struct manifold *m)
{
    return start->moves_on || pair_sinks(a, b, hulls, subshape, start, gravity, dt, m);
}

/* The manifold of two shapes in a step: where they are halfway through it (midpoint.h), or where a pair that is faster
 * than that first touches (advance.h). start: pair_start_of the two. */
SADMM_HOST_INLINE void find_manifold(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                     uint32_t subshape, double margin, double gravity, double dt,
                                     const struct pair_start *midpoint, uint32_t cache, struct manifold *m)
{
    struct pair_start start = *midpoint;
    if (start.moves_on)
        pair_start_at(a, b, pair_first_touch(a, b, hulls, subshape, 0, gravity, dt), margin, gravity, dt, &start);
    const struct pair_pose pose = start.pose; /* pair_manifold's own stays in registers */
    pair_manifold(&a->geometry, &b->geometry, hulls, subshape, &pose, (real)start.limit, cache, m);
    m->time_offset = start.time_offset;
    if (start.moves_on || inner_is_asked(a, b, gravity, dt, m))
        inner_balls_add(a, b, hulls, subshape, cache != 0, start.touch, gravity, dt, m);
}

/* ---- meshes: their triangles have one pose in common ------------------------------------------------------------- */

/* When a pair that moves on first touches the triangle, s; HUGE_VAL: not within the step. */
SADMM_INLINE double mesh_first_touch(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *blocks,
                                     uint32_t subshape, double gravity, double dt)
{
    const struct first_touch first = pair_first_touch(a, b, blocks, subshape, 0, gravity, dt);
    return first.missed ? HUGE_VAL : first.time_offset;
}

/* From where the manifolds of all triangles are found: where a pair that moves on touches the first of them. `first`:
 * the least of mesh_first_touch. */
SADMM_INLINE void mesh_start_at(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double first, double margin,
                                double gravity, double dt, struct pair_start *start)
{
    const struct first_touch touch = {first < HUGE_VAL ? first : start->time_offset, !(first < HUGE_VAL)};
    pair_start_at(a, b, touch, margin, gravity, dt, start);
}

#endif

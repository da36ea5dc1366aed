/* Conservative advancement: when does a pair that passes a good part of its thinner shape in a step first touch?
 *
 * Halfway through the step it may be past the contact already, and at its start the nearest features are those that the
 * one leaves behind or flies by: a plane laid between them stops a body that passes, a small one at 500 m/s by metres.
 * So such a pair is moved and turned on from the start of the step, as far as it cannot have touched yet, and again
 * from there, until it touches, or the step ends. What it can have closed is bounded from above, along the direction by
 * which the two are parted: by the velocities of the centres of mass, by what turns, a point's distance from its body's
 * centre of mass being a bound of its lever, and by what accelerations add, for which the whole step has one velocity
 * more. How far apart they are is bounded from below by what lies farthest along that direction, of either.
 */
#ifndef SADMM_COLLISION_MANIFOLD_ADVANCE_H
#define SADMM_COLLISION_MANIFOLD_ADVANCE_H

#include "collision/convex/convex_pair.h"
#include "collision/convex/farthest.h"
#include "collision/shapes/proxy.h"
#include "manifold_box_pair.h"
#include "manifold_box_round.h"
#include "manifold_mesh.h"
#include "manifold_plane.h"
#include "manifold_round.h"

/* Touching: a distance of this share of the thinner shape. */
#define ADVANCE_TOUCH 1e-3
/* Turning takes surfaces through each other unnoticed where they move by more than this share of the thinner shape. */
#define ADVANCE_SPIN  1.0
/* Most moves: a graze that takes more is a contact where it is then. */
enum { ADVANCE_MOVES = 24 };

/* Is it a ball about its body's centre of mass, which no turning moves? */
SADMM_INLINE bool is_own_ball(const struct sadmm_proxy *p)
{
    return p->geometry.type == SADMM_SHAPE_SPHERE && p->arm[0] == 0 && p->arm[1] == 0 && p->arm[2] == 0;
}

/* How far turning moves a shape's surface within the step, m. */
SADMM_INLINE double surface_spin(const struct sadmm_proxy *p) { return is_own_ball(p) ? 0 : p->spin; }

/* Is the pair one of these? time_offset: proxy_time_offset. */
SADMM_INLINE bool advance_needed(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double time_offset,
                                 double dt)
{
    return time_offset < 0.5 * dt ||
           surface_spin(a) + surface_spin(b) > ADVANCE_SPIN * (a->thin < b->thin ? a->thin : b->thin);
}

/* ---- how far two shapes are apart at least ----------------------------------------------------------------------- */

/* The largest distance that an axis parts two boxes by; normal: from 2 to 1, frame of 1. */
SADMM_INLINE real boxes_apart(const struct box_pair *boxes, vec3 *normal)
{
    const vec3 t = v3_from_array(boxes->t);
    real most = -SADMM_REAL_MAX;
    int axis, k;
    *normal = v3(0, 0, 1);
    for (axis = 0; axis < 15; ++axis) {
        const vec3 n = box_axis_direction(boxes, axis, 0);
        const real along = v3_dot(n, t), x[3] = {n.x, n.y, n.z};
        real s = real_abs(along);
        for (k = 0; k < 3; ++k)
            s -= boxes->h1[k] * real_abs(x[k]) +
                 boxes->h2[k] * real_abs(x[0] * boxes->R[0][k] + x[1] * boxes->R[1][k] + x[2] * boxes->R[2][k]);
        if (s <= most) continue;
        most = s;
        *normal = along < 0 ? n : v3_neg(n);
    }
    return most;
}

/* From a ball or a capsule a to a ball, a capsule or a box b: between nearest points, or near that. */
SADMM_INLINE vec3 round_normal(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                               const struct pair_pose *pose)
{
    const vec3 a = v3_load(shape_a->size), b = v3_load(shape_b->size);
    const real far = SADMM_REAL_MAX;
    const bool ball = shape_a->type == SADMM_SHAPE_SPHERE;
    struct manifold m;
    m.count = 0;
    m.normal = v3(0, 0, 1);
    if (shape_b->type == SADMM_SHAPE_SPHERE) manifold_sphere_sphere(a.x, b.x, pose, far, &m);
    else if (shape_b->type == SADMM_SHAPE_CAPSULE && ball) manifold_sphere_capsule(a.x, b.x, b.y, pose, far, &m);
    else if (shape_b->type == SADMM_SHAPE_CAPSULE) manifold_capsule_capsule(a.x, a.y, b.x, b.y, pose, far, 0, &m);
    else if (ball) manifold_sphere_box(a.x, b, pose, far, 0, &m);
    else manifold_capsule_box(a.x, a.y, b, pose, far, 0, &m);
    return m.normal;
}

/* a and b, or the triangle `subshape` of a mesh b, as hulls of pieces. */
SADMM_INLINE void advance_pair_make(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                                    uint32_t subshape, const struct pair_pose *pose, struct mesh_triangle *triangle,
                                    struct convex_pair *pair)
{
    struct mesh_place place;
    struct mesh mesh;
    if (!geometry_is_mesh(b)) {
        convex_pair_make(a, b, hulls, pose, pair);
        return;
    }
    mesh_at(hulls, b->hull, &mesh);
    mesh_triangle_of(&mesh, (int32_t)subshape, triangle);
    convex_of(a, hulls, &pair->a);
    pair->b.form = CONVEX_POLYTOPE;
    pair->b.size = v3(0, 0, 0);
    mesh_triangle_polytope(triangle, &pair->b.p);
    place = mesh_place_of(a, b, triangle, pose);
    pair->R = place.R;
    pair->t = place.t;
    pair->thin = place.thin;
    pair->size = place.size;
    convex_pair_finish(pair);
}

/* By the walk of gjk.h: from where it ends, how far its direction parts the two. */
SADMM_RARE real pieces_apart(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                             uint32_t subshape, const struct pair_pose *pose, vec3 *normal)
{
    struct mesh_triangle triangle;
    struct convex_pair pair;
    struct gjk_simplex simplex;
    vec3 v;
    real length;
    advance_pair_make(a, b, hulls, subshape, pose, &triangle, &pair);
    *normal = v3_neg(pair.t);
    if (!(v3_norm2(*normal) > 0)) *normal = v3(0, 0, 1);
    if (convex_distance(&pair, *normal, SADMM_REAL_MAX, &simplex, &v) != GJK_APART) return 0;
    length = v3_norm(v);
    if (!(length > pair.slack)) return 0;
    *normal = v3_scale(v, -1 / length);
    return convex_separation(&pair, *normal) - pair.slack;
}

/* Of a ball and a triangle, in the frame of the mesh: between nearest points. */
SADMM_INLINE real ball_from_triangle(real radius, vec3 centre, const double *hulls, const struct sadmm_geometry *b,
                                     uint32_t subshape, vec3 *normal)
{
    struct gjk_simplex simplex;
    struct mesh mesh;
    int32_t corner[3], opposite[3];
    vec3 v;
    real length;
    int k;
    mesh_at(hulls, b->hull, &mesh);
    mesh_corners(&mesh, (int32_t)subshape, corner, opposite);
    simplex.count = 3;
    for (k = 0; k < 3; ++k) simplex.p[k].w = v3_sub(mesh_vertex(&mesh, corner[k]), centre);
    v = closest_on_triangle(&simplex);
    length = v3_norm(v);
    *normal = length > 0 ? v3_scale(v, 1 / length) : v3(0, 0, 1);
    return length - radius;
}

/* No less than this are the two shapes apart, along the normal (from a to b, in the frame of b). subshape: of a mesh
 * b. */
SADMM_INLINE real shapes_apart(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                               uint32_t subshape, const struct pair_pose *pose, vec3 *normal)
{
    const vec3 t = r3_vec3(pose->t);
    mat3 R;
    int k;
    if (hulls && a->type == SADMM_SHAPE_SPHERE && geometry_is_mesh(b))
        return ball_from_triangle((real)a->size[0], t, hulls, b, subshape, normal);
    if (hulls && a->type != SADMM_SHAPE_PLANE && b->type > SADMM_SHAPE_BOX)
        return pieces_apart(a, b, hulls, subshape, pose, normal);
    if (a->type == SADMM_SHAPE_BOX) {
        struct box_pair boxes;
        box_pair_make(v3_load(b->size), v3_load(a->size), pose, SADMM_REAL_MAX, &boxes);
        return boxes_apart(&boxes, normal);
    }
    if (a->type == SADMM_SHAPE_PLANE) {
        const real offset = plane_offset(pose, normal);
        return v3_dot(*normal, geometry_farthest(b, hulls, v3_neg(*normal))) + offset;
    }
    *normal = round_normal(a, b, pose);
    for (k = 0; k < 3; ++k) R.r[k] = r3_vec3(pose->R[k]);
    return v3_dot(*normal, v3_sub(v3_sub(geometry_farthest(b, hulls, v3_neg(*normal)), t),
                                  m3_mul(R, geometry_farthest(a, hulls, m3_tmul(R, *normal)))));
}

/* ---- in a step --------------------------------------------------------------------------------------------------- */

/* How far a shape reaches from its body's centre of mass, m. */
SADMM_INLINE double proxy_size(const struct sadmm_proxy *p)
{
    return sqrt(p->arm[0] * p->arm[0] + p->arm[1] * p->arm[1] + p->arm[2] * p->arm[2]) + geometry_radius(&p->geometry);
}

/* How far what of a shape is nearest may be from its body's centre of mass, m, but for what is round about a centre
 * that goes along. */
SADMM_INLINE double proxy_lever(const struct sadmm_proxy *p)
{
    const bool round = p->geometry.type == SADMM_SHAPE_SPHERE || p->geometry.type == SADMM_SHAPE_CAPSULE;
    return proxy_size(p) - (round ? p->geometry.size[0] : 0);
}

/* How fast turning can bring a point at that distance along the normal: r . (n x w). */
SADMM_INLINE double turning_speed(const struct sadmm_proxy *p, const double normal[3], double lever)
{
    const double x = normal[1] * p->angular[2] - normal[2] * p->angular[1],
                 y = normal[2] * p->angular[0] - normal[0] * p->angular[2],
                 z = normal[0] * p->angular[1] - normal[1] * p->angular[0];
    return lever * sqrt(x * x + y * y + z * z);
}

/* Pose of a in b's frame, `time_offset` seconds into the step, and where b is then (pair_manifold.h). */
SADMM_CALLED struct pair_pose proxies_pose(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double time_offset,
                                           double dt, struct proxy_place *of_b);

struct first_touch {
    double time_offset; /* s: when it touches, or up to when it was tested */
    bool missed;        /* nothing touches before the end of the step */
};

/* subshape: of a mesh b. from: when they do not touch yet, s. */
SADMM_INLINE struct first_touch first_touch_of(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                               const double *hulls, uint32_t subshape, double from, double gravity,
                                               double dt)
{
    const double touch = ADVANCE_TOUCH * min_of(a->thin, b->thin),
                 falls = (fall_of(gravity, dt) + a->fall + b->fall) / dt, lever_a = proxy_lever(a),
                 lever_b = proxy_lever(b);
    struct first_touch first = {from, false};
    struct proxy_place of_b;
    double normal[3];
    int move, k;
    for (move = 0; move < ADVANCE_MOVES; ++move) {
        const struct pair_pose pose = proxies_pose(a, b, first.time_offset, dt, &of_b);
        vec3 n;
        /* accelerations add their part to the whole step's velocity, from its start on */
        const double distance =
            (double)shapes_apart(&a->geometry, &b->geometry, hulls, subshape, &pose, &n) - falls * first.time_offset;
        double closing = falls, next;
        if (!(distance > touch)) return first;
        rotate_to_world(of_b.R, n, normal);
        for (k = 0; k < 3; ++k) closing -= normal[k] * (b->velocity[k] - a->velocity[k]);
        closing += turning_speed(a, normal, lever_a) + turning_speed(b, normal, lever_b);
        next = first.time_offset + distance / closing;
        if (!(closing > 0 && next < dt)) { /* nor with velocities that have no difference */
            first.missed = true;
            return first;
        }
        first.time_offset = next;
    }
    return first;
}

SADMM_RARE struct first_touch first_touch_with_hulls(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                                     const double *hulls, uint32_t subshape, double from,
                                                     double gravity, double dt)
{
    return first_touch_of(a, b, hulls, subshape, from, gravity, dt);
}
SADMM_RARE struct first_touch first_touch_plain(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double from,
                                                double gravity, double dt)
{
    return first_touch_of(a, b, NULL, 0, from, gravity, dt);
}

/* hulls: NULL where a compiler is to leave out what needs shape data. */
SADMM_INLINE struct first_touch pair_first_touch(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                                 const double *hulls, uint32_t subshape, double from, double gravity,
                                                 double dt)
{
    return hulls ? first_touch_with_hulls(a, b, hulls, subshape, from, gravity, dt)
                 : first_touch_plain(a, b, from, gravity, dt);
}

#endif

/* A triangle of a mesh (b) against cylinder, cone and ellipsoid (a), in the frame of the mesh. What the surface pushes
 * along, and which points are left out, is as for polytopes (manifold_mesh.h):
 *
 *   1. What is above the triangle's plane by more than the limit is no contact.
 *   2. What lies on the face, or is over it where all around it is flat: the points of what faces along its normal, and
 *      the lowest point of the body where that is over the face.
 *   3. What stands on an edge or a corner by a cap, as it did in the last step.
 *   4. Else the direction along which the two are farthest apart, or least deep in each other. Where the surface does
 *      not push along that, the best direction that it does push along takes over (mesh_by_surface).
 *
 * Points of rims are spread from the mesh's x axis, so that all triangles under a cap have points of the same eight.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_CONVEX_MESH_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_CONVEX_MESH_H

#include "manifold_convex.h"
#include "manifold_mesh.h"

/* Halvings of the angle between the two sides of an edge, in which the best direction is searched for. */
enum { CONVEX_ARC_STEPS = 24 };

struct convex_triangle {
    struct mesh mesh;
    struct mesh_triangle triangle;
    struct convex_pair pair;  /* in the frame of the mesh, moved to the triangle */
    struct convex_axis front; /* the axis of the triangle's face */
};

SADMM_INLINE void convex_triangle_make(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                       const double *blocks, uint32_t subshape, const struct pair_pose *pose,
                                       struct convex_triangle *p)
{
    struct convex_pair *pair = &p->pair;
    struct mesh_place place;
    int k;
    mesh_at(blocks, b->hull, &p->mesh);
    mesh_triangle_of(&p->mesh, (int32_t)subshape, &p->triangle);
    convex_of(a, blocks, &pair->a);
    pair->b.form = CONVEX_POLYTOPE;
    pair->b.size = v3(0, 0, 0);
    mesh_triangle_polytope(&p->triangle, &pair->b.p);
    place = mesh_place_of(a, b, &p->triangle, pose);
    pair->R = place.R;
    pair->t = place.t;
    pair->thin = place.thin;
    pair->size = place.size;
    convex_pair_finish(pair);
    convex_pair_tips(pose, p->triangle.origin, pair);
    pair->spread = v3(1, 0, 0);
    for (k = 0; k < 3; ++k) /* before points are chosen: others are to be in their place */
        pair->left_out |= (uint32_t)mesh_marked(p->triangle.marks, MESH_CORNER_FLAT, k) << k |
                          (uint32_t)mesh_marked(p->triangle.marks, MESH_EDGE_FLAT, k) << (16 + k);
    convex_flat_axis(pair, false, MESH_FRONT, &p->front);
}

/* The points that are this triangle's to give, in the frame of the mesh. cache, separation: of the axis. Where the two
 * are apart all triangles at an edge or a corner have found the same there; while they overlap each speaks for
 * itself. */
SADMM_INLINE void convex_mesh_give(const struct convex_triangle *p, uint32_t cache, real separation, struct manifold *m)
{
    const uint32_t kind = cache & CONVEX_MEMORY_MASK;
    const bool shared = kind == CONVEX_MEMORY_FLAT_A || (kind == CONVEX_MEMORY_DIRECTION && separation >= 0);
    if (shared && separation >= 0 && m->count > 0 && !mesh_owns(&p->triangle, v3_neg(m->normal))) {
        int k, kept = 0;
        for (k = 0; k < m->count; ++k)
            if (m->points[k].feature >> AXIS_KIND_SHIFT != FEATURE_NEAREST) m->points[kept++] = m->points[k];
        m->count = kept;
    }
    mesh_give(&p->triangle, shared ? MESH_AROUND : kind == CONVEX_MEMORY_FLAT_B ? MESH_IN_PLANE : MESH_ALONE,
              4 * p->pair.slack, m);
}

/* Is a cap of the body along the face, so that points of its rim are the lowest? */
SADMM_INLINE bool convex_cap_is_even(const struct convex_triangle *p)
{
    const struct convex *c = &p->pair.a;
    const vec3 d = m3_tmul(p->pair.R, p->front.n);
    return convex_flat(c, d, MANIFOLD_COS_NEAR) >= 0 &&
           c->size.x * real_sqrt(d.x * d.x + d.y * d.y) <= MANIFOLD_FLAT * p->pair.thin;
}

/* The points along the normal of the face, with the lowest one of the body if it is over the face. The smallest
 * separation that there is, largest: there is none. */
SADMM_INLINE real convex_on_front(const struct convex_triangle *p, real limit, struct manifold *m)
{
    const struct convex_axis *front = &p->front;
    bool witness;
    const real least = convex_clip_manifold(&p->pair, front->n, front->separation, limit, m, &witness);
    if (!mesh_is_over(&p->triangle, front->pa, 4 * p->pair.slack)) return least;
    if (!convex_cap_is_even(p))
        hull_add_nearest(p->pair.thin, front->pa, front->pb, polytope_feature(FEATURE_NEAREST, 0, 0), m);
    return front->separation;
}

/* Is x, on the triangle, at a side that is flat? What is nearest there says nothing. */
SADMM_INLINE bool convex_at_flat_side(const struct convex_triangle *p, vec3 x)
{
    const struct mesh_triangle *t = &p->triangle;
    int k;
    for (k = 0; k < 3; ++k) {
        const vec3 from = mesh_corner(t, k), d = v3_sub(mesh_corner(t, mesh_next_corner(k)), from);
        if (mesh_marked(t->marks, MESH_EDGE_FLAT, k) &&
            v3_norm(v3_cross(d, v3_sub(x, from))) <= MANIFOLD_SNAP / 2 * p->pair.thin * v3_norm(d))
            return true;
    }
    return false;
}

/* Is u the face's normal, to within mesh_allows? The distance along that is the same, to its square. */
#define CONVEX_FRONT (16 * MESH_ACROSS)
SADMM_INLINE bool convex_is_front(const struct mesh_triangle *t, vec3 u)
{
    int number;
    if (!(v3_dot(u, t->normal) > 0)) return false;
    return v3_norm2(v3_cross(u, t->normal)) <= CONVEX_FRONT * CONVEX_FRONT ||
           mesh_part_along(t, u, &number) == MESH_FACE;
}

/* Does the body lie on the triangle (mesh_lies_on)? Then its points are m's. */
SADMM_INLINE bool convex_lies_on(const struct convex_triangle *p, bool known, real limit, struct manifold *m)
{
    const struct convex_pair *pair = &p->pair;
    const real separation = p->front.separation;
    if (!known && separation < -MANIFOLD_KEEP_EXTENT * pair->thin) return false;
    return convex_on_front(p, limit, m) - separation <=
           (separation >= 0 ? 2 * pair->slack : MANIFOLD_FLAT * pair->thin);
}

/* The axis n, if what of the body is deepest along it is where the edge is. */
SADMM_INLINE bool convex_edge_axis(const struct convex_triangle *p, const struct mesh_arc *arc, vec3 n,
                                   struct convex_axis *axis)
{
    const struct convex_pair *pair = &p->pair;
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    const struct difference_point point = convex_support(pair, n, &zero);
    vec3 d;
    real share;
    axis->n = n;
    axis->pa = convex_point_a(pair, point.a, n);
    axis->separation = v3_dot(n, v3_sub(arc->from, axis->pa));
    axis->pb = v3_madd(axis->pa, axis->separation, n);
    d = v3_sub(axis->pb, arc->from);
    share = v3_dot(d, arc->along) / v3_norm2(arc->along);
    return share >= 0 && share <= 1 && v3_norm(v3_madd(d, -share, arc->along)) <= MANIFOLD_KEEP_EXTENT * pair->thin;
}

/* The best axis that an edge pushes along: between the normals of both its sides. */
SADMM_INLINE bool convex_arc_axis(const struct convex_triangle *p, const struct mesh_arc *arc, struct convex_axis *axis)
{
    const vec3 along = v3_scale(arc->along, 1 / v3_norm(arc->along)), other = v3_cross(arc->side[1], along);
    vec3 low = p->triangle.normal, high = v3_scale(other, 1 / v3_norm(other));
    int k;
    axis->n = v3_neg(low);
    /* the deepest point of the body is on this side of the edge, or on the other one: the better direction is there */
    for (k = 0; k < CONVEX_ARC_STEPS; ++k) {
        const vec3 sum = v3_add(low, high);
        const real length = v3_norm(sum);
        vec3 u;
        if (!(length > 0)) return false;
        u = v3_scale(sum, 1 / length);
        convex_edge_axis(p, arc, v3_neg(u), axis);
        if (v3_dot(v3_sub(axis->pb, arc->from), v3_cross(along, u)) > 0) low = u;
        else high = u;
    }
    return convex_edge_axis(p, arc, axis->n, axis);
}

/* Of the directions that the surface pushes along the one by which the two are least deep in each other. */
SADMM_INLINE uint32_t convex_best_axis(const struct convex_triangle *p, struct convex_axis *best)
{
    const struct convex_pair *pair = &p->pair;
    uint32_t cache = CONVEX_MEMORY_FLAT_B | (uint32_t)MESH_FRONT << MANIFOLD_DIRECTION_SHIFT;
    struct convex_axis axis;
    struct mesh_arc arc;
    int k;
    *best = p->front;
    for (k = 0; convex_has_flat(&pair->a, (uint32_t)k); ++k) {
        convex_flat_axis(pair, true, k, &axis);
        if (axis.separation <= best->separation || !mesh_allows(&p->mesh, &p->triangle, v3_neg(axis.n))) continue;
        *best = axis;
        cache = CONVEX_MEMORY_FLAT_A | (uint32_t)k << MANIFOLD_DIRECTION_SHIFT;
    }
    for (k = 0; k < 3; ++k)
        if (mesh_arc_of(&p->mesh, &p->triangle, k, &arc) && convex_arc_axis(p, &arc, &axis) &&
            axis.separation > best->separation) {
            *best = axis;
            cache = CONVEX_MEMORY_DIRECTION | manifold_direction_bits(axis.n);
        }
    return cache;
}

/* Has the body come through the triangle by its front? Its middle says so; of a cone that or its centre of mass: with
 * its tip, or its base, one of them is through before most of it is. */
SADMM_INLINE bool convex_came_through(const struct convex_triangle *p, const struct manifold *m)
{
    const struct convex_pair *pair = &p->pair;
    const vec3 down = m3_mul(pair->R, v3(0, 0, -pair->a.size.y / 2));
    return mesh_came_through_front(&p->mesh, &p->triangle, pair->t, m) ||
           (pair->a.form == CONVEX_CONE &&
            mesh_came_through_front(&p->mesh, &p->triangle, v3_add(pair->t, down), m));
}

/* Where the surface does not push along the axis of least depth, or of the nearest points (mesh_by_surface). */
SADMM_RARE void convex_by_surface(const struct convex_triangle *p, const struct convex_axis *nearest, bool kept_front,
                                  real limit, struct manifold *m)
{
    const struct convex_pair *pair = &p->pair;
    struct convex_axis axis = p->front;
    uint32_t cache = CONVEX_MEMORY_FLAT_B | (uint32_t)MESH_FRONT << MANIFOLD_DIRECTION_SHIFT;
    real least;
    bool front;
    if (nearest->separation < 0 && !kept_front) cache = convex_best_axis(p, &axis);
    front = (cache & CONVEX_MEMORY_MASK) == CONVEX_MEMORY_FLAT_B;
    if (front) {
        least = convex_on_front(p, limit, m);
        /* deep, with the lowest point beside this triangle: over another one, which it may not touch */
        if (m->count == 0 && axis.separation < -MESH_SHALLOW * pair->thin && nearest->separation < 0 &&
            v3_dot(axis.n, nearest->n) >= (real)0.5)
            hull_add_nearest(pair->thin, nearest->pa, nearest->pb, polytope_feature(FEATURE_NEAREST, 0, 0), m);
    } else {
        least = axis.separation;
        convex_points(pair, &axis, limit, m);
    }
    m->cache = cache;
    /* much deeper by it than by a way out that has not much to do with it: that is for other triangles to say. They do
     * at once where this is no face */
    if (!front || (!kept_front && v3_dot(axis.n, nearest->n) < (real)0.5)) {
        const real more = front ? MESH_SHALLOW : MANIFOLD_KEEP_EXTENT;
        if (m->count > 0 && least < 4 * real_min(nearest->separation, 0) - more * pair->thin &&
            !(front && convex_came_through(p, m)))
            m->count = 0;
    }
    convex_mesh_give(p, cache, axis.separation, m);
}

SADMM_RARE void convex_mesh_manifold(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                     const double *blocks, uint32_t subshape, const struct pair_pose *pose, real limit,
                                     uint32_t cache, struct manifold *m)
{
    const uint32_t of_front = CONVEX_MEMORY_FLAT_B | (uint32_t)MESH_FRONT << MANIFOLD_DIRECTION_SHIFT;
    struct convex_triangle p;
    struct convex_memory memory;
    struct convex_axis axis;
    uint32_t found;
    bool flat, shallow;
    convex_triangle_make(a, b, blocks, subshape, pose, &p);
    convex_recall(&p.pair, cache, &memory);
    if (!memory.known) memory.side = p.front.n;
    if (p.front.separation > limit + p.pair.slack) return;
    /* of what is flat all around the face alone speaks, if only of what is over it */
    flat = mesh_is_flat(&p.triangle);
    shallow = p.front.separation >= -MESH_SHALLOW * p.pair.thin;
    if (convex_lies_on(&p, flat || cache == of_front, limit, m) || flat) {
        if (flat && m->count > 0 && !shallow && cache != of_front &&
            !convex_came_through(&p, m))
            m->count = 0;
        m->cache = of_front;
        convex_mesh_give(&p, of_front, p.front.separation, m);
        return;
    }
    m->count = 0;
    if (memory.is_flat && memory.of_a) {
        if (memory.axis.separation > limit + p.pair.slack) return;
        if (convex_on_flat(&p.pair, &memory.axis, true, memory.flat, limit, m) &&
            mesh_allows(&p.mesh, &p.triangle, v3_neg(memory.axis.n))) {
            m->cache = cache;
            convex_mesh_give(&p, cache, memory.axis.separation, m);
            return;
        }
        m->count = 0;
    }
    if (!convex_search(&p.pair, memory.side, memory.known, limit, &axis, &found)) {
        m->count = 0;
        return;
    }
    if (!mesh_allows(&p.mesh, &p.triangle, v3_neg(axis.n))) {
        convex_by_surface(&p, &axis, cache == of_front, limit, m);
        return;
    }
    if (convex_is_front(&p.triangle, v3_neg(axis.n))) {
        convex_on_front(&p, limit, m);
        if (!convex_at_flat_side(&p, axis.pb))
            hull_add_nearest(p.pair.thin, axis.pa, axis.pb, polytope_feature(FEATURE_NEAREST, 0, 0), m);
        found = of_front;
    } else {
        convex_points(&p.pair, &axis, limit, m);
    }
    m->cache = found;
    convex_mesh_give(&p, found, axis.separation, m);
}

#endif

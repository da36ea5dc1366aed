/* A triangle of a mesh (b) against sphere, capsule, box and hull (a), in the frame of the mesh. As for two hulls
 * (manifold_hull.h), but that the surface has one side, and that it goes on beyond the triangle (mesh_triangle.h):
 *
 * 1. What is above the triangle's plane by more than the limit is no contact. Nor is, where all around the triangle is
 *      in its plane, what has no vertex over it: of the points there only those are kept.
 *   2. What lies on it: the points of the clipped faces, if the deepest of the body is among them. That is all that
 *      most pairs ask for.
 *   3. Else the nearest points, or the least depth, and the axis to use, as for hulls. Where the surface does not push
 *      along that, its face takes over, if the body is over it; of what is in each other, the best of all axes that it
 *      does push along. But not if it says something else altogether: that a body whose rim hangs over a wall is to
 *      leave through the wall. Then it is a matter for the other triangles.
 *   4. Points on edges and corners that are flat are left out, and of points that several triangles would have along
 *      one and the same normal all but the first triangle's.
 *
 * What is so far below the surface that its deepest point is nearer to another side is still pushed out by the side
 * where it came from, as long as the pair remembers it.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_MESH_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_MESH_H

#include "collision/mesh/mesh_triangle.h"
#include "collision/mesh/mesh_walk.h"
#include "manifold_hull.h"

/* Up to this share of the thinner extent a body is pushed out by the face that it is over, whatever else would be
 * nearer: a body that slides on to the next triangle of a plane is over it by a sliver, at first. */
#define MESH_SHALLOW ((real)0.05)

/* What a triangle and a shape are to each other. */
struct mesh_pair {
    struct mesh mesh;
    struct mesh_triangle triangle;
    struct polytope_pair pair;  /* in the frame of the mesh, moved to the triangle */
    struct polytope_axis front; /* the axis of the triangle's face */
};

/* Where a shape a is, in the frame of the mesh moved to the triangle, and by what the two are measured. */
struct mesh_place {
    mat3 R;
    vec3 t;
    real thin, size;
};

SADMM_INLINE struct mesh_place mesh_place_of(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                             const struct mesh_triangle *triangle, const struct pair_pose *pose)
{
    struct mesh_place place;
    real size2 = 0;
    int k;
    for (k = 0; k < 3; ++k) {
        place.R.r[k] = r3_vec3(pose->R[k]);
        size2 = real_max(size2, v3_norm2(mesh_corner(triangle, k)));
    }
    place.t = v3_sub(r3_vec3(pose->t), triangle->origin);
    place.thin = (real)min_of(geometry_thickness(a), geometry_thickness(b));
    place.size = (real)geometry_radius(a) + real_sqrt(size2) + v3_norm(place.t);
    return place;
}

SADMM_INLINE void mesh_pair_make(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *blocks,
                                 uint32_t subshape, const struct pair_pose *pose, struct mesh_pair *p)
{
    struct polytope_pair *pair = &p->pair;
    struct mesh_place place;
    mesh_at(blocks, b->hull, &p->mesh);
    mesh_triangle_of(&p->mesh, (int32_t)subshape, &p->triangle);
    polytope_of(a, blocks, &pair->a);
    mesh_triangle_polytope(&p->triangle, &pair->b);
    place = mesh_place_of(a, b, &p->triangle, pose);
    pair->R = place.R;
    pair->t = place.t;
    pair->thin = place.thin;
    pair->size = place.size;
    pair->slack = 8 * SADMM_EPSILON * pair->size;
    axis_of_face_b(pair, MESH_FRONT, &p->front);
}

SADMM_INLINE real manifold_least(const struct manifold *m)
{
    real least = SADMM_REAL_MAX;
    int k;
    for (k = 0; k < m->count; ++k) least = real_min(least, m->points[k].separation);
    return least;
}

/* Which other triangles have the normal of a manifold: none that is known, those beside it in its plane, all around. */
enum mesh_share { MESH_ALONE, MESH_IN_PLANE, MESH_AROUND };

/* Is x beyond a flat edge, by more than the tolerance? Then it is over another triangle of the same plane. */
SADMM_INLINE bool mesh_is_beyond_flat(const struct mesh_triangle *t, vec3 x, real tolerance)
{
    int k;
    for (k = 0; k < 3; ++k) {
        const vec3 from = mesh_corner(t, k), d = v3_sub(mesh_corner(t, mesh_next_corner(k)), from);
        if (mesh_marked(t->marks, MESH_EDGE_FLAT, k) &&
            v3_dot(v3_cross(t->normal, d), v3_sub(x, from)) < -tolerance * v3_norm(d))
            return true;
    }
    return false;
}

/* A point that says nothing that others do not. slack: rounding of positions. */
SADMM_INLINE bool mesh_leaves_out(const struct mesh_triangle *t, const struct manifold_point *point,
                                  enum mesh_share share, real slack)
{
    const uint32_t number = point->feature & AXIS_EDGE_MASK;
    switch (point->feature >> AXIS_KIND_SHIFT) {
    case FEATURE_VERTEX_A: return share == MESH_IN_PLANE && mesh_is_beyond_flat(t, point->position, slack);
    case FEATURE_VERTEX_B:
        return mesh_marked(t->marks, MESH_CORNER_FLAT, (int)number - 1) ||
               (share == MESH_IN_PLANE && mesh_marked(t->marks, MESH_CORNER_LATER, (int)number - 1)) ||
               (share == MESH_AROUND && !mesh_marked(t->marks, MESH_CORNER_OWN, (int)number - 1));
    case FEATURE_CROSSING:
        return mesh_marked(t->marks, MESH_EDGE_FLAT, (int)number) ||
               (share == MESH_AROUND && !mesh_marked(t->marks, MESH_EDGE_OWN, (int)number));
    default: return false;
    }
}

/* The points that are this triangle's to give, in the frame of the mesh. */
SADMM_INLINE void mesh_give(const struct mesh_triangle *t, enum mesh_share share, real slack, struct manifold *m)
{
    int k, kept = 0;
    for (k = 0; k < m->count; ++k) {
        struct manifold_point point = m->points[k];
        if (mesh_leaves_out(t, &point, share, slack)) continue;
        point.position = v3_add(point.position, t->origin);
        m->points[kept++] = point;
    }
    m->count = kept;
}

/* kind: of the axis. */
SADMM_INLINE void mesh_finish(const struct mesh_pair *p, int kind, struct manifold *m)
{
    const bool sphere = p->pair.a.vertices == 1;
    if (sphere && m->count > 0 && !mesh_owns(&p->triangle, v3_neg(m->normal))) m->count = 0;
    mesh_give(&p->triangle, kind == AXIS_FACE_A ? MESH_AROUND : kind == AXIS_FACE_B ? MESH_IN_PLANE : MESH_ALONE,
              4 * p->pair.slack, m);
}

/* Does the body lie on the triangle: is the lowest point of it over the face? known: it did in the last step, or else
 * it must not be deep. */
SADMM_INLINE bool mesh_lies_on(const struct polytope_pair *pair, const struct polytope_axis *front, bool known,
                               const struct manifold *m)
{
    const real least = manifold_least(m);
    if (m->count == 0) return false;
    if (front->separation >= 0) return least <= front->separation + 2 * pair->slack;
    return least <= front->separation + MANIFOLD_FLAT * pair->thin &&
           (known || front->separation >= -MANIFOLD_KEEP_EXTENT * pair->thin);
}

/* Is a vertex of the body over the face, or nearly, and within the limit? */
SADMM_INLINE bool mesh_has_vertex_over(const struct mesh_pair *p, real limit)
{
    const struct polytope *a = &p->pair.a;
    const vec3 n = p->triangle.normal;
    const real beside = 2 * MANIFOLD_SNAP * p->pair.thin;
    struct four_planes planes; /* inward of each edge, and down, in a's frame and scale */
    int k;
    for (k = 0; k < 4; ++k) {
        vec3 d = v3_neg(n);
        planes.least[k] = -(limit + p->pair.slack + a->radius);
        if (k < 3) {
            const vec3 from = mesh_corner(&p->triangle, k);
            d = v3_cross(n, v3_sub(mesh_corner(&p->triangle, mesh_next_corner(k)), from));
            planes.least[k] = v3_dot(d, from) - beside * v3_norm(d);
        }
        planes.least[k] -= v3_dot(d, p->pair.t);
        d = m3_tmul(p->pair.R, d);
        planes.n[k] = v3(a->scale.x * d.x, a->scale.y * d.y, a->scale.z * d.z);
    }
    return any_within(a->x, a->y, a->z, hull_stride(a->vertices), &planes);
}

/* Is x over the face, or beside it by no more than the tolerance? */
SADMM_INLINE bool mesh_is_over(const struct mesh_triangle *t, vec3 x, real tolerance)
{
    int k;
    for (k = 0; k < 3; ++k) {
        const vec3 from = mesh_corner(t, k), d = v3_sub(mesh_corner(t, mesh_next_corner(k)), from);
        if (v3_dot(v3_cross(t->normal, d), v3_sub(x, from)) < -tolerance * v3_norm(d)) return false;
    }
    return true;
}

/* The ends of a capsule, or a sphere, that are over the face: steep ones as well, for what stands on one end may fall
 * onto the other within the step. */
SADMM_INLINE void mesh_ends_over(const struct mesh_pair *p, real limit, struct manifold *m)
{
    const struct polytope_pair *pair = &p->pair;
    const vec3 n = p->triangle.normal;
    const real beside = pair->a.vertices == 1 ? 4 * pair->slack : MANIFOLD_SNAP / 2 * pair->thin;
    int k;
    m->normal = p->front.n;
    for (k = 0; k < pair->a.vertices; ++k) {
        const vec3 x = pair_point_a(pair, k);
        const real separation = v3_dot(n, x) - pair->a.radius;
        if (separation > limit + pair->slack || !mesh_is_over(&p->triangle, x, beside)) continue;
        manifold_add(m, v3_madd(x, -pair->a.radius - separation / 2, n), separation,
                     polytope_feature(FEATURE_VERTEX_A, 0, k) + 1);
    }
}

/* The points along the face's normal of what is over it; the lowest corner of a body need not be one of the face that
 * points there. */
SADMM_INLINE void mesh_on_front(const struct mesh_pair *p, real limit, struct manifold *m)
{
    const struct polytope_pair *pair = &p->pair;
    const vec3 n = p->triangle.normal;
    vec3 x;
    int v;
    if (pair->a.faces == 0) {
        mesh_ends_over(p, limit, m);
        return;
    }
    clip_manifold(pair, p->front.n, p->front.separation, limit, m);
    v = polytope_support(&pair->a, v3_neg(m3_tmul(pair->R, n)), 0);
    x = pair_point_a(pair, v);
    if (!mesh_is_over(&p->triangle, x, 4 * pair->slack)) return;
    hull_add_nearest(pair->thin, v3_madd(x, -pair->a.radius, n), v3_madd(x, -v3_dot(n, x), n),
                     polytope_feature(FEATURE_VERTEX_A, 0, v) + 1, m);
}

/* ---- deep in the surface ----------------------------------------------------------------------------------------- */

/* The share of the way `from` - `to` at which it comes into the surface through the triangle; above 1: it does not. */
SADMM_INLINE real mesh_way_in(const struct mesh_triangle *t, vec3 from, vec3 to)
{
    const real high = v3_dot(t->normal, v3_sub(from, t->origin)), low = v3_dot(t->normal, v3_sub(to, t->origin));
    const real share = high / (high - low);
    if (!(high >= 0 && low < 0)) return 2;
    return mesh_is_over(t, v3_sub(v3_madd(from, share, v3_sub(to, from)), t->origin),
                        16 * SADMM_EPSILON * (v3_norm(to) + v3_norm(from)))
               ? share
               : 2;
}

/* Is a body with its middle at `from` at `to`, inside of the surface, because it came through what points along n? The
 * surface is asked where the way there first goes in: of what the body is deep in that is where it came from, whatever
 * triangles are near. */
SADMM_RARE bool mesh_came_through(const struct mesh *m, vec3 from, vec3 to, vec3 n)
{
    struct sadmm_box3 box;
    struct mesh_walk walk;
    struct mesh_triangle t;
    real first = 2, along = -1;
    int32_t triangle;
    int k;
    const real a[3] = {from.x, from.y, from.z}, b[3] = {to.x, to.y, to.z};
    for (k = 0; k < 3; ++k) {
        const double rounding = 16 * (double)SADMM_EPSILON * (fabs((double)a[k]) + fabs((double)b[k]));
        box.lo[k] = min_of((double)a[k], (double)b[k]) - rounding;
        box.hi[k] = (double)a[k] + (double)b[k] - min_of((double)a[k], (double)b[k]) + rounding;
    }
    mesh_walk_begin(m, &box, &walk);
    for (triangle = mesh_walk_next(m, &walk); triangle >= 0; triangle = mesh_walk_next(m, &walk)) {
        real share, same;
        mesh_triangle_of(m, triangle, &t);
        share = mesh_way_in(&t, from, to);
        if (share > 1) continue;
        same = v3_dot(t.normal, n);
        /* through an edge, to within rounding: either side */
        if (share < first - 64 * SADMM_EPSILON) along = same;
        else if (share <= first + 64 * SADMM_EPSILON) along = real_max(along, same);
        else continue;
        first = real_min(first, share);
    }
    return along >= MANIFOLD_COS_SAME;
}

/* Is the deepest point of m, along the face's normal, where the body came through it? In the frame of the triangle. */
SADMM_INLINE bool mesh_came_through_front(const struct mesh *mesh, const struct mesh_triangle *t, vec3 middle,
                                          const struct manifold *m)
{
    int k, deepest = 0;
    vec3 x;
    for (k = 1; k < m->count; ++k)
        if (m->points[k].separation < m->points[deepest].separation) deepest = k;
    x = v3_madd(m->points[deepest].position, -m->points[deepest].separation / 2, m->normal);
    return mesh_came_through(mesh, v3_add(middle, t->origin), v3_add(x, t->origin), t->normal);
}

/* A point inside of the body, as near to its middle as its corners allow. */
SADMM_INLINE vec3 mesh_middle_of(const struct polytope_pair *pair)
{
    vec3 sum = v3(0, 0, 0);
    int k;
    for (k = 0; k < pair->a.vertices; ++k) sum = v3_add(sum, polytope_vertex(&pair->a, k));
    return v3_add(m3_mul(pair->R, v3_scale(sum, (real)1 / (real)pair->a.vertices)), pair->t);
}

/* The last step's axis. False: there is none. */
SADMM_INLINE bool mesh_recall(const struct mesh_pair *p, uint32_t cache, struct polytope_axis *kept)
{
    return axis_recall(&p->pair, cache, kept) && !(kept->kind == AXIS_FACE_B && kept->b == MESH_BACK);
}

/* Where all around is in the triangle's plane the face says all that there is to say. known: it did in the last
 * step. */
SADMM_CALLED void mesh_by_face(const struct mesh_pair *p, bool known, real limit, struct manifold *m)
{
    const bool shallow = p->front.separation >= -MESH_SHALLOW * p->pair.thin;
    mesh_on_front(p, limit, m);
    if (m->count > 0 && !shallow && !known &&
        !mesh_came_through_front(&p->mesh, &p->triangle, mesh_middle_of(&p->pair), m))
        m->count = 0;
    m->cache = axis_memory(&p->front);
    mesh_finish(p, AXIS_FACE_B, m);
}

/* What needs no search: true, and the manifold is there, or there is none. Else as hull_by_memory. */
SADMM_INLINE bool mesh_by_memory(const struct mesh_pair *p, real limit, uint32_t cache, struct polytope_axis *kept,
                                 bool *known, vec3 *start, struct manifold *m)
{
    const struct polytope_pair *pair = &p->pair;
    const struct polytope_axis *face;
    bool of_a;
    *known = mesh_recall(p, cache, kept);
    *start = *known ? kept->n : p->front.n;
    if (p->front.separation > limit + pair->slack || (*known && kept->separation > limit + pair->slack)) return true;
    if (mesh_is_flat(&p->triangle)) {
        if (mesh_has_vertex_over(p, limit)) mesh_by_face(p, *known && kept->kind == AXIS_FACE_B, limit, m);
        return true;
    }
    if (pair->a.faces == 0 || (*known && kept->kind == AXIS_EDGES)) return false;
    of_a = *known && kept->kind == AXIS_FACE_A;
    face = of_a ? kept : &p->front;
    clip_manifold(pair, face->n, face->separation, limit, m);
    if (of_a ? hull_is_witness(pair, kept, m) && mesh_allows(&p->mesh, &p->triangle, v3_neg(kept->n))
             : mesh_lies_on(pair, &p->front, *known, m)) {
        m->cache = of_a ? cache : axis_memory(&p->front);
        mesh_finish(p, face->kind, m);
        return true;
    }
    m->count = 0;
    m->cache = 0;
    return false;
}

/* The directions that an edge pushes along, if it stands out: they go down to both sides of it. */
struct mesh_arc {
    vec3 from, along; /* the edge */
    vec3 side[2];     /* across it, on the surface, to each side */
};

/* False: the edge does not stand out. */
SADMM_INLINE bool mesh_arc_of(const struct mesh *mesh, const struct mesh_triangle *t, int k, struct mesh_arc *arc)
{
    vec3 beyond;
    arc->from = mesh_corner(t, k);
    arc->along = v3_sub(mesh_corner(t, mesh_next_corner(k)), arc->from);
    arc->side[0] = v3_cross(t->normal, arc->along);
    if (t->opposite[k] < 0) { /* the surface ends: as if it went on straight down */
        arc->side[1] = v3_neg(t->normal);
        return true;
    }
    beyond = v3_sub(v3_sub(mesh_vertex(mesh, t->opposite[k]), t->origin), arc->from);
    arc->side[1] = beyond;
    return v3_dot(beyond, t->normal) < 0 && !mesh_marked(t->marks, MESH_EDGE_FLAT, k);
}

/* The axis of an edge of a and one of the triangle, if both push along it. */
SADMM_INLINE bool mesh_edge_axis(const struct polytope_pair *pair, const struct mesh_arc *arc, int k, int e,
                                 struct polytope_axis *axis)
{
    vec3 from, n, m[2];
    const vec3 d = edge_of_a(pair, e, &from);
    real n2;
    int i;
    n = v3_cross(d, arc->along);
    n2 = v3_norm2(n);
    if (!(n2 > (real)1e-8 * v3_norm2(d) * v3_norm2(arc->along))) return false;
    /* into the surface: seen from it, both its sides go down */
    n = v3_scale(n, (v3_dot(n, arc->side[0]) < 0 ? -1 : 1) / real_sqrt(n2));
    if (v3_dot(n, arc->side[0]) < 0 || v3_dot(n, arc->side[1]) < 0) return false;
    if (pair->a.faces > 0) { /* between the normals of its faces */
        for (i = 0; i < 2; ++i) m[i] = m3_mul(pair->R, polytope_normal(&pair->a, pair->a.edge_face[2 * e + i]));
        if (v3_dot(v3_cross(m[0], n), v3_cross(n, m[1])) < 0 || v3_dot(n, v3_add(m[0], m[1])) < 0) return false;
    }
    axis->kind = AXIS_EDGES;
    axis->a = e;
    axis->b = k;
    axis->n = n;
    axis->separation = v3_dot(n, v3_sub(arc->from, from)) - pair_radii(pair);
    return true;
}

/* Of all axes that the surface pushes along the one by which the two are least deep in each other. */
SADMM_INLINE void mesh_best_axis(const struct mesh_pair *p, struct polytope_axis *best)
{
    const struct polytope_pair *pair = &p->pair;
    struct polytope_axis axis;
    struct mesh_arc arc;
    int f, k, e;
    *best = p->front;
    for (f = 0; f < pair->a.faces; ++f) {
        axis_of_face_a(pair, f, &axis);
        if (axis.separation > best->separation && mesh_allows(&p->mesh, &p->triangle, v3_neg(axis.n))) *best = axis;
    }
    for (k = 0; k < 3; ++k) {
        if (!mesh_arc_of(&p->mesh, &p->triangle, k, &arc)) continue;
        for (e = 0; e < pair->a.edges; ++e)
            if (mesh_edge_axis(pair, &arc, k, e, &axis) && axis.separation > best->separation) *best = axis;
    }
}

/* Where the surface does not push along the axis of least depth, or of the nearest points. */
SADMM_RARE void mesh_by_surface(const struct mesh_pair *p, const struct polytope_axis *nearest, bool kept_front,
                                real limit, struct manifold *m)
{
    const struct polytope_pair *pair = &p->pair;
    struct polytope_axis axis = p->front;
    vec3 pa, pb;
    real least;
    if (nearest->separation < -pair_radii(pair) && !kept_front) mesh_best_axis(p, &axis);
    if (axis.kind == AXIS_FACE_B && pair->a.faces == 0) mesh_ends_over(p, limit, m);
    else clip_manifold(pair, axis.n, axis.separation, limit, m);
    m->cache = axis_memory(&axis);
    if (axis.kind == AXIS_EDGES && hull_crossing(pair, &axis, &pa, &pb)) {
        pa = v3_madd(pa, pair->a.radius, axis.n);
        hull_add_nearest(pair->thin, pa, pb, polytope_feature(FEATURE_CROSSING, axis.a, axis.b), m);
    }
    /* much deeper by it than by a way out that has not much to do with it: that is for other triangles to say, unless
     * the body came through here */
    least = manifold_least(m);
    if (m->count > 0 && !kept_front && v3_dot(axis.n, nearest->n) < (real)0.5 &&
        least < 4 * real_min(nearest->separation, 0) - MESH_SHALLOW * pair->thin &&
        !(axis.kind == AXIS_FACE_B && mesh_came_through_front(&p->mesh, &p->triangle, mesh_middle_of(pair), m)))
        m->count = 0;
    mesh_finish(p, axis.kind, m);
}

/* By the nearest points, or those that are least deep, of axis `nearest`. */
SADMM_INLINE void mesh_by_nearest(const struct mesh_pair *p, const struct polytope_axis *kept, bool known,
                                  const struct polytope_axis *nearest, vec3 pa, vec3 pb, uint32_t feature, real limit,
                                  struct manifold *m)
{
    struct polytope_axis axis = *nearest;
    if (p->pair.a.faces > 0) hull_choose(&p->pair, kept, known, &axis);
    else hull_choose_inside(&p->pair, kept, known, &axis);
    hull_keep_edges(&p->pair, nearest, &axis, &pa, &pb, &feature);
    if (!mesh_allows(&p->mesh, &p->triangle, v3_neg(axis.n))) axis = *nearest;
    if (!mesh_allows(&p->mesh, &p->triangle, v3_neg(axis.n))) {
        mesh_by_surface(p, nearest, known && kept->kind == AXIS_FACE_B, limit, m);
        return;
    }
    if (mesh_is_front(&p->triangle, v3_neg(axis.n))) axis = p->front;
    if (p->pair.a.faces > 0 || hull_has_face_along(&p->pair, axis.n))
        clip_manifold(&p->pair, axis.n, axis.separation, limit, m);
    if (m->count == 0 && (axis.kind == AXIS_FACE_A || axis.kind == AXIS_FACE_B)) { /* not over each other */
        axis = *nearest;
        if (!mesh_allows(&p->mesh, &p->triangle, v3_neg(axis.n))) {
            mesh_by_surface(p, nearest, known && kept->kind == AXIS_FACE_B, limit, m);
            return;
        }
    }
    m->normal = axis.n;
    m->cache = axis_memory(&axis);
    hull_add_nearest(p->pair.thin, pa, pb, feature, m);
    mesh_finish(p, axis.kind, m);
}

/* In two parts (hull_manifold_at_once). */
SADMM_RARE bool mesh_manifold_at_once(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                      const double *blocks, uint32_t subshape, const struct pair_pose *pose, real limit,
                                      uint32_t cache, struct gjk_walk *walk, struct manifold *m)
{
    struct mesh_pair p;
    struct polytope_axis kept;
    vec3 start;
    bool known;
    mesh_pair_make(a, b, blocks, subshape, pose, &p);
    if (mesh_by_memory(&p, limit, cache, &kept, &known, &start, m)) return true;
    hull_walk(&p.pair, start, limit, walk);
    return walk->end == GJK_FAR;
}

SADMM_RARE void mesh_manifold_from(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *blocks,
                                   uint32_t subshape, const struct pair_pose *pose, real limit, uint32_t cache,
                                   const struct gjk_walk *walk, struct manifold *m)
{
    struct mesh_pair p;
    struct polytope_axis kept, nearest;
    vec3 pa, pb;
    uint32_t feature;
    bool known;
    mesh_pair_make(a, b, blocks, subshape, pose, &p);
    kept = p.front;
    known = mesh_recall(&p, cache, &kept);
    if (hull_nearest_from(&p.pair, walk, limit, &nearest, &pa, &pb, &feature))
        mesh_by_nearest(&p, &kept, known, &nearest, pa, pb, feature, limit, m);
}

/* The whole. */
SADMM_RARE void mesh_manifold(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *blocks,
                              uint32_t subshape, const struct pair_pose *pose, real limit, uint32_t cache,
                              struct manifold *m)
{
#ifdef __CUDACC__ /* as hull_manifold */
    struct gjk_walk walk;
    if (!mesh_manifold_at_once(a, b, blocks, subshape, pose, limit, cache, &walk, m))
        mesh_manifold_from(a, b, blocks, subshape, pose, limit, cache, &walk, m);
#else
    struct mesh_pair p;
    struct polytope_axis kept, nearest;
    vec3 pa, pb, start;
    uint32_t feature;
    bool known;
    mesh_pair_make(a, b, blocks, subshape, pose, &p);
    kept = p.front; /* until something is known */
    if (mesh_by_memory(&p, limit, cache, &kept, &known, &start, m)) return;
    if (hull_nearest(&p.pair, start, limit, &nearest, &pa, &pb, &feature))
        mesh_by_nearest(&p, &kept, known, &nearest, pa, pb, feature, limit, m);
#endif
}

#endif

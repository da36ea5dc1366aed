/* Contacts at the seams of pieces that are one body together: flush or overlapping shapes of a body, or of the bodies
 * that do not move.
 *
 * Each pair of shapes has its contact by itself, and at a seam that may be one that the union of the pieces does not
 * have: with a side that another piece hides, or along a normal that points into another piece. Whatever slides over
 * flush pieces would be stopped by it, or thrown up. Such a contact is left out, by what the union is there:
 *
 *   A piece pushes along u at a point of its surface if nothing of the others that have the point reaches farther along
 *   u (the normal cone of a union is what its parts' have in common). What hides the point is a neighbour that has it
 *   and reaches farther.
 *
 *   In a concave corner that is so of real contacts as well, of a wall where it meets the floor. There the surface goes
 *   on, with the same normal, to where nothing hides it: so a contact is left out only if all of its points are hidden,
 *   and what is beside each on the surface that faces along u.
 *
 * It takes no velocities and no other contacts: which ones are left out does not depend on an order, and host and
 * device leave out the same.
 */
#ifndef SADMM_COLLISION_FIND_SEAM_H
#define SADMM_COLLISION_FIND_SEAM_H

#include "collision/base/manifold.h"
#include "collision/convex/farthest.h"
#include "collision/mesh/mesh_triangle.h"
#include "collision/mesh/mesh_walk.h"
#include "collision/shapes/proxy.h"

/* Pieces are flush within this share of the thinner shape's extent: as even as what lies on them may lie
 * (MANIFOLD_FLAT). */
#define SEAM_FLUSH  MANIFOLD_FLAT
/* How far beside a point its surface is sampled, as a share of the thinner extent. */
#define SEAM_BESIDE 0.05
/* What faces along a direction: slopes, and turns of the direction by which its surface is searched for. */
#define SEAM_SLOPE  2e-3
#define SEAM_TURN   1e-3
enum { SEAM_DIRECTIONS = 8 };

/* A shape that may have points of another one: its box in that one's frame, rounded outwards, with what is flush.
 * Neighbours of a shape are sorted by lo along its seam_axis. */
struct seam_neighbour {
    float lo[3], hi[3];
    float most; /* hi along that axis, of this one and all before */
    uint32_t slot;
};

/* An axis along which a shape is long. */
SADMM_INLINE int seam_axis(const struct sadmm_geometry *g)
{
    if (g->type != SADMM_SHAPE_BOX && g->type != SADMM_SHAPE_HULL && g->type != SADMM_SHAPE_MESH) return 0;
    return g->size[0] >= g->size[1] && g->size[0] >= g->size[2] ? 0 : g->size[1] >= g->size[2] ? 1 : 2;
}

/* Neighbours by shape slot: [first[slot], first[slot + 1]). first is NULL where nothing has any. */
struct seam_view {
    const uint32_t *first;
    const struct seam_neighbour *neighbours;
};

/* A piece, and what it is asked with. */
struct seam_piece {
    const struct sadmm_proxy *proxies;
    const double *hulls;
    const struct sadmm_proxy *own;
    const struct seam_neighbour *first, *last;
    double flush, beside; /* m */
    int32_t triangle;     /* of a mesh */
    int axis;             /* seam_axis */
};

SADMM_INLINE vec3 seam_to_world(const struct sadmm_proxy *p, vec3 v)
{
    return v3((real)(p->R[0] * (double)v.x + p->R[1] * (double)v.y + p->R[2] * (double)v.z),
              (real)(p->R[3] * (double)v.x + p->R[4] * (double)v.y + p->R[5] * (double)v.z),
              (real)(p->R[6] * (double)v.x + p->R[7] * (double)v.y + p->R[8] * (double)v.z));
}
SADMM_INLINE vec3 seam_to_own(const struct sadmm_proxy *p, vec3 v)
{
    return v3((real)(p->R[0] * (double)v.x + p->R[3] * (double)v.y + p->R[6] * (double)v.z),
              (real)(p->R[1] * (double)v.x + p->R[4] * (double)v.y + p->R[7] * (double)v.z),
              (real)(p->R[2] * (double)v.x + p->R[5] * (double)v.y + p->R[8] * (double)v.z));
}
/* From the origin of p to that of q. */
SADMM_INLINE vec3 seam_between(const struct sadmm_proxy *p, const struct sadmm_proxy *q)
{
    return v3((real)(q->x[0] - p->x[0]), (real)(q->x[1] - p->x[1]), (real)(q->x[2] - p->x[2]));
}

/* ---- what a shape has, and how far it reaches: own frame --------------------------------------------------------- */

/* How far x is outside of the shape, or, negative, inside, as far as that shows whether it has x, to a tolerance. */
SADMM_INLINE real seam_outside(const struct sadmm_geometry *g, const double *hulls, vec3 x)
{
    if (g->type == SADMM_SHAPE_PLANE) return x.z;
    return -geometry_inner_radius(g, hulls, x);
}

/* Has a mesh the point x, on its surface or behind it by no more than `behind`, and does it reach farther along u
 * there? */
SADMM_RARE bool seam_mesh_hides(const double *hulls, uint32_t at, vec3 x, vec3 u, real flush, real behind)
{
    const double beside = (double)behind;
    const struct sadmm_box3 box = {{(double)x.x - beside, (double)x.y - beside, (double)x.z - beside},
                                   {(double)x.x + beside, (double)x.y + beside, (double)x.z + beside}};
    struct mesh mesh;
    struct mesh_walk walk;
    struct mesh_triangle t;
    int32_t triangle;
    int k;
    mesh_at(hulls, at, &mesh);
    mesh_walk_begin(&mesh, &box, &walk);
    for (triangle = mesh_walk_next(&mesh, &walk); triangle >= 0; triangle = mesh_walk_next(&mesh, &walk)) {
        vec3 from;
        bool has;
        mesh_triangle_of(&mesh, triangle, &t);
        from = v3_sub(x, t.origin);
        has = v3_dot(t.normal, from) <= flush && v3_dot(t.normal, from) >= -behind;
        for (k = 0; k < 3; ++k) {
            const vec3 side = v3_sub(mesh_corner(&t, mesh_next_corner(k)), mesh_corner(&t, k));
            has &= v3_dot(v3_cross(t.normal, side), v3_sub(from, mesh_corner(&t, k))) >= -flush * v3_norm(side);
        }
        if (has && v3_dot(u, t.normal) < -(real)SEAM_SLOPE) return true; /* u goes into what is behind the surface */
        for (k = 0; k < 3; ++k)
            if (has && v3_dot(u, v3_sub(mesh_corner(&t, k), from)) > 2 * flush) return true;
    }
    return false;
}

/* Has the shape the point x, and does it reach farther along u? */
SADMM_INLINE bool seam_shape_hides(const struct sadmm_geometry *g, const double *hulls, vec3 x, vec3 u, real flush,
                                   real behind)
{
    if (g->type == SADMM_SHAPE_MESH) return seam_mesh_hides(hulls, g->hull, x, u, flush, behind);
    if (seam_outside(g, hulls, x) > flush) return false;
    if (g->type == SADMM_SHAPE_PLANE)
        return u.z <= 0 || u.x * u.x + u.y * u.y > (real)(SEAM_SLOPE * SEAM_SLOPE) || -x.z > 2 * flush;
    return v3_dot(u, v3_sub(geometry_farthest(g, hulls, u), x)) > 2 * flush;
}

/* ---- a contact --------------------------------------------------------------------------------------------------- */

/* Is x, on the piece's surface, hidden by a neighbour, seen along u? Own frame. */
SADMM_RARE bool seam_hides_point(const struct seam_piece *piece, vec3 x, vec3 u)
{
    const int axis = piece->axis;
    const real along = axis == 0 ? x.x : axis == 1 ? x.y : x.z;
    const struct seam_neighbour *n = piece->first, *end = piece->last;
    while (n < end) { /* the first one that begins beyond x */
        const struct seam_neighbour *middle = n + (end - n) / 2;
        if (middle->lo[axis] <= along) n = middle + 1;
        else end = middle;
    }
    while (n > piece->first && (--n)->most >= along) {
        const struct sadmm_proxy *other = &piece->proxies[n->slot];
        vec3 at;
        if (!(x.x >= n->lo[0] && x.x <= n->hi[0] && x.y >= n->lo[1] && x.y <= n->hi[1] && x.z >= n->lo[2] &&
              x.z <= n->hi[2]))
            continue;
        at = seam_to_own(other, v3_sub(seam_to_world(piece->own, x), seam_between(piece->own, other)));
        if (seam_shape_hides(&other->geometry, piece->hulls, at, seam_to_own(other, seam_to_world(piece->own, u)),
                             (real)piece->flush, (real)(piece->flush + piece->beside)))
            return true;
    }
    return false;
}

/* The point of the piece farthest along u; of a mesh, of its triangle. */
SADMM_INLINE vec3 seam_farthest(const struct seam_piece *piece, vec3 u)
{
    struct mesh mesh;
    struct mesh_triangle t;
    int k, best = 0;
    if (piece->own->geometry.type != SADMM_SHAPE_MESH) return geometry_farthest(&piece->own->geometry, piece->hulls, u);
    mesh_at(piece->hulls, piece->own->geometry.hull, &mesh);
    mesh_triangle_of(&mesh, piece->triangle, &t);
    for (k = 1; k < 3; ++k)
        if (v3_dot(u, mesh_corner(&t, k)) > v3_dot(u, mesh_corner(&t, best))) best = k;
    return v3_add(t.origin, mesh_corner(&t, best));
}

/* Is the piece's surface beside x in the k-th of SEAM_DIRECTIONS hidden as well, as far as it faces along u? */
SADMM_INLINE bool seam_hides_beside(const struct seam_piece *piece, vec3 x, vec3 u, int k)
{
    const real half = (real)0.70710678118654752;
    const real cosine = k % 4 == 2 ? 0 : k % 2 ? half : 1, sine = k % 4 == 0 ? 0 : k % 2 ? half : 1;
    vec3 t1, t2, turned, d;
    real length;
    v3_tangents(u, &t1, &t2);
    turned = v3_madd(v3_madd(u, (real)SEAM_TURN * (k > 2 && k < 6 ? -cosine : cosine), t1),
                     (real)SEAM_TURN * (k > 4 ? -sine : sine), t2);
    d = v3_sub(seam_farthest(piece, v3_scale(turned, 1 / v3_norm(turned))), x);
    length = v3_norm(d);
    if (!(length > (real)(4 * piece->flush)) || v3_dot(d, u) < -(real)SEAM_SLOPE * length) return true;
    return seam_hides_point(piece, v3_madd(x, real_min(1, (real)piece->beside / length), d), u);
}

/* And in all of them? */
SADMM_RARE bool seam_hides_around(const struct seam_piece *piece, vec3 x, vec3 u)
{
    int k;
    for (k = 0; k < SEAM_DIRECTIONS; ++k)
        if (!seam_hides_beside(piece, x, u, k)) return false;
    return true;
}

/* The k-th flat of the piece, in *normal; false: there are no more. *has: is x on it? */
SADMM_INLINE bool seam_flat(const struct seam_piece *piece, int k, vec3 x, vec3 *normal, bool *has)
{
    const struct sadmm_geometry *g = &piece->own->geometry;
    struct mesh mesh;
    struct mesh_triangle t;
    struct convex c;
    real offset;
    if (g->type == SADMM_SHAPE_SPHERE || g->type == SADMM_SHAPE_CAPSULE) return false;
    if (g->type == SADMM_SHAPE_BOX) {
        const real side = k % 2 ? -1 : 1;
        if (k >= 6) return false;
        *normal = v3(k / 2 == 0 ? side : 0, k / 2 == 1 ? side : 0, k / 2 == 2 ? side : 0);
        offset = (real)g->size[k / 2];
    } else if (g->type == SADMM_SHAPE_MESH) {
        if (k >= 1) return false;
        mesh_at(piece->hulls, g->hull, &mesh);
        mesh_triangle_of(&mesh, piece->triangle, &t);
        *normal = t.normal;
        offset = v3_dot(t.normal, t.origin);
    } else {
        convex_of(g, piece->hulls, &c);
        if (!convex_has_flat(&c, (uint32_t)k)) return false;
        *normal = convex_flat_normal(&c, k);
        offset = convex_flat_offset(&c, k) + c.p.radius;
    }
    *has = real_abs(v3_dot(*normal, x) - offset) <= 2 * (real)piece->flush;
    return true;
}

/* Is x in a corner between the piece and what hides it: on a flat, the k-th, that pushes along u as well, which is
 * hidden at x and not beside it? What is deep there is pushed along an edge, which is hidden, by what is not. *there:
 * the piece has a k-th flat. */
SADMM_INLINE bool seam_is_corner_at(const struct seam_piece *piece, int k, vec3 x, vec3 u, bool *there)
{
    vec3 normal;
    bool has;
    *there = seam_flat(piece, k, x, &normal, &has);
    return *there && has && v3_dot(normal, u) > (real)SEAM_SLOPE && seam_hides_point(piece, x, normal) &&
           !seam_hides_around(piece, x, normal);
}
SADMM_RARE bool seam_is_corner(const struct seam_piece *piece, vec3 x, vec3 u)
{
    bool there;
    int k;
    for (k = 0; !seam_is_corner_at(piece, k, x, u, &there); ++k)
        if (!there) return false;
    return true;
}

/* One of the two shapes of a manifold, a where `of_a`, else b; false: it has no neighbours. */
SADMM_INLINE bool seam_piece_of(const struct seam_view *seams, const struct sadmm_proxy *proxies, const double *hulls,
                                uint32_t a, uint32_t b, uint32_t subshape, bool of_a, struct seam_piece *piece)
{
    const double thin = min_of(proxies[a].thin, proxies[b].thin);
    const uint32_t slot = of_a ? a : b;
    piece->first = seams->neighbours + seams->first[slot];
    piece->last = seams->neighbours + seams->first[slot + 1];
    piece->proxies = proxies;
    piece->hulls = hulls;
    piece->own = &proxies[slot];
    piece->flush = SEAM_FLUSH * thin;
    piece->beside = SEAM_BESIDE * thin;
    piece->triangle = (int32_t)subshape;
    piece->axis = seam_axis(&piece->own->geometry);
    return piece->first < piece->last;
}

/* The direction that the piece pushes along, and a point of the manifold on its surface: both in its own frame. normal,
 * position, separation: of the manifold, in the frame of b; time_offset: where its points are. */
SADMM_INLINE vec3 seam_direction(const struct seam_piece *piece, const struct sadmm_proxy *b, vec3 normal, bool of_a)
{
    return seam_to_own(piece->own, seam_to_world(b, v3_scale(normal, of_a ? 1 : -1)));
}
SADMM_INLINE vec3 seam_point(const struct seam_piece *piece, const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                             vec3 normal, double time_offset, vec3 position, real separation, bool of_a)
{
    const vec3 at = v3_madd(position, (of_a ? -1 : 1) * separation / 2, normal);
    vec3 shift = v3(0, 0, 0);
    if (of_a)
        shift = v3((real)offset_displacement(a, b, time_offset, 0), (real)offset_displacement(a, b, time_offset, 1),
                   (real)offset_displacement(a, b, time_offset, 2));
    return seam_to_own(piece->own, v3_add(v3_sub(seam_to_world(b, at), seam_between(b, piece->own)), shift));
}

/* Is the manifold hidden at one of its two shapes? */
SADMM_RARE bool seam_hides_at(const struct seam_piece *piece, const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                              const struct manifold *m, bool of_a)
{
    const vec3 u = seam_direction(piece, b, m->normal, of_a);
    vec3 x[SADMM_MANIFOLD_POINTS];
    int k;
    for (k = 0; k < m->count; ++k) {
        x[k] = seam_point(piece, a, b, m->normal, m->time_offset, m->points[k].position, m->points[k].separation, of_a);
        if (!seam_hides_point(piece, x[k], u)) return false;
    }
    for (k = 0; k < m->count; ++k)
        if (!seam_hides_around(piece, x[k], u) || seam_is_corner(piece, x[k], u)) return false;
    return true;
}

/* Is the manifold of two shapes one that the union of their pieces does not have? It has points. */
SADMM_RARE bool seam_hides(const struct seam_view *seams, const struct sadmm_proxy *proxies, const double *hulls,
                           uint32_t a, uint32_t b, uint32_t subshape, const struct manifold *m)
{
    struct seam_piece piece;
    int of_a;
    for (of_a = 0; of_a < 2; ++of_a)
        if (seam_piece_of(seams, proxies, hulls, a, b, subshape, of_a, &piece) &&
            seam_hides_at(&piece, &proxies[a], &proxies[b], m, of_a))
            return true;
    return false;
}

#endif

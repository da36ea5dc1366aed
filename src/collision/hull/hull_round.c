/* The set within r of a convex polyhedron, but for the polyhedron itself, is
 *
 *   over every face     a prism of height r
 *   along every edge    a wedge of a cylinder, between the normals of its two faces, which include the angle t
 * at every vertex the cone of a ball's sector: directions u in the spherical polygon S whose corners are the normals
 *                       of the faces there
 *
 * (the decomposition behind Steiner's formula; Schneider, "Convex Bodies: The Brunn-Minkowski Theory", 4.2). Integrals
 * of 1, x and x x^T over each are elementary, but for those over S, whose sides are arcs of the angles t about unit
 * axes e, the directions of the edges towards the vertex, counter-clockwise seen from outside:
 *
 *   area of S        2 pi - sum of the angles of the faces at the vertex      (Gauss and Bonnet)
 *   S u              1/2 sum t e                                              (Stokes)
 *   S u u^T          area / 3 + 1/6 sum (e m^T + m e^T),  m: integral of u along the arc
 *
 * The last is Green's formula for u u^T - 1/3, whose Laplacian on the sphere is -6 times itself: what is left is the
 * derivative across the sides, along -e. All sums are linear, so that vertices, edges and faces are gone through
 * once. */
#include "hull_round.h"

static const double pi = 3.14159265358979323846;

/* share x (p q^T + q p^T) / 2 */
static void add_product(struct hull_integrals *sum, double share, vec3 p, vec3 q)
{
    const double a[3] = {p.x, p.y, p.z}, b[3] = {q.x, q.y, q.z};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j) sum->second[i][j] += share / 2 * (a[i] * b[j] + a[j] * b[i]);
}

static void add_first(struct hull_integrals *sum, double share, vec3 p)
{
    sum->first[0] += share * p.x;
    sum->first[1] += share * p.y;
    sum->first[2] += share * p.z;
}

struct hull_round {
    const struct hull_mesh *mesh;
    const double *vertices, *planes;
    double r;
    vec3 origin;
    mat3 axes;
};

static vec3 vertex_at(const struct hull_round *round, int32_t vertex)
{
    return m3_tmul(round->axes, v3_sub(v3_load(round->vertices + 3 * vertex), round->origin));
}

static vec3 normal_of(const struct hull_round *round, int32_t face)
{
    return m3_tmul(round->axes, v3_load(round->planes + 4 * face));
}

/* A triangle of a face, raised along n. */
static void add_prism(const struct hull_round *round, vec3 n, vec3 a, vec3 b, vec3 c, struct hull_integrals *sum)
{
    const double r = round->r, area = v3_dot(n, v3_cross(v3_sub(b, a), v3_sub(c, a))) / 2;
    const vec3 three = v3_add(v3_add(a, b), c);
    sum->volume += r * area;
    add_first(sum, r * area / 3, three);
    add_first(sum, r * r / 2 * area, n);
    add_product(sum, r * area / 12, a, a);
    add_product(sum, r * area / 12, b, b);
    add_product(sum, r * area / 12, c, c);
    add_product(sum, r * area / 12, three, three);
    add_product(sum, r * r * area / 3, three, n);
    add_product(sum, r * r * r / 3 * area, n, n);
}

/* A vertex's part that is proportional to the area of S. */
static void add_sector(const struct hull_round *round, vec3 x, double area, struct hull_integrals *sum)
{
    const double r = round->r, ball = r * r * r / 3 * area;
    sum->volume += ball;
    add_first(sum, ball, x);
    add_product(sum, ball, x, x);
    for (int k = 0; k < 3; ++k) sum->second[k][k] += r * r / 5 * ball;
}

/* Between faces f and g. The edge runs along d, with f to its left, from `from` to `to`: the wedge, and the arc's part
 * of the vertex at either end. */
static void add_edge(const struct hull_round *round, vec3 from, vec3 to, vec3 nf, vec3 ng, struct hull_integrals *sum)
{
    const double r = round->r, length = v3_norm(v3_sub(to, from));
    const vec3 d = v3_scale(v3_sub(to, from), 1 / length), middle = v3_scale(v3_add(from, to), 0.5);
    const vec3 arc = v3_cross(d, v3_sub(nf, ng)); /* the integral of u along the arc */
    const double sine = v3_norm(v3_cross(nf, ng)), angle = atan2(sine, v3_dot(nf, ng));
    const vec3 between = v3_norm2(arc) > 1 ? arc : v3_add(nf, ng), out = v3_scale(between, 1 / v3_norm(between)),
               across = v3_cross(out, d);
    const double area = r * r / 2 * angle, four = length * r * r * r * r / 4;
    sum->volume += length * area;
    add_first(sum, length * area, middle);
    add_first(sum, length * r * r * r / 3, arc);
    add_product(sum, length * area, middle, middle);
    add_product(sum, length * length * length / 12 * area, d, d);
    add_product(sum, 2 * length * r * r * r / 3, middle, arc);
    add_product(sum, four * (angle + sine) / 2, out, out);
    add_product(sum, four * (angle - sine) / 2, across, across);
    for (int end = 0; end < 2; ++end) {
        const vec3 x = end ? to : from, e = end ? d : v3_neg(d);
        const double power4 = r * r * r * r / 4, power5 = r * r * r * r * r / 5;
        add_first(sum, power4 * angle / 2, e);
        add_product(sum, power4 * angle, x, e);
        add_product(sum, power5 / 3, e, arc);
    }
}

void sadmm_hull_add_round(const struct hull_mesh *mesh, const double *vertices, const double *planes, double r,
                          vec3 origin, mat3 axes, struct hull_integrals *sum)
{
    const struct hull_round round = {mesh, vertices, planes, r, origin, axes};
    for (int32_t v = 0; v < mesh->vertex_count; ++v) add_sector(&round, vertex_at(&round, v), 2 * pi, sum);
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        const int32_t first = mesh->face_first[f], end = mesh->face_first[f + 1];
        const vec3 n = normal_of(&round, f), a = vertex_at(&round, mesh->corner[first]);
        vec3 last = vertex_at(&round, mesh->corner[end - 1]), here = a;
        for (int32_t c = first; c < end; ++c) {
            const vec3 next = vertex_at(&round, mesh->corner[c + 1 < end ? c + 1 : first]), back = v3_sub(last, here),
                       on = v3_sub(next, here);
            add_sector(&round, here, -atan2(v3_norm(v3_cross(on, back)), v3_dot(on, back)), sum);
            if (c > first && c + 1 < end) add_prism(&round, n, a, here, next, sum);
            last = here;
            here = next;
        }
    }
    for (int32_t e = 0; e < mesh->edge_count; ++e) {
        const int32_t there = mesh->edge_corner[2 * e], back = mesh->edge_corner[2 * e + 1];
        add_edge(&round, vertex_at(&round, mesh->corner[there]), vertex_at(&round, mesh->corner[back]),
                 normal_of(&round, sadmm_hull_mesh_face_of(mesh, there)),
                 normal_of(&round, sadmm_hull_mesh_face_of(mesh, back)), sum);
    }
}

/* The triangle of a mesh that is nearest to a convex body, or the one that it is deepest in. Boxes that are farther
 * away than what has been found are passed over.
 *
 * A mesh is a surface with one side: what is in a triangle is as deep as the shortest way off it to that side, in front
 * of the triangle or past its sides. Where the shortest way of all leads behind it, that is straight to the front.
 */
#include "closest_mesh.h"

#include "closest_pair.h"
#include "collision/manifold/manifold_convex_mesh.h"
#include "collision/mesh/mesh_walk.h"

struct search {
    const struct sadmm_placed *a;
    const struct closest_pose *pose;
    const struct mesh *mesh;
    struct sadmm_box3 box; /* around a, in the frame of the mesh */
    double limit;          /* nothing farther counts; negative: nor what is less deep */
    bool found;
    struct sadmm_separation *separation;
};

/* ---- one triangle ------------------------------------------------------------------------------------------------ */

static void triangle_pair(const struct sadmm_placed *a, const struct closest_pose *pose, const struct mesh_triangle *t,
                          double *thin, double *size, vec3 *move)
{
    double reach2 = 0;
    for (int k = 0; k < 3; ++k) reach2 = max_of(reach2, v3_norm2(mesh_corner(t, k)));
    *thin = geometry_thickness(&a->geometry);
    *move = v3_sub(pose->t, t->origin);
    *size = geometry_radius(&a->geometry) + sqrt(reach2) + v3_norm(*move);
}

/* Straight to the front of the triangle; point: the body's farthest behind. */
static void to_the_front(vec3 normal, vec3 point, struct sadmm_separation *separation)
{
    const double height = v3_dot(normal, point);
    closest_put(v3_neg(normal), height, point, v3_madd(point, -height, normal), separation);
}

static bool touches_polytope(const struct sadmm_placed *a, const struct closest_pose *pose,
                             const struct mesh_triangle *t, double limit, struct sadmm_separation *separation)
{
    struct polytope_pair pair = {.R = pose->R};
    triangle_pair(a, pose, t, &pair.thin, &pair.size, &pair.t);
    pair.slack = 8 * SADMM_EPSILON * pair.size;
    polytope_of(&a->geometry, a->blocks, &pair.a);
    mesh_triangle_polytope(t, &pair.b);
    if (!closest_of_polytopes(&pair, v3_neg(t->normal), limit, separation)) return false;
    if (separation->distance < 0 && v3_dot(separation->normal, t->normal) > 0) {
        const int v = polytope_support(&pair.a, m3_tmul(pair.R, v3_neg(t->normal)), 0);
        to_the_front(t->normal, v3_madd(pair_point_a(&pair, v), -pair.a.radius, t->normal), separation);
    }
    return true;
}

static bool touches_smooth(const struct sadmm_placed *a, const struct closest_pose *pose, const struct mesh_triangle *t,
                           double limit, struct sadmm_separation *separation)
{
    struct convex_pair pair = {.R = pose->R};
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    triangle_pair(a, pose, t, &pair.thin, &pair.size, &pair.t);
    convex_of(&a->geometry, a->blocks, &pair.a);
    pair.b.form = CONVEX_POLYTOPE;
    mesh_triangle_polytope(t, &pair.b.p);
    convex_pair_finish(&pair);
    if (!closest_of_convex(&pair, v3_neg(t->normal), limit, separation)) return false;
    if (separation->distance < 0 && v3_dot(separation->normal, t->normal) > 0) {
        const vec3 down = v3_neg(t->normal);
        to_the_front(t->normal, convex_point_a(&pair, convex_support(&pair, down, &zero).a, down), separation);
    }
    return true;
}

bool sadmm_closest_on_triangle(const struct sadmm_placed *a, const struct closest_pose *pose,
                               const struct mesh_triangle *triangle, double limit, struct sadmm_separation *separation)
{
    if (!(geometry_is_smooth(&a->geometry) ? touches_smooth : touches_polytope)(a, pose, triangle, limit, separation))
        return false;
    separation->a = v3_add(separation->a, triangle->origin);
    separation->b = v3_add(separation->b, triangle->origin);
    return true;
}

/* ---- all of them ------------------------------------------------------------------------------------------------- */

static double limit_of(const struct search *s) { return s->limit > 0 ? s->limit : 0; }

static void try_triangle(struct search *s, int32_t triangle)
{
    struct mesh_triangle t;
    struct sadmm_separation separation;
    mesh_triangle_of(s->mesh, triangle, &t);
    if (!sadmm_closest_on_triangle(s->a, s->pose, &t, limit_of(s), &separation)) return;
    if (separation.distance > s->limit ||
        (s->found && separation.distance == s->limit && triangle > s->separation->triangle)) return;
    separation.triangle = triangle;
    *s->separation = separation;
    s->limit = separation.distance;
    s->found = true;
}

/* The square of how far two boxes are apart. */
static double box_separation2(const struct sadmm_box3 *box, const double lo[3], const double hi[3])
{
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double apart = max_of(max_of(lo[k] - box->hi[k], box->lo[k] - hi[k]), 0);
        sum += apart * apart;
    }
    return sum;
}

static bool box_is_near(const struct search *s, const double lo[3], const double hi[3])
{
    const double limit = limit_of(s);
    return box_separation2(&s->box, lo, hi) <= limit * limit * (1 + 1e-9);
}

static bool node_is_near(const struct search *s, int32_t node)
{
    const struct mesh_node *n = &s->mesh->node[node];
    const double lo[3] = {(double)n->lo[0], (double)n->lo[1], (double)n->lo[2]},
                 hi[3] = {(double)n->hi[0], (double)n->hi[1], (double)n->hi[2]};
    return box_is_near(s, lo, hi);
}

static bool triangle_is_near(const struct search *s, int32_t triangle)
{
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    int32_t corner[3], opposite[3];
    mesh_corners(s->mesh, triangle, corner, opposite);
    for (int c = 0; c < 3; ++c) {
        double x[3];
        v3_store(mesh_vertex(s->mesh, corner[c]), x);
        for (int k = 0; k < 3; ++k) {
            lo[k] = min_of(lo[k], x[k]);
            hi[k] = max_of(hi[k], x[k]);
        }
    }
    return box_is_near(s, lo, hi);
}

static void try_leaf(struct search *s, int32_t node)
{
    const int32_t first = s->mesh->node[node].first >> 3, last = first + (s->mesh->node[node].first & 7);
    for (int32_t t = first; t < last; ++t)
        if (triangle_is_near(s, t)) try_triangle(s, t);
}

/* Down to a leaf that is near, for a first idea of the distance; then all that may be nearer. */
static void search_tree(struct search *s)
{
    int32_t at = 0;
    while (s->mesh->node[at].first < 0) {
        const int32_t left = at + 1, right = s->mesh->node[left].next;
        double separation[2];
        for (int k = 0; k < 2; ++k) {
            const struct mesh_node *n = &s->mesh->node[k ? right : left];
            const double lo[3] = {(double)n->lo[0], (double)n->lo[1], (double)n->lo[2]},
                         hi[3] = {(double)n->hi[0], (double)n->hi[1], (double)n->hi[2]};
            separation[k] = box_separation2(&s->box, lo, hi);
        }
        at = separation[1] < separation[0] ? right : left;
    }
    try_leaf(s, at);
    const int32_t seen = at;
    for (at = 0; at < s->mesh->nodes;) {
        if (!node_is_near(s, at)) {
            at = s->mesh->node[at].next;
            continue;
        }
        if (s->mesh->node[at].first >= 0 && at != seen) try_leaf(s, at);
        ++at;
    }
}

/* The cells beneath the body first, by its middle; then all within the distance, row by row. */
static void search_heights(struct search *s)
{
    const struct mesh *m = s->mesh;
    const int32_t cells[2] = {m->columns - 1, m->rows - 1};
    const int32_t column = mesh_cell(0.5 * (s->box.lo[0] + s->box.hi[0]), m->spacing[0], cells[0]),
                  row = mesh_cell(0.5 * (s->box.lo[1] + s->box.hi[1]), m->spacing[1], cells[1]),
                  seen = row * cells[0] + column;
    try_triangle(s, 2 * seen);
    try_triangle(s, 2 * seen + 1);
    const double reach = limit_of(s);
    const int32_t first = mesh_cell(s->box.lo[1] - reach - m->spacing[1], m->spacing[1], cells[1]),
                  last = mesh_cell(s->box.hi[1] + reach + m->spacing[1], m->spacing[1], cells[1]);
    for (int32_t r = first; r <= last; ++r) {
        const double now = limit_of(s);
        const int32_t low = mesh_cell(s->box.lo[0] - now - m->spacing[0], m->spacing[0], cells[0]),
                      high = mesh_cell(s->box.hi[0] + now + m->spacing[0], m->spacing[0], cells[0]);
        for (int32_t c = low; c <= high; ++c) {
            const int32_t cell = r * cells[0] + c;
            for (int32_t t = 2 * cell; t < 2 * cell + 2; ++t)
                if (cell != seen && triangle_is_near(s, t)) try_triangle(s, t);
        }
    }
}

void sadmm_closest_box(const struct sadmm_placed *a, const struct closest_pose *pose, struct sadmm_box3 *box)
{
    const double x[3] = {pose->t.x, pose->t.y, pose->t.z};
    double R[9], extent[3];
    for (int k = 0; k < 3; ++k) v3_store(pose->R.r[k], R + 3 * k);
    geometry_extents(&a->geometry, R, extent);
    for (int k = 0; k < 3; ++k) {
        const double e = extent[k] + 16 * DBL_EPSILON * (fabs(x[0]) + fabs(x[1]) + fabs(x[2]) + extent[k]);
        box->lo[k] = x[k] - e;
        box->hi[k] = x[k] + e;
    }
}

bool sadmm_closest_on_mesh(const struct sadmm_placed *a, const struct sadmm_placed *b, const struct closest_pose *pose,
                           double limit, struct sadmm_separation *separation)
{
    struct mesh mesh;
    mesh_at(b->blocks, b->geometry.hull, &mesh);
    struct search s = {.a = a, .pose = pose, .mesh = &mesh, .limit = limit, .separation = separation};
    sadmm_closest_box(a, pose, &s.box);
    if (mesh.kind == MESH_HEIGHTS) search_heights(&s);
    else search_tree(&s);
    return s.found;
}

/* The triangle of a mesh that a shape comes to first. Boxes that it does not meet, or meets later than what has been
 * found, are passed over. A triangle is met from its front. */
#include "cast_mesh.h"

#include "cast_steps.h"
#include "closest_mesh.h"
#include "collision/manifold/manifold_convex_mesh.h"
#include "collision/mesh/mesh_walk.h"

/* All in the frame of the mesh. */
struct search {
    const struct sadmm_cast *cast;
    struct closest_pose pose; /* of the shape, where it begins */
    const struct mesh *mesh;
    struct sadmm_box3 box; /* around it, there */
    double direction[3];
    double limit, size;
    bool found;
    int32_t triangle;
    struct sadmm_separation separation;
};

struct moving_pair {
    const struct search *s;
    const struct mesh_triangle *triangle;
};

static bool apart_after(const void *pair, double way, struct sadmm_separation *separation)
{
    const struct moving_pair *p = (const struct moving_pair *)pair;
    struct closest_pose pose = p->s->pose;
    pose.t = v3_madd(pose.t, way, v3_load(p->s->direction));
    return sadmm_closest_on_triangle(p->s->cast->shape, &pose, p->triangle, HUGE_VAL, separation);
}

static void triangle_box(const struct mesh_triangle *t, struct sadmm_box3 *box)
{
    for (int c = 0; c < 3; ++c) {
        double x[3];
        v3_store(v3_add(mesh_corner(t, c), t->origin), x);
        for (int k = 0; k < 3; ++k) {
            box->lo[k] = c > 0 ? min_of(box->lo[k], x[k]) : x[k];
            box->hi[k] = c > 0 ? max_of(box->hi[k], x[k]) : x[k];
        }
    }
}

static void try_triangle(struct search *s, int32_t triangle)
{
    struct mesh_triangle t;
    struct sadmm_box3 box;
    struct sadmm_separation separation;
    const vec3 direction = v3_load(s->direction);
    double enter, way;
    mesh_triangle_of(s->mesh, triangle, &t);
    const double faces = -v3_dot(direction, t.normal);
    if (!((s->cast->from_behind ? fabs(faces) : faces) > SADMM_CAST_GRAZES)) return;
    triangle_box(&t, &box);
    if (!sadmm_cast_meets(&s->box, s->direction, &box, s->limit, &enter)) return;
    const struct moving_pair pair = {s, &t};
    if (!sadmm_cast_go(apart_after, &pair, direction, s->size, enter, s->limit, &way, &separation)) return;
    if (s->found && way == s->limit && triangle > s->triangle) return;
    s->separation = separation;
    s->triangle = triangle;
    s->limit = way;
    s->found = true;
}

static bool meets_node(const struct search *s, int32_t node, double *enter)
{
    const struct mesh_node *n = &s->mesh->node[node];
    const struct sadmm_box3 box = {{(double)n->lo[0], (double)n->lo[1], (double)n->lo[2]},
                                   {(double)n->hi[0], (double)n->hi[1], (double)n->hi[2]}};
    return sadmm_cast_meets(&s->box, s->direction, &box, s->limit, enter);
}

static void search_tree(struct search *s)
{
    for (int32_t at = 0; at < s->mesh->nodes;) {
        const struct mesh_node *node = &s->mesh->node[at];
        double enter;
        if (!meets_node(s, at, &enter)) {
            at = node->next;
            continue;
        }
        if (node->first >= 0)
            for (int32_t t = node->first >> 3; t < (node->first >> 3) + (node->first & 7); ++t) try_triangle(s, t);
        ++at;
    }
}

/* The ends of its way in which it is in a strip of the mesh, along an axis; false: it never is. */
static bool within(const struct search *s, int axis, double lo, double hi, double *first, double *last)
{
    const double d = s->direction[axis], near = lo - s->box.hi[axis], far = hi - s->box.lo[axis];
    if (fabs(d) < 1e-300) return near <= 0 && far >= 0;
    *first = max_of(*first, (d > 0 ? near : far) / d);
    *last = min_of(*last, (d > 0 ? far : near) / d);
    return *first <= *last;
}

/* Row by row, the cells that it is above or below as it passes the row. */
static void search_heights(struct search *s)
{
    const struct mesh *m = s->mesh;
    const int32_t cells[2] = {m->columns - 1, m->rows - 1};
    const double half[2] = {0.5 * cells[0] * m->spacing[0], 0.5 * cells[1] * m->spacing[1]}, slack = m->spacing[1];
    double first = 0, last = s->limit;
    if (!within(s, 0, -half[0], half[0], &first, &last) || !within(s, 1, -half[1], half[1], &first, &last)) return;
    const double dy = s->direction[1], dx = s->direction[0], ends[2] = {first, isinf(last) ? first : last};
    const int32_t row_a = mesh_cell(s->box.lo[1] + min_of(ends[0] * dy, ends[1] * dy) - slack, m->spacing[1], cells[1]),
                  row_b = mesh_cell(s->box.hi[1] + max_of(ends[0] * dy, ends[1] * dy) + slack, m->spacing[1], cells[1]);
    for (int32_t k = 0; k <= row_b - row_a; ++k) {
        const int32_t r = dy < 0 ? row_b - k : row_a + k; /* nearest first */
        const double low = r * m->spacing[1] - half[1];
        double in = 0, out = min_of(s->limit, last);
        if (!within(s, 1, low - slack, low + 2 * slack, &in, &out)) continue;
        const double way[2] = {dx != 0 ? in * dx : 0, dx != 0 && !isinf(out) ? out * dx : 0},
                     left = s->box.lo[0] + min_of(way[0], way[1]) - m->spacing[0],
                     right = s->box.hi[0] + max_of(way[0], way[1]) + m->spacing[0];
        const int32_t end = mesh_cell(right, m->spacing[0], cells[0]);
        for (int32_t c = mesh_cell(left, m->spacing[0], cells[0]); c <= end; ++c) {
            const int32_t cell = r * cells[0] + c;
            try_triangle(s, 2 * cell);
            try_triangle(s, 2 * cell + 1);
        }
    }
}

bool sadmm_cast_on_mesh(const struct sadmm_cast *cast, const struct sadmm_placed *placed, double limit,
                        struct sadmm_cast_find *find)
{
    struct mesh mesh;
    struct search s = {.cast = cast, .pose = sadmm_closest_pose(cast->shape, placed), .mesh = &mesh, .limit = limit};
    mesh_at(placed->blocks, placed->geometry.hull, &mesh);
    v3_store(placed_own(placed, v3_load(cast->direction)), s.direction);
    s.size = geometry_radius(&cast->shape->geometry) + geometry_radius(&placed->geometry) + v3_norm(s.pose.t);
    sadmm_closest_box(cast->shape, &s.pose, &s.box);
    if (mesh.kind == MESH_HEIGHTS) search_heights(&s);
    else search_tree(&s);
    if (!s.found) return false;
    find->distance = s.limit;
    find->normal = placed_world(placed, s.separation.normal);
    find->point = v3_add(placed_world(placed, s.separation.b), v3_load(placed->x));
    find->triangle = s.triangle;
    find->inside = false;
    return true;
}

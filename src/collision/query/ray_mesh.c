/* Rays through meshes that miss nothing between two triangles: Woop, Benthin, Wald, "Watertight ray/triangle
 * intersection", JCGT 2013. Corners are moved to the ray's origin and sheared so that the ray is the z axis; the sides
 * of a triangle are on one or the other side of the axis by the sign of a difference of two products, which rounding
 * may make 0 but never turn around, and which is the same for both triangles at an edge.
 */
#include "ray_mesh.h"

#include "collision/mesh/mesh_triangle.h"
#include "ray_box.h"

struct shear {
    vec3 origin;
    int x, y, z; /* axes: z the one that the ray goes along most */
    double per_x, per_y, per_z;
};

static double component(vec3 v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

static struct shear shear_of(const struct ray_line *line)
{
    const vec3 d = line->d;
    struct shear s = {.origin = line->x};
    s.z = fabs(d.x) > fabs(d.y) ? 0 : 1;
    if (fabs(d.z) > fabs(component(d, s.z))) s.z = 2;
    s.x = mesh_next_corner(s.z);
    s.y = mesh_next_corner(s.x);
    const double along = component(d, s.z);
    if (along < 0) { /* so that what is counter-clockwise stays that */
        const int swap = s.x;
        s.x = s.y;
        s.y = swap;
    }
    s.per_x = component(d, s.x) / along;
    s.per_y = component(d, s.y) / along;
    s.per_z = 1 / along;
    return s;
}

struct sheared {
    double x, y, z;
};

static struct sheared sheared_of(const struct shear *s, vec3 corner)
{
    const vec3 rel = v3_sub(corner, s->origin);
    const double z = component(rel, s->z);
    return (struct sheared){component(rel, s->x) - s->per_x * z, component(rel, s->y) - s->per_y * z, s->per_z * z};
}

/* What the search has so far. */
struct search {
    const struct mesh *mesh;
    struct shear shear;
    bool from_behind;
    double limit; /* nothing farther counts */
    int32_t triangle;
};

/* enter: where the ray enters the box that it is in (ray_box.h). */
static void try_triangle(struct search *s, int32_t triangle, double enter)
{
    int32_t corner[3], opposite[3];
    mesh_corners(s->mesh, triangle, corner, opposite);
    const struct sheared a = sheared_of(&s->shear, mesh_vertex(s->mesh, corner[0])),
                         b = sheared_of(&s->shear, mesh_vertex(s->mesh, corner[1])),
                         c = sheared_of(&s->shear, mesh_vertex(s->mesh, corner[2]));
    const double u = c.x * b.y - c.y * b.x, v = a.x * c.y - a.y * c.x, w = b.x * a.y - b.y * a.x;
    const bool front = u >= 0 && v >= 0 && w >= 0, back = s->from_behind && u <= 0 && v <= 0 && w <= 0;
    if (!front && !back) return;
    const double all = u + v + w;
    if (all == 0) return; /* seen edge on */
    const double own = (u * a.z + v * b.z + w * c.z) / all, distance = own < enter ? enter : own;
    if (!(own >= 0 && distance <= s->limit)) return;
    if (distance == s->limit && s->triangle >= 0 && triangle > s->triangle) return; /* the lower of two */
    s->limit = distance;
    s->triangle = triangle;
}

static void search_tree(struct search *s, const struct ray_line *line)
{
    const double x[3] = {line->x.x, line->x.y, line->x.z}, d[3] = {line->d.x, line->d.y, line->d.z};
    const struct mesh_node *leaf;
    struct ray_walk walk;
    ray_walk_begin(&walk, s->mesh->node, s->mesh->nodes, x, d);
    while ((leaf = ray_walk_next(&walk, s->limit)))
        for (int32_t k = 0; k < (leaf->first & 7); ++k) try_triangle(s, (leaf->first >> 3) + k, walk.enter);
}

/* The cells [first, last] of `cells` that the coordinates from a to b are in, and one more on each side: which side of
 * a line a number is on may be rounding. False: all is beside the grid. */
static bool cells_of(double a, double b, double spacing, int32_t cells, int32_t *first, int32_t *last)
{
    const double low = (a < b ? a : b) / spacing + 0.5 * cells - 0.01,
                 high = (a < b ? b : a) / spacing + 0.5 * cells + 0.01;
    if (!(high >= 0 && low <= cells)) return false;
    *first = low > 0 ? (int32_t)low : 0;
    *last = high < cells ? (int32_t)high : cells - 1;
    return *first <= *last;
}

/* Column after column along the axis on which the ray crosses more of them: it is in few cells of each. */
static void search_heights(struct search *s, const struct ray_line *line)
{
    const struct mesh *m = s->mesh;
    const double x[3] = {line->x.x, line->x.y, line->x.z}, d[3] = {line->d.x, line->d.y, line->d.z};
    const int32_t cells[2] = {m->columns - 1, m->rows - 1};
    const double half[3] = {0.5 * cells[0] * m->spacing[0], 0.5 * cells[1] * m->spacing[1], m->half_height};
    const int major = fabs(d[0]) * m->spacing[1] >= fabs(d[1]) * m->spacing[0] ? 0 : 1, minor = 1 - major;
    double in = 0, out = HUGE_VAL;
    for (int k = 0; k < 3; ++k) { /* within the box, and a little more */
        const double reach = half[k] * (1 + 1e-9) + 1e-9 * (fabs(x[k]) + half[0] + half[1]);
        if (fabs(d[k]) < 1e-300) {
            if (fabs(x[k]) > reach) return;
            continue;
        }
        const double a = (-reach - x[k]) / d[k], b = (reach - x[k]) / d[k];
        in = fmax(in, fmin(a, b));
        out = fmin(out, fmax(a, b));
    }
    int32_t first, last;
    if (!(in <= out) || !cells_of(x[major] + in * d[major], out < HUGE_VAL ? x[major] + out * d[major] : x[major],
                                  m->spacing[major], cells[major], &first, &last))
        return;
    const bool up = d[major] >= 0;
    for (int32_t step = 0; step <= last - first; ++step) {
        const int32_t c = up ? first + step : last - step;
        /* where the ray is in this column */
        const double begin = ((double)c - 0.5 * cells[major] - 0.01) * m->spacing[major],
                     end = begin + 1.02 * m->spacing[major];
        double enter = in, leave = out;
        if (fabs(d[major]) > 1e-300) {
            enter = fmax(enter, ((up ? begin : end) - x[major]) / d[major]);
            leave = fmin(leave, ((up ? end : begin) - x[major]) / d[major]);
        }
        int32_t low, high;
        if (enter > s->limit) return; /* all that follow are farther */
        if (!(enter <= leave) ||
            !cells_of(x[minor] + enter * d[minor], leave < HUGE_VAL ? x[minor] + leave * d[minor] : x[minor],
                      m->spacing[minor], cells[minor], &low, &high))
            continue;
        for (int32_t r = low; r <= high; ++r) {
            const int32_t cell = major == 0 ? r * cells[0] + c : c * cells[0] + r;
            try_triangle(s, 2 * cell, enter);
            try_triangle(s, 2 * cell + 1, enter);
        }
    }
}

int32_t sadmm_ray_mesh(const double *blocks, uint32_t at, const struct ray_line *line, double limit, bool from_behind,
                       double *distance, vec3 *normal)
{
    struct mesh_triangle found;
    struct mesh mesh;
    mesh_at(blocks, at, &mesh);
    struct search s = {
        .mesh = &mesh, .shear = shear_of(line), .from_behind = from_behind, .limit = limit, .triangle = -1};
    if (mesh.kind == MESH_HEIGHTS) search_heights(&s, line);
    else search_tree(&s, line);
    if (s.triangle < 0) return -1;
    mesh_triangle_of(&mesh, s.triangle, &found);
    *distance = s.limit;
    *normal = found.normal;
    return s.triangle;
}

#include "closest.h"

#include "collision/manifold/collision_table.h"
#include "collision/mesh/mesh_data.h"
#include "closest_mesh.h"
#include "closest_pair.h"

bool sadmm_closest_is_known(int type_a, int type_b)
{
    return pair_is_listed(type_a, type_b) || type_a + type_b == SADMM_SHAPE_PLANE + SADMM_SHAPE_MESH;
}

struct closest_pose sadmm_closest_pose(const struct sadmm_placed *a, const struct sadmm_placed *b)
{
    struct closest_pose pose;
    mat3 columns; /* of a's axes in b's frame */
    for (int k = 0; k < 3; ++k) columns.r[k] = placed_own(b, v3(a->R[k], a->R[3 + k], a->R[6 + k]));
    pose.R.r[0] = v3(columns.r[0].x, columns.r[1].x, columns.r[2].x);
    pose.R.r[1] = v3(columns.r[0].y, columns.r[1].y, columns.r[2].y);
    pose.R.r[2] = v3(columns.r[0].z, columns.r[1].z, columns.r[2].z);
    pose.t = placed_own(b, v3_sub(v3_load(a->x), v3_load(b->x)));
    return pose;
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

/* The vertex of a mesh that is farthest along d. */
static vec3 mesh_support(const double *blocks, uint32_t at, vec3 d)
{
    struct mesh mesh;
    mesh_at(blocks, at, &mesh);
    const int32_t count = mesh.kind == MESH_HEIGHTS ? mesh.columns * mesh.rows : mesh.vertices;
    vec3 best = mesh_vertex(&mesh, 0);
    double most = v3_dot(d, best);
    for (int32_t v = 1; v < count; ++v) {
        const vec3 x = mesh_vertex(&mesh, v);
        const double along = v3_dot(d, x);
        if (along > most) {
            most = along;
            best = x;
        }
    }
    return best;
}

static vec3 support(const struct sadmm_placed *b, vec3 d)
{
    if (b->geometry.type == SADMM_SHAPE_MESH) return mesh_support(b->blocks, b->geometry.hull, d);
    struct convex c;
    convex_of(&b->geometry, b->blocks, &c);
    return v3_madd(convex_point(&c, convex_piece(&c, d, 0), d), c.p.radius, d);
}

static bool plane_closest(const struct sadmm_placed *a, const struct sadmm_placed *b, double limit,
                          struct sadmm_separation *separation)
{
    const vec3 up = v3(a->R[2], a->R[5], a->R[8]), n = placed_own(b, up);
    const double height = v3_dot(up, v3_sub(v3_load(b->x), v3_load(a->x)));
    separation->normal = n;
    separation->b = support(b, v3_neg(n));
    separation->distance = height + v3_dot(n, separation->b);
    separation->a = v3_madd(separation->b, -separation->distance, n);
    separation->triangle = -1;
    return separation->distance <= limit;
}

/* ---- spheres and capsules ---------------------------------------------------------------------------------------- */

static double half_length(const struct sadmm_geometry *g) { return g->type == SADMM_SHAPE_CAPSULE ? g->size[1] : 0; }

static bool rounds_closest(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                           const struct closest_pose *pose, double limit, struct sadmm_separation *separation)
{
    const double ha = half_length(a), hb = half_length(b), ra = a->size[0], rb = b->size[0];
    const vec3 u = v3(pose->R.r[0].z, pose->R.r[1].z, pose->R.r[2].z), w = v3(0, 0, 1);
    double s, t;
    segments_closest(pose->t, u, ha, v3(0, 0, 0), w, hb, &s, &t);
    const vec3 pa = v3_madd(pose->t, s, u), pb = v3_scale(w, t), d = v3_sub(pb, pa);
    /* where the segments meet: across both of them */
    const vec3 across = v3_cross(u, w);
    vec3 n;
    if (ha > 0 && hb > 0 && v3_norm2(across) > 1e-24) {
        n = v3_scale(across, 1 / v3_norm(across));
    } else if (ha > 0) {
        vec3 other;
        v3_tangents(u, &n, &other);
    } else {
        n = hb > 0 ? v3(1, 0, 0) : v3(0, 0, 1);
    }
    const double length = direction_or(d, ra + rb + ha + hb, n, &n);
    closest_put(n, length - ra - rb, v3_madd(pa, ra, n), v3_madd(pb, -rb, n), separation);
    return separation->distance <= limit;
}

/* ---- convex ------------------------------------------------------------------------------------------------------ */

static bool convex_closest(const struct sadmm_placed *a, const struct sadmm_placed *b, const struct closest_pose *pose,
                           double limit, struct sadmm_separation *separation)
{
    const struct sadmm_geometry *ga = &a->geometry, *gb = &b->geometry;
    const double thin = min_of(geometry_thickness(ga), geometry_thickness(gb)),
                 size = geometry_radius(ga) + geometry_radius(gb) + v3_norm(pose->t);
    const vec3 start = v3_neg(pose->t);
    if (!geometry_is_smooth(ga) && !geometry_is_smooth(gb)) {
        struct polytope_pair pair = {
            .R = pose->R, .t = pose->t, .thin = thin, .size = size, .slack = 8 * SADMM_EPSILON * size};
        polytope_of(ga, a->blocks, &pair.a);
        polytope_of(gb, b->blocks, &pair.b);
        return closest_of_polytopes(&pair, start, limit, separation);
    }
    struct convex_pair pair = {.R = pose->R, .t = pose->t, .thin = thin, .size = size};
    convex_of(ga, a->blocks, &pair.a);
    convex_of(gb, b->blocks, &pair.b);
    convex_pair_finish(&pair);
    return closest_of_convex(&pair, start, limit, separation);
}

static bool is_round(int type) { return type == SADMM_SHAPE_SPHERE || type == SADMM_SHAPE_CAPSULE; }

/* In order of rank (geometry.h); in the frame of b. */
static bool closest_in_order(const struct sadmm_placed *a, const struct sadmm_placed *b, double limit,
                             struct sadmm_separation *separation)
{
    if (a->geometry.type == SADMM_SHAPE_PLANE) return plane_closest(a, b, limit, separation);
    const struct closest_pose pose = sadmm_closest_pose(a, b);
    if (b->geometry.type == SADMM_SHAPE_MESH) return sadmm_closest_on_mesh(a, b, &pose, limit, separation);
    if (is_round(b->geometry.type)) return rounds_closest(&a->geometry, &b->geometry, &pose, limit, separation);
    return convex_closest(a, b, &pose, limit, separation);
}

static vec3 point_in_world(const struct sadmm_placed *p, vec3 x) { return v3_add(placed_world(p, x), v3_load(p->x)); }

bool sadmm_closest(const struct sadmm_placed *a, const struct sadmm_placed *b, double limit,
                   struct sadmm_separation *separation)
{
    const bool swapped = geometry_rank(a->geometry.type) > geometry_rank(b->geometry.type);
    const struct sadmm_placed *first = swapped ? b : a, *second = swapped ? a : b;
    if (!closest_in_order(first, second, limit, separation)) return false;
    separation->normal = placed_world(second, separation->normal);
    separation->normal = v3_scale(separation->normal, 1 / v3_norm(separation->normal));
    separation->a = point_in_world(second, separation->a);
    separation->b = point_in_world(second, separation->b);
    if (swapped) {
        const vec3 swap = separation->a;
        separation->a = separation->b;
        separation->b = swap;
        separation->normal = v3_neg(separation->normal);
    }
    return true;
}

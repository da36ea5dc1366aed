/* Debug drawing: the surface of every shape is closed, inside of the shape and close to it; what flags select; joints,
 * couplings, contacts, islands, names. */
#include <pthread.h>
#include <stdint.h>

#include "core/base/memory.h"
#include "core/math/quat.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "world/state/world_state.h"

/* ---- what was drawn ---------------------------------------------------------------------------------------------- */

enum { MOST = 40000 };
struct triangle {
    double corners[3][3], normal[3];
    uint32_t colour;
};
struct line {
    double ends[2][3];
    uint32_t colour;
};
struct drawing {
    struct triangle *triangles;
    struct line *lines;
    double points[256][3], texts_at[64][3];
    char texts[64][64];
    int triangle_count, line_count, point_count, text_count, colour_count;
};

static void on_line(void *user, const double from[3], const double to[3], uint32_t colour)
{
    struct drawing *d = (struct drawing *)user;
    ck_assert_int_lt(d->line_count, MOST);
    struct line *line = &d->lines[d->line_count++];
    memcpy(line->ends[0], from, sizeof line->ends[0]);
    memcpy(line->ends[1], to, sizeof line->ends[1]);
    line->colour = colour;
}

static void on_triangle(void *user, const double a[3], const double b[3], const double c[3], const double normal[3],
                        uint32_t colour)
{
    struct drawing *d = (struct drawing *)user;
    ck_assert_int_lt(d->triangle_count, MOST);
    struct triangle *t = &d->triangles[d->triangle_count++];
    memcpy(t->corners[0], a, sizeof t->corners[0]);
    memcpy(t->corners[1], b, sizeof t->corners[1]);
    memcpy(t->corners[2], c, sizeof t->corners[2]);
    memcpy(t->normal, normal, sizeof t->normal);
    t->colour = colour;
}

static void on_point(void *user, const double position[3], uint32_t colour)
{
    struct drawing *d = (struct drawing *)user;
    (void)colour;
    ck_assert_int_lt(d->point_count, 256);
    memcpy(d->points[d->point_count++], position, sizeof *d->points);
}

static void on_text(void *user, const double position[3], const char *text, uint32_t colour)
{
    struct drawing *d = (struct drawing *)user;
    (void)colour;
    ck_assert_int_lt(d->text_count, 64);
    memcpy(d->texts_at[d->text_count], position, sizeof *d->texts_at);
    snprintf(d->texts[d->text_count++], sizeof *d->texts, "%s", text);
}

static uint32_t on_colour(void *user, sadmm_shape_id shape, uint32_t usual)
{
    (void)usual;
    ++((struct drawing *)user)->colour_count;
    return 0x100 + shape.slot;
}

static struct drawing drawing;

static void begin(void)
{
    drawing = (struct drawing){.triangles = calloc(MOST, sizeof *drawing.triangles),
                               .lines = calloc(MOST, sizeof *drawing.lines)};
}

static void end(void)
{
    free(drawing.triangles);
    free(drawing.lines);
}

static sadmm_draw draw_of(uint32_t flags)
{
    sadmm_draw draw = sadmm_draw_default();
    draw.user = &drawing;
    draw.line = on_line;
    draw.triangle = on_triangle;
    draw.point = on_point;
    draw.text = on_text;
    draw.flags = flags;
    return draw;
}

/* Anew. */
static void draw_world(const sadmm_world *world, const sadmm_draw *draw)
{
    drawing.triangle_count = drawing.line_count = drawing.point_count = drawing.text_count = drawing.colour_count = 0;
    const sadmm_status status = sadmm_world_debug_draw(world, draw);
    ck_assert_msg(status == SADMM_OK, "%s", sadmm_last_message());
}

/* ---- worlds ------------------------------------------------------------------------------------------------------ */

static sadmm_world *empty_world(void)
{
    const sadmm_world_def def = fixed_world_def();
    return create_world(&def);
}

/* At a pose along no axis. */
static sadmm_body_id add_body(sadmm_world *world, sadmm_body_type type, double x)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_body_id id;
    body.type = type;
    body.mass = 2;
    sadmm_sphere_inertia(2, 0.5, body.inertia);
    body.position[0] = x, body.position[1] = -0.4, body.position[2] = 2;
    q_store(q_exp(v3(0.3, -0.7, 0.4)), body.orientation);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    return id;
}

static sadmm_shape_def shape_of(sadmm_shape_type type)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    static const double size[3] = {0.3, 0.45, 0.6};
    static const int sizes[SADMM_SHAPE_TYPE_COUNT] = {0, 1, 2, 3, 0, 0, 2, 2, 3};
    def.type = type;
    for (int k = 0; k < sizes[type]; ++k) def.size[k] = size[k];
    def.position[0] = 0.2, def.position[2] = -0.1;
    q_store(q_exp(v3(-0.5, 0.1, 0.9)), def.orientation);
    return def;
}

/* An irregular solid of five corners, flat sides and a sharp tip; NULL: the library has no hulls. */
static sadmm_hull *make_hull(double convex_radius)
{
    static const double points[][3] = {
        {-0.3, -0.2, 0}, {0.4, -0.2, 0}, {0.4, 0.3, 0.05}, {-0.3, 0.3, 0}, {0.1, 0.05, 0.9}};
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull = NULL;
    def.points = *points;
    def.point_count = sizeof points / sizeof *points;
    def.convex_radius = convex_radius;
    const sadmm_status status = sadmm_hull_create(&def, &hull);
    ck_assert(status == SADMM_OK || status == SADMM_ERROR_UNAVAILABLE);
    return hull;
}

/* A tetrahedron: closed. */
static sadmm_mesh *make_mesh(void)
{
    static const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const int32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    sadmm_mesh_def def = sadmm_mesh_def_default();
    sadmm_mesh *mesh;
    def.vertices = vertices, def.vertex_count = 4;
    def.triangles = triangles, def.triangle_count = 4;
    ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    return mesh;
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

/* By the divergence theorem, about the first corner. */
static double volume(void)
{
    double sum = 0;
    const vec3 o = v3_load(drawing.triangles[0].corners[0]);
    for (int k = 0; k < drawing.triangle_count; ++k) {
        const struct triangle *t = &drawing.triangles[k];
        const vec3 a = v3_sub(v3_load(t->corners[0]), o), b = v3_sub(v3_load(t->corners[1]), o),
                   c = v3_sub(v3_load(t->corners[2]), o);
        sum += v3_dot(a, v3_cross(b, c)) / 6;
    }
    return sum;
}

static int compare_edges(const void *left, const void *right)
{
    const double *a = left, *b = right;
    for (int k = 0; k < 6; ++k)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

/* Every edge is gone along once either way: corners of neighbours are rounded to 1e-9 m, so that they are the same. An
 * edge of no length, between two corners that are one, has no neighbour. */
static void expect_closed(const char *what)
{
    const size_t count = 3 * (size_t)drawing.triangle_count;
    double(*there)[6] = calloc(count, sizeof *there), (*back)[6] = calloc(count, sizeof *back);
    size_t edges = 0;
    for (size_t e = 0; e < count; ++e) {
        const struct triangle *t = &drawing.triangles[e / 3];
        double ends[2][3];
        for (int s = 0; s < 2; ++s)
            for (int k = 0; k < 3; ++k) ends[s][k] = rint(t->corners[(e + (size_t)s) % 3][k] * 1e9) + 0.0;
        if (memcmp(ends[0], ends[1], sizeof ends[0]) == 0) continue;
        memcpy(there[edges], ends[0], sizeof ends[0]), memcpy(there[edges] + 3, ends[1], sizeof ends[1]);
        memcpy(back[edges], ends[1], sizeof ends[1]), memcpy(back[edges] + 3, ends[0], sizeof ends[0]);
        ++edges;
    }
    qsort(there, edges, sizeof *there, compare_edges);
    qsort(back, edges, sizeof *back, compare_edges);
    for (size_t e = 0; e < edges; ++e) {
        ck_assert_msg(compare_edges(there[e], back[e]) == 0, "%s: an edge has no neighbour", what);
        ck_assert_msg(e == 0 || compare_edges(there[e - 1], there[e]) != 0, "%s: an edge is there twice", what);
    }
    free(there);
    free(back);
}

/* Normals are unit, and those of the corners' order: within 0.05, since those of rounds are means over four corners. */
static void expect_normals(const char *what)
{
    for (int k = 0; k < drawing.triangle_count; ++k) {
        const struct triangle *t = &drawing.triangles[k];
        const vec3 a = v3_load(t->corners[0]),
                   n = v3_cross(v3_sub(v3_load(t->corners[1]), a), v3_sub(v3_load(t->corners[2]), a));
        ck_assert_double_eq_tol(v3_norm(v3_load(t->normal)), 1, 1e-12);
        if (v3_norm(n) > 1e-12)
            ck_assert_msg(v3_dot(n, v3_load(t->normal)) / v3_norm(n) > 0.95, "%s: triangle %d looks the other way",
                          what, k);
    }
}

/* Of one shape, in a world of its own, with its surface in `drawing`. */
static sadmm_world *draw_one(const sadmm_shape_def *def, int32_t segments)
{
    const bool fixed = def->type == SADMM_SHAPE_MESH || def->type == SADMM_SHAPE_PLANE;
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, fixed ? SADMM_BODY_STATIC : SADMM_BODY_DYNAMIC, 0.7);
    sadmm_draw draw = draw_of(SADMM_DRAW_SHAPES);
    draw.segments = segments;
    MUST(world, sadmm_world_add_shape(world, body, def, NULL));
    draw_world(world, &draw);
    return world;
}

static void expect_triangles(sadmm_shape_type type, int32_t n)
{
    static const int32_t factors[SADMM_SHAPE_TYPE_COUNT][3] = {
        /* by n^2, n, 1, as draw.h says */
        [SADMM_SHAPE_SPHERE] = {1, -2, 0},  [SADMM_SHAPE_ELLIPSOID] = {1, -2, 0}, [SADMM_SHAPE_CAPSULE] = {1, 0, 0},
        [SADMM_SHAPE_CYLINDER] = {0, 4, 0}, [SADMM_SHAPE_CONE] = {0, 2, 0},       [SADMM_SHAPE_BOX] = {0, 0, 12},
        [SADMM_SHAPE_PLANE] = {0, 0, 2}};
    const int32_t *f = factors[type];
    ck_assert_int_eq(drawing.triangle_count, f[0] * n * n + f[1] * n + f[2]);
}

static const sadmm_shape_type solids[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,
                                          SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
static const int32_t fine[] = {4, 8, 24, 100};
enum { SOLIDS = sizeof solids / sizeof *solids, FINE = sizeof fine / sizeof *fine };

/* The volume is between that of the shape and 30 / n^2 less. */
static void expect_volume(const sadmm_shape_def *def, int32_t n, const char *what)
{
    sadmm_mass mass;
    ck_assert_int_eq(sadmm_shape_mass(def, 1, &mass), SADMM_OK);
    const double drawn = volume(), share = 30. / (n * (double)n);
    ck_assert_msg(drawn <= mass.mass * (1 + 1e-9) && drawn >= mass.mass * (1 - share) * (1 - 1e-9),
                  "%s with %d segments: %.9g m^3 of %.9g", what, n, drawn, mass.mass);
}

START_TEST(solids_are_closed_and_have_their_volume)
{
    for (int k = 0; k < SOLIDS; ++k)
        for (int f = 0; f < FINE; ++f) {
            char what[32];
            const sadmm_shape_def def = shape_of(solids[k]);
            snprintf(what, sizeof what, "shape type %d", solids[k]);
            sadmm_world *world = draw_one(&def, fine[f]);
            expect_triangles(solids[k], fine[f]);
            expect_closed(what);
            if (fine[f] > 8) expect_normals(what);
            expect_volume(&def, fine[f], what);
            sadmm_world_destroy(world);
        }
}
END_TEST

/* A hull, and rounded: every corner of the surface is on the shape, by the distance of a point-like ball. */
START_TEST(hulls_are_drawn_with_their_rounds)
{
    static const double radii[] = {0, 0.02, 0.3};
    for (int r = 0; r < 3; ++r)
        for (int f = 0; f < FINE; ++f) {
            sadmm_shape_def def = shape_of(SADMM_SHAPE_HULL);
            sadmm_hull *hull = make_hull(radii[r]);
            if (!hull) return;
            def.hull = hull;
            sadmm_world *world = draw_one(&def, fine[f]);
            expect_closed("a hull");
            if (fine[f] > 8) expect_normals("a hull");
            expect_volume(&def, fine[f], "a hull");
            sadmm_world_destroy(world);
            sadmm_hull_destroy(hull);
        }
}
END_TEST

/* How far a point is from the shape: < 0 inside. */
static double distance_to(sadmm_world *world, sadmm_shape_id shape, const double at[3])
{
    static const double unit[4] = {1, 0, 0, 0};
    const double tiny = 1e-6;
    sadmm_shape_def ball = sadmm_shape_def_default();
    sadmm_closest_points closest;
    ball.size[0] = tiny;
    MUST(world, sadmm_world_closest_to_shape(world, &ball, at, unit, shape, &closest));
    return closest.distance + tiny;
}

/* Corners lie on the surface. Tolerance: penetration is known to 1e-3 of the thinner one, here of the ball of 1e-6 m,
 * and distances of round shapes apart to 1e-10. */
START_TEST(corners_are_on_the_surface)
{
    for (int k = 0; k <= SOLIDS; ++k) {
        sadmm_shape_def def = shape_of(k < SOLIDS ? solids[k] : SADMM_SHAPE_HULL);
        sadmm_hull *hull = k < SOLIDS ? NULL : make_hull(0.1);
        if (k == SOLIDS && !hull) return;
        def.hull = hull;
        sadmm_world *world = draw_one(&def, 12);
        sadmm_shape_id shape;
        MUST(world, sadmm_world_shape_at(world, 0, &shape));
        for (int t = 0; t < drawing.triangle_count; ++t)
            for (int c = 0; c < 3; ++c) {
                const double off = distance_to(world, shape, drawing.triangles[t].corners[c]);
                ck_assert_msg(fabs(off) < 1e-7, "shape %d: a corner is %g m off", k, off);
            }
        sadmm_world_destroy(world);
        sadmm_hull_destroy(hull);
    }
}
END_TEST

START_TEST(meshes_are_drawn_as_they_are)
{
    sadmm_shape_def def = shape_of(SADMM_SHAPE_MESH);
    sadmm_mesh *mesh = make_mesh();
    def.mesh = mesh;
    sadmm_world *world = draw_one(&def, 24);
    ck_assert_int_eq(drawing.triangle_count, 4);
    expect_closed("a mesh");
    expect_normals("a mesh");
    ck_assert_double_eq_tol(volume(), 1. / 6, 1e-14);
    sadmm_draw draw = draw_of(SADMM_DRAW_EDGES);
    draw_world(world, &draw);
    ck_assert_int_eq(drawing.line_count, 12);
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);

    static const double heights[6] = {0, 0.1, 0.2, 0.1, 0.3, 0};
    sadmm_heightfield_def field = sadmm_heightfield_def_default();
    field.heights = heights;
    field.columns = 3, field.rows = 2;
    field.spacing[0] = field.spacing[1] = 1;
    ck_assert_int_eq(sadmm_heightfield_create(&field, &mesh), SADMM_OK);
    def.mesh = mesh;
    world = draw_one(&def, 24);
    ck_assert_int_eq(drawing.triangle_count, 4);
    expect_normals("a heightfield");
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
}
END_TEST

START_TEST(planes_are_squares)
{
    const sadmm_shape_def def = shape_of(SADMM_SHAPE_PLANE);
    sadmm_world *world = draw_one(&def, 24);
    expect_triangles(SADMM_SHAPE_PLANE, 24);
    expect_normals("a plane");
    for (int t = 0; t < 2; ++t) {
        const struct triangle *of = &drawing.triangles[t];
        const vec3 a = v3_load(of->corners[0]), b = v3_load(of->corners[1]), c = v3_load(of->corners[2]);
        ck_assert_double_eq_tol(v3_norm(v3_cross(v3_sub(b, a), v3_sub(c, a))) / 2, 200, 1e-9); /* half of 20 x 20 */
    }
    sadmm_world_destroy(world);
}
END_TEST

/* ---- bounds and edges -------------------------------------------------------------------------------------------- */

/* All that is drawn is in the box that queries know, and of shapes along the world's axes it reaches its sides. */
START_TEST(bounds_are_those_of_queries)
{
    for (int k = 0; k < SOLIDS; ++k)
        for (int turned = 0; turned < 2; ++turned) {
            sadmm_world *world = empty_world();
            sadmm_body_def body = sadmm_body_def_default();
            sadmm_body_id id;
            sadmm_shape_def def = shape_of(solids[k]);
            double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
            if (!turned) memcpy(def.orientation, (double[4]){1, 0, 0, 0}, sizeof def.orientation);
            body.type = SADMM_BODY_KINEMATIC;
            MUST(world, sadmm_world_add_body(world, &body, &id));
            MUST(world, sadmm_world_add_shape(world, id, &def, NULL));
            const sadmm_draw draw = draw_of(SADMM_DRAW_BOUNDS | SADMM_DRAW_SHAPES);
            draw_world(world, &draw);
            ck_assert_int_eq(drawing.line_count, 12);
            for (int l = 0; l < 12; ++l)
                for (int i = 0; i < 6; ++i) {
                    low[i % 3] = fmin(low[i % 3], drawing.lines[l].ends[i / 3][i % 3]);
                    high[i % 3] = fmax(high[i % 3], drawing.lines[l].ends[i / 3][i % 3]);
                }
            double least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
            for (int i = 0; i < 9 * drawing.triangle_count; ++i) {
                const double x = drawing.triangles[i / 9].corners[i / 3 % 3][i % 3];
                least[i % 3] = fmin(least[i % 3], x);
                most[i % 3] = fmax(most[i % 3], x);
            }
            for (int i = 0; i < 3; ++i) {
                ck_assert_msg(least[i] >= low[i] - 1e-12 && most[i] <= high[i] + 1e-12, "shape type %d", solids[k]);
                /* segments are a multiple of 4: extremes along the axes are corners */
                if (!turned) ck_assert_double_eq_tol(most[i] - least[i], high[i] - low[i], 1e-12);
            }
            sadmm_world_destroy(world);
        }
}
END_TEST

START_TEST(edges_are_counted)
{
    static const int32_t lines[SADMM_SHAPE_TYPE_COUNT] = {
        [SADMM_SHAPE_PLANE] = 22,           [SADMM_SHAPE_SPHERE] = 3 * 24,       [SADMM_SHAPE_ELLIPSOID] = 3 * 24,
        [SADMM_SHAPE_CAPSULE] = 4 * 24 + 4, [SADMM_SHAPE_CYLINDER] = 2 * 24 + 12, [SADMM_SHAPE_CONE] = 24 + 8,
        [SADMM_SHAPE_BOX] = 12};
    const sadmm_draw draw = draw_of(SADMM_DRAW_EDGES);
    for (int type = 0; type < SADMM_SHAPE_TYPE_COUNT; ++type) {
        if (type == SADMM_SHAPE_HULL || type == SADMM_SHAPE_MESH) continue;
        const sadmm_shape_def def = shape_of((sadmm_shape_type)type);
        sadmm_world *world = draw_one(&def, 24);
        draw_world(world, &draw);
        ck_assert_int_eq(drawing.triangle_count, 0);
        ck_assert_msg(drawing.line_count == lines[type], "shape type %d: %d lines", type, drawing.line_count);
        sadmm_world_destroy(world);
    }
    for (int rounded = 0; rounded < 2; ++rounded) {
        sadmm_shape_def def = shape_of(SADMM_SHAPE_HULL);
        sadmm_hull *hull = make_hull(rounded ? 0.1 : 0);
        if (!hull) return;
        def.hull = hull;
        sadmm_world *world = draw_one(&def, 24);
        draw_world(world, &draw);
        ck_assert_int_eq(drawing.line_count, (rounded ? 2 : 1) * sadmm_hull_edge_count(hull));
        sadmm_world_destroy(world);
        sadmm_hull_destroy(hull);
    }
}
END_TEST

/* ---- what else there is ------------------------------------------------------------------------------------------ */

/* Two balls on a floor that touch it and are joined, the first pulled by a hand. */
static sadmm_world *two_balls(sadmm_body_id bodies[2])
{
    sadmm_world *world = empty_world();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def ball = sadmm_shape_def_default(), plane = sadmm_shape_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_coupling_def hand = sadmm_coupling_def_default();
    sadmm_body_id ground;
    ball.size[0] = 0.1;
    body.mass = 1;
    body.position[2] = 0.1;
    sadmm_sphere_inertia(1, 0.1, body.inertia);
    for (int k = 0; k < 2; ++k) {
        body.name = k ? "right" : NULL;
        ball.name = k ? NULL : "skin";
        body.position[0] = k;
        MUST(world, sadmm_world_add_body(world, &body, &bodies[k]));
        MUST(world, sadmm_world_add_shape(world, bodies[k], &ball, NULL));
    }
    body.name = "floor";
    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    memset(body.position, 0, sizeof body.position);
    plane.type = SADMM_SHAPE_PLANE;
    MUST(world, sadmm_world_add_body(world, &body, &ground));
    MUST(world, sadmm_world_add_shape(world, ground, &plane, NULL));
    joint.body_a = bodies[0], joint.body_b = bodies[1];
    joint.position_a[0] = 0.5, joint.position_b[0] = -0.5;
    joint.name = "bar";
    MUST(world, sadmm_world_add_joint(world, &joint, NULL));
    hand.body = bodies[0];
    hand.target_position[2] = 0.5;
    MUST(world, sadmm_world_add_coupling(world, &hand, NULL));
    step_world(world, 2);
    return world;
}

static void expect_counts(const sadmm_world *world, uint32_t flags, int triangles, int lines, int points, int texts)
{
    const sadmm_draw draw = draw_of(flags);
    draw_world(world, &draw);
    ck_assert_msg(drawing.triangle_count == triangles && drawing.line_count == lines &&
                      drawing.point_count == points && drawing.text_count == texts,
                  "flags %u: %d triangles, %d lines, %d points, %d texts", flags, drawing.triangle_count,
                  drawing.line_count, drawing.point_count, drawing.text_count);
}

START_TEST(flags_select)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    ck_assert_int_eq(sadmm_world_contact_count(world), 2);
    expect_counts(world, 0, 0, 0, 0, 0);
    expect_counts(world, SADMM_DRAW_SHAPES, 2 * 24 * 22 + 2, 0, 0, 0);
    expect_counts(world, SADMM_DRAW_EDGES, 0, 2 * 3 * 24 + 22, 0, 0);
    expect_counts(world, SADMM_DRAW_BOUNDS, 0, 24, 0, 0);
    expect_counts(world, SADMM_DRAW_JOINTS, 0, 9, 0, 0);
    expect_counts(world, SADMM_DRAW_COUPLINGS, 0, 7, 0, 0);
    expect_counts(world, SADMM_DRAW_CONTACTS, 0, 2, 2, 0);
    expect_counts(world, SADMM_DRAW_FORCES, 0, 2, 0, 0);
    expect_counts(world, SADMM_DRAW_CENTRES, 0, 6, 2, 0);
    expect_counts(world, SADMM_DRAW_ISLANDS, 0, 1, 0, 0);
    expect_counts(world, SADMM_DRAW_NAMES, 0, 0, 0, 4);
    expect_counts(world, SADMM_DRAW_ALL, 2 * 24 * 22 + 2, 2 * 3 * 24 + 22 + 24 + 9 + 7 + 2 + 2 + 6 + 1, 4, 4);
    /* what touches no more has no contacts; joints stay */
    MUST(world, sadmm_world_remove_body(world, bodies[0]));
    expect_counts(world, SADMM_DRAW_CONTACTS | SADMM_DRAW_FORCES | SADMM_DRAW_ISLANDS | SADMM_DRAW_JOINTS, 0, 0, 0, 0);
    sadmm_world_destroy(world);
}
END_TEST

/* Where they are. Two balls of 1 kg: 9.81 N each, to the tolerance of the solve, 1e-3. */
START_TEST(marks_are_where_they_belong)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    sadmm_draw draw = draw_of(SADMM_DRAW_FORCES);
    double sum = 0;
    draw.force_scale = 0.1;
    draw_world(world, &draw);
    for (int k = 0; k < 2; ++k) {
        const struct line *line = &drawing.lines[k];
        ck_assert_double_eq_tol(line->ends[0][2], 0, 1e-4);
        sum += fabs(line->ends[1][2] - line->ends[0][2]);
    }
    ck_assert_double_eq_tol(sum, 0.1 * 2 * 9.81, 1e-3);
    draw.flags = SADMM_DRAW_ISLANDS;
    draw_world(world, &draw);
    ck_assert_double_eq_tol(fabs(drawing.lines[0].ends[0][0] - drawing.lines[0].ends[1][0]), 1, 1e-4);
    draw.flags = SADMM_DRAW_JOINTS;
    draw_world(world, &draw);
    ck_assert_double_eq_tol(drawing.lines[8].ends[0][0], 0.5, 1e-4); /* from one frame to the other */
    ck_assert_double_eq_tol(drawing.lines[8].ends[1][0], 0.5, 1e-4);
    draw.flags = SADMM_DRAW_COUPLINGS;
    draw_world(world, &draw);
    ck_assert_double_eq_tol(drawing.lines[6].ends[1][2], 0.5, 1e-12); /* to the target */
    draw.flags = SADMM_DRAW_NAMES;
    draw_world(world, &draw);
    ck_assert_str_eq(drawing.texts[0], "skin");
    ck_assert_str_eq(drawing.texts[1], "right");
    ck_assert_double_eq_tol(drawing.texts_at[1][0], 1, 1e-4);
    ck_assert_str_eq(drawing.texts[3], "bar");
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(callbacks_may_be_missing)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    for (int missing = 0; missing < 16; ++missing) {
        sadmm_draw draw = draw_of(SADMM_DRAW_ALL);
        if (missing & 1) draw.line = NULL;
        if (missing & 2) draw.triangle = NULL;
        if (missing & 4) draw.point = NULL;
        if (missing & 8) draw.text = NULL;
        draw_world(world, &draw);
        ck_assert(!drawing.line_count == !!(missing & 1) && !drawing.triangle_count == !!(missing & 2) &&
                  !drawing.point_count == !!(missing & 4) && !drawing.text_count == !!(missing & 8));
    }
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(colours_are_asked_for)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    sadmm_draw draw = draw_of(SADMM_DRAW_SHAPES);
    draw.shape_colour = on_colour;
    draw_world(world, &draw);
    ck_assert_int_eq(drawing.colour_count, 3);
    ck_assert_uint_eq(drawing.triangles[0].colour, 0x101);
    ck_assert_uint_eq(drawing.triangles[drawing.triangle_count - 1].colour, 0x103);
    sadmm_world_destroy(world);
}
END_TEST

/* A box to be drawn, an environment to be drawn. */
START_TEST(what_is_elsewhere_is_left_out)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    sadmm_draw draw = draw_of(SADMM_DRAW_SHAPES | SADMM_DRAW_CENTRES | SADMM_DRAW_CONTACTS);
    draw.highest[0] = 0.5; /* the left one; and the plane, which has no end */
    draw_world(world, &draw);
    ck_assert_int_eq(drawing.triangle_count, 24 * 22 + 2);
    ck_assert_int_eq(drawing.point_count, 2);
    draw = draw_of(SADMM_DRAW_SHAPES | SADMM_DRAW_CENTRES | SADMM_DRAW_CONTACTS | SADMM_DRAW_JOINTS);
    draw.environment = 3; /* the floor collides with all */
    draw_world(world, &draw);
    ck_assert(drawing.triangle_count == 2 && drawing.point_count == 0 && drawing.line_count == 0);
    sadmm_world_destroy(world);
}
END_TEST

static void refused(const sadmm_world *world, const sadmm_draw *draw, const char *message)
{
    ck_assert_int_eq(sadmm_world_debug_draw(world, draw), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(sadmm_last_message(), message) != NULL, "no \"%s\" in \"%s\"", message, sadmm_last_message());
}

START_TEST(what_is_out_of_range_is_refused)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    sadmm_draw draw = draw_of(1u << 10);
    refused(world, &draw, "draw->flags = 1024: must be in [0, 1023]");
    draw = draw_of(SADMM_DRAW_ALL), draw.segments = 6;
    refused(world, &draw, "draw->segments = 6: must be a multiple of 4 in [4, 1024]");
    draw = draw_of(SADMM_DRAW_ALL), draw.segments = 0;
    refused(world, &draw, "draw->segments = 0");
    draw = draw_of(SADMM_DRAW_ALL), draw.force_scale = -1;
    refused(world, &draw, "draw->force_scale = -1");
    draw = draw_of(SADMM_DRAW_ALL), draw.axis_length = NAN;
    refused(world, &draw, "draw->axis_length = nan");
    draw = draw_of(SADMM_DRAW_ALL), draw.plane_size = 0;
    refused(world, &draw, "draw->plane_size = 0");
    draw = draw_of(SADMM_DRAW_ALL), draw.lowest[1] = 1, draw.highest[1] = 0;
    refused(world, &draw, "draw->lowest[1] = 1, draw->highest[1] = 0");
    draw = draw_of(SADMM_DRAW_ALL), draw.environment = -2;
    refused(world, &draw, "draw->environment = -2");
    draw = draw_of(SADMM_DRAW_ALL), draw.struct_size = 0;
    refused(world, &draw, "sadmm_draw_default()");
    ck_assert_int_eq(drawing.line_count + drawing.triangle_count, 0);
    sadmm_world_destroy(world);
}
END_TEST

/* It reads: the world goes on to the same bits, and no memory is asked for. */
START_TEST(nothing_changes)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies), *other = two_balls(bodies);
    const sadmm_draw draw = draw_of(SADMM_DRAW_ALL);
    sadmm_test_fail_allocations_after(0);
    draw_world(world, &draw);
    sadmm_test_fail_allocations_after(-1);
    step_world(world, 10);
    step_world(other, 10);
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Two renderers at once see the same; what they draw is counted, each on its own. */
static void count_triangle(void *user, const double a[3], const double b[3], const double c[3], const double normal[3],
                           uint32_t colour)
{
    (void)a, (void)b, (void)c, (void)normal, (void)colour;
    ++*(int *)user;
}
static void count_line(void *user, const double from[3], const double to[3], uint32_t colour)
{
    (void)from, (void)to, (void)colour;
    ++*(int *)user;
}
struct renderer {
    const sadmm_world *world;
    int count;
    sadmm_status status;
};
static void *render(void *argument)
{
    struct renderer *r = (struct renderer *)argument;
    sadmm_draw draw = sadmm_draw_default();
    draw.user = &r->count;
    draw.triangle = count_triangle;
    draw.line = count_line;
    draw.flags = SADMM_DRAW_ALL;
    for (int k = 0; k < 50 && r->status == SADMM_OK; ++k) r->status = sadmm_world_debug_draw(r->world, &draw);
    return NULL;
}

START_TEST(threads_draw_at_once)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    struct renderer renderers[2] = {{.world = world}, {.world = world}};
    pthread_t threads[2];
    for (int k = 0; k < 2; ++k) ck_assert_int_eq(pthread_create(&threads[k], NULL, render, &renderers[k]), 0);
    for (int k = 0; k < 2; ++k) ck_assert_int_eq(pthread_join(threads[k], NULL), 0);
    for (int k = 0; k < 2; ++k) {
        ck_assert_int_eq(renderers[k].status, SADMM_OK);
        ck_assert_int_eq(renderers[k].count, 50 * (2 * 24 * 22 + 2 + 2 * 3 * 24 + 22 + 24 + 9 + 7 + 2 + 2 + 6 + 1));
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A device has made steps that nobody has read: the flags that say so are set by hand here. */
START_TEST(steps_on_a_device_are_read_first)
{
    sadmm_body_id bodies[2];
    sadmm_world *world = two_balls(bodies);
    const sadmm_draw draw = draw_of(SADMM_DRAW_ALL);
    MUST(world, sadmm_world_prepare_draw(world));
    draw_world(world, &draw);
    world->resident.bodies_behind = true;
    ck_assert_int_eq(sadmm_world_debug_draw(world, &draw), SADMM_ERROR_UNAVAILABLE);
    ck_assert_ptr_nonnull(strstr(sadmm_last_message(), "sadmm_world_prepare_draw"));
    world->resident.bodies_behind = false;
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("draw");
    TCase *cases = tcase_create("draw");
    tcase_add_checked_fixture(cases, begin, end);
    tcase_set_timeout(cases, 60);
    tcase_add_test(cases, solids_are_closed_and_have_their_volume);
    tcase_add_test(cases, hulls_are_drawn_with_their_rounds);
    tcase_add_test(cases, corners_are_on_the_surface);
    tcase_add_test(cases, meshes_are_drawn_as_they_are);
    tcase_add_test(cases, planes_are_squares);
    tcase_add_test(cases, bounds_are_those_of_queries);
    tcase_add_test(cases, edges_are_counted);
    tcase_add_test(cases, flags_select);
    tcase_add_test(cases, marks_are_where_they_belong);
    tcase_add_test(cases, callbacks_may_be_missing);
    tcase_add_test(cases, colours_are_asked_for);
    tcase_add_test(cases, what_is_elsewhere_is_left_out);
    tcase_add_test(cases, what_is_out_of_range_is_refused);
    tcase_add_test(cases, nothing_changes);
    tcase_add_test(cases, threads_draw_at_once);
    tcase_add_test(cases, steps_on_a_device_are_read_first);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}

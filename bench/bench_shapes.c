/* subadmm-bench shapes: what the manifold of a pair costs one core, by types; what a large mesh costs to make. Pairs
 * rest face on face (round shapes: on a face), each turned in its own way, with the memory of the step before (warm)
 * and without (cold); what is timed is the narrow phase of contact finding as steps run it, matching and all. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "collision/collision.h"
#include "collision/convex/polytope.h"
#include "collision/find/find_candidates.h"
#include "collision/find/variants.h"
#include "collision/hull/hull.h"
#include "collision/hull/hull_write.h"
#include "collision/mesh/mesh.h"
#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/math/quat.h"
#include "subadmm/subadmm.h"

static const char command[] = "shapes";

enum { PAIRS = 512, FORMS = 16, REPEATS = 30 };

/* A shape of size 1 m or so, and which way it rests on another. */
struct form {
    const char *name;
    struct sadmm_geometry geometry;
    quat down;    /* turns it so that a face, or its side, is down */
    double below; /* from its origin to there, m */
};

struct bench {
    struct form forms[FORMS];
    int form_count;
    sadmm_hull *hulls[FORMS];
    double *shape_data;
    size_t shape_data_doubles;
    struct sadmm_shape shapes[2 * PAIRS];
    struct sadmm_geometry geometries[2];
    struct sadmm_collision_body bodies[2 * PAIRS];
    struct sadmm_collision_input input;
    struct sadmm_candidates candidates;
    struct sadmm_contact_set before, after;
};

static struct form *add_form(struct bench *b, const char *name, int type, double s0, double s1, double s2)
{
    struct form *form = &b->forms[b->form_count++];
    *form = (struct form){.name = name,
                          .geometry = {.type = type, .subshapes = 1, .size = {s0, s1, s2}},
                          .down = {1, 0, 0, 0}, .below = s2};
    return form;
}

/* The turn that takes the unit vector n to -z. */
static quat turn_down(const double n[3])
{
    const double w = 1 - n[2];
    const double q[4] = {w, -n[1], n[0], 0}, x[4] = {0, 1, 0, 0};
    return w < 1e-12 ? q_load(x) : q_normalize(q_load(q));
}

static sadmm_status append_block(struct bench *b, struct form *form, const double *block, size_t doubles,
                                 struct sadmm_error *error)
{
    if (!SADMM_GROW(b->shape_data, b->shape_data_doubles, b->shape_data_doubles + doubles))
        return sadmm_fail_memory(error, "shape data");
    form->geometry.hull = (uint32_t)b->shape_data_doubles;
    memcpy(b->shape_data + b->shape_data_doubles, block, doubles * sizeof *b->shape_data);
    b->shape_data_doubles += doubles;
    return SADMM_OK;
}

static sadmm_status add_hull(struct bench *b, const char *name, const double *points, size_t count,
                             double convex_radius, struct sadmm_error *error)
{
    const sadmm_hull_def def = {.struct_size = sizeof def,
                                .points = points,
                                .point_count = count,
                                .merge = 1e-6,
                                .convex_radius = convex_radius};
    sadmm_hull *hull;
    sadmm_status status = sadmm_hull_create(&def, &hull);
    if (status != SADMM_OK) return sadmm_fail(error, status, "%s", sadmm_last_message());
    b->hulls[b->form_count] = hull;
    struct form *form = add_form(b, name, SADMM_SHAPE_HULL, hull->half[0], hull->half[1], hull->half[2]);
    TRY(append_block(b, form, hull->block, hull->doubles, error));
    struct polytope p;
    polytope_at(b->shape_data, form->geometry.hull, &p);
    const double n[3] = {p.nx[0], p.ny[0], p.nz[0]};
    form->down = turn_down(n);
    form->below = p.offset[0] + p.radius;
    return SADMM_OK;
}

/* Heights over `side` x `side` points; as triangles where `in_triangles`. The caller destroys it. */
static sadmm_status make_ground(int side, double spacing, double height, bool in_triangles, sadmm_mesh **mesh,
                                struct sadmm_error *error)
{
    const size_t points = (size_t)side * (size_t)side, cells = (size_t)(side - 1) * (size_t)(side - 1);
    double *x = (double *)sadmm_alloc(4 * points, sizeof *x), *z = x ? x + 3 * points : NULL;
    int32_t *corners = (int32_t *)sadmm_alloc(6 * cells, sizeof *corners), *to = corners;
    sadmm_status status = x && corners ? SADMM_OK : sadmm_fail_memory(error, "the ground");
    for (int32_t v = 0; status == SADMM_OK && v < (int32_t)points; ++v) {
        const int column = v % side, row = v / side;
        z[v] = height * sin(0.3 * column) * cos(0.2 * row);
        x[3 * v] = spacing * (column - 0.5 * (side - 1));
        x[3 * v + 1] = spacing * (row - 0.5 * (side - 1));
        x[3 * v + 2] = z[v];
        if (column == side - 1 || row == side - 1) continue;
        const int32_t two[6] = {v, v + 1, v + side + 1, v, v + side + 1, v + side};
        memcpy(to, two, sizeof two);
        to += 6;
    }
    if (status == SADMM_OK) {
        const sadmm_mesh_def triangles = {sizeof triangles, x, points, corners, 2 * cells};
        const sadmm_heightfield_def field = {sizeof field, z, side, side, {spacing, spacing}};
        status = in_triangles ? sadmm_mesh_create(&triangles, mesh) : sadmm_heightfield_create(&field, mesh);
        if (status != SADMM_OK) status = sadmm_fail(error, status, "%s", sadmm_last_message());
    }
    sadmm_free(x);
    sadmm_free(corners);
    return status;
}

/* Flat, in triangles of a quarter of the bodies. */
static sadmm_status add_ground(struct bench *b, const char *name, bool in_triangles, struct sadmm_error *error)
{
    sadmm_mesh *mesh = NULL;
    TRY(make_ground(17, 0.5, 0, in_triangles, &mesh, error));
    struct form *form = add_form(b, name, SADMM_SHAPE_MESH, mesh->half[0], mesh->half[1], mesh->half[2]);
    form->geometry.subshapes = 0;
    form->down = (quat){0, 1, 0, 0}; /* bodies rest on its upper side */
    form->below = 0;
    const sadmm_status status = append_block(b, form, mesh->block, mesh->doubles, error);
    sadmm_mesh_destroy(mesh);
    return status;
}

/* Points spread over a sphere (golden spiral): all are corners. */
static void spread(int count, double *points)
{
    for (int k = 0; k < count; ++k) {
        const double z = 1 - (2 * k + 1.0) / count, r = sqrt(1 - z * z), angle = k * 2.399963229728653;
        const double x[3] = {r * cos(angle), r * sin(angle), z};
        memcpy(points + 3 * k, x, sizeof x);
    }
}

static sadmm_status make_forms(struct bench *b, struct sadmm_error *error)
{
    double cube[24], ball[3 * 128];
    if (!SADMM_GROW(b->shape_data, 0, HULL_FIRST_OWN)) return sadmm_fail_memory(error, "the hulls");
    sadmm_hull_prelude(b->shape_data);
    b->shape_data_doubles = HULL_FIRST_OWN;
    add_form(b, "sphere", SADMM_SHAPE_SPHERE, 1, 0, 0)->below = 1;
    const double z[3] = {1, 0, 0};
    struct form *capsule = add_form(b, "capsule", SADMM_SHAPE_CAPSULE, 0.5, 0.5, 0);
    capsule->down = turn_down(z);
    capsule->below = 0.5;
    add_form(b, "box", SADMM_SHAPE_BOX, 1, 1, 1);
    add_form(b, "cylinder", SADMM_SHAPE_CYLINDER, 1, 1, 1);
    struct form *log = add_form(b, "its side", SADMM_SHAPE_CYLINDER, 1, 1, 0);
    log->down = capsule->down;
    log->below = 1;
    add_form(b, "cone", SADMM_SHAPE_CONE, 1, 1, 1);
    add_form(b, "ellipsoid", SADMM_SHAPE_ELLIPSOID, 1, 0.8, 0.6)->below = 0.6;
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) cube[3 * v + k] = v >> k & 1 ? 1 : -1;
    sadmm_status status = add_hull(b, "box as hull", cube, 8, 0, error);
    for (int k = 0; k < 24; ++k) cube[k] *= 0.9;
    if (status == SADMM_OK) status = add_hull(b, "rounded box", cube, 8, 0.1, error);
    static const struct {
        const char *name;
        int count;
    } balls[] = {{"hull of 16", 16}, {"hull of 32", 32}, {"hull of 128", 128}};
    for (size_t k = 0; k < sizeof balls / sizeof *balls && status == SADMM_OK; ++k) {
        spread(balls[k].count, ball);
        status = add_hull(b, balls[k].name, ball, (size_t)balls[k].count, 0, error);
    }
    if (status == SADMM_OK) status = add_ground(b, "heights", false, error);
    if (status == SADMM_OK) status = add_ground(b, "triangles", true, error);
    return status;
}

/* The pairs, far from each other: `lower` upside down, `upper` on it. */
static void place(struct bench *b, const struct form *lower, const struct form *upper)
{
    static const double flip[4] = {0, 1, 0, 0};
    b->geometries[0] = lower->geometry;
    b->geometries[1] = upper->geometry;
    for (int k = 0; k < 2 * PAIRS; ++k) {
        const bool on_top = k % 2;
        const struct form *form = on_top ? upper : lower;
        const double half = 0.5 * (0.1 + 0.37 * k), turn[4] = {cos(half), 0, 0, sin(half)};
        struct sadmm_collision_body *body = &b->bodies[k];
        quat q = q_mul(q_load(turn), form->down);
        if (!on_top) q = q_mul(q_load(flip), q);
        *body = (struct sadmm_collision_body){
            .position = {10.0 * (k / 2), 0.1 * on_top, on_top ? lower->below + upper->below - 1e-4 : 0},
            .system_body = on_top ? k / 2 : -1, .inertia = 1};
        q_store(q_normalize(q), body->orientation);
        b->shapes[k] = (struct sadmm_shape){.geometry = (uint32_t)on_top, .orientation = {1, 0, 0, 0}, .friction = 0.5,
                                            .category = 1, .mask = UINT32_MAX, .body = k, .alive = true,
                                            .revision = b->shapes[k].revision + 1};
    }
}

/* us a pair; *points: of a pair. */
static sadmm_status measure(struct bench *b, bool warm, double *us, double *points, struct sadmm_error *error)
{
    double best = HUGE_VAL;
    TRY(sadmm_candidates_update(&b->candidates, &b->input, 1, error));
    b->before.pair_count = b->before.point_count = 0;
    for (int repeat = 0; repeat < REPEATS; ++repeat) {
        const double begin = sadmm_clock_ms();
        b->after.pair_count = b->after.point_count = 0;
        if (!b->candidates.kernels->narrow_phase(&b->candidates, &b->input, 0, b->candidates.list.count, &b->before,
                                                 &b->after))
            return sadmm_fail_memory(error, "contacts");
        const double ms = sadmm_clock_ms() - begin;
        if (repeat > 0 && ms < best) best = ms; /* what disturbs a run only makes it longer */
        if (warm) {
            const struct sadmm_contact_set swap = b->before;
            b->before = b->after;
            b->after = swap;
        }
    }
    *us = 1e3 * best / PAIRS;
    *points = (double)(warm ? b->before : b->after).point_count / PAIRS;
    return SADMM_OK;
}

/* A million triangles: hills, by heights or one by one. */
static sadmm_status measure_making(bool in_triangles, struct sadmm_error *error)
{
    sadmm_mesh *mesh = NULL;
    const double begin = sadmm_clock_ms();
    TRY(make_ground(708, 0.1, 0.5, in_triangles, &mesh, error));
    printf("%lld triangles %-18s made in %6.0f ms, %6.1f MiB\n", (long long)sadmm_mesh_triangle_count(mesh),
           in_triangles ? "one by one" : "by their heights", sadmm_clock_ms() - begin,
           (double)sadmm_mesh_bytes(mesh) / (1 << 20));
    sadmm_mesh_destroy(mesh);
    return SADMM_OK;
}

static sadmm_status run(struct bench *b, struct sadmm_error *error)
{
    TRY(make_forms(b, error));
    TRY(sadmm_candidates_init(&b->candidates, sadmm_broad_phase_default(), error));
    b->input = (struct sadmm_collision_input){
        .shapes = b->shapes, .shape_count = 2 * PAIRS, .geometries = b->geometries, .geometry_count = 2,
        .hulls = b->shape_data, .hull_doubles = b->shape_data_doubles, .bodies = b->bodies, .body_count = 2 * PAIRS,
        .dt = 0.005, .margin = 0.02, .threads = 1, .gravity = 9.81};
    printf("%-12s %-12s %8s %10s %10s   (%d pairs, %s, us a pair)\n", "on", "rests", "points", "warm", "cold", PAIRS,
           b->candidates.kernels->variant);
    for (int lower = 2; lower < b->form_count; ++lower)
        for (int upper = 0; upper < b->form_count && !interrupted(); ++upper) {
            double warm = 0, cold = 0, points = 0;
            if (upper > lower || b->forms[upper].geometry.type == SADMM_SHAPE_MESH) continue;
            place(b, &b->forms[lower], &b->forms[upper]);
            TRY(measure(b, false, &cold, &points, error));
            TRY(measure(b, true, &warm, &points, error));
            printf("%-12s %-12s %8.1f %10.3f %10.3f\n", b->forms[lower].name, b->forms[upper].name, points, warm, cold);
            fflush(stdout);
        }
    for (int in_triangles = 0; in_triangles < 2 && !interrupted(); ++in_triangles)
        TRY(measure_making(in_triangles, error));
    return SADMM_OK;
}

int bench_shapes(int argc, char **argv)
{
    struct sadmm_error error = {SADMM_OK, ""};
    int code = bench_parse(command, NULL, 0, NULL, argc, argv);
    if (code) return code < 0 ? 0 : code;
    struct bench *b = sadmm_alloc(1, sizeof *b);
    sadmm_status status = b ? run(b, &error) : sadmm_fail_memory(&error, "the pairs");
    if (b) {
        sadmm_candidates_free(&b->candidates);
        sadmm_contact_set_free(&b->before);
        sadmm_contact_set_free(&b->after);
        for (int k = 0; k < FORMS; ++k) sadmm_hull_destroy(b->hulls[k]);
        sadmm_free(b->shape_data);
    }
    sadmm_free(b);
    if (status == SADMM_OK) return 0;
    fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
    return 1;
}

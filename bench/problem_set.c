#include "problem_set.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fclib/fclib.h"
#include "problem_builder.h"
#include "scenes/scenes.h"

static const double pi = 3.14159265358979323846;
/* Gravity as it is on a plane tilted by this angle about y (rad): downhill is +x. */
static vec3 tilted_gravity(double angle) { return v3(9.81 * sin(angle), 0, -9.81 * cos(angle)); }

/* ---- stacks -------------------------------------------------------------------------------------------------- */

/* 0.2 m cubes, mu = 0.5, lowest first. */
static void stack(struct problem_builder *p, const double *masses, int count)
{
    const double h = 0.1, span[2] = {-h, h};
    for (int i = 0; i < count; ++i) {
        problem_builder_box(p, masses[i], v3(h, h, h), v3(0, 0, h * (2 * i + 1)));
        problem_builder_rectangle(p, i, i - 1, span, span, 2 * h * i, 0.5);
    }
}

static void stack_heavy_above(struct problem_builder *p, long n)
{
    (void)n;
    stack(p, (const double[]){0.01, 1, 100}, 3);
}

static void stack_heavy_below(struct problem_builder *p, long n)
{
    (void)n;
    stack(p, (const double[]){100, 1, 0.01}, 3);
}

static void stack_equal(struct problem_builder *p, long n)
{
    const double masses[20] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    stack(p, masses, (int)n);
}

/* The flat pyramid of the scene library. */
static void pyramid(struct problem_builder *p, long rows)
{
    const double h = 0.1, y[2] = {-h, h};
    for (long r = 0, first = 0; r < rows; first += rows - r, ++r)
        for (long q = 0; q < rows - r; ++q) {
            double x = 2.2 * h * ((double)q + 0.5 * (double)r), z = 2 * h * (double)r;
            int32_t self = (int32_t)(first + q), below = (int32_t)(first - (rows - r + 1) + q);
            problem_builder_box(p, 1, v3(h, h, h), v3(x, 0, z + h));
            if (r == 0) problem_builder_rectangle(p, self, -1, (const double[]){x - h, x + h}, y, z, 0.5);
            for (int side = 0; side < 2 && r > 0; ++side) {
                double other = x + (side ? 1.1 * h : -1.1 * h);
                problem_builder_rectangle(p, self, below + side,
                                          (const double[]){fmax(x, other) - h, fmin(x, other) + h}, y, z, 0.5);
            }
        }
}

/* ---- plates, cards, slopes ----------------------------------------------------------------------------------- */

/* Four levels of a 10 kg plate on four 50 g cubes on a slope of 30 degrees, mu = 3: the cubes pass everything on. */
static void plates(struct problem_builder *p, long levels)
{
    const double c = 0.05;
    int32_t below = -1;
    double z = 0;
    p->gravity = tilted_gravity(pi / 6);
    for (long level = 0; level < levels; ++level) {
        int32_t first = (int32_t)p->body_count, plate = first + 4;
        for (int k = 0; k < 4; ++k) {
            double x = k & 2 ? 0.3 : -0.3, y = k & 1 ? 0.3 : -0.3;
            problem_builder_box(p, 0.05, v3(c, c, c), v3(x, y, z + c));
            problem_builder_rectangle(p, first + k, below, (const double[]){x - c, x + c},
                                      (const double[]){y - c, y + c}, z, 3);
        }
        problem_builder_box(p, 10, v3(0.4, 0.4, 0.02), v3(0, 0, z + 2 * c + 0.02));
        for (int k = 0; k < 4; ++k) {
            double x = k & 2 ? 0.3 : -0.3, y = k & 1 ? 0.3 : -0.3;
            problem_builder_rectangle(p, plate, first + k, (const double[]){x - c, x + c},
                                      (const double[]){y - c, y + c}, z + 2 * c, 3);
        }
        below = plate;
        z += 2 * c + 0.04;
    }
}

/* Two 10 g cards that lean on each other at 65 degrees. */
static void cards(struct problem_builder *p, long n)
{
    const double angle = 65 * pi / 180, half = 0.05, side = 0.03, mu = 0.7;
    (void)n;
    for (int32_t k = 0; k < 2; ++k) {
        double s = k ? -1 : 1, turn = k ? -(pi - angle) : -angle; /* about y: the card's x onto its upward direction */
        vec3 up = v3(s * cos(angle), 0, sin(angle)), centre = v3(-s * half * cos(angle), 0, half * sin(angle));
        struct built_body *card = problem_builder_box(p, 0.01, v3(half, side, 0.001), centre);
        card->orientation = q_exp(v3(0, turn, 0));
        for (int y = -1; y <= 1; y += 2)
            problem_builder_contact(p, k, -1, v3_add(v3_madd(centre, -half, up), v3(0, y * side, 0)), v3(0, 0, 1), mu);
    }
    for (int y = -1; y <= 1; y += 2)
        problem_builder_contact(p, 0, 1, v3(0, y * side, 2 * half * sin(angle)), v3(-1, 0, 0), mu);
}

/* A cube on a slope half a degree below (-1) or above (1) the friction angle. */
static void incline(struct problem_builder *p, long side)
{
    const double h = 0.1, mu = 0.5, span[2] = {-h, h};
    p->gravity = tilted_gravity(atan(mu) + 0.5 * (double)side * pi / 180);
    problem_builder_box(p, 1, v3(h, h, h), v3(0, 0, h));
    problem_builder_rectangle(p, 0, -1, span, span, 0, mu);
}

/* A bar on three pairs of points (statically indeterminate) that slides and turns, under two blocks. */
static void bar(struct problem_builder *p, long n)
{
    (void)n;
    struct built_body *body = problem_builder_box(p, 5, v3(1, 0.05, 0.05), v3(0, 0, 0.05));
    body->linear = v3(0.015, 0.003, 0);
    body->angular = v3(0, 0, 0.02);
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; y += 2) problem_builder_contact(p, 0, -1, v3(x, 0.05 * y, 0), v3(0, 0, 1), 0.4);
    problem_builder_box(p, 1, v3(0.1, 0.1, 0.1), v3(0.9, 0, 0.2))->linear = v3(0.3, 0, 0);
    problem_builder_box(p, 20, v3(0.1, 0.1, 0.1), v3(-0.85, 0, 0.2));
    const double y[2] = {-0.05, 0.05};
    problem_builder_rectangle(p, 1, 0, (const double[]){0.8, 1.0}, y, 0.1, 0.2);
    problem_builder_rectangle(p, 2, 0, (const double[]){-0.95, -0.75}, y, 0.1, 0.2);
}

/* Links of 1 kg on ball joints, a 1000 kg block at the end that is pushed, four 1 kg cubes stacked on it. */
static void chain(struct problem_builder *p, long links)
{
    const double length = 0.2, block = 0.5, cube = 0.1;
    double z = 0;
    for (int32_t k = 0; k < links; ++k, z -= length) {
        problem_builder_box(p, 1, v3(0.03, 0.03, length / 2), v3(0, 0, z - length / 2));
        problem_builder_ball(p, k, k - 1, v3(0, 0, z));
    }
    int32_t below = (int32_t)links;
    problem_builder_box(p, 1000, v3(block, block, block), v3(0, 0, z - block))->linear = v3(0.3, 0, 0);
    problem_builder_ball(p, below, below - 1, v3(0, 0, z));
    for (int q = 0; q < 4; ++q, ++below) {
        problem_builder_box(p, 1, v3(cube, cube, cube), v3(0.3, 0, z + cube * (2 * q + 1)));
        problem_builder_rectangle(p, below + 1, below, (const double[]){0.3 - cube, 0.3 + cube},
                                  (const double[]){-cube, cube}, z + 2 * cube * q, 0.5);
    }
}

/* ---- random pile --------------------------------------------------------------------------------------------- */

static uint64_t state;

/* Uniform in [0, 1). */
static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double between(double low, double high) { return low + (high - low) * uniform(); }

/* Variance 1, by the sum of twelve. */
static double normal(void)
{
    double sum = -6;
    for (int k = 0; k < 12; ++k) sum += uniform();
    return sum;
}

static vec3 normals(double scale)
{
    double x = normal(), y = normal(), z = normal();
    return v3_scale(v3(x, y, z), scale);
}

struct link {
    double distance;
    int32_t a, b;
};

static int by_distance(const void *a, const void *b)
{
    const struct link *x = a, *y = b;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    return x->a != y->a ? x->a - y->a : x->b - y->b;
}

static void link_bodies(struct problem_builder *p, const struct link *link)
{
    vec3 a = p->bodies[link->a].position, b = p->bodies[link->b].position;
    vec3 direction = v3_add(v3_scale(v3_sub(a, b), 1 / link->distance), normals(0.4));
    vec3 point = v3_add(v3_scale(v3_add(a, b), 0.5), normals(0.15));
    problem_builder_contact(p, link->a, link->b, point, direction, between(0.2, 0.9));
}

/* Contacts of the lowest bodies with the ground and between the nearest pairs, some of which get several. */
static void random_contacts(struct problem_builder *p, int count, int ground)
{
    int32_t n = (int32_t)p->body_count;
    enum { MOST = 200 };
    static struct link links[MOST * (MOST - 1) / 2], heights[MOST];
    int pairs = 0;
    for (int32_t a = 0; a < n; ++a) {
        heights[a] = (struct link){p->bodies[a].position.z, a, a};
        for (int32_t b = a + 1; b < n; ++b)
            links[pairs++] = (struct link){v3_norm(v3_sub(p->bodies[a].position, p->bodies[b].position)), a, b};
    }
    qsort(links, (size_t)pairs, sizeof *links, by_distance);
    qsort(heights, (size_t)n, sizeof *heights, by_distance);
    for (int k = 0; k < ground; ++k) {
        int32_t a = heights[(int)(uniform() * (n / 8))].a;
        double x = between(-0.3, 0.3), y = between(-0.3, 0.3);
        problem_builder_contact(p, a, -1, v3_add(p->bodies[a].position, v3(x, y, -0.4)),
                                v3_add(v3(0, 0, 1), normals(0.2)), between(0.2, 0.9));
    }
    int near = (count - ground) * 6 / 10;
    for (int k = 0; k < count - ground; ++k) link_bodies(p, &links[k < near ? k : (int)(uniform() * near)]);
}

/* The errors are such that some velocity satisfies every contact: the problem has a solution. */
static void random_errors(struct problem_builder *p)
{
    double velocities[6 * 200];
    for (size_t k = 0; k < 6 * p->body_count; ++k) velocities[k] = 0.02 * normal();
    for (size_t k = 0; k < p->contact_count; ++k) {
        double slack = uniform() < 0.5 ? 0 : -0.05 * log(1 - uniform());
        p->contacts[k].error = slack - problem_builder_approach(p, k, velocities);
    }
}

/* Bodies of 30 g to 30 kg in a cube, contacts in no order at all. */
static void random_pile(struct problem_builder *p, long seed)
{
    static const struct {
        int bodies, contacts;
    } sizes[] = {{200, 900}, {100, 400}, {60, 240}};
    int n = sizes[seed].bodies;
    double side = cbrt(0.5 * n);
    state = 2862933555777941757u * (uint64_t)(seed + 1) + 3037000493u;
    for (int i = 0; i < n; ++i) {
        double x = between(0, side), y = between(0, side), z = between(0, side), mass = pow(10, between(-1.5, 1.5));
        double hx = between(0.2, 0.5), hy = between(0.2, 0.5), hz = between(0.2, 0.5);
        struct built_body *body = problem_builder_box(p, mass, v3(hx, hy, hz), v3(x, y, z));
        double w = normal(), qx = normal(), qy = normal(), qz = normal();
        body->orientation = (quat){w, qx, qy, qz};
        body->linear = normals(0.3);
        body->angular = normals(0.3);
    }
    if (p->out_of_memory) return;
    random_contacts(p, sizes[seed].contacts, sizes[seed].contacts / 10);
    if (!p->out_of_memory) random_errors(p);
}

/* ---- scenes -------------------------------------------------------------------------------------------------- */

static sadmm_status scene_error(const sadmm_world *world, sadmm_status status, struct sadmm_error *error)
{
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_world_message(world));
}

static sadmm_status freeze_after(const struct sadmm_scene *scene, int steps, sadmm_problem *problem,
                                 struct sadmm_error *error)
{
    sadmm_world *world;
    sadmm_status status = sadmm_scene_build(scene, &world, error);
    if (status != SADMM_OK) return status;
    for (int i = 0; i <= steps && status == SADMM_OK; ++i) {
        status = sadmm_scene_before_step(scene, world, i, error);
        if (status == SADMM_OK) status = scene_error(world, sadmm_world_step(world), error);
    }
    if (status == SADMM_OK) status = scene_error(world, sadmm_world_freeze(world, problem), error);
    sadmm_world_destroy(world);
    return status;
}

static sadmm_status from_scene(const char *spec, int steps, struct set_problem *out, struct sadmm_error *error)
{
    struct sadmm_scene scene;
    sadmm_status status = sadmm_scene_open(spec, &scene, error);
    if (status != SADMM_OK) return status;
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = SADMM_F64;
    sadmm_scene_set_method(&scene, SADMM_METHOD_PAPER);
    out->dt = scene.def.settings.dt;
    out->penalty_period = scene.def.settings.penalty_period;
    status = sadmm_problem_create(&out->problem);
    if (status != SADMM_OK) sadmm_fail_memory(error, "the problem");
    else status = freeze_after(&scene, steps, out->problem, error);
    sadmm_scene_close(&scene);
    return status;
}

/* ---- the set ------------------------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    void (*build)(struct problem_builder *, long n); /* NULL: the scene of that name after n steps */
    long n;
    bool quick;
} set[] = {
    {"stack 10g 1kg 100kg", stack_heavy_above, 0, true},
    {"stack 100kg 1kg 10g", stack_heavy_below, 0, true},
    {"stack of 10", stack_equal, 10, true},
    {"stack of 20", stack_equal, 20, false},
    {"plates on cubes, tilted", plates, 4, false},
    {"cards", cards, 0, true},
    {"incline, below", incline, -1, true},
    {"incline, above", incline, 1, true},
    {"bar", bar, 0, true},
    {"chain 1:1000", chain, 20, false},
    {"pyramid 10", pyramid, 10, false},
    {"pyramid 20", pyramid, 20, false},
    {"pyramid 30", pyramid, 30, false},
    {"random pile 200", random_pile, 0, false},
    {"random pile 100", random_pile, 1, false},
    {"random pile 60", random_pile, 2, false},
    {"sliding_cubes:200", NULL, 40, false},
    {"vertical_stacks:12", NULL, 100, false},
    {"oblique_stacks:2", NULL, 100, false},
    {"card_houses:1", NULL, 300, false},
    {"pyramid:30", NULL, 100, false},
    {"pile:200", NULL, 300, false},
    {"settled_pile:500", NULL, 40, false},
    {"burst:3", NULL, 60, false},
    {"incline", NULL, 40, true},
    {"bounce", NULL, 2800, false}, /* most spheres have come to rest */
};

size_t problem_set_count(void) { return sizeof set / sizeof *set; }
const char *problem_set_name(size_t index) { return set[index].name; }
bool problem_set_quick(size_t index) { return set[index].quick; }

sadmm_status problem_set_make(size_t index, struct set_problem *out, struct sadmm_error *error)
{
    struct problem_builder builder;
    sadmm_status status;
    *out = (struct set_problem){.dt = 0.005, .penalty_period = 30, .quick = set[index].quick};
    snprintf(out->name, sizeof out->name, "%s%s", set[index].build ? "" : "scene ", set[index].name);
    if (set[index].build) {
        problem_builder_start(&builder);
        set[index].build(&builder, set[index].n);
        status = problem_builder_finish(&builder, &out->problem, error);
        problem_builder_free(&builder);
    } else {
        status = from_scene(set[index].name, (int)set[index].n, out, error);
    }
    if (status != SADMM_OK) problem_set_free(out);
    return status;
}

sadmm_status problem_set_freeze(const char *scene, int steps, struct set_problem *out, struct sadmm_error *error)
{
    *out = (struct set_problem){.dt = 0.005, .penalty_period = 30};
    snprintf(out->name, sizeof out->name, "scene %.50s", scene);
    const sadmm_status status = from_scene(scene, steps, out, error);
    if (status != SADMM_OK) problem_set_free(out);
    return status;
}

sadmm_status problem_set_load(const char *path, struct set_problem *out, struct sadmm_error *error)
{
    const char *slash = strrchr(path, '/');
    *out = (struct set_problem){.dt = 0.005, .penalty_period = 30};
    snprintf(out->name, sizeof out->name, "%.60s", slash ? slash + 1 : path);
    char *dot = strrchr(out->name, '.');
    if (dot) *dot = 0;
    return sadmm_fclib_load(path, &out->problem, error);
}

void problem_set_free(struct set_problem *problem)
{
    sadmm_problem_destroy(problem->problem);
    problem->problem = NULL;
}

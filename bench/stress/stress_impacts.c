/* Impacts: of two balls, whose answer is known, and on what is thin, which nothing may pass. */
#include <string.h>

#include "core/math/quat.h"
#include "stress.h"

/* ---- two balls -------------------------------------------------------------------------------------------------- */

/* A ball of 1 kg hits one of so many, straight: v1' = v (m1 - e m2) / (m1 + m2), v2' = v (1 + e) m1 / (m1 + m2). */
static void two_balls(struct stress *s)
{
    static const double restitutions[] = {0, 0.5, 1};
    const double speed = 2, m = s->value, bound = speed * stress_by(s, 1e-6, 1e-5);
    for (int k = 0; k < 3; ++k) {
        const double e = restitutions[k], first = speed * (1 - e * m) / (1 + m), second = speed * (1 + e) / (1 + m);
        struct stress_body ball = {.shape = SADMM_SHAPE_SPHERE,
                                   .size = {0.1},
                                   .mass = 1,
                                   .position = {-0.3, 0, 0},
                                   .velocity = {speed, 0, 0},
                                   .restitution = e,
                                   .friction = 0.5};
        stress_open(s, 0);
        const sadmm_body_id a = stress_add(s, &ball);
        ball.mass = m;
        ball.position[0] = ball.velocity[0] = 0;
        const sadmm_body_id b = stress_add(s, &ball);
        while (s->time < 0.2 && stress_step(s)) {}
        stress_check(s, "speed of the first, m/s", fabs(stress_state(s, a).linear_velocity[0] - first), bound);
        stress_check(s, "speed of the other, m/s", fabs(stress_state(s, b).linear_velocity[0] - second), bound);
        stress_check(s, "overlap, m", s->overlap, 1e-4);
    }
}

/* ---- on plates and meshes --------------------------------------------------------------------------------------- */

static const char *const forms[] = {"ball", "capsule",   "box",    "hull", "cylinder",
                                    "cone", "ellipsoid", "needle", "leaf"};
static const struct {
    sadmm_shape_type type;
    double size[3];
} solids[] = {
    {SADMM_SHAPE_SPHERE, {0.1}},
    {SADMM_SHAPE_CAPSULE, {0.05, 0.05}},
    {SADMM_SHAPE_BOX, {0.1, 0.08, 0.06}},
    {SADMM_SHAPE_HULL, {0.1, 0.08, 0.06}},
    {SADMM_SHAPE_CYLINDER, {0.1, 0.06}},
    {SADMM_SHAPE_CONE, {0.08, 0.1}},
    {SADMM_SHAPE_ELLIPSOID, {0.1, 0.08, 0.06}},
    {SADMM_SHAPE_BOX, {0.1, 0.005, 0.005}},
    {SADMM_SHAPE_BOX, {0.1, 0.1, 0.003}},
};
enum { FORMS = sizeof solids / sizeof *solids, SHOTS = 200, GRID = 16 };

/* Ten points in a box; NULL: built without qhull. */
static sadmm_hull *make_hull(const double half[3])
{
    sadmm_hull_def def = sadmm_hull_def_default();
    double points[30];
    uint64_t seed = 5;
    sadmm_hull *hull = NULL;
    for (int k = 0; k < 30; ++k) points[k] = half[k % 3] * stress_random(&seed);
    def.points = points;
    def.point_count = 10;
    return sadmm_hull_create(&def, &hull) == SADMM_OK ? hull : NULL;
}

static void add_grid(struct stress *s)
{
    const double cell = 0.5;
    double vertices[(GRID + 1) * (GRID + 1)][3];
    int32_t triangles[2 * GRID * GRID][3];
    struct stress_body ground = {.shape = SADMM_SHAPE_MESH, .friction = 0.5};
    sadmm_mesh_def def = sadmm_mesh_def_default();
    sadmm_mesh *mesh = NULL;
    uint64_t seed = 3;
    for (int k = 0; k < (GRID + 1) * (GRID + 1); ++k) {
        vertices[k][0] = cell * (k % (GRID + 1) - GRID / 2 + 0.3 * stress_random(&seed));
        vertices[k][1] = cell * (k / (GRID + 1) - GRID / 2 + 0.3 * stress_random(&seed));
        vertices[k][2] = 0;
    }
    for (int k = 0; k < GRID * GRID; ++k) {
        const int32_t at = k / GRID * (GRID + 1) + k % GRID,
                      corners[2][3] = {{at, at + 1, at + GRID + 2}, {at, at + GRID + 2, at + GRID + 1}};
        memcpy(triangles[2 * k], corners, sizeof corners);
    }
    def.vertices = vertices[0];
    def.vertex_count = (GRID + 1) * (GRID + 1);
    def.triangles = triangles[0];
    def.triangle_count = 2 * GRID * GRID;
    if (sadmm_mesh_create(&def, &mesh) != SADMM_OK) stress_fail(s, "%s", sadmm_last_message());
    ground.mesh = mesh;
    stress_add(s, &ground);
    sadmm_mesh_destroy(mesh);
}

static void add_plate(struct stress *s)
{
    const struct stress_body plate = {
        .shape = SADMM_SHAPE_BOX, .size = {50, 50, 0.0005}, .position = {0, 0, -0.0005}, .friction = 0.5};
    stress_add(s, &plate);
}

/* Bodies, each in an environment of its own, are shot at z = 0 in any orientation, half of them spinning. */
static sadmm_body_id add_shot(struct stress *s, int number, const sadmm_hull *hull, uint64_t *seed)
{
    const double speed = s->value;
    struct stress_body body = {.shape = solids[s->variant].type,
                               .mass = 1,
                               .friction = 0.5,
                               .hull = hull,
                               .environment = number + 1,
                               .restitution = number % 4 == 0 ? 0.5 : 0};
    memcpy(body.size, solids[s->variant].size, sizeof body.size);
    double length;
    do {
        for (int k = 0; k < 4; ++k) body.orientation[k] = stress_random(seed);
        length = sqrt(body.orientation[0] * body.orientation[0] + body.orientation[1] * body.orientation[1] +
                      body.orientation[2] * body.orientation[2] + body.orientation[3] * body.orientation[3]);
    } while (length < 0.1 || length > 1);
    for (int k = 0; k < 4; ++k) body.orientation[k] /= length;
    body.velocity[0] = 0.4 * speed * stress_random(seed);
    body.velocity[1] = 0.4 * speed * stress_random(seed);
    body.velocity[2] = -speed;
    if (number % 2)
        for (int k = 0; k < 3; ++k) body.spin[k] = fmin(speed / 0.1, 100) * stress_random(seed);
    const double wait = 0.01 * (1 + stress_random(seed)); /* s, until its centre would be there, beside its size */
    body.position[2] = 0.25 + wait * speed;
    for (int k = 0; k < 2; ++k) body.position[k] = -body.velocity[k] * body.position[2] / speed;
    return stress_add(s, &body);
}

static void shoot(struct stress *s, void (*add_ground)(struct stress *s))
{
    const int shots = s->quick ? 20 : SHOTS;
    uint64_t seed = 7;
    sadmm_body_id ids[SHOTS];
    bool through[SHOTS] = {false};
    sadmm_hull *hull = solids[s->variant].type == SADMM_SHAPE_HULL ? make_hull(solids[s->variant].size) : NULL;
    if (solids[s->variant].type == SADMM_SHAPE_HULL && !hull) {
        stress_fail(s, "%s", sadmm_last_message());
        return;
    }
    stress_open(s, STRESS_G);
    add_ground(s);
    for (int k = 0; k < shots; ++k) ids[k] = add_shot(s, k, hull, &seed);
    sadmm_hull_destroy(hull);
    const struct stress_sums start = stress_sum(s);
    const double whole = start.kinetic + start.potential;
    int passed = 0;
    for (int step = 0; step < 60 && stress_step(s); ++step) {
        const struct stress_sums now = stress_sum(s);
        stress_check(s, "energy over the start, share", (now.kinetic + now.potential) / whole - 1,
                     stress_by(s, 1e-6, 1e-5));
        for (int k = 0; k < shots; ++k) {
            const double *x = stress_state(s, ids[k]).position;
            /* whole, and where the ground still is */
            through[k] = through[k] || (x[2] < -0.15 && fabs(x[0]) < 1 && fabs(x[1]) < 1);
        }
    }
    for (int k = 0; k < shots; ++k) passed += through[k];
    stress_check(s, "passed through, share", (double)passed / shots, 0);
}

static void at_plate(struct stress *s) { shoot(s, add_plate); }
static void at_mesh(struct stress *s) { shoot(s, add_grid); }

#define SHOT_VALUES                                                                                      \
    .parameter = "m/s", .values = {1, 10, 100, 1000}, .value_count = 4, .quick = 0x9, .variants = forms, \
    .variant_count = FORMS

static const struct stress_case cases[] = {
    {.name = "two_balls",
     .about = "a ball hits a heavier one, restitution 0, 0.5 and 1: speeds in closed form",
     .parameter = "mass ratio",
     .values = {1e-8, 1e-4, 1, 1e2, 1e4, 1e6, 1e8},
     .value_count = 7,
     .quick = 0x55,
     .run = two_balls},
    {.name = "thin_plate",
     .about = "bodies of 0.1 m are shot at a plate of 1 mm: none passes, none gains energy",
     SHOT_VALUES,
     .run = at_plate},
    {.name = "thin_mesh",
     .about = "bodies of 0.1 m are shot at a triangle mesh: none passes, none gains energy",
     SHOT_VALUES,
     .run = at_mesh},
};
const struct stress_group stress_impacts = {cases, sizeof cases / sizeof *cases};

/* Drops and shots at random: bodies of every shape, 0.5 mm to 1 m large, fall or are shot at a sheet, and must stay on
 * their side of it. The criterion is the body's own: its centre of mass, which is inside of it, never crosses the
 * surface that bodies cannot pass, wherever the library sees its contacts. */
#ifndef TESTS_DROPS_H
#define TESTS_DROPS_H

#include "core/math/quat.h"
#include "fixed_work.h"
#include "scene_tools.h"

enum drop_ground { DROP_PLANE, DROP_PLATE, DROP_SHEET, DROP_HEIGHTS, DROP_GRID, DROP_FLOATING, DROP_GROUNDS };
enum { DROP_COMPOUND = SADMM_SHAPE_TYPE_COUNT, DROP_NEEDLE, DROP_LEAF, DROP_FORMS };

/* Of one world: bodies of one form on one ground, each in an environment of its own. */
struct drop_case {
    int form; /* sadmm_shape_type or one of the above */
    enum drop_ground ground;
    double dt;
    sadmm_backend backend;
    sadmm_precision precision;
    uint64_t seed;
};
enum { DROP_BODIES = 40, DROP_STEPS = 40 };

struct drop_result {
    int dropped, through, crossed; /* behind the sheet in the end; at any time */
    double deepest;                /* of a centre of mass behind the surface, in body sizes */
    uint64_t first;                /* which one: its number, from 1 */
};

static inline double drop_unit(uint64_t *seed) /* in [0, 1) */
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return (double)((*seed * UINT64_C(0x2545F4914F6CDD1D)) >> 11) / 9007199254740992.0;
}
static inline double drop_between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * drop_unit(seed);
}
static inline double drop_log(uint64_t *seed, double low, double high)
{
    return exp(drop_between(seed, log(low), log(high)));
}
static inline quat drop_turn(uint64_t *seed)
{
    quat q;
    do {
        q.w = drop_between(seed, -1, 1);
        q.x = drop_between(seed, -1, 1);
        q.y = drop_between(seed, -1, 1);
        q.z = drop_between(seed, -1, 1);
    } while (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z < 0.01);
    return q_normalize(q);
}

/* A shape of about this half size. */
static inline sadmm_shape_def drop_shape(int form, double size, sadmm_hull *const *hull)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    double s[3] = {size, 0.8 * size, 0.6 * size};
    shape.type = form < SADMM_SHAPE_TYPE_COUNT ? (sadmm_shape_type)form : SADMM_SHAPE_BOX;
    if (form == SADMM_SHAPE_CAPSULE) s[0] = 0.6 * size, s[1] = size;
    if (form == SADMM_SHAPE_CONE) s[1] = size;
    if (form == DROP_NEEDLE) s[1] = s[2] = 0.05 * size;
    if (form == DROP_LEAF) s[1] = size, s[2] = 0.03 * size;
    for (int k = 0; k < 3; ++k) shape.size[k] = s[k];
    if (form == SADMM_SHAPE_HULL) shape.hull = *hull;
    return shape;
}

/* A hull of ten points within a box of this half size; NULL: built without qhull. */
static inline sadmm_hull *drop_hull(double size, uint64_t *seed)
{
    sadmm_hull_def def = sadmm_hull_def_default();
    double points[30];
    sadmm_hull *hull = NULL;
    for (int k = 0; k < 30; ++k) points[k] = size * (k % 3 == 2 ? 0.6 : 1) * drop_between(seed, -1, 1);
    def.points = points;
    def.point_count = 10;
    const sadmm_status made = sadmm_hull_create(&def, &hull);
    ck_assert(made == SADMM_OK || made == SADMM_ERROR_UNAVAILABLE);
    return hull;
}

/* The body: one shape, or a cross of two boxes with a ball at an end. Its size is a bound of its extent from the centre
 * of mass. */
static inline sadmm_body_id drop_body(sadmm_world *world, int form, double size, int32_t environment,
                                      const sadmm_body_def *state, double friction, double restitution, uint64_t *seed)
{
    sadmm_hull *hull = form == SADMM_SHAPE_HULL ? drop_hull(size, seed) : NULL;
    sadmm_shape_def shapes[3];
    sadmm_mass parts[3], sum;
    sadmm_body_def body = *state;
    sadmm_body_id id;
    const int count = form == DROP_COMPOUND ? 3 : 1;
    shapes[0] = drop_shape(form == DROP_COMPOUND ? DROP_NEEDLE : form, size, &hull);
    if (count == 3) {
        shapes[1] = shapes[0];
        shapes[1].orientation[0] = shapes[1].orientation[3] = sqrt(0.5);
        shapes[2] = drop_shape(SADMM_SHAPE_SPHERE, 0.2 * size, NULL);
        shapes[2].position[0] = 0.8 * size;
    }
    for (int k = 0; k < count; ++k) ck_assert_int_eq(sadmm_shape_mass(&shapes[k], 8000, &parts[k]), SADMM_OK);
    ck_assert_int_eq(sadmm_mass_sum(parts, (size_t)count, &sum), SADMM_OK);
    body.type = SADMM_BODY_DYNAMIC;
    body.mass = sum.mass;
    memcpy(body.inertia, sum.inertia, sizeof body.inertia);
    body.environment = environment;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    for (int k = 0; k < count; ++k) {
        sadmm_shape_def *s = &shapes[k];
        ck_assert_int_eq(sadmm_mass_pose_in_body(&sum, s->position, s->orientation), SADMM_OK);
        s->friction = friction;
        s->restitution = restitution;
        MUST(world, sadmm_world_add_shape(world, id, s, NULL));
    }
    sadmm_hull_destroy(hull);
    return id;
}

/* The surface z = 0 of a frame, `half` to each side. */
static inline void drop_ground(sadmm_world *world, const struct drop_case *c, const double turn[4], double half,
                               double thickness, double cell, double mass, int32_t environment, uint64_t *seed,
                               sadmm_body_id *id)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_mesh *mesh = NULL;
    enum { GRID = 12 };
    double vertices[3 * (GRID + 1) * (GRID + 1)];
    int32_t triangles[6 * GRID * GRID];
    body.type = c->ground == DROP_FLOATING ? SADMM_BODY_DYNAMIC : SADMM_BODY_STATIC;
    body.environment = environment;
    memcpy(body.orientation, turn, sizeof body.orientation);
    if (c->ground == DROP_PLANE) shape.type = SADMM_SHAPE_PLANE;
    if (c->ground == DROP_PLATE || c->ground == DROP_FLOATING) {
        shape.type = SADMM_SHAPE_BOX;
        shape.size[0] = shape.size[1] = half;
        shape.size[2] = thickness / 2;
        if (c->ground == DROP_PLATE) shape.position[2] = -thickness / 2;
    }
    if (c->ground == DROP_FLOATING) {
        const quat q = q_load(turn);
        body.gravity_scale = 0;
        body.mass = mass;
        sadmm_box_inertia(body.mass, shape.size, body.inertia);
        v3_store(m3_mul(q_matrix(q), v3(0, 0, -thickness / 2)), body.position);
    }
    if (c->ground == DROP_SHEET || c->ground == DROP_GRID) {
        sadmm_mesh_def def = sadmm_mesh_def_default();
        const int n = c->ground == DROP_SHEET ? 1 : GRID;
        const double step = c->ground == DROP_SHEET ? 2 * half : cell;
        for (int y = 0; y <= n; ++y)
            for (int x = 0; x <= n; ++x) {
                double *v = vertices + 3 * (y * (n + 1) + x);
                const bool inner = x > 0 && y > 0 && x < n && y < n;
                v[0] = step * (x - 0.5 * n + (inner ? drop_between(seed, -0.3, 0.3) : 0));
                v[1] = step * (y - 0.5 * n + (inner ? drop_between(seed, -0.3, 0.3) : 0));
                v[2] = 0;
            }
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                const int32_t at = y * (n + 1) + x;
                const int32_t t[6] = {at, at + 1, at + n + 2, at, at + n + 2, at + n + 1};
                memcpy(triangles + 6 * (y * n + x), t, sizeof t);
            }
        def.vertices = vertices;
        def.vertex_count = (size_t)((n + 1) * (n + 1));
        def.triangles = triangles;
        def.triangle_count = (size_t)(2 * n * n);
        ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    }
    if (c->ground == DROP_HEIGHTS) {
        sadmm_heightfield_def def = sadmm_heightfield_def_default();
        def.columns = def.rows = GRID + 1;
        def.spacing[0] = def.spacing[1] = cell;
        memset(vertices, 0, sizeof vertices);
        def.heights = vertices;
        ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
    }
    if (mesh) {
        shape.type = SADMM_SHAPE_MESH;
        shape.mesh = mesh;
    }
    shape.friction = 0.5;
    MUST(world, sadmm_world_add_body(world, &body, id));
    MUST(world, sadmm_world_add_shape(world, *id, &shape, NULL));
    sadmm_mesh_destroy(mesh);
}

/* x in the frame of the ground's surface. */
static inline vec3 drop_seen_from(const sadmm_body_state *ground, double offset, const double x[3])
{
    vec3 at = m3_tmul(q_matrix(q_load(ground->orientation)), v3_sub(v3_load(x), v3_load(ground->position)));
    at.z -= offset;
    return at;
}

static inline struct drop_result drop_all(const struct drop_case *c)
{
    uint64_t seed = c->seed * UINT64_C(0x9E3779B97F4A7C15) + 1;
    sadmm_world_def def = fixed_world_def();
    struct drop_result result = {0, 0, 0, 0, 0};
    const bool floating = c->ground == DROP_FLOATING;
    double size[DROP_BODIES];
    vec3 last[DROP_BODIES];
    bool over[DROP_BODIES], crossed[DROP_BODIES], through[DROP_BODIES];
    sadmm_body_id id[DROP_BODIES], ground[DROP_BODIES];
    seed ^= (uint64_t)(c->form * 64 + (int)c->ground) << 40;
    for (int k = 0; k < 20; ++k) drop_unit(&seed);
    /* the sheet and all that the bodies have in common */
    const quat turn = drop_turn(&seed);
    const mat3 R = q_matrix(turn);
    const double thickness = drop_log(&seed, 1e-4, 1e-2), scale = drop_log(&seed, 5e-4, 1),
                 cell = scale * drop_log(&seed, 0.3, 30), half = floating ? 30 * scale : 100,
                 reach = c->ground == DROP_HEIGHTS || c->ground == DROP_GRID ? 6 * cell : half;
    double q[4];
    q_store(turn, q);
    def.backend = c->backend;
    def.precision = c->precision;
    def.settings.threads = 1;
    def.settings.dt = c->dt;
    v3_store(m3_mul(R, v3(0, 0, -9.81)), def.settings.gravity);
    sadmm_world *world = create_world(&def);
    for (int i = 0; i < DROP_BODIES; ++i)
        if (i == 0 || floating)
            drop_ground(world, c, q, half, thickness, cell, 8e6 * scale * scale * scale, floating ? i : -1, &seed,
                        &ground[i]);
        else ground[i] = ground[0];
    for (int i = 0; i < DROP_BODIES; ++i) {
        sadmm_body_def state = sadmm_body_def_default();
        vec3 way, at;
        const bool drop = drop_unit(&seed) < 0.5 || floating;
        const double spin = drop_unit(&seed) < 0.5 ? 0 : drop_log(&seed, 1, 1000),
                     speed = drop_log(&seed, 0.1, drop ? 10 : 1000);
        size[i] = scale * drop_between(&seed, 0.5, 1);
        do {
            way = v3(drop_between(&seed, -1, 1), drop_between(&seed, -1, 1), drop_between(&seed, -1, -0.2));
        } while (v3_norm(way) > 1 || v3_norm(way) < 0.3);
        if (drop) way = v3(0, 0, -1);
        way = v3_scale(way, 1 / v3_norm(way));
        /* it comes from where it does not touch yet, and may be there after a step or three */
        at = v3(reach * drop_between(&seed, -0.3, 0.3), reach * drop_between(&seed, -0.3, 0.3), 0);
        at = v3_madd(at, -(2.4 * size[i] / -way.z + 3 * drop_unit(&seed) * speed * c->dt), way);
        v3_store(m3_mul(R, at), state.position);
        v3_store(m3_mul(R, v3_scale(way, speed)), state.linear_velocity);
        q_store(drop_turn(&seed), state.orientation);
        v3_store(v3_scale(v3_sub(v3_scale(q_matrix(drop_turn(&seed)).r[0], spin), v3(0, 0, 0)), 1),
                 state.angular_velocity);
        id[i] = drop_body(world, c->form, size[i], i, &state, drop_unit(&seed) < 0.3 ? 0 : drop_between(&seed, 0, 1),
                          drop_unit(&seed) < 0.5 ? 0 : drop_unit(&seed), &seed);
        last[i] = at;
        over[i] = true;
        crossed[i] = through[i] = false;
    }
    result.dropped = DROP_BODIES;
    for (int step = 0; step < DROP_STEPS; ++step) {
        step_world(world, 1);
        for (int i = 0; i < DROP_BODIES; ++i) {
            const sadmm_body_state b = body_state(world, id[i]), g = body_state(world, ground[i]);
            const vec3 x = drop_seen_from(&g, floating ? thickness / 2 : 0, b.position);
            const double share = last[i].z > 0 && x.z < 0 ? last[i].z / (last[i].z - x.z) : 1,
                         out = reach - 2 * size[i];
            /* where it crosses the surface, or is */
            const vec3 there = v3_add(last[i], v3_scale(v3_sub(x, last[i]), share));
            if (!over[i]) continue;
            last[i] = x;
            if (fabs(there.x) > out || fabs(there.y) > out) { /* beside it, where nothing is */
                over[i] = false;
                continue;
            }
            if (x.z < 0) {
                if (!crossed[i]) ++result.crossed;
                crossed[i] = true;
                result.deepest = fmax(result.deepest, -x.z / size[i]);
                through[i] = through[i] || x.z < -size[i] - thickness;
            }
        }
    }
    for (int i = 0; i < DROP_BODIES; ++i) {
        if (through[i] && !result.first) result.first = (uint64_t)i + 1;
        result.through += through[i];
    }
    sadmm_world_destroy(world);
    return result;
}

/* Can bodies of this form be made? Hulls need qhull. */
static inline bool drop_form_is_there(int form)
{
    uint64_t seed = 1;
    sadmm_hull *hull = form == SADMM_SHAPE_HULL ? drop_hull(1, &seed) : NULL;
    const bool there = form != SADMM_SHAPE_HULL || hull;
    sadmm_hull_destroy(hull);
    return there;
}

/* All grounds, `worlds` of each, numbered from `first` on, with steps of 1 to 20 ms. */
static inline void drop_worlds(int form, uint64_t first, int worlds)
{
    static const double steps[] = {0.001, 0.005, 0.01, 0.02};
    if (!drop_form_is_there(form)) return;
    for (int ground = 0; ground < DROP_GROUNDS; ++ground) {
        /* What is left to the solve (meshes, what rests on something): iterations leave a share of the speed of an
         * impact of two dynamic bodies, or of coupled contacts, which may be more than a compound of several shapes, a
         * needle or a leaf is thick: of these those that are through are counted, at most two in a thousand. */
        const bool counted = ground == DROP_FLOATING || form >= DROP_COMPOUND;
        int through = 0;
        for (int k = 0; k < worlds; ++k) {
            const struct drop_case c = {
                form,      (enum drop_ground)ground, steps[((uint64_t)k + first) % 4], SADMM_BACKEND_CPU,
                SADMM_F64, first + (uint64_t)k};
            const struct drop_result r = drop_all(&c);
            through += r.through;
            if (r.through > 0 && !counted)
                printf("form %d, ground %d, world %d: %d of %d are through, the first is %d\n", form, ground,
                       (int)c.seed, r.through, r.dropped, (int)r.first);
        }
        if (worlds > 1) printf("form %d, ground %d: %d of %d through\n", form, ground, through, worlds * DROP_BODIES);
        ck_assert_msg(counted || through == 0, "form %d, ground %d: %d through", form, ground, through);
        ck_assert_msg(1000 * through <= 2 * worlds * DROP_BODIES + 999, "form %d, ground %d: %d through", form, ground,
                      through);
    }
}

#endif

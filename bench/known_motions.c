#include "known_motions.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"
#include "known_make.h"
#include "motion_world.h"

/* ---- worlds ---------------------------------------------------------------------------------------------------- */

struct known_world {
    const struct known_motion *motion;
    sadmm_world *world;
    struct moving_body bodies[EXACT_BODIES];
    struct sadmm_error *error;
};

static sadmm_status check(const struct known_world *w, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(w->error, status, "%s", sadmm_world_message(w->world));
}

enum { CELLS = 40 };

/* Many cells under a body: as a heightfield, or as a mesh whose corners lie anywhere in theirs. */
static sadmm_status make_cloth(const struct known_motion *m, sadmm_mesh **mesh)
{
    static const double heights[(CELLS + 1) * (CELLS + 1)];
    const double cell = 0.37 * m->scale;
    double vertices[CELLS + 1][CELLS + 1][3];
    int32_t triangles[CELLS][CELLS][2][3];
    if (m->odd_ground) {
        sadmm_heightfield_def def = sadmm_heightfield_def_default();
        def.heights = heights;
        def.columns = def.rows = CELLS + 1;
        def.spacing[0] = cell, def.spacing[1] = 1.3 * cell;
        return sadmm_heightfield_create(&def, mesh);
    }
    for (int i = 0; i <= CELLS; ++i)
        for (int j = 0; j <= CELLS; ++j) {
            const int32_t at = i * (CELLS + 1) + j;
            vertices[i][j][0] = cell * (i - CELLS / 2 + 0.3 * sin(12.9 * i + 78.2 * j));
            vertices[i][j][1] = cell * (j - CELLS / 2 + 0.3 * sin(39.3 * i + 11.1 * j));
            vertices[i][j][2] = 0;
            if (i == CELLS || j == CELLS) continue;
            const int32_t corners[2][3] = {{at, at + CELLS + 1, at + 1}, {at + CELLS + 1, at + CELLS + 2, at + 1}};
            memcpy(triangles[i][j], corners, sizeof corners);
        }
    sadmm_mesh_def def = sadmm_mesh_def_default();
    def.vertices = vertices[0][0];
    def.vertex_count = (CELLS + 1) * (CELLS + 1);
    def.triangles = triangles[0][0][0];
    def.triangle_count = 2 * CELLS * CELLS;
    return sadmm_mesh_create(&def, mesh);
}

static sadmm_status add_ground(struct known_world *w)
{
    const struct known_motion *m = w->motion;
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_mesh *mesh = NULL;
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    shape.friction = m->friction;
    shape.restitution = m->restitution;
    shape.type = m->ground == GROUND_CLOTH ? SADMM_SHAPE_MESH : m->odd_ground ? SADMM_SHAPE_BOX : SADMM_SHAPE_PLANE;
    if (shape.type == SADMM_SHAPE_BOX) {
        shape.size[0] = shape.size[1] = 50 * m->scale;
        shape.size[2] = 10 * m->scale;
        shape.position[2] = -shape.size[2];
    }
    if (shape.type == SADMM_SHAPE_MESH && make_cloth(m, &mesh) != SADMM_OK)
        return sadmm_fail(w->error, SADMM_ERROR_OUT_OF_MEMORY, "%s", sadmm_last_message());
    shape.mesh = mesh;
    sadmm_status status = check(w, sadmm_world_add_body(w->world, &body, &id));
    if (status == SADMM_OK) status = check(w, sadmm_world_add_shape(w->world, id, &shape, NULL));
    sadmm_mesh_destroy(mesh);
    return status;
}

static sadmm_status add_bodies(struct known_world *w)
{
    const struct known_motion *m = w->motion;
    for (int i = 0; i < m->system.body_count; ++i) {
        const struct exact_body *from = &m->system.bodies[i];
        struct moving_body *to = &w->bodies[i];
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = m->shapes[i];
        body.mass = to->mass = from->mass;
        memcpy(body.inertia, from->inertia, sizeof body.inertia);
        memcpy(to->inertia, from->inertia, sizeof to->inertia);
        memcpy(body.position, from->state.position, sizeof body.position);
        memcpy(body.orientation, from->state.orientation, sizeof body.orientation);
        memcpy(body.linear_velocity, from->state.linear_velocity, sizeof body.linear_velocity);
        memcpy(body.angular_velocity, from->state.angular_velocity, sizeof body.angular_velocity);
        TRY(check(w, sadmm_world_add_body(w->world, &body, &to->id)));
        shape.friction = m->friction;
        shape.restitution = m->restitution;
        if (m->has_shapes) TRY(check(w, sadmm_world_add_shape(w->world, to->id, &shape, NULL)));
    }
    return SADMM_OK;
}

/* A point is a spherical joint, a point and an axis are a hinge. */
static sadmm_status add_joints(struct known_world *w)
{
    const struct exact_system *s = &w->motion->system;
    for (int k = 0; k < s->link_count; ++k) {
        const struct exact_link *point = &s->links[k];
        const struct exact_link *next = &s->links[k + 1], *axis = NULL;
        if (k + 1 < s->link_count && next->kind == EXACT_AXIS) axis = next;
        sadmm_joint_def joint = sadmm_joint_def_default();
        const sadmm_body_state *a = point->a < 0 ? NULL : &s->bodies[point->a].state;
        const mat3 turn = q_matrix(a ? q_load(a->orientation) : (quat){1, 0, 0, 0});
        const vec3 at = v3_add(a ? v3_load(a->position) : v3(0, 0, 0), m3_mul(turn, v3_load(point->point[0])));
        double place[3], frame[4] = {1, 0, 0, 0};
        if (point->kind != EXACT_POINT) continue;
        joint.kind = axis ? SADMM_JOINT_REVOLUTE : SADMM_JOINT_SPHERICAL;
        if (a) joint.body_a = w->bodies[point->a].id;
        joint.body_b = w->bodies[point->b].id;
        if (axis) { /* from z to the axis: half a turn about the direction halfway between them */
            const vec3 along = m3_mul(turn, v3_load(axis->axis)), middle = v3_add(along, v3(0, 0, 1));
            q_store(q_normalize((quat){0, middle.x, middle.y, middle.z}), frame);
        }
        v3_store(at, place);
        TRY(check(w, sadmm_world_place_joint(w->world, &joint, place, frame)));
        TRY(check(w, sadmm_world_add_joint(w->world, &joint, NULL)));
    }
    return SADMM_OK;
}

static sadmm_status build(struct known_world *w, const sadmm_world_def *from, double dt)
{
    const struct known_motion *m = w->motion;
    sadmm_world_def def = *from;
    def.settings.dt = dt;
    memcpy(def.settings.gravity, m->gravity, sizeof def.settings.gravity);
    if (sadmm_world_create(&def, &w->world) != SADMM_OK)
        return sadmm_fail(w->error, SADMM_ERROR_UNAVAILABLE, "%s", sadmm_last_message());
    if (m->ground != GROUND_NONE) TRY(add_ground(w));
    TRY(add_bodies(w));
    return m->jointed ? add_joints(w) : SADMM_OK;
}

/* ---- runs ------------------------------------------------------------------------------------------------------ */

static double energy_of(const struct known_motion *m, const sadmm_body_state *states, double *kinetic)
{
    struct exact_system system = m->system;
    for (int i = 0; i < system.body_count; ++i) system.bodies[i].state = states[i];
    memcpy(system.gravity, m->gravity, sizeof system.gravity);
    return exact_energy(&system, kinetic);
}

/* After every step of dt. */
struct known_frames {
    int count;
    sadmm_body_state states[KNOWN_FRAMES][EXACT_BODIES];
};

static void find_frames(const struct known_motion *motion, struct known_frames *frames)
{
    struct known_motion known = *motion;
    double now = 0;
    frames->count = (int)lround(known.seconds / known.dt);
    for (int frame = 0; frame < frames->count; ++frame) {
        known_motion_advance(&known, &now, known.dt);
        for (int i = 0; i < known.system.body_count; ++i)
            frames->states[frame][i] = known.system.bodies[i].state;
    }
}

static sadmm_status follow(struct known_world *w, const struct known_frames *frames, int level,
                           struct known_result *result)
{
    const struct known_motion *m = w->motion;
    double largest = 0, *error = &result->error[level];
    if (level == 0) result->most = -HUGE_VAL;
    for (int frame = 0; frame < frames->count; ++frame) {
        const sadmm_body_state *wanted = frames->states[frame];
        sadmm_body_state states[EXACT_BODIES];
        double kinetic;
        for (int k = 0; k < 1 << level; ++k) TRY(check(w, sadmm_world_step(w->world)));
        for (int i = 0; i < m->system.body_count; ++i) {
            TRY(check(w, sadmm_world_body_state(w->world, w->bodies[i].id, &states[i])));
            *error = fmax(*error, pose_distance(&w->bodies[i], &states[i], &wanted[i]));
        }
        if (level > 0) continue;
        result->left = energy_of(m, states, NULL) - energy_of(m, wanted, &kinetic);
        result->most = fmax(result->most, result->left);
        largest = fmax(largest, kinetic);
    }
    if (level == 0) result->left /= largest, result->most /= largest;
    return SADMM_OK;
}

sadmm_status known_motion_run(const struct known_motion *motion, const sadmm_world_def *def,
                              void (*opened)(sadmm_world *world), int levels, struct known_result *result,
                              struct sadmm_error *error)
{
    struct known_frames frames;
    find_frames(motion, &frames);
    *result = (struct known_result){0};
    for (int level = 0; level < levels; ++level) {
        struct known_world w = {.motion = motion, .error = error};
        sadmm_status status = build(&w, def, motion->dt / (1 << level));
        if (status == SADMM_OK && opened) opened(w.world);
        if (status == SADMM_OK) status = follow(&w, &frames, level, result);
        sadmm_world_destroy(w.world);
        TRY(status);
    }
    return SADMM_OK;
}

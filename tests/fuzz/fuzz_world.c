/* Worlds: the input is a program of calls with ordinary, extreme and wrong arguments, stale ids, NULLs, and memory that
 * runs out. Whatever the calls:
 *
 *   - a call that fails leaves the world as it was: its bodies, their states, its shapes and its settings, and says why
 *   - after a step that succeeds every state and every contact is finite and in its range, and a certificate that was
 *     asked for
 *     finite and not negative
 *   - what was set is what is read
 */
#include <string.h>

#include "bytes.h"
#include "core/base/memory.h"
#include "subadmm/events.h"
#include "subadmm/world.h"

/* Few, so that an input is quick and its calls meet the same objects again. */
enum { MAX_BODIES = 6, MAX_SHAPES = 8, MAX_CALLS = 64, MAX_STEPS = 10, IDS = 16, HULLS = 4 };
enum { MESHES = 8, MAX_TRIANGLES = 16 };
enum { MAX_CONTACTS = 8 * MAX_SHAPES * MAX_SHAPES * MAX_TRIANGLES };

struct machine {
    struct bytes in;
    sadmm_world *world;
    sadmm_problem *problem;
    sadmm_body_id bodies[IDS];
    sadmm_shape_id shapes[IDS];
    int body_ids, shape_ids; /* ever made; the last IDS of them are kept, removed ones too */
    int steps;
    int64_t done;            /* steps that succeeded */
    sadmm_contact contacts[MAX_CONTACTS];
};

/* ---- what a failed call must not change -------------------------------------------------------------------------- */

struct picture {
    uint64_t states, objects;
    int32_t bodies, shapes;
    sadmm_settings settings;
    sadmm_step_report report;
};

static uint64_t mix(uint64_t hash, const void *data, size_t size)
{
    const uint8_t *byte = data;
    for (size_t k = 0; k < size; ++k) hash = (hash ^ byte[k]) * UINT64_C(0x100000001b3);
    return hash;
}

static struct picture inspect(sadmm_world *world)
{
    struct picture p;
    memset(&p, 0, sizeof p);
    MUST(sadmm_world_state_hash(world, &p.states) == SADMM_OK, "state hash");
    p.bodies = sadmm_world_body_count(world);
    p.shapes = sadmm_world_shape_count(world);
    p.settings = sadmm_world_settings(world);
    MUST(sadmm_world_report(world, &p.report) == SADMM_OK, "report");
    p.objects = UINT64_C(0xcbf29ce484222325);
    for (int32_t k = 0; k < p.bodies; ++k) {
        sadmm_body_id id;
        sadmm_body_def def;
        MUST(sadmm_world_body_at(world, k, &id) == SADMM_OK, "body %d", k);
        MUST(sadmm_world_body_def(world, id, &def) == SADMM_OK, "body %d", k);
        p.objects = mix(p.objects, &id, sizeof id);
        p.objects = mix(p.objects, &def.mass, sizeof def.mass);
        p.objects = mix(p.objects, def.inertia, sizeof def.inertia);
        p.objects = mix(p.objects, &def.gravity_scale, sizeof def.gravity_scale);
        p.objects = mix(p.objects, &def.linear_damping, sizeof def.linear_damping);
        p.objects = mix(p.objects, &def.angular_damping, sizeof def.angular_damping);
        p.objects = mix(p.objects, def.name, strlen(def.name));
        p.objects = mix(p.objects, &def.environment, sizeof def.environment);
    }
    for (int32_t k = 0; k < p.shapes; ++k) {
        sadmm_shape_id id;
        sadmm_body_id body;
        sadmm_shape_def def;
        MUST(sadmm_world_shape_at(world, k, &id) == SADMM_OK, "shape %d", k);
        MUST(sadmm_world_shape_def(world, id, &def, &body) == SADMM_OK, "shape %d", k);
        p.objects = mix(p.objects, &id, sizeof id);
        p.objects = mix(p.objects, &body, sizeof body);
        p.objects = mix(p.objects, def.size, sizeof def.size);
        p.objects = mix(p.objects, def.position, sizeof def.position);
        p.objects = mix(p.objects, &def.hull, sizeof def.hull);
        p.objects = mix(p.objects, &def.mesh, sizeof def.mesh);
        p.objects = mix(p.objects, &def.friction, sizeof def.friction);
    }
    return p;
}

static void must_be_as_before(sadmm_world *world, const struct picture *before, sadmm_status status)
{
    struct picture after = inspect(world);
    const char *name = sadmm_status_name(status);
    MUST(after.states == before->states, "%s: a state changed", name);
    MUST(after.bodies == before->bodies && after.shapes == before->shapes, "%s: bodies or shapes came or went", name);
    MUST(after.objects == before->objects, "%s: a body or a shape changed", name);
    MUST(memcmp(&after.settings, &before->settings, sizeof after.settings) == 0, "%s: the settings changed", name);
    MUST(after.report.step == before->report.step && after.report.time == before->report.time, "%s: time went on",
         name);
}

/* ---- what must hold after a step --------------------------------------------------------------------------------- */

static void must_be_sound(struct machine *m)
{
    int32_t count = sadmm_world_body_count(m->world), dynamic = 0;
    sadmm_step_report report;
    for (int32_t k = 0; k < count; ++k) {
        sadmm_body_id id;
        sadmm_body_state s;
        sadmm_body_def def;
        double wrench[6];
        MUST(sadmm_world_body_at(m->world, k, &id) == SADMM_OK, "body %d", k);
        MUST(sadmm_world_body_state(m->world, id, &s) == SADMM_OK, "body %d", k);
        MUST(sadmm_world_body_def(m->world, id, &def) == SADMM_OK, "body %d", k);
        MUST(all_finite(s.position, 3) && all_finite(s.linear_velocity, 3) && all_finite(s.angular_velocity, 3),
             "body %d: x %g %g %g, v %g %g %g", k, s.position[0], s.position[1], s.position[2], s.linear_velocity[0],
             s.linear_velocity[1], s.linear_velocity[2]);
        double q2 = 0;
        for (int i = 0; i < 4; ++i) q2 += s.orientation[i] * s.orientation[i];
        MUST(fabs(q2 - 1) <= 1e-12, "body %d: |q|^2 - 1 = %g", k, q2 - 1); /* normalised: a few roundings */
        if (def.type == SADMM_BODY_STATIC) continue;
        dynamic += def.type == SADMM_BODY_DYNAMIC;
        sadmm_status status = sadmm_world_body_contact_wrench(m->world, id, wrench);
        MUST(status == SADMM_OK || status == SADMM_ERROR_UNAVAILABLE, "wrench: %s", sadmm_status_name(status));
        if (status == SADMM_OK) MUST(all_finite(wrench, 6), "body %d: wrench", k);
    }

    MUST(sadmm_world_report(m->world, &report) == SADMM_OK, "report");
    int32_t contacts = sadmm_world_contact_count(m->world);
    MUST(report.step == ++m->done, "step %lld", (long long)report.step);
    /* hits taken at their moment are contacts, but none of the solve's */
    MUST(report.bodies == dynamic && report.contacts <= contacts, "%d bodies, %d contacts", report.bodies,
         report.contacts);
    MUST(report.pairs <= report.contacts && (report.pairs > 0) == (report.contacts > 0), "%d pairs", report.pairs);
    MUST(isfinite(report.penetration_max) && report.penetration_max >= 0, "penetration %g", report.penetration_max);
    const sadmm_certificate *c = &report.certificate;
    if (sadmm_world_settings(m->world).certify)
        MUST(isfinite(c->ncp_max) && c->ncp_max >= 0 && isfinite(c->ncp_mean) && c->ncp_mean >= 0 &&
                 isfinite(c->momentum_max) && c->momentum_max >= 0 && isfinite(c->siconos) && c->siconos >= 0,
             "natural map %g, mean %g, momentum %g, siconos %g", c->ncp_max, c->ncp_mean, c->momentum_max, c->siconos);
    const sadmm_settings settings = sadmm_world_settings(m->world);
    MUST(report.iterations >= 0 && report.iterations <= settings.iterations + settings.substeps - 1, "%d iterations",
         report.iterations);
    MUST(contacts <= MAX_CONTACTS, "%d contacts", contacts);
    MUST(sadmm_world_contacts(m->world, 0, contacts, m->contacts) == SADMM_OK, "contacts");
    for (int32_t k = 0; k < contacts; ++k) {
        const sadmm_contact *c = &m->contacts[k];
        double n2 = 0;
        for (int i = 0; i < 3; ++i) n2 += c->normal[i] * c->normal[i];
        MUST(fabs(n2 - 1) <= 1e-12, "contact %d: |n|^2 - 1 = %g", k, n2 - 1);
        MUST(all_finite(c->position, 3) && all_finite(c->impulse, 3) && all_finite(c->force, 3) &&
             isfinite(c->separation) &&
                 isfinite(c->friction) && c->friction >= 0,
             "contact %d: separation %g, impulse %g %g %g", k, c->separation, c->impulse[0], c->impulse[1],
             c->impulse[2]);
        MUST(c->triangle >= -1 && c->triangle < MAX_TRIANGLES, "contact %d: triangle %d", k, c->triangle);
    }
}

/* ---- arguments --------------------------------------------------------------------------------------------------- */

static sadmm_body_id take_body(struct machine *m)
{
    sadmm_body_id none = {take_choice(&m->in, 16) == 15 ? take_byte(&m->in) : 0, 1};
    return m->body_ids == 0 || none.slot ? none : m->bodies[take_choice(&m->in, m->body_ids < IDS ? m->body_ids : IDS)];
}

static sadmm_shape_id take_shape(struct machine *m)
{
    sadmm_shape_id none = {take_choice(&m->in, 16) == 15 ? take_byte(&m->in) : 0, 1};
    return m->shape_ids == 0 || none.slot ? none
                                          : m->shapes[take_choice(&m->in, m->shape_ids < IDS ? m->shape_ids : IDS)];
}

static sadmm_settings take_settings(struct machine *m, sadmm_settings s)
{
    struct bytes *in = &m->in;
    for (int changes = 1 + take_choice(in, 3); changes > 0; --changes)
        switch (take_choice(in, 24)) {
        case 0: s.dt = take_rarely(in, 8) ? take_extreme(in) : take_scale(in, 1e-6, 1); break;
        case 1: s.gravity[take_choice(in, 3)] = take_number(in, -20, 20); break;
        case 2: s.method = (sadmm_method)(take_choice(in, 8) == 7 ? take_byte(in) : take_choice(in, 2)); break;
        case 3: s.iterations = take_choice(in, 10); break;
        case 4: s.relaxation = take_number(in, 1, 2); break;
        case 5: s.penalty_period = take_choice(in, 6) - 1; break;
        case 6: s.penalty_mass_factor = take_rarely(in, 8) ? take_extreme(in) : take_scale(in, 1e-6, 1e12); break;
        case 7: s.penalty_offset = take_rarely(in, 8) ? take_extreme(in) : take_scale(in, 1e-6, 1e15); break;
        case 8: s.penalty_ratio_limit = take_number(in, 1, 100); break;
        case 9: s.penalty_update_warm = take_choice(in, 2); break;
        case 10: s.warm_start = take_choice(in, 2); break;
        case 11: s.residual_tolerance = take_choice(in, 2) ? take_extreme(in) : take_scale(in, 1e-12, 1); break;
        case 12: s.tolerance = take_choice(in, 2) ? take_extreme(in) : take_scale(in, 1e-12, 1); break;
        case 13: s.ncp_points = take_choice(in, 2) ? 0 : take_choice(in, 128); break;
        case 14: s.check_period = take_choice(in, 6); break;
        case 15: s.measure_residuals = take_choice(in, 2); break;
        case 16: s.certify = take_choice(in, 2); break;
        case 17: s.recover_wrenches = take_choice(in, 2); break;
        case 18: s.correction_factor = take_number(in, 0, 1); break;
        case 19: s.slop = take_number(in, 0, 1); break;
        case 20: s.correction_speed = take_number(in, 0, 1e3); break;
        case 21: s.restitution_threshold = take_number(in, 0, 10); break;
        case 22: s.threads = take_choice(in, 4) - 1; break;
        default:
            if (take_choice(in, 2)) s.substeps = take_choice(in, 6);
            else s.gravity[2] = 0;
            break;
        }
    return s;
}

static void take_state(struct bytes *in, double reach, sadmm_body_state *s)
{
    take_vector(in, -reach, reach, s->position);
    take_orientation(in, s->orientation);
    memset(s->linear_velocity, 0, sizeof s->linear_velocity);
    memset(s->angular_velocity, 0, sizeof s->angular_velocity);
    switch (take_choice(in, 4)) {
    case 1: take_vector(in, -10, 10, s->linear_velocity); break;
    case 2: take_vector(in, -100, 100, s->angular_velocity); break;
    case 3:
        take_vector(in, -1e6, 1e6, s->linear_velocity);
        take_vector(in, -1e6, 1e6, s->angular_velocity);
        break;
    }
}

static void take_forces(struct bytes *in, double *scale, double *linear, double *angular)
{
    *scale = take_choice(in, 4) ? take_number(in, -2, 2) : take_extreme(in);
    *linear = take_choice(in, 4) ? take_scale(in, 1e-6, 1e6) : take_extreme(in);
    *angular = take_choice(in, 4) ? take_scale(in, 1e-6, 1e6) : take_extreme(in);
}

static sadmm_body_def take_body_def(struct machine *m)
{
    struct bytes *in = &m->in;
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_state state;
    int kind = take_choice(in, 8);
    def.type = kind == 7   ? (sadmm_body_type)take_byte(in)
               : kind >= 5 ? SADMM_BODY_STATIC
               : kind == 4 ? SADMM_BODY_KINEMATIC
                           : SADMM_BODY_DYNAMIC;
    def.mass = take_rarely(in, 16) ? take_extreme(in) : (take_choice(in, 4) ? 1 : take_scale(in, 1e-9, 1e12));
    double size = take_choice(in, 4) ? 0.5 : take_scale(in, 1e-6, 1e6);
    sadmm_sphere_inertia(def.mass, size, def.inertia);
    if (take_choice(in, 4) == 3) def.inertia[take_choice(in, 3)] *= take_number(in, 0, 2);
    if (def.type == SADMM_BODY_STATIC) {
        take_vector(in, -1, 1, def.position);
        take_orientation(in, def.orientation);
    } else {
        take_state(in, 2, &state);
        memcpy(def.position, state.position, sizeof def.position);
        memcpy(def.orientation, state.orientation, sizeof def.orientation);
        memcpy(def.linear_velocity, state.linear_velocity, sizeof def.linear_velocity);
        memcpy(def.angular_velocity, state.angular_velocity, sizeof def.angular_velocity);
    }
    def.environment = take_rarely(in, 4) ? take_choice(in, 4) - 2 : (def.type == SADMM_BODY_DYNAMIC ? 0 : -1);
    if (take_rarely(in, 16))
        def.name = "a name that is longer than the sixty-three bytes that are kept of it, and then some";
    if (take_rarely(in, 8)) take_forces(in, &def.gravity_scale, &def.linear_damping, &def.angular_damping);
    return def;
}

/* One of a few hulls, which every input meets again; NULL in libraries that cannot make any. */
static const sadmm_hull *hull_at(int k)
{
    static sadmm_hull *hulls[HULLS];
    sadmm_hull **hull = &hulls[k % HULLS];
    if (!*hull) { /* with 4, 6, 8 and 10 corners, the longer the thinner */
        double points[30];
        const int count = 2 * (k % HULLS + 2);
        for (int i = 0; i < count; ++i) {
            points[3 * i] = 0.5 * cos(2.4 * i);
            points[3 * i + 1] = 0.5 * sin(2.4 * i);
            points[3 * i + 2] = (i % 2 ? 0.4 : -0.4) / (k % HULLS + 1);
        }
        const sadmm_hull_def def = {.struct_size = sizeof def,
                                    .points = points,
                                    .point_count = (size_t)count,
                                    .convex_radius = k % 2 ? 0.05 : 0};
        if (sadmm_hull_create(&def, hull) != SADMM_OK) return NULL;
    }
    return *hull;
}

/* Heights over 3 x 3 and 4 x 3 points: flat, with steps, with needles. */
static sadmm_status make_heights(int k, sadmm_mesh **mesh)
{
    double heights[12];
    const sadmm_heightfield_def def = {sizeof def, heights, 3 + k % 2, 3, {0.5, k == 1 ? 0.05 : 0.5}};
    for (int i = 0; i < 12; ++i) heights[i] = k == 0 ? 0 : k == 1 ? 0.3 * (i % 2) : 0.4 * cos(2.4 * i) + 5 * (i == 4);
    return sadmm_heightfield_create(&def, mesh);
}

/* Triangles: two that are one square, a tetrahedron, a fan of which three have one edge, ones that cross each other or
 * do not meet, and slivers. */
static sadmm_status make_triangles(int k, sadmm_mesh **mesh)
{
    static const double square[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const double tetrahedron[12] = {0, 0, 0.6, 0.6, 0, -0.4, -0.3, 0.5, -0.4, -0.3, -0.5, -0.4};
    static const double fan[15] = {0, -1, 0, 0, 1, 0, 1, 0, 0.2, -1, 0, 0.1, 0.1, 0, 1};
    static const int32_t corners[3][12] = {
        {0, 1, 2, 0, 2, 3},
        {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2},
        {0, 2, 1, 0, 1, 3, 0, 1, 4},
    };
    double soup[3 * 3 * MAX_TRIANGLES];
    int32_t all[3 * MAX_TRIANGLES];
    for (int i = 0; i < 3 * MAX_TRIANGLES; ++i) {
        all[i] = i;
        soup[3 * i] = cos(2.4 * i);
        soup[3 * i + 1] = sin(1.7 * i);
        soup[3 * i + 2] = k == 3 ? 0.5 * cos(3.1 * i) : 0;
        if (k == 4 && i % 3 == 2) { /* beside the edge before by less and less */
            soup[3 * i] = soup[3 * i - 3] + pow(0.3, i / 3);
            soup[3 * i + 1] = soup[3 * i - 2];
        }
    }
    const sadmm_mesh_def defs[5] = {
        {sizeof *defs, square, 4, corners[0], 2},
        {sizeof *defs, tetrahedron, 4, corners[1], 4},
        {sizeof *defs, fan, 5, corners[2], 3},
        {sizeof *defs, soup, 3 * MAX_TRIANGLES, all, MAX_TRIANGLES},
        {sizeof *defs, soup, 3 * MAX_TRIANGLES, all, MAX_TRIANGLES},
    };
    return sadmm_mesh_create(&defs[k], mesh);
}

static const sadmm_mesh *mesh_at_number(int k)
{
    static sadmm_mesh *meshes[MESHES];
    sadmm_mesh **mesh = &meshes[k % MESHES];
    if (*mesh) return *mesh;
    const sadmm_status status = k % MESHES < 3 ? make_heights(k % MESHES, mesh) : make_triangles(k % MESHES - 3, mesh);
    MUST(status == SADMM_OK, "%s", sadmm_last_message());
    return *mesh;
}

static sadmm_shape_def take_shape_def(struct machine *m)
{
    struct bytes *in = &m->in;
    sadmm_shape_def def = sadmm_shape_def_default();
    const bool any_type = take_rarely(in, 32);
    const int type = take_byte(in);
    if (!any_type && type >= 240) def.type = SADMM_SHAPE_HULL;
    else if (!any_type && type >= 208) def.type = SADMM_SHAPE_MESH;
    else if (!any_type && type >= 176) def.type = (sadmm_shape_type)(SADMM_SHAPE_CYLINDER + type % 3);
    else def.type = (sadmm_shape_type)(any_type ? type : type % SADMM_SHAPE_HULL);
    if (def.type == SADMM_SHAPE_HULL && type < 255) def.hull = hull_at(type);
    if (def.type == SADMM_SHAPE_MESH && type < 239) def.mesh = mesh_at_number(type);
    bool any_size = take_choice(in, 4) == 3;
    for (int k = 0; k < 3; ++k) {
        def.size[k] = any_size ? take_scale(in, 1e-6, 1e6) : take_in(in, 0.1, 0.9);
        if (take_rarely(in, 64)) def.size[k] = take_extreme(in);
    }
    if (take_choice(in, 4) == 3) {
        take_vector(in, -1, 1, def.position);
        take_orientation(in, def.orientation);
    }
    if (take_choice(in, 2)) def.friction = take_number(in, 0, 2);
    if (take_choice(in, 4) == 3) def.restitution = take_number(in, 0, 1);
    if (take_rarely(in, 16)) def.category = take_byte(in);
    def.sensor = def.category % 4 == 3 && def.type != SADMM_SHAPE_MESH;
    if (take_rarely(in, 16)) def.mask = take_byte(in);
    return def;
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

static sadmm_status add_body(struct machine *m)
{
    sadmm_body_def def = take_body_def(m);
    sadmm_body_id id;
    bool null = take_rarely(&m->in, 32);
    if (sadmm_world_body_count(m->world) >= MAX_BODIES) return SADMM_OK;
    sadmm_status status = sadmm_world_add_body(m->world, null ? NULL : &def, &id);
    if (status != SADMM_OK) return status;
    m->bodies[m->body_ids++ % IDS] = id;
    sadmm_body_def read;
    MUST(sadmm_world_body_def(m->world, id, &read) == SADMM_OK, "a new body");
    MUST(read.type == def.type && memcmp(read.position, def.position, sizeof read.position) == 0, "a new body");
    return SADMM_OK;
}

/* The last body made that may have a mesh, if there is one. */
static sadmm_body_id take_ground(struct machine *m, sadmm_body_id else_this)
{
    for (int k = m->body_ids - 1; k >= 0 && k >= m->body_ids - IDS; --k) {
        sadmm_body_def def;
        if (sadmm_world_body_def(m->world, m->bodies[k % IDS], &def) == SADMM_OK && def.type != SADMM_BODY_DYNAMIC)
            return m->bodies[k % IDS];
    }
    return else_this;
}

static sadmm_status add_shape(struct machine *m)
{
    sadmm_body_id body = take_body(m);
    sadmm_shape_def def = take_shape_def(m), read;
    if (def.type == SADMM_SHAPE_MESH && take_choice(&m->in, 4)) body = take_ground(m, body);
    sadmm_shape_id id;
    bool null = take_rarely(&m->in, 32);
    if (sadmm_world_shape_count(m->world) >= MAX_SHAPES) return SADMM_OK;
    sadmm_status status = sadmm_world_add_shape(m->world, body, null ? NULL : &def, &id);
    if (status != SADMM_OK) return status;
    m->shapes[m->shape_ids++ % IDS] = id;
    MUST(sadmm_world_shape_def(m->world, id, &read, NULL) == SADMM_OK, "a new shape");
    MUST(read.type == def.type && read.friction == def.friction && read.mask == def.mask, "a new shape");
    return SADMM_OK;
}

static sadmm_status set_state(struct machine *m)
{
    sadmm_body_id id = take_body(m);
    sadmm_body_state state, read;
    bool null = take_rarely(&m->in, 32);
    take_state(&m->in, take_choice(&m->in, 8) == 7 ? 1e9 : 2, &state);
    sadmm_status status = sadmm_world_set_body_state(m->world, id, null ? NULL : &state);
    if (status != SADMM_OK) return status;
    MUST(sadmm_world_body_state(m->world, id, &read) == SADMM_OK, "a state that was set");
    MUST(memcmp(read.position, state.position, sizeof read.position) == 0 &&
             memcmp(read.linear_velocity, state.linear_velocity, sizeof read.linear_velocity) == 0 &&
             memcmp(read.angular_velocity, state.angular_velocity, sizeof read.angular_velocity) == 0,
         "a state that was set");
    return SADMM_OK;
}

static sadmm_status set_wrench(struct machine *m)
{
    double force[3], torque[3];
    sadmm_body_id id = take_body(m);
    double reach = take_choice(&m->in, 4) == 3 ? 1e15 : 100;
    bool null = take_rarely(&m->in, 32);
    take_vector(&m->in, -reach, reach, force);
    take_vector(&m->in, -reach, reach, torque);
    return sadmm_world_set_body_wrench(m->world, id, force, null ? NULL : torque);
}

static sadmm_status move(struct machine *m)
{
    double position[3], orientation[4];
    sadmm_body_id id = take_body(m);
    take_vector(&m->in, -2, 2, position);
    take_orientation(&m->in, orientation);
    return sadmm_world_move_body(m->world, id, position, orientation);
}

static sadmm_status set_forces(struct machine *m)
{
    double scale, linear, angular;
    sadmm_body_id id = take_body(m);
    sadmm_body_def read;
    take_forces(&m->in, &scale, &linear, &angular);
    const bool of_gravity = take_choice(&m->in, 2);
    sadmm_status status = of_gravity ? sadmm_world_set_body_gravity_scale(m->world, id, scale)
                                     : sadmm_world_set_body_damping(m->world, id, linear, angular);
    if (status != SADMM_OK) return status;
    MUST(sadmm_world_body_def(m->world, id, &read) == SADMM_OK, "forces that were set");
    MUST(of_gravity ? read.gravity_scale == scale : read.linear_damping == linear && read.angular_damping == angular,
         "forces that were set");
    return SADMM_OK;
}

static sadmm_status step(struct machine *m)
{
    if (m->steps >= MAX_STEPS) return SADMM_OK;
    ++m->steps;
    sadmm_status status = take_choice(&m->in, 8) ? sadmm_world_step(m->world) : sadmm_world_step_async(m->world);
    if (status != SADMM_OK) return status;
    sadmm_test_fail_allocations_after(-1);
    MUST(sadmm_world_wait(m->world) == SADMM_OK, "wait");
    must_be_sound(m);
    return SADMM_OK;
}

static sadmm_status freeze(struct machine *m)
{
    sadmm_solve_report report;
    sadmm_certificate certificate;
    sadmm_step_report step;
    bool solve = take_choice(&m->in, 4) == 3;
    sadmm_status status = sadmm_world_freeze(m->world, take_rarely(&m->in, 32) ? NULL : m->problem);
    if (status != SADMM_OK) return status;
    sadmm_test_fail_allocations_after(-1);
    /* Hits within the step were solved before it: they can be read, and are not in the problem. */
    MUST(sadmm_world_report(m->world, &step) == SADMM_OK, "the report");
    MUST(sadmm_problem_contact_count(m->problem) == step.contacts, "a frozen problem");
    status = sadmm_problem_certify(m->problem, &certificate);
    MUST(status == SADMM_OK || status == SADMM_ERROR_NON_FINITE, "%s", sadmm_problem_message(m->problem));
    if (!solve) return SADMM_OK;
    sadmm_settings settings = sadmm_world_settings(m->world);
    status = sadmm_problem_solve(m->problem, SADMM_BACKEND_CPU, SADMM_F64, &settings, &report);
    MUST(status == SADMM_OK || status == SADMM_ERROR_NON_FINITE, "%s", sadmm_problem_message(m->problem));
    return SADMM_OK;
}

/* As many as there were, one at a time or all at once; whatever the ring has lost. */
static sadmm_status take_events(struct machine *m, int32_t room)
{
    sadmm_event events[8];
    int32_t count = -1;
    const int32_t waiting = sadmm_world_event_count(m->world);
    const sadmm_status status = sadmm_world_take_events(m->world, room < 8 ? room : 8, events, &count, NULL);
    if (status != SADMM_OK) return status;
    MUST(count == (room < waiting ? room : waiting) || count == 8, "%d of %d events taken, for %d", count, waiting,
         room);
    for (int32_t k = 0; k < count; ++k)
        MUST((int)events[k].type >= 0 && events[k].type < SADMM_EVENT_TYPE_COUNT && events[k].shape_b.slot > 0 &&
                 (k == 0 || events[k].step >= events[k - 1].step), "event %d makes no sense", k);
    return SADMM_OK;
}

static sadmm_status read_something(struct machine *m)
{
    int32_t at = take_choice(&m->in, 12) - 2;
    sadmm_body_id body;
    sadmm_shape_id shape;
    double wrench[6];
    char text[32];
    int32_t count;
    size_t size;
    switch (take_choice(&m->in, 9)) {
    case 0: return sadmm_world_body_at(m->world, at, &body);
    case 1: return sadmm_world_shape_at(m->world, at, take_rarely(&m->in, 8) ? NULL : &shape);
    case 2: return sadmm_world_contacts(m->world, at, take_choice(&m->in, 8) - 1, at == 3 ? NULL : m->contacts);
    case 3: return sadmm_world_body_contact_wrench(m->world, take_body(m), wrench);
    case 4: return sadmm_world_body_state(m->world, take_body(m), NULL);
    case 5: return sadmm_world_record_events(m->world, at);
    case 6: return take_events(m, at);
    case 7: return sadmm_world_sensor_overlaps(m->world, take_shape(m), at > 0 ? 1 : at, &shape, &count);
    default:
        size = (size_t)take_choice(&m->in, sizeof text + 1);
        sadmm_world_explain(m->world, size ? text : NULL, size);
        MUST(size == 0 || memchr(text, 0, size), "explain: no end within %zu bytes", size);
        return SADMM_OK;
    }
}

static sadmm_status make_call(struct machine *m)
{
    sadmm_settings settings;
    sadmm_body_id a;
    sadmm_shape_id s;
    switch (take_choice(&m->in, 24)) {
    case 0: case 1: return add_body(m);
    case 2: case 3: case 4: return add_shape(m);
    case 5: return sadmm_world_remove_body(m->world, take_body(m));
    case 6: return sadmm_world_remove_shape(m->world, take_shape(m));
    case 7: case 8: return set_state(m);
    case 9: return set_wrench(m);
    case 10: case 11:
        settings = take_settings(m, sadmm_world_settings(m->world));
        return sadmm_world_set_settings(m->world, take_rarely(&m->in, 32) ? NULL : &settings);
    case 12:
        a = take_body(m);
        return sadmm_world_set_body_pair_contact(m->world, a, take_body(m), take_choice(&m->in, 2));
    case 13:
        s = take_shape(m);
        return sadmm_world_set_pair_friction(m->world, s, take_shape(m), take_number(&m->in, -1, 1));
    case 14: return freeze(m);
    case 15: case 16: return read_something(m);
    case 17: return set_forces(m);
    case 18: return move(m);
    default: return step(m);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    for (int k = 0; k < HULLS; ++k) hull_at(k); /* before memory runs out */
    for (int k = 0; k < MESHES; ++k) mesh_at_number(k);
    static struct machine m;
    memset(&m, 0, offsetof(struct machine, contacts));
    m.in = bytes_of(data, size);

    sadmm_world_def def = sadmm_world_def_default();
    int backend = take_choice(&m.in, 8);
    def.backend = backend == 0 ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU;
    def.precision = backend < 5 ? SADMM_F64 : SADMM_F32;
    if (take_choice(&m.in, 4) == 3) def.contact_margin = take_number(&m.in, 0, 1);
    def.settings.threads = 1;
    def.settings.iterations = 4;
    if (sadmm_world_create(&def, &m.world) != SADMM_OK) {
        MUST(m.world == NULL && sadmm_last_message()[0], "a world that was refused");
        return 0;
    }
    MUST(sadmm_problem_create(&m.problem) == SADMM_OK, "a problem");

    for (int call = 0; call < MAX_CALLS && bytes_left(&m.in); ++call) {
        struct picture before = inspect(m.world);
        if (take_rarely(&m.in, 32)) sadmm_test_fail_allocations_after(take_choice(&m.in, 32));
        sadmm_status status = make_call(&m);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) continue;
        MUST(status > SADMM_OK && status < SADMM_STATUS_COUNT, "status %d", (int)status);
        MUST(sadmm_world_message(m.world)[0], "%s without a message", sadmm_status_name(status));
        must_be_as_before(m.world, &before, status);
    }
    sadmm_problem_destroy(m.problem);
    sadmm_world_destroy(m.world);
    return 0;
}

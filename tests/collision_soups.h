/* Random shapes for contact finding, and the two pipelines that find the contacts of them, on the host and on a device
 * (emulated: SADMM_CUDA_EMULATED): the same set, in the same order, number for number. */
#ifndef TESTS_COLLISION_SOUPS_H
#define TESTS_COLLISION_SOUPS_H

#include "hull_shapes.h"
#include "mesh_tools.h"

#include "backend_cuda/collide/pipeline.h"
#include "core/base/memory.h"

#ifdef SADMM_CUDA_EMULATED
#include "emulation_control.h"
#endif

/* ---- both pipelines -------------------------------------------------------------------------------------------- */

#define OK(call)                                                                                         \
    do {                                                                                                 \
        struct sadmm_error ok_error = {0};                                                               \
        struct sadmm_error *error = &ok_error;                                                           \
        sadmm_status ok_status = (call);                                                                 \
        ck_assert_msg(ok_status == SADMM_OK, "%s: %s: %s", #call, sadmm_status_name(ok_status), error->message); \
    } while (0)

struct both {
    struct sadmm_collision *host;
    struct sadmm_cuda_collision *device;
    struct sadmm_contact_set host_set, device_set;
};

/* In the place of the number of shapes from which there is a tree. */
enum { BY_GROUPS = -1 };

/* radix: with the sort and the scan of large scenes, whatever the capacities, and their stores. */
static inline struct both both_new_tuned(int32_t tree_from, bool radix)
{
    struct both b = {0};
    struct sadmm_cuda_collision_tuning tuning = {.tree_from = tree_from,
                                                 .group_leaves = tree_from == BY_GROUPS ? INT32_MAX : -1,
                                                 .by_warp_from = radix,
                                                 .radix_from = radix};
    OK(sadmm_collision_create(&b.host, error));
    OK(COLLISION(create)(0, &b.device, error));
    COLLISION(tune)(b.device, &tuning);
    return b;
}

static inline struct both both_new(int32_t tree_from) { return both_new_tuned(tree_from, false); }

static inline void both_free(struct both *b)
{
    sadmm_collision_destroy(b->host);
    COLLISION(destroy)(b->device);
    sadmm_contact_set_free(&b->host_set);
    sadmm_contact_set_free(&b->device_set);
}

static inline bool same_numbers(const double *a, const double *b, int count)
{
    for (int k = 0; k < count; ++k)
        if (!(a[k] == b[k])) return false;
    return true;
}

/* Check writes down every assertion that it passes: there are too many here. */
#define SAME(condition, ...)                                 \
    do {                                                     \
        if (!(condition)) ck_assert_msg(false, __VA_ARGS__); \
    } while (0)

static inline void check_same(const struct sadmm_contact_set *host, const struct sadmm_contact_set *device,
                              const char *about)
{
    SAME(host->pair_count == device->pair_count && host->point_count == device->point_count,
             "%s: %zu pairs and %zu points on the device instead of %zu and %zu", about, device->pair_count,
                  device->point_count, host->pair_count, host->point_count);
    for (size_t i = 0; i < host->pair_count; ++i) {
        const struct sadmm_contact_pair *p = &host->pairs[i], *q = &device->pairs[i];
        SAME(p->shape_a == q->shape_a && p->shape_b == q->shape_b && p->subshape == q->subshape,
                      "%s: pair %zu is %d-%d, subshape %u, instead of %d-%d, subshape %u", about, i, q->shape_a,
                      q->shape_b, q->subshape, p->shape_a, p->shape_b, p->subshape);
        SAME(p->body_a == q->body_a && p->body_b == q->body_b && p->first == q->first &&
                          p->count == q->count && p->cache == q->cache && p->revision == q->revision &&
                          p->placed == q->placed,
                      "%s: pair %zu (shapes %d-%d): %d points from %d, cache %u instead of %d from %d, cache %u", about,
                      i, p->shape_a, p->shape_b, q->count, q->first, q->cache, p->count, p->first, p->cache);
        SAME(same_numbers(p->normal, q->normal, 3) && same_numbers(&p->friction, &q->friction, 1) &&
                          same_numbers(&p->restitution, &q->restitution, 1),
                      "%s: pair %zu (shapes %d-%d): normal %.17g %.17g %.17g instead of %.17g %.17g %.17g", about, i,
                      p->shape_a, p->shape_b, q->normal[0], q->normal[1], q->normal[2], p->normal[0], p->normal[1],
                      p->normal[2]);
    }
    for (size_t k = 0; k < host->point_count; ++k) {
        const struct sadmm_contact_point *p = &host->points[k], *q = &device->points[k];
        SAME(p->feature == q->feature && p->migrates == q->migrates, "%s: point %zu: feature %u instead of %u",
                      about, k, q->feature, p->feature);
        SAME(same_numbers(p->arm_a, q->arm_a, 3) && same_numbers(p->arm_b, q->arm_b, 3) &&
                          same_numbers(&p->separation, &q->separation, 1) && same_numbers(&p->error, &q->error, 1),
                      "%s: point %zu: separation %.17g instead of %.17g", about, k, q->separation, p->separation);
        SAME(same_numbers(p->impulse, q->impulse, 3),
                      "%s: point %zu: impulse %.17g %.17g %.17g instead of %.17g %.17g %.17g", about, k, q->impulse[0],
                      q->impulse[1], q->impulse[2], p->impulse[0], p->impulse[1], p->impulse[2]);
    }
}

/* The next set of both, from what each of them has. */
static inline struct sadmm_cuda_contacts both_find(struct both *b, const struct sadmm_collision_input *input,
                                            const char *about)
{
    struct sadmm_cuda_contacts out = {0};
    OK(sadmm_collision_find(b->host, input, &b->host_set, error));
    OK(COLLISION(find)(b->device, NULL, input, &out, error));
    OK(COLLISION(download)(b->device, NULL, &b->device_set, error));
    ck_assert_uint_eq((size_t)out.counts.pairs, b->device_set.pair_count);
    ck_assert_uint_eq((size_t)out.counts.points, b->device_set.point_count);
    ck_assert_int_ge(out.counts.candidates, out.counts.pairs);
    check_same(&b->host_set, &b->device_set, about);
    return out;
}

static inline void copy_set(struct sadmm_contact_set *to, const struct sadmm_contact_set *from)
{
    ck_assert(SADMM_GROW(to->pairs, 0, from->pair_count));
    ck_assert(SADMM_GROW(to->points, 0, from->point_count));
    if (from->pair_count) memcpy(to->pairs, from->pairs, from->pair_count * sizeof *to->pairs);
    if (from->point_count) memcpy(to->points, from->points, from->point_count * sizeof *to->points);
    to->pair_count = from->pair_count;
    to->point_count = from->point_count;
}

/* Both go on from this set. */
static inline void both_start_from(struct both *b, const struct sadmm_contact_set *set)
{
    copy_set(&b->host_set, set);
    OK(COLLISION(upload)(b->device, NULL, set, error));
}

/* ---- random numbers -------------------------------------------------------------------------------------------- */

static uint64_t random_state;

static inline void seed(uint64_t value) { random_state = value * 2862933555777941757u + 3037000493u; }

/* [0, 1) */
static inline double uniform(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (double)(random_state >> 11) * 0x1p-53;
}

static inline double between(double low, double high) { return low + (high - low) * uniform(); }
static inline int below(int count) { return (int)(uniform() * count); }
static inline bool chance(double share) { return uniform() < share; }

static inline void random_quaternion(double q[4])
{
    double size = 0;
    for (int k = 0; k < 4; ++k) q[k] = between(-1, 1);
    for (int k = 0; k < 4; ++k) size += q[k] * q[k];
    size = sqrt(size);
    for (int k = 0; k < 4; ++k) q[k] = size > 0.1 ? q[k] / size : k == 0;
}

/* Impulses as a solver leaves them: pushing, with some friction. */
static inline void random_impulses(struct sadmm_contact_set *set)
{
    for (size_t i = 0; i < set->pair_count; ++i)
        for (int32_t j = 0; j < set->pairs[i].count; ++j) {
            double push = chance(0.2) ? 0 : uniform();
            for (int k = 0; k < 3; ++k)
                set->points[set->pairs[i].first + j].impulse[k] = push * (set->pairs[i].normal[k] + between(-0.5, 0.5));
        }
}

/* ---- soups ----------------------------------------------------------------------------------------------------- */

struct shape_soup {
    struct sadmm_shape *shapes;
    struct sadmm_geometry *geometries; /* one a shape */
    struct sadmm_collision_body *bodies;
    uint64_t *disabled, *friction;
    double *values;
    struct sadmm_collision_input input;
    uint32_t revisions;
    struct test_shape_data *shape_data; /* of hulls; NULL: there are none */
    struct sadmm_geometry forms[8];
    struct sadmm_geometry meshes[4];
};

struct soup_kind {
    const char *name;
    int bodies, shapes_a_body, groups, planes;
    double density;         /* expected overlaps grow with it */
    double size_low, size_high;
    double static_share, filter_share, disabled_share, friction_share, dead_share;
    int steps, tree_from; /* or BY_GROUPS */
    int subshapes;          /* of a geometry, at most; 0: one */
    int hulls;              /* forms of hulls; 0: no shape is one */
    int meshes;             /* forms of meshes, what static bodies are; 0: none is */
    double smooth;          /* share of cylinders, cones and ellipsoids */
};

static inline int compare_keys(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Sorted pairs of two slots out of `slots`, each once. */
static inline size_t random_pairs(uint64_t *keys, size_t wanted, int slots)
{
    size_t n = 0;
    for (size_t i = 0; i < wanted; ++i) {
        uint32_t a = (uint32_t)below(slots), b = (uint32_t)below(slots);
        if (a != b) keys[n++] = a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
    }
    qsort(keys, n, sizeof *keys, compare_keys);
    size_t kept = 0;
    for (size_t i = 0; i < n; ++i)
        if (kept == 0 || keys[kept - 1] != keys[i]) keys[kept++] = keys[i];
    return kept;
}

static inline void random_shape(struct shape_soup *s, const struct soup_kind *kind, struct sadmm_shape *shape, int body)
{
    struct sadmm_geometry *geometry = &s->geometries[shape - s->shapes];
    memset(shape, 0, sizeof *shape);
    shape->geometry = (uint32_t)(shape - s->shapes);
    geometry->type = SADMM_SHAPE_SPHERE + below(3);
    geometry->subshapes = 1 + (kind->subshapes ? below(kind->subshapes) : 0);
    for (int k = 0; k < 3; ++k) geometry->size[k] = kind->size_low * pow(kind->size_high / kind->size_low, uniform());
    if (chance(0.3)) geometry->size[1] = geometry->size[2] = geometry->size[0];
    if (kind->smooth > 0 && chance(kind->smooth)) geometry->type = SADMM_SHAPE_CYLINDER + below(3);
    else if (kind->hulls && chance(0.6)) *geometry = s->forms[below(kind->hulls)];
    random_quaternion(shape->orientation);
    if (kind->shapes_a_body > 1)
        for (int k = 0; k < 3; ++k) shape->position[k] = between(-1, 1) * geometry->size[0];
    shape->friction = below(3) * 0.25;
    shape->restitution = uniform();
    shape->category = chance(kind->filter_share) ? 1u << below(4) : 1;
    shape->mask = chance(kind->filter_share) ? 1u << below(4) | 1u << below(4) : UINT32_MAX;
    shape->body = body;
    shape->alive = !chance(kind->dead_share);
    shape->revision = ++s->revisions;
}

static inline double rough(double x, double y)
{
    return 0.1 * (sin(5 * x) + cos(7 * y)) + 0.2 * fabs(x);
}

/* A mesh in the shape data: a rough ground, a ball, a box in pieces, a heightfield. */
static inline struct sadmm_geometry mesh_in_data(struct test_shape_data *shape_data, int form, double size)
{
    struct sadmm_geometry geometry = {.type = SADMM_SHAPE_MESH, .hull = (uint32_t)shape_data->used};
    const double half[3] = {size, 2 * size, 0.5 * size};
    double heights[20 * 15];
    sadmm_mesh *mesh = NULL;
    if (form < 3) {
        struct soup *s = form == 0   ? soup_ground(12, 9, size / 3, 0.24, 3, rough)
                         : form == 1 ? soup_ball(half, 5)
                                     : soup_box(half, 4);
        mesh = soup_mesh(s);
        free(s);
    } else {
        const sadmm_heightfield_def def = {sizeof def, heights, 20, 15, {size / 4, size / 3}};
        for (int i = 0; i < 20 * 15; ++i) heights[i] = size * (uniform() - 0.5);
        ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
    }
    ck_assert_uint_le(shape_data->used + mesh->doubles, TEST_SHAPE_DATA);
    memcpy(shape_data->numbers + shape_data->used, mesh->block, mesh->doubles * sizeof *shape_data->numbers);
    shape_data->used += mesh->doubles;
    memcpy(geometry.size, mesh->half, sizeof geometry.size);
    sadmm_mesh_destroy(mesh);
    return geometry;
}

static inline struct shape_soup shape_soup_new(const struct soup_kind *kind, uint64_t number)
{
    struct shape_soup s = {0};
    const int bodies = kind->bodies + kind->planes, shapes = kind->bodies * kind->shapes_a_body + kind->planes;
    const size_t overrides = 4 * (size_t)bodies + 1;
    double volume = 0;
    int32_t dynamic = 0;
    seed(number);
    if (kind->hulls || kind->smooth > 0) {
        uint64_t state = 4711 + number;
        s.shape_data = test_shape_data_new();
        for (int form = 0; form < kind->hulls; ++form) {
            double size[3];
            struct test_hull h;
            for (int k = 0; k < 3; ++k) size[k] = between(kind->size_low, kind->size_high);
            if (form == 0) box_hull(size, &h);
            else if (form == 1) prism_hull(20, 0.5, &h);
            else random_hull(&state, form == 2 ? 60 : 6 + below(20), size, &h);
            if (form > 2 || chance(0.3)) h.convex_radius = between(0, 0.3 * kind->size_low);
            s.forms[form] = test_shape_data_add(s.shape_data, &h);
        }
        for (int form = 0; form < kind->meshes; ++form)
            s.meshes[form] = mesh_in_data(s.shape_data, form, 3 * kind->size_high);
        s.input.hulls = s.shape_data->numbers;
        s.input.hull_doubles = s.shape_data->used;
        s.input.hull_revision = (uint32_t)number;
    }
    s.shapes = calloc((size_t)shapes + 1, sizeof *s.shapes);
    s.geometries = calloc((size_t)shapes + 1, sizeof *s.geometries);
    s.bodies = calloc((size_t)bodies + 1, sizeof *s.bodies);
    s.disabled = calloc(overrides, sizeof *s.disabled);
    s.friction = calloc(overrides, sizeof *s.friction);
    s.values = calloc(overrides, sizeof *s.values);
    /* planes among the others */
    for (int i = 0, plane = 0; i < shapes; ++i) {
        const int body = kind->planes && i % (shapes / (kind->planes + 1) + 1) == 3 && plane < kind->planes
                             ? kind->bodies + plane : i % (kind->bodies ? kind->bodies : 1);
        random_shape(&s, kind, &s.shapes[i], body);
        if (body < kind->bodies) {
            const double *size = s.geometries[i].size;
            volume += pow(2 * fmax(size[0], fmax(size[1], size[2])), 3);
        } else {
            ++plane;
            s.geometries[i].type = SADMM_SHAPE_PLANE;
            s.shapes[i].alive = true;
        }
    }
    const double half = 0.5 * cbrt(volume / kind->density / (kind->groups > 1 ? kind->groups : 1));
    for (int i = 0; i < bodies; ++i) {
        struct sadmm_collision_body *b = &s.bodies[i];
        const bool plane = i >= kind->bodies, still = plane || chance(kind->static_share);
        for (int k = 0; k < 3; ++k) b->position[k] = between(-half, half);
        random_quaternion(b->orientation);
        b->environment = kind->groups > 1 ? below(kind->groups) : 0;
        b->system_body = still ? -1 : dynamic++;
        if (still && chance(0.5)) b->environment = -1;
        for (int k = 0; k < shapes && still && !plane && kind->meshes; ++k)
            if (s.shapes[k].body == i) s.geometries[k] = s.meshes[below(kind->meshes)];
        if (plane) {
            const double wall[4] = {sqrt(0.5), i % 2 ? sqrt(0.5) : 0, i % 2 ? 0 : sqrt(0.5), 0};
            memcpy(b->orientation, wall, sizeof wall);
            for (int k = 0; k < 3; ++k) b->position[k] = -0.8 * half;
        }
        for (int k = 0; k < 6 && !still; ++k) b->velocity[k] = between(-1, 1) * (k < 3 ? half : 3);
        if (!still) b->inertia = exp(between(-9, 0));
        if (chance(0.02)) /* a bullet */
            for (int k = 0; k < 3; ++k) b->velocity[k] *= 30;
    }
    s.input.shapes = s.shapes;
    s.input.shape_count = (size_t)shapes;
    s.input.geometries = s.geometries;
    s.input.geometry_count = (size_t)shapes;
    s.input.bodies = s.bodies;
    s.input.body_count = (size_t)bodies;
    s.input.dt = 0.01;
    s.input.margin = 0.02;
    s.input.threads = 1;
    s.input.gravity = 9.81;
    s.input.disabled_body_pairs = s.disabled;
    s.input.friction_pairs = s.friction;
    s.input.friction_values = s.values;
    if (chance(kind->disabled_share))
        s.input.disabled_body_pair_count = random_pairs(s.disabled, overrides - 1, bodies);
    if (chance(kind->friction_share))
        s.input.friction_pair_count = random_pairs(s.friction, overrides - 1, shapes);
    for (size_t i = 0; i < overrides; ++i) s.values[i] = uniform();
    return s;
}

static inline void shape_soup_free(struct shape_soup *s)
{
    free(s->shapes);
    free(s->geometries);
    free(s->bodies);
    free(s->disabled);
    free(s->friction);
    free(s->values);
    free(s->shape_data);
}

/* A step later: everything moved, some shapes gone, new or others. */
static inline void soup_advance(struct shape_soup *s, const struct soup_kind *kind)
{
    for (int i = 0; i < kind->bodies; ++i) {
        struct sadmm_collision_body *b = &s->bodies[i];
        double turn[4], q[4];
        if (b->system_body < 0) continue;
        for (int k = 0; k < 3; ++k) b->position[k] += s->input.dt * b->velocity[k];
        /* q <- (1, w dt / 2) q, normalised */
        turn[0] = 1;
        for (int k = 0; k < 3; ++k) turn[k + 1] = 0.5 * s->input.dt * b->velocity[3 + k];
        memcpy(q, b->orientation, sizeof q);
        b->orientation[0] = turn[0] * q[0] - turn[1] * q[1] - turn[2] * q[2] - turn[3] * q[3];
        b->orientation[1] = turn[0] * q[1] + turn[1] * q[0] + turn[2] * q[3] - turn[3] * q[2];
        b->orientation[2] = turn[0] * q[2] - turn[1] * q[3] + turn[2] * q[0] + turn[3] * q[1];
        b->orientation[3] = turn[0] * q[3] + turn[1] * q[2] - turn[2] * q[1] + turn[3] * q[0];
        double size = 0;
        for (int k = 0; k < 4; ++k) size += b->orientation[k] * b->orientation[k];
        for (int k = 0; k < 4; ++k) b->orientation[k] /= sqrt(size);
    }
    for (size_t i = 0; i < s->input.shape_count && kind->dead_share > 0; ++i)
        if (s->geometries[i].type != SADMM_SHAPE_PLANE && chance(0.05))
            random_shape(s, kind, &s->shapes[i], s->shapes[i].body);
}

#endif

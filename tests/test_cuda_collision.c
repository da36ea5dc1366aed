/* Contact finding on the CUDA device against the host pipeline: the same set, in the same order, number for number.
 *
 * Every formula is the host's, in double and without contraction, so there are no tolerances: a difference of one bit
 * in a gap or an arm is a failure. Inputs are scenes that the CPU backend steps and random soups. The same checks run
 * on the emulated device (test_cuda_collision_emulated.c, cuda_emulation/), where every build can run them; here they
 * run on a real one, or the program is skipped and says why. One file: nearly all tests run the same two pipelines
 * (`both`), most of them on the same random soups.
 */
#include "hull_pool.h"
#include "mesh_tools.h"
#include "scene_tools.h"

#include "backend_cuda/collide/pipeline.h"
#include "core/base/memory.h"
#include "core/world/world_internal.h"

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

/* radix: with the sort and the scan of large scenes, whatever the capacities. */
static struct both both_new_tuned(int32_t tree_from, bool radix)
{
    struct both b = {0};
    struct sadmm_cuda_collision_tuning tuning = {.tree_from = tree_from, .radix_from = radix};
    OK(sadmm_collision_create(&b.host, error));
    OK(COLLISION(create)(0, &b.device, error));
    COLLISION(tune)(b.device, &tuning);
    return b;
}

static struct both both_new(int32_t tree_from) { return both_new_tuned(tree_from, false); }

static void both_free(struct both *b)
{
    sadmm_collision_destroy(b->host);
    COLLISION(destroy)(b->device);
    sadmm_contact_set_free(&b->host_set);
    sadmm_contact_set_free(&b->device_set);
}

static bool same_numbers(const double *a, const double *b, int count)
{
    for (int k = 0; k < count; ++k)
        if (!(a[k] == b[k])) return false;
    return true;
}

static void check_same(const struct sadmm_contact_set *host, const struct sadmm_contact_set *device, const char *about)
{
    ck_assert_msg(host->pair_count == device->pair_count && host->point_count == device->point_count,
                  "%s: %zu pairs and %zu points on the device instead of %zu and %zu", about, device->pair_count,
                  device->point_count, host->pair_count, host->point_count);
    for (size_t i = 0; i < host->pair_count; ++i) {
        const struct sadmm_contact_pair *p = &host->pairs[i], *q = &device->pairs[i];
        ck_assert_msg(p->shape_a == q->shape_a && p->shape_b == q->shape_b && p->child == q->child,
                      "%s: pair %zu is %d-%d, child %u, instead of %d-%d, child %u", about, i, q->shape_a, q->shape_b,
                      q->child, p->shape_a, p->shape_b, p->child);
        ck_assert_msg(p->body_a == q->body_a && p->body_b == q->body_b && p->first == q->first &&
                          p->count == q->count && p->cache == q->cache && p->revision == q->revision &&
                          p->placed == q->placed,
                      "%s: pair %zu (shapes %d-%d): %d points from %d, cache %u instead of %d from %d, cache %u", about,
                      i, p->shape_a, p->shape_b, q->count, q->first, q->cache, p->count, p->first, p->cache);
        ck_assert_msg(same_numbers(p->normal, q->normal, 3) && same_numbers(&p->friction, &q->friction, 1) &&
                          same_numbers(&p->restitution, &q->restitution, 1),
                      "%s: pair %zu (shapes %d-%d): normal %.17g %.17g %.17g instead of %.17g %.17g %.17g", about, i,
                      p->shape_a, p->shape_b, q->normal[0], q->normal[1], q->normal[2], p->normal[0], p->normal[1],
                      p->normal[2]);
    }
    for (size_t k = 0; k < host->point_count; ++k) {
        const struct sadmm_contact_point *p = &host->points[k], *q = &device->points[k];
        ck_assert_msg(p->feature == q->feature && p->reserved == q->reserved, "%s: point %zu: feature %u instead of %u",
                      about, k, q->feature, p->feature);
        ck_assert_msg(same_numbers(p->arm_a, q->arm_a, 3) && same_numbers(p->arm_b, q->arm_b, 3) &&
                          same_numbers(&p->gap, &q->gap, 1) && same_numbers(&p->error, &q->error, 1),
                      "%s: point %zu: gap %.17g instead of %.17g", about, k, q->gap, p->gap);
        ck_assert_msg(same_numbers(p->impulse, q->impulse, 3),
                      "%s: point %zu: impulse %.17g %.17g %.17g instead of %.17g %.17g %.17g", about, k, q->impulse[0],
                      q->impulse[1], q->impulse[2], p->impulse[0], p->impulse[1], p->impulse[2]);
    }
}

/* The next set of both, from what each of them has. */
static struct sadmm_cuda_contacts both_find(struct both *b, const struct sadmm_collision_input *input,
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

static void copy_set(struct sadmm_contact_set *to, const struct sadmm_contact_set *from)
{
    ck_assert(sadmm_grow((void **)&to->pairs, &to->pair_capacity, 0, from->pair_count, sizeof *to->pairs));
    ck_assert(sadmm_grow((void **)&to->points, &to->point_capacity, 0, from->point_count, sizeof *to->points));
    if (from->pair_count) memcpy(to->pairs, from->pairs, from->pair_count * sizeof *to->pairs);
    if (from->point_count) memcpy(to->points, from->points, from->point_count * sizeof *to->points);
    to->pair_count = from->pair_count;
    to->point_count = from->point_count;
}

/* Both go on from this set. */
static void both_start_from(struct both *b, const struct sadmm_contact_set *set)
{
    copy_set(&b->host_set, set);
    OK(COLLISION(upload)(b->device, NULL, set, error));
}

/* ---- random numbers -------------------------------------------------------------------------------------------- */

static uint64_t random_state;

static void seed(uint64_t value) { random_state = value * 2862933555777941757u + 3037000493u; }

/* [0, 1) */
static double uniform(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (double)(random_state >> 11) * 0x1p-53;
}

static double between(double low, double high) { return low + (high - low) * uniform(); }
static int below(int count) { return (int)(uniform() * count); }
static bool chance(double share) { return uniform() < share; }

static void random_quaternion(double q[4])
{
    double size = 0;
    for (int k = 0; k < 4; ++k) q[k] = between(-1, 1);
    for (int k = 0; k < 4; ++k) size += q[k] * q[k];
    size = sqrt(size);
    for (int k = 0; k < 4; ++k) q[k] = size > 0.1 ? q[k] / size : k == 0;
}

/* Impulses as a solver leaves them: pushing, with some friction. */
static void random_impulses(struct sadmm_contact_set *set)
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
    struct test_pool *pool;    /* of hulls; NULL: there are none */
    struct sadmm_geometry forms[8];
    struct sadmm_geometry meshes[4];
};

struct soup_kind {
    const char *name;
    int bodies, shapes_a_body, groups, planes;
    double density;         /* expected overlaps grow with it */
    double size_low, size_high;
    double static_share, filter_share, disabled_share, friction_share, dead_share;
    int steps, tree_from;
    int children;           /* of a geometry, at most; 0: one */
    int hulls;              /* forms of hulls; 0: no shape is one */
    int meshes;             /* forms of meshes, what static bodies are; 0: none is */
    double smooth;          /* share of cylinders, cones and ellipsoids */
};

static int compare_keys(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Sorted pairs of two slots out of `slots`, each once. */
static size_t random_pairs(uint64_t *keys, size_t wanted, int slots)
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

static void random_shape(struct shape_soup *s, const struct soup_kind *kind, struct sadmm_shape *shape, int body)
{
    struct sadmm_geometry *geometry = &s->geometries[shape - s->shapes];
    memset(shape, 0, sizeof *shape);
    shape->geometry = (uint32_t)(shape - s->shapes);
    geometry->type = SADMM_SHAPE_SPHERE + below(3);
    geometry->children = 1 + (kind->children ? below(kind->children) : 0);
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

static double rough(double x, double y)
{
    return 0.1 * (sin(5 * x) + cos(7 * y)) + 0.2 * fabs(x);
}

/* A mesh in the pool: a rough ground, a ball, a box in pieces, a heightfield. */
static struct sadmm_geometry pooled_mesh(struct test_pool *pool, int form, double size)
{
    struct sadmm_geometry geometry = {.type = SADMM_SHAPE_MESH, .hull = (uint32_t)pool->used};
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
        const sadmm_heightfield_def def = {heights, 20, 15, {size / 4, size / 3}};
        for (int i = 0; i < 20 * 15; ++i) heights[i] = size * (uniform() - 0.5);
        ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
    }
    ck_assert_uint_le(pool->used + mesh->doubles, TEST_POOL);
    memcpy(pool->numbers + pool->used, mesh->block, mesh->doubles * sizeof *pool->numbers);
    pool->used += mesh->doubles;
    memcpy(geometry.size, mesh->half, sizeof geometry.size);
    sadmm_mesh_destroy(mesh);
    return geometry;
}

static struct shape_soup shape_soup_new(const struct soup_kind *kind, uint64_t number)
{
    struct shape_soup s = {0};
    const int bodies = kind->bodies + kind->planes, shapes = kind->bodies * kind->shapes_a_body + kind->planes;
    const size_t overrides = 4 * (size_t)bodies + 1;
    double volume = 0;
    int32_t dynamic = 0;
    seed(number);
    if (kind->hulls || kind->smooth > 0) {
        uint64_t state = 4711 + number;
        s.pool = test_pool_new();
        for (int form = 0; form < kind->hulls; ++form) {
            double size[3];
            struct test_hull h;
            for (int k = 0; k < 3; ++k) size[k] = between(kind->size_low, kind->size_high);
            if (form == 0) box_hull(size, &h);
            else if (form == 1) prism_hull(20, 0.5, &h);
            else random_hull(&state, form == 2 ? 60 : 6 + below(20), size, &h);
            if (form > 2 || chance(0.3)) h.rounding = between(0, 0.3 * kind->size_low);
            s.forms[form] = test_pool_add(s.pool, &h);
        }
        for (int form = 0; form < kind->meshes; ++form)
            s.meshes[form] = pooled_mesh(s.pool, form, 3 * kind->size_high);
        s.input.hulls = s.pool->numbers;
        s.input.hull_doubles = s.pool->used;
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

static void shape_soup_free(struct shape_soup *s)
{
    free(s->shapes);
    free(s->geometries);
    free(s->bodies);
    free(s->disabled);
    free(s->friction);
    free(s->values);
    free(s->pool);
}

/* A step later: everything moved, some shapes gone, new or others. */
static void soup_advance(struct shape_soup *s, const struct soup_kind *kind)
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

static const struct soup_kind soups[] = {
    {.name = "loose, all pairs", .bodies = 120, .shapes_a_body = 1, .planes = 1, .density = 1, .size_low = 0.5,
     .size_high = 1, .static_share = 0.1, .steps = 4, .tree_from = 1000000},
    {.name = "loose, tree", .bodies = 120, .shapes_a_body = 1, .planes = 1, .density = 1, .size_low = 0.5,
     .size_high = 1, .static_share = 0.1, .steps = 4, .tree_from = 1},
    {.name = "sizes 1e-3 to 1e3, tree", .bodies = 700, .shapes_a_body = 1, .planes = 2, .density = 4, .size_low = 1e-3,
     .size_high = 1e3, .static_share = 0.2, .steps = 2, .tree_from = 1},
    {.name = "sizes 1e-3 to 1e3, all pairs", .bodies = 200, .shapes_a_body = 1, .planes = 2, .density = 4,
     .size_low = 1e-3, .size_high = 1e3, .static_share = 0.2, .steps = 3},
    {.name = "environments in one place, tree", .bodies = 400, .shapes_a_body = 1, .groups = 20, .planes = 12,
     .density = 2, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .steps = 3, .tree_from = 1},
    {.name = "environments in one place, all pairs", .bodies = 200, .shapes_a_body = 1, .groups = 5, .planes = 6,
     .density = 2, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .steps = 3},
    {.name = "several shapes a body, filters, overrides, tree", .bodies = 100, .shapes_a_body = 4, .planes = 2,
     .density = 3, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .filter_share = 0.5, .disabled_share = 1,
     .friction_share = 1, .dead_share = 0.2, .steps = 5, .tree_from = 1},
    {.name = "several shapes a body, filters, overrides, all pairs", .bodies = 60, .shapes_a_body = 4, .planes = 2,
     .density = 3, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .filter_share = 0.5, .disabled_share = 1,
     .friction_share = 1, .dead_share = 0.2, .steps = 5},
    {.name = "several manifolds a pair, tree", .bodies = 90, .shapes_a_body = 2, .groups = 3, .planes = 4, .density = 2,
     .size_low = 0.3, .size_high = 1, .static_share = 0.2, .friction_share = 1, .dead_share = 0.1, .steps = 4,
     .tree_from = 1, .children = 3},
    {.name = "several manifolds a pair, all pairs", .bodies = 90, .shapes_a_body = 2, .planes = 2, .density = 2,
     .size_low = 0.3, .size_high = 1, .static_share = 0.2, .friction_share = 1, .dead_share = 0.1, .steps = 4,
     .children = 3},
    {.name = "more than small tiles are for, all pairs", .bodies = 1100, .shapes_a_body = 1, .planes = 1, .density = 2,
     .size_low = 0.3, .size_high = 1, .static_share = 0.1, .steps = 1, .tree_from = 1000000},
    {.name = "hulls among others, tree", .bodies = 150, .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 0.3,
     .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4, .tree_from = 1, .hulls = 6},
    {.name = "hulls among others, all pairs", .bodies = 60, .shapes_a_body = 2, .planes = 1, .density = 3,
     .size_low = 0.3, .size_high = 1, .static_share = 0.1, .friction_share = 1, .steps = 4, .hulls = 6},
    {.name = "on meshes, tree", .bodies = 100, .shapes_a_body = 1, .groups = 3, .planes = 2, .density = 3, .size_low = 0.3,
     .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4, .tree_from = 1, .hulls = 5, .meshes = 4},
    {.name = "on meshes, all pairs", .bodies = 60, .shapes_a_body = 1, .planes = 1, .density = 3, .size_low = 0.3,
     .size_high = 1, .static_share = 0.1, .friction_share = 1, .steps = 4, .hulls = 5, .meshes = 4},
    {.name = "smooth bodies alone, tree", .bodies = 100, .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 0.1,
     .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4, .tree_from = 1, .smooth = 1},
    {.name = "smooth bodies among all others, all pairs", .bodies = 80, .shapes_a_body = 2, .planes = 1, .density = 3,
     .size_low = 0.2, .size_high = 1, .static_share = 0.1, .friction_share = 1, .steps = 4, .hulls = 6, .smooth = 0.5},
    {.name = "smooth bodies and hulls on meshes, tree", .bodies = 100, .shapes_a_body = 1, .planes = 1, .density = 3,
     .size_low = 0.3, .size_high = 1, .static_share = 0.15, .steps = 4, .tree_from = 1, .hulls = 3, .meshes = 4,
     .smooth = 0.7},
};
enum { SOUPS = sizeof soups / sizeof *soups };

/* Chained: each find starts from what the one before left where it was made. Impulses are put in after the first. */
START_TEST(soups_equal_host)
{
    const struct soup_kind *kind = &soups[_i];
    size_t pairs = 0;
    for (uint64_t number = 1; number <= 2; ++number) {
        struct shape_soup s = shape_soup_new(kind, number);
        struct both b = both_new_tuned(kind->tree_from, number == 2);
        for (int step = 0; step < kind->steps; ++step) {
            char about[128];
            snprintf(about, sizeof about, "%s, soup %d, step %d", kind->name, (int)number, step);
            both_find(&b, &s.input, about);
            pairs += b.host_set.pair_count;
            if (step == 0) {
                random_impulses(&b.host_set);
                both_start_from(&b, &b.host_set);
            }
            soup_advance(&s, kind);
        }
        both_free(&b);
        shape_soup_free(&s);
    }
    ck_assert_uint_gt(pairs, 100); /* or the soup shows little */
}
END_TEST

/* ---- scenes ---------------------------------------------------------------------------------------------------- */

static struct sadmm_collision_input world_input(const sadmm_world *world, struct sadmm_collision_body *bodies)
{
    struct sadmm_collision_input input = {
        .shapes = world->shapes,
        .shape_count = world->shape_slots,
        .geometries = world->geometries,
        .geometry_count = world->shape_slots,
        .bodies = bodies,
        .body_count = world->body_slots,
        .dt = world->def.settings.dt,
        .margin = world->def.contact_margin,
        .threads = 1,
        .disabled_body_pairs = world->disabled_pairs.keys,
        .disabled_body_pair_count = world->disabled_pairs.count,
        .friction_pairs = world->friction_pairs.keys,
        .friction_values = world->friction_pairs.values,
        .friction_pair_count = world->friction_pairs.count,
    };
    int32_t dynamic = 0;
    for (size_t slot = 0; slot < world->body_slots; ++slot) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        memcpy(bodies[slot].position, body->rigid.position, sizeof bodies[slot].position);
        memcpy(bodies[slot].orientation, body->rigid.orientation, sizeof bodies[slot].orientation);
        memcpy(bodies[slot].velocity, body->rigid.velocity, sizeof bodies[slot].velocity);
        bodies[slot].inertia = body->rigid.inertia[0];
        bodies[slot].environment = body->environment;
        bodies[slot].system_body = body->alive && body->type == SADMM_BODY_DYNAMIC ? dynamic++ : -1;
    }
    return input;
}

static const struct {
    const char *spec;
    int steps;
    bool resting; /* contacts from the first step on */
} scenes[] = {
    {"card_houses:3", 20, true}, {"sliding_cubes:20", 20, false}, {"pile:100", 15, false}, {"pyramid:6", 10, true},
    {"oblique_stacks:3", 10, true}, {"vertical_stacks:6", 10, true}, {"spin_plate", 10, false},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

/* The previous set is the world's, with the impulses that the solver found. */
START_TEST(scenes_equal_host)
{
    const bool tree = _i % 2;
    struct sadmm_scene scene = open_scene(scenes[_i / 2].spec);
    scene.def.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = build_scene(&scene);
    struct sadmm_collision_body *bodies = calloc(world->body_slots, sizeof *bodies);
    struct both b = both_new(tree ? 1 : 1000000);
    size_t points = 0, pushing = 0;
    for (int step = 0; step < scenes[_i / 2].steps; ++step) {
        char about[96];
        struct sadmm_error error = {0};
        snprintf(about, sizeof about, "%s, %s, step %d", scenes[_i / 2].spec, tree ? "tree" : "all pairs", step);
        ck_assert_int_eq(sadmm_scene_before_step(&scene, world, step, &error), SADMM_OK);
        step_world(world, 1);
        struct sadmm_collision_input input = world_input(world, bodies);
        both_start_from(&b, &world->contacts);
        both_find(&b, &input, about);
        points += b.host_set.point_count;
        for (size_t k = 0; k < b.host_set.point_count; ++k) pushing += norm3(b.host_set.points[k].impulse) > 0;
    }
    if (scenes[_i / 2].resting) {
        ck_assert_uint_gt(points, 0);
        ck_assert_uint_gt(pushing, points / 4); /* impulses were carried over */
    }
    free(bodies);
    both_free(&b);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- capacities ------------------------------------------------------------------------------------------------ */

/* A find that starts with capacities of one candidate and one point repeats until everything fits, and drops nothing;
 * then nothing is allocated any more while the numbers stay. */
START_TEST(capacities_grow)
{
    const struct soup_kind *kind = &soups[_i % SOUPS];
    struct shape_soup s = shape_soup_new(kind, 3);
    struct both b = both_new(0);
    const bool radix = _i / SOUPS;
    struct sadmm_cuda_collision_tuning tight = {.tree_from = kind->tree_from, .radix_from = radix, .first_capacity = 1};
    COLLISION(tune)(b.device, &tight);
    struct sadmm_cuda_contacts out = both_find(&b, &s.input, kind->name);
    struct sadmm_cuda_collision_stats first = COLLISION(stats)(b.device);
    ck_assert_int_gt(out.counts.points, 1);
    ck_assert_int_ge(first.repeats, 1);
    /* each capacity once, for the counts are exact; before that pairs with meshes, whose triangles nobody has counted
     * yet */
    ck_assert_int_le(first.repeats, kind->meshes ? 3 : 2);
    ck_assert_int_ge(first.candidate_capacity, out.counts.candidates);
    ck_assert_int_ge(first.point_capacity, out.counts.points);

    both_find(&b, &s.input, kind->name); /* the other set */
    struct sadmm_cuda_collision_stats second = COLLISION(stats)(b.device);
    for (int i = 0; i < 3; ++i) both_find(&b, &s.input, kind->name);
    struct sadmm_cuda_collision_stats last = COLLISION(stats)(b.device);
    ck_assert_int_eq(last.allocations, second.allocations);
    ck_assert_int_eq(last.repeats, first.repeats);
    ck_assert_int_eq(last.finds, 5);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* Capacities too small in the middle of a run: the previous step's impulses are still there for the repeated stage. */
START_TEST(capacities_grow_later)
{
    const struct soup_kind *kind = &soups[6];
    struct shape_soup s = shape_soup_new(kind, 4);
    struct both b = both_new(kind->tree_from);
    struct sadmm_cuda_collision_tuning tight = {.tree_from = kind->tree_from, .first_capacity = 2};
    both_find(&b, &s.input, "first");
    random_impulses(&b.host_set);
    both_start_from(&b, &b.host_set);
    for (int step = 0; step < 3; ++step) {
        COLLISION(tune)(b.device, &tight);
        both_find(&b, &s.input, "after the capacities were taken back");
        soup_advance(&s, kind);
    }
    ck_assert_int_ge(COLLISION(stats)(b.device).repeats, 3);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* ---- edges ----------------------------------------------------------------------------------------------------- */

static struct sadmm_geometry geometry_of(int type, double s0, double s1, double s2)
{
    struct sadmm_geometry geometry = {.type = type, .children = 1, .size = {s0, s1, s2}};
    return geometry;
}

static struct sadmm_geometry ball(double radius) { return geometry_of(SADMM_SHAPE_SPHERE, radius, 0, 0); }

/* The shape of a body; of the geometry of that number. */
static struct sadmm_shape shape_of(int body)
{
    struct sadmm_shape shape = {.geometry = (uint32_t)body, .orientation = {1, 0, 0, 0}, .friction = 0.5, .category = 1,
                                .mask = UINT32_MAX, .body = body, .alive = true, .revision = (uint32_t)body + 1};
    return shape;
}

/* No shapes, planes alone, one shape, one shape on a plane, everything dead. */
START_TEST(few_shapes)
{
    struct both b = both_new(_i ? 1 : 1000000);
    struct sadmm_collision_body bodies[3] = {
        {.orientation = {1, 0, 0, 0}, .system_body = -1, .environment = -1},
        {.position = {0, 0, 0.5}, .orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0, 0, 1.4}, .orientation = {1, 0, 0, 0}, .system_body = 1},
    };
    struct sadmm_geometry geometries[3] = {geometry_of(SADMM_SHAPE_PLANE, 0, 0, 0), ball(0.5), ball(0.5)};
    struct sadmm_shape shapes[3] = {shape_of(0), shape_of(1), shape_of(2)};
    struct sadmm_collision_input input = {.shapes = shapes, .geometries = geometries, .geometry_count = 3,
                                          .bodies = bodies, .body_count = 3, .dt = 0.01, .margin = 0.02};
    for (int round = 0; round < 2; ++round)
        for (size_t count = 0; count <= 3; ++count) {
            input.shape_count = count;
            both_find(&b, &input, "few shapes");
            ck_assert_uint_eq(b.device_set.pair_count, count > 0 ? count - 1 : 0);
        }
    for (int i = 0; i < 3; ++i) {
        shapes[i].alive = false;
        ++shapes[i].revision;
    }
    both_find(&b, &input, "dead shapes");
    ck_assert_uint_eq(b.device_set.pair_count, 0);
    both_free(&b);
}
END_TEST

/* Equal Morton codes: spheres in one place, beside one body so far away that the grid would otherwise be one cell. */
START_TEST(one_place)
{
    enum { COUNT = 48 };
    struct sadmm_shape shapes[COUNT];
    struct sadmm_geometry geometries[COUNT];
    struct sadmm_collision_body bodies[COUNT];
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = COUNT, .geometries = geometries,
                                          .geometry_count = COUNT, .bodies = bodies, .body_count = COUNT, .dt = 0.01,
                                          .margin = 0.02};
    struct both b = both_new(1);
    memset(bodies, 0, sizeof bodies);
    for (int i = 0; i < COUNT; ++i) {
        shapes[i] = shape_of(i);
        geometries[i] = ball(i % 7 ? 0.1 : 20);
        bodies[i].orientation[0] = 1;
        bodies[i].system_body = i;
    }
    bodies[5].position[0] = 1e9;
    both_find(&b, &input, "one place");
    ck_assert_uint_eq(b.device_set.pair_count, (COUNT - 1) * (COUNT - 2) / 2);
    both_free(&b);
}
END_TEST

/* A shape that takes over a slot inherits nothing; one whose neighbour changed neither. */
START_TEST(slots_are_reused)
{
    struct sadmm_geometry geometries[3] = {ball(0.5), ball(0.5), ball(0.5)};
    struct sadmm_shape shapes[3] = {shape_of(0), shape_of(1), shape_of(2)};
    struct sadmm_collision_body bodies[3] = {
        {.orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0, 0, 0.95}, .orientation = {1, 0, 0, 0}, .system_body = 1},
        {.position = {0, 0, 1.9}, .orientation = {1, 0, 0, 0}, .system_body = 2},
    };
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 3, .geometries = geometries,
                                          .geometry_count = 3, .bodies = bodies, .body_count = 3, .dt = 0.01,
                                          .margin = 0.02};
    struct both b = both_new(0);
    both_find(&b, &input, "first");
    ck_assert_uint_eq(b.device_set.point_count, 2);
    for (int k = 0; k < 2; ++k) b.host_set.points[k].impulse[2] = 1 + k;
    both_start_from(&b, &b.host_set);
    geometries[2] = ball(0.49);
    shapes[2].revision = 9;
    both_find(&b, &input, "another sphere in the third slot");
    ck_assert_double_eq_tol(b.device_set.points[0].impulse[2], 1, 1e-14); /* the normal is unit to rounding */
    ck_assert(b.device_set.points[1].impulse[2] == 0);
    both_free(&b);
}
END_TEST

/* A world puts its hulls closer together when some are gone: contents stay, places change. */
START_TEST(hulls_move_in_the_pool)
{
    const double size[3] = {0.5, 0.4, 0.3};
    struct test_pool *pool = test_pool_new();
    struct test_hull h;
    struct both b = both_new(_i ? 1 : 1000000);
    struct sadmm_collision_body bodies[2] = {
        {.orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0, 0, 0.59}, .orientation = {1, 0, 0, 0}, .system_body = 1},
    };
    box_hull(size, &h);
    struct sadmm_geometry geometries[2] = {test_pool_add(pool, &h), geometry_of(SADMM_SHAPE_BOX, 0.2, 0.2, 0.3)};
    struct sadmm_shape shapes[2] = {shape_of(0), shape_of(1)};
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 2, .geometries = geometries,
                                          .geometry_count = 2, .bodies = bodies, .body_count = 2, .dt = 0.01,
                                          .margin = 0.02, .hulls = pool->numbers, .hull_doubles = pool->used,
                                          .hull_revision = 1};
    both_find(&b, &input, "first");
    ck_assert_uint_eq(b.device_set.pair_count, 1);
    ck_assert_int_eq(b.device_set.pairs[0].count, 4);
    /* another hull takes its place, and it goes behind that one: no shape's revision says so */
    const struct sadmm_geometry moved = test_pool_add(pool, &h);
    prism_hull(5, 3, &h);
    test_hull_block(&h, pool->numbers + geometries[0].hull);
    pool->used += 400; /* where the longer one reaches */
    test_hull_block(&h, pool->numbers + geometries[0].hull);
    box_hull(size, &h);
    geometries[0].hull = moved.hull + 400;
    test_hull_block(&h, pool->numbers + geometries[0].hull);
    input.hull_doubles = pool->used;
    ++input.hull_revision;
    both_find(&b, &input, "moved");
    ck_assert_int_eq(b.device_set.pairs[0].count, 4);
    both_free(&b);
    free(pool);
}
END_TEST

/* Pairs are matched by (shape, shape, child): of the four manifolds of two cubes the last step had all but the second.
 * Each goes on with its own impulses and its own axis (two are equally good), and the one that was not there starts
 * without. */
START_TEST(children_are_matched_by_number)
{
    struct sadmm_geometry geometries[3] = {geometry_of(SADMM_SHAPE_BOX, 0.05, 0.05, 0.05),
                                           geometry_of(SADMM_SHAPE_BOX, 0.05, 0.05, 0.05), ball(0.05)};
    struct sadmm_shape shapes[3] = {shape_of(0), shape_of(1), shape_of(2)};
    struct sadmm_collision_body bodies[3] = {
        {.orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0.09, 0, 0.09}, .orientation = {1, 0, 0, 0}, .system_body = 1},
        {.position = {-0.09, 0, 0}, .orientation = {1, 0, 0, 0}, .system_body = 2},
    };
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 3, .geometries = geometries,
                                          .geometry_count = 3, .bodies = bodies, .body_count = 3, .dt = 0.01,
                                          .margin = 0.02};
    struct both b = both_new_tuned(_i % 2 ? 1 : 1000000, _i / 2);
    uint32_t face[2];
    for (int k = 0; k < 2; ++k) { /* what is remembered of the face that is less deep: along x, along z */
        bodies[1].position[2 * k] = 0.095;
        both_find(&b, &input, "one child each");
        ck_assert_uint_eq(b.device_set.pair_count, 2);
        ck_assert_int_eq(b.device_set.pairs[0].shape_a, 0);
        face[k] = b.device_set.pairs[0].cache;
        bodies[1].position[2 * k] = 0.09;
        both_start_from(&b, &(struct sadmm_contact_set){0});
    }
    ck_assert_uint_ne(face[0], face[1]);
    geometries[0].children = geometries[1].children = 2;
    shapes[0].revision = 10;
    shapes[1].revision = 11;
    both_find(&b, &input, "two children each");
    ck_assert_uint_eq(b.device_set.pair_count, 4 + 2); /* the ball is of one piece */
    for (int i = 0; i < 4; ++i) b.host_set.pairs[i].cache = face[i % 2];
    both_start_from(&b, &b.host_set);
    both_find(&b, &input, "each with its own face");
    for (size_t i = 0; i < b.host_set.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &b.host_set.pairs[i];
        for (int32_t j = 0; j < p->count; ++j)
            for (int k = 0; k < 3; ++k) b.host_set.points[p->first + j].impulse[k] = (double)(1 + i) * p->normal[k];
    }
    memmove(&b.host_set.pairs[1], &b.host_set.pairs[2], (b.host_set.pair_count - 2) * sizeof *b.host_set.pairs);
    --b.host_set.pair_count;
    both_start_from(&b, &b.host_set);
    both_find(&b, &input, "without the second");
    ck_assert_uint_eq(b.device_set.pair_count, 4 + 2);
    for (size_t i = 0; i < b.device_set.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &b.device_set.pairs[i];
        ck_assert_uint_eq(p->child, i < 4 ? i : i - 4);
        if (i < 4 && i != 1) ck_assert_uint_eq(p->cache, face[i % 2]);
        for (int32_t j = 0; j < p->count; ++j)
            for (int k = 0; k < 3; ++k) /* the normal is unit to rounding */
                ck_assert_double_eq_tol(b.device_set.points[p->first + j].impulse[k],
                                        i == 1 ? 0 : (double)(1 + i) * p->normal[k], 1e-13);
    }
    both_free(&b);
}
END_TEST

/* What collision knows nothing of is refused when it is loaded, as on the host, so that no kernel ever sees it; the
 * current set stays. */
START_TEST(shapes_without_manifolds_are_refused)
{
    enum { MANY = 70000 };
    struct sadmm_geometry geometries[2] = {geometry_of(SADMM_SHAPE_BOX, 0.5, 0.5, 0.5), ball(0.5)};
    const struct sadmm_geometry good = geometries[1];
    struct sadmm_shape *shapes = calloc(MANY, sizeof *shapes);
    struct sadmm_collision_body bodies[2] = {
        {.orientation = {1, 0, 0, 0}, .system_body = -1},
        {.position = {0, 0, 0.99}, .orientation = {1, 0, 0, 0}, .system_body = 0},
    };
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 2, .geometries = geometries,
                                          .geometry_count = 2, .bodies = bodies, .body_count = 2, .dt = 0.01,
                                          .margin = 0.02};
    static const struct {
        int32_t type, children;
        uint32_t handle;
        const char *words;
    } bad[] = {
        {SADMM_SHAPE_TYPE_COUNT, 1, 1, "shapes[1]: type = "}, {-1, 1, 1, "type = -1"},
        {SADMM_SHAPE_PLANE, 1, 1, "only static bodies"},       {SADMM_SHAPE_SPHERE, 0, 1, "children = 0"},
        {SADMM_SHAPE_SPHERE, 1, 2, "geometry = 2"},            {SADMM_SHAPE_HULL, 1, 1, "hull = 0"},
        {SADMM_SHAPE_CONE, 1, 1, "type = 7: needs a pool"},
    };
    struct both b = both_new(0);
    shapes[0] = shape_of(0);
    shapes[1] = shape_of(1);
    both_find(&b, &input, "good ones");
    ck_assert_uint_eq(b.device_set.pair_count, 1);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        struct sadmm_error error = {0};
        struct sadmm_cuda_contacts out;
        geometries[1].type = bad[i].type;
        geometries[1].children = bad[i].children;
        shapes[1].geometry = bad[i].handle;
        ++shapes[1].revision;
        for (int time = 0; time < 2; ++time) {
            ck_assert_int_eq(COLLISION(find)(b.device, NULL, &input, &out, &error), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_msg(strstr(error.message, bad[i].words) != NULL, "%s: does not say %s", error.message,
                          bad[i].words);
        }
        OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
        check_same(&b.host_set, &b.device_set, bad[i].words);
        geometries[1] = good;
        shapes[1].geometry = 1;
        both_find(&b, &input, "good again");
    }
    /* a candidate is one 64-bit key: slots and children must fit into it */
    struct sadmm_error error = {0};
    geometries[1].children = SADMM_MOST_CHILDREN;
    ++shapes[1].revision;
    input.shape_count = MANY; /* but for two they are dead */
    ck_assert_int_eq(COLLISION(find)(b.device, NULL, &input, NULL, &error), SADMM_ERROR_LIMIT);
    ck_assert_ptr_nonnull(strstr(error.message, "70000 shapes of up to 65535 children"));
    free(shapes);
    both_free(&b);
}
END_TEST

START_TEST(a_find_can_be_undone)
{
    const struct soup_kind *kind = &soups[6];
    struct shape_soup s = shape_soup_new(kind, 5);
    struct both b = both_new(kind->tree_from);
    struct sadmm_contact_set kept = {0};
    both_find(&b, &s.input, "first");
    random_impulses(&b.host_set);
    both_start_from(&b, &b.host_set);
    COLLISION(undo)(b.device); /* nothing to undo: an upload is no find */
    copy_set(&kept, &b.host_set);

    soup_advance(&s, kind);
    both_find(&b, &s.input, "second");
    sadmm_collision_undo(b.host, &b.host_set);
    COLLISION(undo)(b.device);
    COLLISION(undo)(b.device); /* once only */
    OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
    check_same(&kept, &b.device_set, "after the undo");
    check_same(&b.host_set, &b.device_set, "after both undos");
    both_find(&b, &s.input, "second, again");
    sadmm_contact_set_free(&kept);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* Pipelines know nothing of each other. */
START_TEST(side_by_side)
{
    struct shape_soup s[2] = {shape_soup_new(&soups[0], 6), shape_soup_new(&soups[7], 7)};
    struct both b[2] = {both_new(1), both_new(0)};
    for (int step = 0; step < 3; ++step)
        for (int i = 0; i < 2; ++i) {
            both_find(&b[i], &s[i].input, "side by side");
            if (step == 0) {
                random_impulses(&b[i].host_set);
                both_start_from(&b[i], &b[i].host_set);
            }
            soup_advance(&s[i], &soups[i ? 7 : 0]);
        }
    for (int i = 0; i < 2; ++i) {
        both_free(&b[i]);
        shape_soup_free(&s[i]);
    }
}
END_TEST

START_TEST(no_such_device)
{
    struct sadmm_cuda_collision *device = NULL;
    struct sadmm_error error = {0};
    ck_assert_int_eq(COLLISION(create)(1000, &device, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(device);
    ck_assert_ptr_nonnull(strstr(error.message, "device = 1000"));
    COLLISION(destroy)(NULL);
}
END_TEST

/* Allocations of the host that fail: the message says so, and the current set stays. */
START_TEST(host_memory_that_lacks)
{
    const struct soup_kind *kind = &soups[7];
    struct shape_soup s = shape_soup_new(kind, 8);
    for (long successes = 0;; ++successes) {
        struct sadmm_cuda_collision *device = NULL;
        struct sadmm_contact_set set = {0};
        struct sadmm_error error = {0};
        sadmm_test_fail_allocations_after(successes);
        sadmm_status status = COLLISION(create)(0, &device, &error);
        if (status == SADMM_OK) status = COLLISION(find)(device, NULL, &s.input, NULL, &error);
        if (status == SADMM_OK) status = COLLISION(download)(device, NULL, &set, &error);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_str_ne(error.message, "");
            ck_assert_uint_eq(set.pair_count, 0);
        }
        COLLISION(destroy)(device);
        sadmm_contact_set_free(&set);
        if (status == SADMM_OK) {
            ck_assert_int_gt(successes, 20);
            break;
        }
    }
    shape_soup_free(&s);
}
END_TEST

#ifdef SADMM_CUDA_EMULATED
/* Every runtime call of a find fails once: a message, the current set as it was, and the next find succeeds. */
START_TEST(calls_that_fail)
{
    const struct soup_kind *kind = &soups[_i ? 1 : 7];
    struct shape_soup s = shape_soup_new(kind, 9), later;
    struct both b = both_new_tuned(kind->tree_from, _i);
    long before, calls;
    both_find(&b, &s.input, "first");
    random_impulses(&b.host_set);
    both_start_from(&b, &b.host_set);
    later = s;
    later.input.dt = 0.02;
    for (calls = 0;; ++calls) {
        struct sadmm_error error = {0};
        struct sadmm_cuda_collision_tuning tight = {
            .tree_from = kind->tree_from, .radix_from = _i, .first_capacity = 3};
        COLLISION(tune)(b.device, &tight); /* with the repeats */
        cuda_emulation_calls_left = calls;
        sadmm_status status = COLLISION(find)(b.device, NULL, &later.input, NULL, &error);
        if (status == SADMM_OK && cuda_emulation_calls_left >= 0) break; /* there is no such call any more */
        cuda_emulation_calls_left = -1;
        ck_assert_int_eq(status, SADMM_ERROR_DEVICE);
        ck_assert_ptr_nonnull(strstr(error.message, "CUDA device 0: "));
        OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
        check_same(&b.host_set, &b.device_set, "after a failure");
    }
    cuda_emulation_calls_left = -1;
    ck_assert_int_gt(calls, 10);
    OK(sadmm_collision_find(b.host, &later.input, &b.host_set, error));
    OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
    check_same(&b.host_set, &b.device_set, "after the failures");

    /* no leaks, wherever it stops */
    before = cuda_emulation_allocations;
    for (calls = 0; calls < 60; ++calls) {
        struct sadmm_cuda_collision *device;
        struct sadmm_error error = {0};
        OK(COLLISION(create)(0, &device, error));
        cuda_emulation_calls_left = calls;
        (void)COLLISION(find)(device, NULL, &s.input, NULL, &error);
        cuda_emulation_calls_left = -1;
        COLLISION(destroy)(device);
        ck_assert_int_eq(cuda_emulation_allocations, before);
    }
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* The tree leaves out nearly everything: some dozen nodes a shape. A walk along the leaves would see half of all
 * shapes; the result would be the same. */
START_TEST(tree_prunes)
{
    const struct soup_kind kind = {.name = "sparse", .bodies = 1500, .shapes_a_body = 1, .density = 0.5,
                                   .size_low = 0.5, .size_high = 1};
    struct shape_soup s = shape_soup_new(&kind, 11);
    struct both b = both_new(1);
    if (_i) s.bodies[7].position[1] = 1e8; /* must not spoil the grid */
    const int64_t before = COLLISION(stats)(b.device).visits;
    both_find(&b, &s.input, kind.name);
    const double visits = (double)(COLLISION(stats)(b.device).visits - before) / kind.bodies;
    ck_assert_msg(visits > 3 && visits < 60, "%g nodes a shape", visits);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* Threads in the opposite order: candidates are found, and nodes of the tree reached, in another one. */
START_TEST(threads_in_reverse)
{
    const struct soup_kind *kind = &soups[_i];
    struct shape_soup s = shape_soup_new(kind, 10);
    struct both b = both_new_tuned(kind->tree_from, _i % 4 >= 2);
    cuda_emulation_descending = 1;
    for (int step = 0; step < 2; ++step) {
        both_find(&b, &s.input, kind->name);
        soup_advance(&s, kind);
    }
    cuda_emulation_descending = 0;
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST
#endif

int main(void)
{
    struct sadmm_cuda_collision *device = NULL;
    struct sadmm_error error = {0};
    sadmm_status status = COLLISION(create)(0, &device, &error);
    if (status == SADMM_ERROR_UNAVAILABLE) {
        printf("skipped: %s\n", error.message);
        return 77;
    }
    if (status != SADMM_OK) {
        printf("%s\n", error.message);
        return EXIT_FAILURE;
    }
    COLLISION(destroy)(device);

    Suite *suite = suite_create("cuda_collision");
    TCase *tests = tcase_create("cuda_collision");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, soups_equal_host, 0, SOUPS);
    tcase_add_loop_test(tests, scenes_equal_host, 0, 2 * SCENES);
    tcase_add_loop_test(tests, capacities_grow, 0, 2 * SOUPS);
    tcase_add_test(tests, capacities_grow_later);
    tcase_add_loop_test(tests, few_shapes, 0, 2);
    tcase_add_test(tests, one_place);
    tcase_add_test(tests, slots_are_reused);
    tcase_add_loop_test(tests, hulls_move_in_the_pool, 0, 2);
    tcase_add_loop_test(tests, children_are_matched_by_number, 0, 4);
    tcase_add_test(tests, shapes_without_manifolds_are_refused);
    tcase_add_test(tests, a_find_can_be_undone);
    tcase_add_test(tests, side_by_side);
    tcase_add_test(tests, no_such_device);
    tcase_add_test(tests, host_memory_that_lacks);
#ifdef SADMM_CUDA_EMULATED
    tcase_add_loop_test(tests, calls_that_fail, 0, 2);
    tcase_add_loop_test(tests, tree_prunes, 0, 2);
    tcase_add_loop_test(tests, threads_in_reverse, 0, SOUPS);
#endif
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_set_fork_status(runner, CK_NOFORK); /* a driver that was started does not survive a fork */
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}

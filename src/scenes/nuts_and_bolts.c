/* Nuts on bolts with a real thread: N bolts stand in a row, and a nut runs down each of them by its own weight, to the
 * ground, where it is tightened.
 *
 * The bolt is a triangle mesh, a trapezoid thread of two starts: crest and root on cylinders, flanks leaning by 15
 * degrees. The nut is one body of convex hulls: a hexagon of twelve wedges, which does not reach the bolt, and six
 * segments, 3.4 degrees wide, of the two ridges inside of it, all the same hull. Ridge and groove leave 0.1 mm between
 * them along the axis, and 0.3 mm across it.
 *
 * Neither segments nor triangles are the helix. A flank rises by c = lead / 2 pi a radian whatever its radius, so it is
 * twisted. What is straight between its corners, at the radii r and R and D apart, is off by at most
 *
 *     c D (R - r) / (2 (R + r)):
 *
 * the middle of a diagonal is turned from the middle of the corners by D (R - r) / (2 (R + r)), and is not higher than
 * that. A hull stands out there, triangles stand out or are dented. Here that is 2.8 um for the nut and 7.0 um for the
 * bolt, whose mesh has 60 steps a turn: far below the play, as they have to be. A chord of the ridge's inner edge is 4
 * um inside of its circle; there is room.
 *
 * Contacts are searched for within what turning may move any point of a shape in a step, whichever way, 0.9 mm at 45
 * rad/s. So the wedges are 2 mm off the bolt: a body with some hundred contacts that say nothing needs more iterations.
 *
 * How fast a nut runs down is known. A screw of lead angle a (tan a = c / r) under the weight m (g - z'') is turned by
 * the torque m (g - z'') r tan(a - f), tan f = mu / cos 15 degrees, so that with the nut's moment I about the axis
 *
 *     z'' = g K / (1 + K),     K = m c r tan(a - f) / I.
 *
 * All of that goes through the flanks, which have 2 % of the nut's weight to slow down a mass 50 times its own: small
 * errors of contact forces are large ones of the motion. With 100 iterations of `fast` nuts are 5 % late, with 200 1.4
 * %, with 400 0.6 %. */
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/quat.h"
#include "family.h"
#include "solid.h"

enum {
    STARTS = 2,
    STEPS = 60,           /* of the bolt's mesh, a turn */
    BELOW = 1, TURNS = 6, /* turns of the thread: below the ground, all */
    SEGMENTS = 3,         /* of each of the nut's ridges, which go round once */
    WEDGES = 12, PARTS = WEDGES + STARTS * SEGMENTS,
    FIRST = 1             /* bodies: ground, bolts, nuts */
};

static const double lead = 16e-3, pitch = 8e-3; /* m: a turn, and from one start to the next */
static const double play = 1e-4, across = 3e-4; /* m: along the axis between flanks; what the nut leaves at the root */
static const double root = 9e-3, crest = 10e-3; /* m, radii of the bolt */
static const double lean = 0.26179938779914943; /* rad, of a flank */
static const double wide = 0.06;                /* rad, of a segment */
static const double bore = 12e-3, flat = 18e-3; /* m: of the wedges; of the hexagon, half across its flats */
static const double half_height = 10e-3;        /* m, of the nut */
static const double high = 20e-3, apart = 0.05; /* m: the first nut over the ground; between bolts */
static const double density = 7800, friction = 0.05;
static const double drive_begins = 1, drive_torque = 0.05; /* s; N m, which tightens */
static const double pi = 3.14159265358979323846;

/* ---- the thread -------------------------------------------------------------------------------------------------- */

/* Half of the bolt's ridge along the axis, at a radius: on the mean radius half of a pitch is the ridge's and half the
 * groove's, less the play. The nut's ridge is the same turned round. */
static double half_ridge(double r)
{
    return 0.25 * (pitch - play) - (r - 0.5 * (root + crest)) * tan(lean);
}

static double half_nut_ridge(double r)
{
    return half_ridge(root + crest - r);
}

/* The bolt's first ridge is at z = rise x the angle, the groove above it half a pitch higher. */
static double rise(void)
{
    return lead / (2 * pi);
}

/* A bolt on its way to a mesh: of every step and ridge 4 vertices, from below the ridge to above it. */
struct thread {
    double (*vertices)[3];
    int32_t (*triangles)[3];
    int32_t vertex_count, triangle_count;
};
enum { RING = STEPS * TURNS, MOST_TRIANGLES = 8 * STARTS * RING };

/* Between two lines of vertices along the thread, the second one above; step j to the next. */
static void add_strip(struct thread *t, int32_t below, int32_t above)
{
    const int32_t on = 4 * STARTS, quad[2][3] = {{below, below + on, above + on}, {below, above + on, above}};
    memcpy(t->triangles[t->triangle_count], quad, sizeof quad);
    t->triangle_count += 2;
}

static int32_t vertex_of(int32_t step, int32_t start, int32_t k)
{
    return 4 * (STARTS * step + start) + k;
}

static void make_thread(struct thread *t)
{
    for (int32_t j = 0; j <= RING; ++j)
        for (int32_t i = 0; i < 4 * STARTS; ++i) {
            const int k = i % 4;
            const double angle = 2 * pi * j / STEPS, z = rise() * angle + pitch * (i / 4) - BELOW * lead;
            const double r = k == 0 || k == 3 ? root : crest;
            v3_store(v3(r * cos(angle), r * sin(angle), z + (k < 2 ? -1 : 1) * half_ridge(r)),
                     t->vertices[t->vertex_count++]);
        }
    for (int32_t j = 0; j < RING; ++j)
        for (int32_t i = 0; i < STARTS; ++i) {
            const bool last = i == STARTS - 1; /* the root goes on to the first start's next turn */
            for (int32_t k = 0; k < 3; ++k) add_strip(t, vertex_of(j, i, k), vertex_of(j, i, k + 1));
            if (!last) add_strip(t, vertex_of(j, i, 3), vertex_of(j, i + 1, 0));
            else if (j + STEPS < RING) add_strip(t, vertex_of(j, i, 3), vertex_of(j + STEPS, 0, 0));
        }
}

static sadmm_status make_bolt(sadmm_mesh **bolt, struct sadmm_error *error)
{
    struct thread t = {0};
    sadmm_mesh_def def = sadmm_mesh_def_default();
    sadmm_status status = SADMM_OK;
    t.vertices = (double(*)[3])sadmm_alloc(4 * STARTS * (RING + 1), sizeof *t.vertices);
    t.triangles = (int32_t(*)[3])sadmm_alloc(MOST_TRIANGLES, sizeof *t.triangles);
    if (t.vertices && t.triangles) {
        make_thread(&t);
        def.vertices = t.vertices[0];
        def.vertex_count = (size_t)t.vertex_count;
        def.triangles = t.triangles[0];
        def.triangle_count = (size_t)t.triangle_count;
        status = sadmm_scene_mesh(&def, bolt, error);
    } else {
        status = sadmm_fail_memory(error, "a bolt");
    }
    sadmm_free(t.vertices);
    sadmm_free(t.triangles);
    return status;
}

/* ---- the nut ----------------------------------------------------------------------------------------------------- */

/* The segment at the angle 0, its ridge in the plane z = 0: flanks up to the bolt's crest, from there a foot, which is
 * narrower, to the wedges. */
static sadmm_status make_segment(sadmm_hull **hull, struct sadmm_error *error)
{
    const double radii[3] = {root + across, crest, bore};
    double points[12][3];
    for (int v = 0; v < 12; ++v) {
        const double r = radii[v / 4], angle = (v & 1 ? 0.5 : -0.5) * wide;
        const double half = v / 4 < 2 ? half_nut_ridge(r) : half_nut_ridge(root);
        v3_store(v3(r * cos(angle), r * sin(angle), rise() * angle + (v & 2 ? half : -half)), points[v]);
    }
    return sadmm_scene_hull(points[0], 12, hull, error);
}

/* A twelfth of the hexagon, around +x: with a corner of it, or the middle of a side. */
static sadmm_status make_wedge(bool corner, sadmm_hull **hull, struct sadmm_error *error)
{
    const double half = pi / WEDGES, inner = bore / cos(half);
    const double outer = flat / cos(half); /* both where corners and sides begin: half way between them */
    double points[10][3];
    int count = 0;
    for (int v = 0; v < 8; ++v) {
        const double r = v & 1 ? outer : inner, angle = (v & 2 ? 1 : -1) * half;
        v3_store(v3(r * cos(angle), r * sin(angle), (v & 4 ? 1 : -1) * half_height), points[count++]);
    }
    for (int v = 0; corner && v < 2; ++v)
        v3_store(v3(flat / cos(pi / 6), 0, (v ? 1 : -1) * half_height), points[count++]);
    return sadmm_scene_hull(points[0], count, hull, error);
}

static void turn_about_z(sadmm_shape_def *shape, double angle)
{
    shape->orientation[0] = cos(0.5 * angle);
    shape->orientation[3] = sin(0.5 * angle);
}

/* In the nut's frame: z its axis, its first ridge at z = rise x the angle. The first part is not turned. */
static void lay_out_nut(sadmm_hull *const wedges[2], const sadmm_hull *segment, sadmm_shape_def parts[PARTS])
{
    for (int k = 0; k < WEDGES; ++k) {
        parts[k] = sadmm_hull_shape(wedges[k % 2], friction);
        turn_about_z(&parts[k], 2 * pi * k / WEDGES);
    }
    for (int k = 0; k < STARTS * SEGMENTS; ++k) {
        const int start = k / SEGMENTS, number = k % SEGMENTS;
        const double angle = 2 * pi * ((number + 0.5) / SEGMENTS - 0.5 + (double)start / STARTS);
        sadmm_shape_def *part = &parts[WEDGES + k];
        *part = sadmm_hull_shape(segment, friction);
        turn_about_z(part, angle);
        part->position[2] = rise() * angle - pitch * start;
    }
}

static sadmm_status make_nut(sadmm_hull *hulls[3], struct sadmm_error *error)
{
    sadmm_status status = make_wedge(true, &hulls[0], error);
    if (status == SADMM_OK) status = make_wedge(false, &hulls[1], error);
    return status == SADMM_OK ? make_segment(&hulls[2], error) : status;
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static struct sadmm_frame bolt_at(const struct sadmm_scene *scene, long i)
{
    return sadmm_frame_moved(sadmm_frame_world(), apart * ((double)i - 0.5 * (double)(scene->n - 1)), 0, 0);
}

/* Where nut i's frame begins. The nuts are not all turned alike: each is a share of a turn farther up. */
static double height_of(const struct sadmm_scene *scene, long i)
{
    return high + half_height + 0.25 * lead * (double)i / (double)scene->n;
}

/* The angle at which a nut's ridge is in the middle of the groove. */
static double angle_at(double z)
{
    return (z - 0.5 * pitch) / rise();
}

static struct sadmm_frame nut_at(const struct sadmm_scene *scene, long i)
{
    const double z = height_of(scene, i);
    return sadmm_frame_turned(sadmm_frame_moved(bolt_at(scene, i), 0, 0, z), 2, fmod(angle_at(z), 2 * pi));
}

static sadmm_status place_bolts(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_mesh *bolt;
    sadmm_status status = make_bolt(&bolt, error);
    if (status != SADMM_OK) return status;
    const sadmm_shape_def shape = sadmm_mesh_shape(bolt, friction);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i)
        status = sadmm_place_solids(world, bolt_at(scene, i), &shape, 1, 0, "bolt", NULL, error);
    sadmm_mesh_destroy(bolt);
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_hull *hulls[3] = {NULL};
    sadmm_shape_def parts[PARTS];
    sadmm_status status = make_nut(hulls, error);
    if (status == SADMM_OK) status = sadmm_place_plane(world, sadmm_frame_world(), friction, error);
    if (status == SADMM_OK) status = place_bolts(scene, world, error);
    if (status == SADMM_OK) lay_out_nut(hulls, hulls[2], parts);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i)
        status = sadmm_place_solids(world, nut_at(scene, i), parts, PARTS, density, "nut", NULL, error);
    for (int k = 0; k < 3; ++k) sadmm_hull_destroy(hulls[k]);
    return status;
}

static sadmm_status nut_id(const struct sadmm_scene *scene, sadmm_world *world, long i, sadmm_body_id *id,
                           struct sadmm_error *error)
{
    return sadmm_scene_world_error(world, sadmm_world_body_at(world, FIRST + (int32_t)(scene->n + i), id), error);
}

static sadmm_status before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt;
    if (step != lround(drive_begins / dt)) return SADMM_OK;
    for (long i = 0; i < scene->n; ++i) {
        const double force[3] = {0, 0, 0}, torque[3] = {0, 0, -drive_torque};
        sadmm_body_id id;
        sadmm_status status = nut_id(scene, world, i, &id, error);
        if (status == SADMM_OK)
            status = sadmm_scene_world_error(world, sadmm_world_set_body_wrench(world, id, force, torque), error);
        if (status != SADMM_OK) return status;
    }
    return SADMM_OK;
}

/* ---- success ----------------------------------------------------------------------------------------------------- */

struct nut {
    double z;      /* m, of its middle */
    double off;    /* m: how far its ridge is above the middle of the groove */
    double moment; /* kg m^2, about its axis */
    double mass, spin;
};

static sadmm_status inspect(const struct sadmm_scene *scene, sadmm_world *world, long i, struct nut *nut,
                            struct sadmm_error *error)
{
    sadmm_shape_id first;
    sadmm_shape_def shape;
    sadmm_body_id id;
    sadmm_body_def body;
    /* shapes: ground, bolts, then the parts of the nuts; the first part of each says where its frame is */
    sadmm_status status = sadmm_world_shape_at(world, FIRST + (int32_t)(scene->n + PARTS * i), &first);
    if (status == SADMM_OK) status = sadmm_world_shape_def(world, first, &shape, &id);
    if (status == SADMM_OK) status = sadmm_world_body_def(world, id, &body);
    if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
    const quat turn = q_load(body.orientation);
    const vec3 at = v3_add(v3_load(body.position), m3_mul(q_matrix(turn), v3_load(shape.position)));
    const vec3 x = m3_mul(q_matrix(q_mul(turn, q_load(shape.orientation))), v3(1, 0, 0));
    const vec3 axis = m3_tmul(q_matrix(turn), v3(0, 0, 1));
    nut->z = at.z;
    nut->off = rise() * remainder(angle_at(at.z) - atan2(x.y, x.x), 2 * pi / STARTS);
    nut->moment = body.inertia[0] * axis.x * axis.x + body.inertia[1] * axis.y * axis.y +
                  body.inertia[2] * axis.z * axis.z;
    nut->mass = body.mass;
    nut->spin = fabs(body.angular_velocity[2]);
    return SADMM_OK;
}

/* When nut i is to come to the ground, s. */
static double expected_time(const struct sadmm_scene *scene, long i, const struct nut *nut)
{
    const double r = 0.5 * (root + across + crest), g = -scene->def.settings.gravity[2];
    const double K = nut->mass * rise() * r * tan(atan(rise() / r) - atan(friction / cos(lean))) / nut->moment;
    return sqrt(2 * (height_of(scene, i) - half_height) / (g * K / (1 + K)));
}

/* Unlike fmax: once NaN, always NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

/* How far flanks are off the helix: segments and the bolt's triangles together, m. */
static double bent(void)
{
    const double inner = root + across, of_nut = wide * (crest - inner) / (crest + inner);
    return 0.5 * rise() * (of_nut + 2 * pi / STEPS * (crest - root) / (crest + root));
}

enum { OFF, OVERLAP, LATE, ARRIVED }; /* memory: the most so far, m, m, relative; nuts on the ground */

static void judge(double t, double duration, const double memory[], long nuts, double tight, double spin,
                  struct sadmm_scene_task *run, struct sadmm_scene_task *tighten)
{
    run->name = "run down";
    run->figure_count = 4;
    run->figures[0] = (struct sadmm_scene_figure){"off", "m", memory[OFF]};
    run->figures[1] = (struct sadmm_scene_figure){"overlap", "m", memory[OVERLAP]};
    run->figures[2] = (struct sadmm_scene_figure){"arrived", "", memory[ARRIVED]};
    run->figures[3] = (struct sadmm_scene_figure){"late", "", memory[LATE]};
    run->finished = t >= drive_begins - 1e-9;
    run->passed = run->finished && memory[ARRIVED] == (double)nuts && memory[OFF] < 0.5 * play + bent() &&
                  memory[OVERLAP] < 0.5 * play && memory[LATE] < 0.05;
    tighten->name = "tighten";
    tighten->figure_count = 3;
    tighten->figures[0] = (struct sadmm_scene_figure){"free", "m", tight};
    tighten->figures[1] = (struct sadmm_scene_figure){"spin", "rad/s", spin};
    tighten->figures[2] = (struct sadmm_scene_figure){"overlap", "m", memory[OVERLAP]};
    tighten->finished = t >= duration - 1e-9;
    tighten->passed = tighten->finished && tight < 2 * bent() && spin < 1e-3 && memory[OVERLAP] < 0.5 * play;
}

/* A nut has run down if it came to the ground when it was to, within 5 %, and its way was the lead times its turns all
 * the time, within the play; it is tight if its ridges have come to the upper end of the play and stay there. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt;
    double *memory = result->memory, tight = 0, spin = 0, arrived = 0;
    sadmm_step_report report;
    if (result->task_count && result->tasks[1].finished) return SADMM_OK;
    result->task_count = 2;
    sadmm_status status = sadmm_scene_world_error(world, sadmm_world_report(world, &report), error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        struct nut nut = {0};
        status = inspect(scene, world, i, &nut, error);
        memory[OFF] = larger(memory[OFF], fabs(nut.off));
        tight = larger(tight, fabs(0.5 * play - nut.off));
        spin = larger(spin, nut.spin);
        const bool down = nut.z < half_height + play;
        arrived += down;
        if (down && arrived > memory[ARRIVED]) /* they come in order: the first began lowest */
            memory[LATE] = larger(memory[LATE], fabs(t / expected_time(scene, i, &nut) - 1));
    }
    if (status != SADMM_OK) return status;
    memory[ARRIVED] = larger(memory[ARRIVED], arrived);
    memory[OVERLAP] = larger(memory[OVERLAP], report.penetration_max);
    judge(t, scene->info->duration, memory, scene->n, tight, spin, &result->tasks[0], &result->tasks[1]);
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.001;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_nuts_and_bolts = {
    .info = {
        .name = "nuts_and_bolts",
        .arguments = "[:N]",
        .description = "N nuts run down the threads of N bolts, 0.1 mm of play, and are tightened (N in [1, 1000], "
                       "default 4)",
        .duration = 1.5,
        .iterations = {[SADMM_METHOD_PAPER] = 200, [SADMM_METHOD_FAST] = 200},
    },
    .n_default = 4, .n_min = 1, .n_max = 1000,
    .configure = configure,
    .fill = fill,
    .before_step = before_step,
    .observe = observe,
};

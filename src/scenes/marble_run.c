/* A marble run: eight marbles roll down a ramp, through a loop and round a bend, into a funnel, and through its hole
 * into a tray. Track and funnel are triangle meshes.
 *
 * The track is a channel, half of a tube with the middle of a facet as its bottom, along a line: a ramp, an arc, a loop
 * that shifts sideways, and a bend; its curves have sections every 2 mm. It nowhere bends away from what rolls on it.
 *
 * The ramp is straight, so that what marbles do there is known: they roll without slipping, for which friction of 2/7
 * tan(25 degrees) = 0.13 would do, and of their energy 5/7 goes with the velocity:
 *
 *     v^2 = 10/7 g h,     h: how far the marble has come down.
 *
 * Farther on nothing may gain energy, and some is lost: a polygon in place of a curve turns marbles by jolts, which
 * take about t^2 / n of the energy for a turn by t in n of them. The time from the ramp to the end of the track without
 * losses is an integral along the line, which no marble may come before, nor much after. Marbles begin 0.3 s apart. In
 * the funnel, a pyramid of eight sides and therefore of large jolts, their order is lost. */
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/quat.h"
#include "family.h"
#include "solid.h"

enum {
    MARBLES = 8,
    FACETS = 15, SIDES = FACETS + 3, /* of the half tube; points of a section: two walls stand on it */
    MOST_SECTIONS = 720,
    AROUND = 8, RINGS = 3,           /* of the funnel: hole, rim, the top of the wall on it */
    FIRST = 3                        /* bodies: track, funnel, tray, marbles */
};

static const double radius = 0.008, density = 2500, friction = 0.5; /* m; glass */
static const double tube = 0.016, wall = 0.006;      /* m: radius of the channel; how high its sides go on straight */
static const double ramp = 0.7, steep = 0.43633231299858239, slight = 0.05; /* m; rad: of the ramp, of all else */
static const double loop = 0.07, aside = 0.05, bend = 0.8; /* m: radius; its shift to the right; length */
static const double arc = 0.25, fine = 2e-3, coarse = 0.05; /* m: radius under the ramp; from section to section */
static const double rim = 0.17, hole = 0.018, cone = 0.5, edge = 0.1;  /* m; the cone's slope; of the wall on the rim */
static const double before_axis = 0.145, beside_axis = 0.05; /* m: where the track ends, from the axis of the funnel */
static const double below_end = 0.01;                /* m: the rim, below the end of the track */
static const double end_height = 0.16;               /* m, of the track, over the tray */
static const double opening = 0.35;                  /* rad, half of that of the wall */
static const double tray = 0.12, tray_wall = 0.04, thick = 0.01; /* m: half of its width; its walls; half of that */
static const double begins = 0.02, apart = 0.024;    /* m along the ramp: the last marble; from one to the next */
static const double every = 0.3;                     /* s, from one marble to the next */
static const double pi = 3.14159265358979323846;

/* ---- the line of the track --------------------------------------------------------------------------------------- */

/* The bottom of the channel, forward and up there. */
struct section {
    vec3 bottom, forward, up;
};

struct line {
    struct section at[MOST_SECTIONS];
    int count, ramp_end; /* sections; the one where the ramp ends */
};

static vec3 turned(vec3 v, vec3 axis, double angle)
{
    /* Rodrigues */
    const vec3 along = v3_scale(axis, v3_dot(axis, v) * (1 - cos(angle)));
    return v3_add(v3_madd(v3_scale(v, cos(angle)), sin(angle), v3_cross(axis, v)), along);
}

static vec3 right_of(const struct section *s)
{
    return v3_cross(s->forward, s->up);
}

/* Up by `pitch` about the right, and left by `yaw` about the vertical. */
static void turn_section(struct section *s, double pitch, double yaw)
{
    const vec3 right = right_of(s), z = v3(0, 0, 1);
    s->forward = turned(turned(s->forward, right, pitch), z, yaw);
    s->up = turned(turned(s->up, right, pitch), z, yaw);
}

/* The share of a change that has come about after a share t of the way: it begins and ends gently. */
static double eased(double t)
{
    return t * t * (3 - 2 * t);
}

/* Go on by `length` in steps no longer than `step`, evenly up by `pitch`, and, gently at both ends, left by `yaw` and
 * to the right by `shift`. */
static void go_on(struct line *line, double length, double step, double pitch, double yaw, double shift)
{
    const int steps = (int)ceil(length / step - 1e-9);
    for (int k = 0; k < steps; ++k) {
        struct section s = line->at[line->count - 1];
        const double change = eased((k + 1.0) / steps) - eased((double)k / steps);
        turn_section(&s, 0.5 * pitch / steps, 0.5 * yaw * change);
        s.bottom = v3_madd(v3_madd(s.bottom, length / steps, s.forward), shift * change, right_of(&s));
        turn_section(&s, 0.5 * pitch / steps, 0.5 * yaw * change);
        line->at[line->count++] = s;
    }
}

static void make_line(struct line *line)
{
    line->at[0] = (struct section){v3(0, 0, 0), v3(1, 0, 0), v3(0, 0, 1)};
    line->count = 1;
    turn_section(&line->at[0], -steep, 0);
    go_on(line, ramp, coarse, 0, 0, 0);
    line->ramp_end = line->count - 1;
    go_on(line, arc * (steep - slight), fine, steep - slight, 0, 0);
    go_on(line, 2 * pi * loop, fine, 2 * pi, 0, aside);
    go_on(line, 0.1, coarse, 0, 0, 0);
    go_on(line, bend, fine, 0, pi, 0);
    go_on(line, 0.25, coarse, 0, 0, 0);
    const double up = end_height - line->at[line->count - 1].bottom.z;
    for (int i = 0; i < line->count; ++i) line->at[i].bottom.z += up;
}

/* Where the middle of a marble is that rolls along the bottom. */
static vec3 middle_at(const struct line *line, int i)
{
    return v3_madd(line->at[i].bottom, radius, line->at[i].up);
}

/* The axis of the funnel, at the height of its rim: left of the track's end, which is a little higher. */
static vec3 funnel_at(const struct line *line)
{
    const struct section *end = &line->at[line->count - 1];
    vec3 at = v3_madd(v3_madd(end->bottom, before_axis, end->forward), -beside_axis, right_of(end));
    at.z = end_height - below_end;
    return at;
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

enum { MOST_VERTICES = MOST_SECTIONS * SIDES, MOST_TRIANGLES = 2 * MOST_VERTICES };

struct surface {
    double (*vertices)[3];
    int32_t (*triangles)[3];
    int32_t vertex_count, triangle_count;
};

/* Four vertices, counter-clockwise seen from where marbles are. */
static void add_quad(struct surface *s, int32_t a, int32_t b, int32_t c, int32_t d)
{
    const int32_t quad[2][3] = {{a, b, c}, {a, c, d}};
    memcpy(s->triangles[s->triangle_count], quad, sizeof quad);
    s->triangle_count += 2;
}

/* From the top of the left side to that of the right one. The facets touch a circle with their middles. */
static vec3 channel_point(const struct section *at, int k)
{
    const double half = 0.5 * pi / FACETS, angle = (k - 1) * 2 * half - 0.5 * pi, r = tube / cos(half);
    const bool is_wall = k == 0 || k == SIDES - 1;
    const double out = is_wall ? (k ? r : -r) : r * sin(angle), up = is_wall ? tube + wall : tube - r * cos(angle);
    return v3_madd(v3_madd(at->bottom, up, at->up), out, right_of(at));
}

static void make_channel(const struct line *line, struct surface *s)
{
    for (int i = 0; i < line->count; ++i)
        for (int k = 0; k < SIDES; ++k) v3_store(channel_point(&line->at[i], k), s->vertices[s->vertex_count++]);
    for (int32_t i = 0; i + 1 < line->count; ++i)
        for (int32_t k = 0; k + 1 < SIDES; ++k) {
            const int32_t at = SIDES * i + k;
            add_quad(s, at, at + 1, at + SIDES + 1, at + SIDES);
        }
}

/* The wall on the rim is open towards the track. */
static bool is_open(const struct line *line, double angle)
{
    const vec3 d = v3_sub(line->at[line->count - 1].bottom, funnel_at(line));
    return fabs(remainder(angle - atan2(d.y, d.x), 2 * pi)) < opening;
}

static void make_funnel(const struct line *line, struct surface *s)
{
    const double ring[RINGS][2] = {{hole, cone * (hole - rim)}, {rim, 0}, {rim, edge}};
    for (int j = 0; j < RINGS; ++j)
        for (int k = 0; k < AROUND; ++k) {
            const double angle = 2 * pi * k / AROUND;
            v3_store(v3(ring[j][0] * cos(angle), ring[j][0] * sin(angle), ring[j][1]), s->vertices[s->vertex_count++]);
        }
    for (int32_t j = 0; j + 1 < RINGS; ++j)
        for (int32_t k = 0; k < AROUND; ++k) {
            const int32_t at = AROUND * j, next = (k + 1) % AROUND;
            if (j == 1 && is_open(line, 2 * pi * (k + 0.5) / AROUND)) continue;
            add_quad(s, at + k, at + AROUND + k, at + AROUND + next, at + next);
        }
}

/* A static body of the surface that `make` makes. */
static sadmm_status place_surface(sadmm_world *world, const struct line *line,
                                  void (*make)(const struct line *line, struct surface *s), vec3 origin,
                                  const char *name, struct sadmm_error *error)
{
    struct surface s = {0};
    sadmm_mesh_def def = sadmm_mesh_def_default();
    sadmm_mesh *mesh = NULL;
    sadmm_status status;
    s.vertices = (double(*)[3])sadmm_alloc(MOST_VERTICES, sizeof *s.vertices);
    s.triangles = (int32_t(*)[3])sadmm_alloc(MOST_TRIANGLES, sizeof *s.triangles);
    if (s.vertices && s.triangles) {
        make(line, &s);
        def.vertices = s.vertices[0];
        def.vertex_count = (size_t)s.vertex_count;
        def.triangles = s.triangles[0];
        def.triangle_count = (size_t)s.triangle_count;
        status = sadmm_scene_mesh(&def, &mesh, error);
    } else {
        status = sadmm_fail_memory(error, "a track");
    }
    sadmm_free(s.vertices);
    sadmm_free(s.triangles);
    if (status != SADMM_OK) return status;
    const sadmm_shape_def shape = sadmm_mesh_shape(mesh, friction);
    const struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), origin.x, origin.y, origin.z);
    status = sadmm_place_solids(world, at, &shape, 1, 0, name, NULL, error);
    sadmm_mesh_destroy(mesh);
    return status;
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

/* A floor and four walls under the funnel, around z = 0. */
static sadmm_status place_tray(sadmm_world *world, vec3 under, struct sadmm_error *error)
{
    sadmm_shape_def parts[5];
    for (int k = 0; k < 5; ++k) {
        parts[k] = sadmm_shape_def_default();
        parts[k].type = SADMM_SHAPE_BOX;
        parts[k].friction = friction;
        parts[k].size[0] = parts[k].size[1] = tray + 2 * thick;
        parts[k].size[2] = thick;
        parts[k].position[2] = -thick;
        if (k == 4) continue;
        parts[k].size[k / 2] = thick;
        parts[k].size[2] = 0.5 * tray_wall;
        parts[k].position[k / 2] = (k % 2 ? 1 : -1) * (tray + thick);
        parts[k].position[2] = 0.5 * tray_wall;
    }
    const struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), under.x, under.y, 0);
    return sadmm_place_solids(world, at, parts, 5, 0, "tray", NULL, error);
}

/* Along the ramp: marble 0 is in front. */
static double start_of(int marble)
{
    return begins + apart * (MARBLES - 1 - marble);
}

static vec3 start_at(const struct line *line, int marble)
{
    return v3_madd(middle_at(line, 0), start_of(marble), line->at[0].forward);
}

static int64_t release_step(const struct sadmm_scene *scene, int marble)
{
    return lround(every * marble / scene->def.settings.dt);
}

/* Until it is its turn a marble is without weight. */
static sadmm_status place_marble(sadmm_world *world, vec3 at, bool waits, struct sadmm_error *error)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    shape.type = SADMM_SHAPE_SPHERE;
    shape.size[0] = radius;
    shape.friction = friction;
    const struct sadmm_frame frame = sadmm_frame_moved(sadmm_frame_world(), at.x, at.y, at.z);
    sadmm_status status = sadmm_place_solids(world, frame, &shape, 1, density, "marble", &id, error);
    if (status == SADMM_OK && waits)
        status = sadmm_scene_world_error(world, sadmm_world_set_body_gravity_scale(world, id, 0), error);
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct line line;
    make_line(&line);
    sadmm_status status = place_surface(world, &line, make_channel, v3(0, 0, 0), "track", error);
    if (status == SADMM_OK) status = place_surface(world, &line, make_funnel, funnel_at(&line), "funnel", error);
    if (status == SADMM_OK) status = place_tray(world, funnel_at(&line), error);
    for (int i = 0; i < MARBLES && status == SADMM_OK; ++i)
        status = place_marble(world, start_at(&line, i), release_step(scene, i) > 0, error);
    return status;
}

static sadmm_status before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error)
{
    for (int i = 1; i < MARBLES; ++i) {
        sadmm_body_id id;
        if (step != release_step(scene, i)) continue;
        sadmm_status status = sadmm_world_body_at(world, FIRST + i, &id);
        if (status == SADMM_OK) status = sadmm_world_set_body_gravity_scale(world, id, 1);
        return sadmm_scene_world_error(world, status, error);
    }
    return SADMM_OK;
}

/* ---- success ----------------------------------------------------------------------------------------------------- */

/* Memory. */
enum {
    PASSED,                      /* by marble: when it came to the end of the track, s; 0: not yet */
    ARRIVED = PASSED + MARBLES,  /* and into the tray */
    ROLLING = ARRIVED + MARBLES, /* the largest error of v^2 on the ramp, relative */
    OFF,                         /* the farthest from the channel's axis, m */
    LOST,                        /* times that a marble was nowhere */
    LOWEST,                      /* J, the least energy of all, and by how much it was more than that later */
    GAIN,
    OVERLAP
};

/* Unlike fmax: once NaN, always NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

/* J, from the tray. */
static double energy_of(const struct sadmm_scene *scene, const sadmm_body_def *body)
{
    return 0.5 * (body->mass * v3_norm2(v3_load(body->linear_velocity)) +
                  body->inertia[0] * v3_norm2(v3_load(body->angular_velocity))) -
           body->mass * scene->def.settings.gravity[2] * body->position[2];
}

static int nearest_section(const struct line *line, vec3 x)
{
    int nearest = 0;
    double least = HUGE_VAL;
    for (int i = 0; i < line->count; ++i) {
        const double d = v3_norm2(v3_sub(x, v3_madd(line->at[i].bottom, tube, line->at[i].up)));
        if (d < least) least = d, nearest = i;
    }
    return nearest;
}

/* Of a point from the channel's axis, m: of the part of the axis that begins or ends with the nearest section. */
static double from_axis(const struct line *line, int nearest, vec3 x)
{
    const struct section *s = &line->at[nearest];
    const vec3 d = v3_sub(x, v3_madd(s->bottom, tube, s->up));
    return v3_norm(v3_madd(d, -v3_dot(d, s->forward), s->forward));
}

/* How long a marble takes from its place on the ramp to the end of the track if nothing is lost, s. */
static double fastest(const struct sadmm_scene *scene, const struct line *line, int marble)
{
    const vec3 start = start_at(line, marble);
    const double g = -scene->def.settings.gravity[2];
    double time = 0, speed = 0;
    vec3 at = start;
    for (int i = 0; i < line->count; ++i) {
        const vec3 next = middle_at(line, i);
        if (i <= line->ramp_end && next.z >= start.z) continue;
        const double then = sqrt(10.0 / 7 * g * (start.z - next.z));
        time += v3_norm(v3_sub(next, at)) / (0.5 * (speed + then));
        speed = then;
        at = next;
    }
    return time;
}

/* On the track: how it rolls on the ramp, how far it is from the axis, whether it is through. */
static void inspect_track(const struct sadmm_scene *scene, const struct line *line, int marble, double t,
                          const sadmm_body_def *body, double memory[])
{
    const vec3 x = v3_load(body->position), start = start_at(line, marble);
    const struct section *end = &line->at[line->count - 1];
    const int nearest = nearest_section(line, x);
    const double down = start.z - x.z, g = -scene->def.settings.gravity[2];
    memory[OFF] = larger(memory[OFF], from_axis(line, nearest, x));
    /* after the first decimetre, where a step is little of it */
    if (nearest < line->ramp_end && down > 0.1 * sin(steep))
        memory[ROLLING] = larger(memory[ROLLING],
                                 fabs(v3_norm2(v3_load(body->linear_velocity)) / (10.0 / 7 * g * down) - 1));
    if (nearest > line->ramp_end && v3_dot(v3_sub(x, end->bottom), end->forward) > 0 && nearest == line->count - 1)
        memory[PASSED + marble] = t;
}

/* In the funnel, or under it. */
static void inspect_funnel(const struct line *line, int marble, double t, const sadmm_body_def *body, double memory[])
{
    const vec3 d = v3_sub(v3_load(body->position), funnel_at(line));
    const double bottom = cone * (hole - rim), z = body->position[2];
    const bool inside = hypot(d.x, d.y) < rim && d.z > bottom && d.z < edge + 2 * tube;
    const bool under = fabs(d.x) < tray && fabs(d.y) < tray && z > 0 && d.z <= bottom;
    memory[LOST] += !(inside || under);
    if (under && z < 2 * radius && memory[ARRIVED + marble] == 0) memory[ARRIVED + marble] = t;
}

static void add_energy(double energy, double memory[])
{
    if (memory[LOWEST] == 0 || energy < memory[LOWEST]) memory[LOWEST] = energy;
    memory[GAIN] = larger(memory[GAIN], energy - memory[LOWEST]);
}

static void judge(const struct sadmm_scene *scene, const struct line *line, const double memory[], double weight,
                  bool over, struct sadmm_scene_task tasks[3])
{
    double late = 0, early = 0, passed = 0, arrived = 0, last = 0;
    bool in_order = true;
    for (int i = 0; i < MARBLES; ++i) {
        const double begun = every * i, time = memory[PASSED + i] - begun, expected = fastest(scene, line, i);
        passed += memory[PASSED + i] > 0;
        arrived += memory[ARRIVED + i] > 0;
        last = larger(last, memory[ARRIVED + i]);
        if (memory[PASSED + i] == 0) continue;
        late = larger(late, time / expected - 1);
        early = larger(early, 1 - time / expected);
        in_order = in_order && (i == 0 || (memory[PASSED + i - 1] > 0 && memory[PASSED + i] > memory[PASSED + i - 1]));
    }
    const double gain = memory[GAIN] / weight;
    tasks[0].name = "roll";
    tasks[0].figure_count = 3;
    tasks[0].figures[0] = (struct sadmm_scene_figure){"error", "", memory[ROLLING]};
    tasks[0].figures[1] = (struct sadmm_scene_figure){"gain", "m", gain};
    tasks[0].figures[2] = (struct sadmm_scene_figure){"overlap", "m", memory[OVERLAP]};
    tasks[1].name = "follow the track";
    tasks[1].figure_count = 4;
    tasks[1].figures[0] = (struct sadmm_scene_figure){"passed", "", passed};
    tasks[1].figures[1] = (struct sadmm_scene_figure){"late", "", late};
    tasks[1].figures[2] = (struct sadmm_scene_figure){"off", "m", memory[OFF]};
    tasks[1].figures[3] = (struct sadmm_scene_figure){"in order", "", in_order};
    tasks[2].name = "arrive";
    tasks[2].figure_count = 3;
    tasks[2].figures[0] = (struct sadmm_scene_figure){"arrived", "", arrived};
    tasks[2].figures[1] = (struct sadmm_scene_figure){"time", "s", last};
    tasks[2].figures[2] = (struct sadmm_scene_figure){"lost", "", memory[LOST]};
    for (int k = 0; k < 3; ++k) tasks[k].finished = over || (k < 2 && passed == MARBLES);
    tasks[0].passed = tasks[0].finished && memory[ROLLING] < 2e-3 && gain < 1e-4 && memory[OVERLAP] < 0.1 * radius;
    tasks[1].passed = tasks[1].finished && passed == MARBLES && in_order && late < 0.25 && early < 0.01 &&
                      memory[OFF] < tube;
    tasks[2].passed = tasks[2].finished && arrived == MARBLES && memory[LOST] == 0;
}

static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt;
    double *memory = result->memory, energy = 0, weight = 0;
    struct line line;
    sadmm_step_report report;
    if (result->task_count && result->tasks[2].finished) return SADMM_OK;
    result->task_count = 3;
    make_line(&line);
    sadmm_status status = sadmm_scene_world_error(world, sadmm_world_report(world, &report), error);
    for (int i = 0; i < MARBLES && status == SADMM_OK; ++i) {
        sadmm_body_id id;
        sadmm_body_def body;
        status = sadmm_world_body_at(world, FIRST + i, &id);
        if (status == SADMM_OK) status = sadmm_world_body_def(world, id, &body);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        energy += energy_of(scene, &body);
        weight -= body.mass * scene->def.settings.gravity[2];
        if (memory[PASSED + i] == 0) inspect_track(scene, &line, i, t, &body, memory);
        else inspect_funnel(&line, i, t, &body, memory);
    }
    if (status != SADMM_OK) return status;
    add_energy(energy, memory);
    memory[OVERLAP] = larger(memory[OVERLAP], report.penetration_max);
    judge(scene, &line, memory, weight, t >= scene->info->duration - 1e-9, result->tasks);
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.001;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_marble_run = {
    .info = {
        .name = "marble_run",
        .arguments = "",
        .description = "eight marbles roll down a ramp, through a loop, a bend and a funnel into a tray",
        .duration = 14,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
    },
    .configure = configure,
    .fill = fill,
    .before_step = before_step,
    .observe = observe,
};

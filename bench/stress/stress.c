#include "stress.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/math/quat.h"
#include "subadmm/mass.h"

/* ---- cases and verdicts ---------------------------------------------------------------------------------------- */

const struct stress_case *stress_case_at(size_t index)
{
    static const struct stress_group *const groups[] = {
        &stress_rest,   &stress_piles, &stress_impacts, &stress_friction, &stress_springs,
        &stress_joints, &stress_spins, &stress_energy,  &stress_momentum, &stress_far,
    };
    for (size_t k = 0; k < sizeof groups / sizeof *groups; index -= groups[k++]->count)
        if (index < groups[k]->count) return &groups[k]->cases[index];
    return NULL;
}

static const struct stress_limit *limit_of(const struct stress *s, const struct stress_check *check)
{
    for (int k = 0; k < STRESS_LIMITS && s->about->limits[k].check; ++k) {
        const struct stress_limit *limit = &s->about->limits[k];
        if (!strcmp(limit->check, check->what) && s->value >= limit->from && s->value <= limit->to &&
            (limit->precisions & 1 << s->def.precision) && (!limit->variants || limit->variants >> s->variant & 1))
            return limit;
    }
    return NULL;
}

enum stress_verdict stress_judge(const struct stress *s, const struct stress_check **decisive,
                                 const struct stress_limit **limit)
{
    enum stress_verdict worst = STRESS_PASS;
    double largest = -1;
    *decisive = NULL;
    *limit = NULL;
    for (int k = 0; k < s->check_count; ++k) {
        const struct stress_check *check = &s->checks[k];
        const struct stress_limit *known = limit_of(s, check);
        const double share = check->bound > 0 ? check->worst / check->bound : check->worst > 0 ? INFINITY : 0;
        const enum stress_verdict verdict = check->worst <= check->bound            ? STRESS_PASS
                                            : known && check->worst <= known->bound ? STRESS_LIMIT
                                                                                    : STRESS_FAIL;
        if (verdict < worst || (verdict == worst && share <= largest)) continue;
        worst = verdict;
        largest = share;
        *decisive = check;
        *limit = verdict == STRESS_LIMIT ? known : NULL;
    }
    return s->message[0] || s->check_count == 0 ? STRESS_FAIL : worst;
}

void stress_check(struct stress *s, const char *what, double measured, double bound)
{
    int k = 0;
    if (!stress_ok(s)) return;
    while (k < s->check_count && strcmp(s->checks[k].what, what)) ++k;
    if (k == STRESS_CHECKS) {
        stress_fail(s, "more than %d measures", (int)STRESS_CHECKS);
        return;
    }
    if (k == s->check_count) s->checks[s->check_count++] = (struct stress_check){what, 0, bound};
    if (!(measured <= s->checks[k].worst)) s->checks[k].worst = isnan(measured) ? INFINITY : measured;
}

bool stress_ok(const struct stress *s) { return !s->message[0]; }

void stress_fail(struct stress *s, const char *format, ...)
{
    va_list arguments;
    if (!stress_ok(s)) return;
    va_start(arguments, format);
    vsnprintf(s->message, sizeof s->message, format, arguments);
    va_end(arguments);
}

void stress_run(struct stress *s, const struct stress_case *about, double value, int variant, bool quick,
                const sadmm_world_def *def)
{
    *s = (struct stress){.about = about, .value = value, .variant = variant, .quick = quick, .def = *def};
    about->run(s);
    sadmm_world_destroy(s->world);
    s->world = NULL;
}

/* ---- worlds ----------------------------------------------------------------------------------------------------- */

void stress_must(struct stress *s, sadmm_status status)
{
    if (status != SADMM_OK) stress_fail(s, "%s", s->world ? sadmm_world_message(s->world) : sadmm_last_message());
}

void stress_open(struct stress *s, double gravity)
{
    sadmm_world_destroy(s->world);
    s->world = NULL;
    s->time = s->overlap = s->drift = 0;
    s->def.settings.gravity[2] = -gravity;
    if (stress_ok(s)) stress_must(s, sadmm_world_create(&s->def, &s->world));
}

static void to_world(const struct stress *s, const double position[3], double out[3])
{
    for (int k = 0; k < 3; ++k) out[k] = s->origin[k] + position[k];
}

/* The solid's mass, moments and centre; the shape is moved to have the centre at the body's origin. */
static void make_solid(struct stress *s, const struct stress_body *from, sadmm_shape_def *shape, sadmm_body_def *body)
{
    sadmm_mass solid;
    const bool moments = from->inertia[0] > 0;
    if (!moments || shape->type == SADMM_SHAPE_CONE || shape->type == SADMM_SHAPE_HULL) {
        stress_must(s, sadmm_shape_mass(shape, 1, &solid));
        if (!stress_ok(s)) return;
        for (int k = 0; k < 3; ++k) body->inertia[k] = from->mass / solid.mass * solid.inertia[k];
        double centre[3] = {0, 0, 0}; /* positions are those of centres of mass */
        stress_must(s, sadmm_mass_pose_in_body(&solid, shape->position, shape->orientation));
        stress_must(s, sadmm_mass_pose_of_body(&solid, centre, body->orientation));
    }
    if (moments) memcpy(body->inertia, from->inertia, sizeof body->inertia);
    body->mass = from->mass;
}

sadmm_body_id stress_add(struct stress *s, const struct stress_body *from)
{
    sadmm_body_id id = {0, 0};
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    if (!stress_ok(s)) return id;
    shape.type = from->shape;
    memcpy(shape.size, from->size, sizeof shape.size);
    shape.friction = from->friction;
    shape.restitution = from->restitution;
    shape.hull = from->hull;
    shape.mesh = from->mesh;
    body.type = from->kinematic ? SADMM_BODY_KINEMATIC : from->mass > 0 ? SADMM_BODY_DYNAMIC : SADMM_BODY_STATIC;
    body.environment = body.type == SADMM_BODY_DYNAMIC ? from->environment : -1;
    to_world(s, from->position, body.position);
    if (stress_norm(from->orientation) > 0 || from->orientation[3] != 0)
        memcpy(body.orientation, from->orientation, sizeof body.orientation);
    memcpy(body.linear_velocity, from->velocity, sizeof body.linear_velocity);
    memcpy(body.angular_velocity, from->spin, sizeof body.angular_velocity);
    if (body.type == SADMM_BODY_DYNAMIC) make_solid(s, from, &shape, &body);
    if (stress_ok(s)) stress_must(s, sadmm_world_add_body(s->world, &body, &id));
    if (stress_ok(s) && !from->ghost) stress_must(s, sadmm_world_add_shape(s->world, id, &shape, NULL));
    return id;
}

void stress_add_plane(struct stress *s, const double orientation[4], double friction, double restitution)
{
    struct stress_body plane = {.shape = SADMM_SHAPE_PLANE, .friction = friction, .restitution = restitution};
    if (orientation) memcpy(plane.orientation, orientation, sizeof plane.orientation);
    stress_add(s, &plane);
}

sadmm_joint_id stress_join(struct stress *s, sadmm_joint_def *def, double x, double y, double z,
                           const double orientation[4])
{
    static const double level[4] = {1, 0, 0, 0};
    const double place[3] = {x, y, z};
    double at[3];
    sadmm_joint_id id = {0, 0};
    to_world(s, place, at);
    if (stress_ok(s)) stress_must(s, sadmm_world_place_joint(s->world, def, at, orientation ? orientation : level));
    if (stress_ok(s)) stress_must(s, sadmm_world_add_joint(s->world, def, &id));
    return id;
}

bool stress_step(struct stress *s)
{
    if (stress_ok(s)) stress_must(s, sadmm_world_step(s->world));
    if (stress_ok(s)) stress_must(s, sadmm_world_report(s->world, &s->last));
    if (!stress_ok(s)) return false;
    ++s->steps;
    s->time += s->def.settings.dt;
    s->unsolved += s->last.unsolved > 0 || s->last.error > s->def.settings.tolerance;
    s->overlap = fmax(s->overlap, s->last.penetration_max);
    s->drift = fmax(s->drift, s->last.joint_drift);
    return true;
}

sadmm_body_state stress_state(struct stress *s, sadmm_body_id id)
{
    sadmm_body_state state = {{0}, {1, 0, 0, 0}, {0}, {0}};
    if (stress_ok(s)) stress_must(s, sadmm_world_body_state(s->world, id, &state));
    for (int k = 0; k < 3; ++k) state.position[k] -= s->origin[k];
    return state;
}

sadmm_joint_state stress_joint_state(struct stress *s, sadmm_joint_id id)
{
    sadmm_joint_state state = {0};
    if (stress_ok(s)) stress_must(s, sadmm_world_joint_state(s->world, id, &state));
    return state;
}

void stress_move(struct stress *s, sadmm_body_id id, double x, double y, double z)
{
    static const double level[4] = {1, 0, 0, 0};
    const double place[3] = {x, y, z};
    double at[3];
    to_world(s, place, at);
    if (stress_ok(s)) stress_must(s, sadmm_world_move_body(s->world, id, at, level));
}

double stress_dt(const struct stress *s) { return s->def.settings.dt; }

/* ---- measures --------------------------------------------------------------------------------------------------- */

static void add_sums(struct stress_sums *sums, const sadmm_body_def *body, const double origin[3], double gravity)
{
    const vec3 v = v3_load(body->linear_velocity), w = v3_load(body->angular_velocity),
               x = v3_sub(v3_load(body->position), v3_load(origin));
    const mat3 turn = q_matrix(q_load(body->orientation));
    const vec3 own = m3_tmul(turn, w),
               spin = m3_mul(turn, v3(body->inertia[0] * own.x, body->inertia[1] * own.y, body->inertia[2] * own.z)),
               push = v3_scale(v, body->mass), orbit = v3_cross(x, push);
    double p[3], l[3];
    v3_store(push, p);
    v3_store(v3_add(orbit, spin), l);
    sums->kinetic += 0.5 * (v3_dot(push, v) + v3_dot(spin, w));
    sums->potential += body->mass * gravity * body->gravity_scale * x.z;
    for (int k = 0; k < 3; ++k) sums->momentum[k] += p[k], sums->turning[k] += l[k];
    sums->momentum_scale += v3_norm(push);
    sums->turning_scale += v3_norm(orbit) + v3_norm(spin);
    sums->fastest = fmax(sums->fastest, fmax(v3_norm(v), v3_norm(w)));
}

struct stress_sums stress_sum(struct stress *s)
{
    struct stress_sums sums = {0};
    const int32_t count = stress_ok(s) ? sadmm_world_body_count(s->world) : 0;
    for (int32_t i = 0; i < count && stress_ok(s); ++i) {
        sadmm_body_id id;
        sadmm_body_def body;
        stress_must(s, sadmm_world_body_at(s->world, i, &id));
        if (stress_ok(s)) stress_must(s, sadmm_world_body_def(s->world, id, &body));
        if (stress_ok(s) && body.type == SADMM_BODY_DYNAMIC)
            add_sums(&sums, &body, s->origin, -s->def.settings.gravity[2]);
    }
    return sums;
}

double stress_norm(const double a[3]) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

double stress_distance(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return stress_norm(d);
}

void stress_turn(int axis, double angle, double orientation[4])
{
    orientation[0] = cos(angle / 2);
    for (int k = 0; k < 3; ++k) orientation[k + 1] = k == axis ? sin(angle / 2) : 0;
}

double stress_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 4503599627370496.0 - 1;
}

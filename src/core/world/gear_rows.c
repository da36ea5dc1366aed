/* Gears as constraint rows, after those of joints: one hard row each, the sum of two coordinates' rows.
 *
 * Where a dynamic body carries the axles of both joints, that sum is a row on three bodies, and rows are on two. But the
 * joints' locked rows may be added to it, each as often as one likes: they hold anyway, and so does their sum with it.
 * They are added so that nothing is left on the carrier. What they stand for is the teeth: what presses wheel on wheel,
 * while the bearings hold the carrier (docs/algorithm.md, section 10). */
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/ldl6.h"
#include "world_internal.h"

enum { GEAR_BODIES = 3 };

/* Of a step: its row on the bodies, and its bias. */
struct acting_gear {
    struct acting_joint joint[2];
    int32_t body[GEAR_BODIES]; /* -1: none */
    double row[GEAR_BODIES][6], bias;
    int count;
};

/* How small what is left on the carrier must be, and how large the shares of locked rows may be, both of what was there:
 * rounding of axes that are parallel, which no sum of rows joins, stays outside of both. */
static const double MOST_LEFT = 1e-9, MOST_SHARE = 1e4;

static bool acts(const sadmm_world *world, const struct sadmm_world_gear *gear)
{
    return gear->alive && gear->def.enabled && world->joints[gear->joint[0]].def.enabled &&
           world->joints[gear->joint[1]].def.enabled;
}

static void add_row(struct acting_gear *acting, int32_t body, const double row[6], double factor)
{
    int at = 0;
    while (at < acting->count && acting->body[at] != body) ++at;
    acting->count += at == acting->count;
    acting->body[at] = body;
    for (int j = 0; j < 6; ++j) acting->row[at][j] += factor * row[j];
}

/* A coordinate's row of a joint, on all of its dynamic bodies. */
static void add_coordinate(struct acting_gear *acting, int i, int k, double factor)
{
    for (int s = 0; s < 2; ++s) {
        double row[6];
        if (acting->joint[i].side[s].system_body < 0) continue;
        joint_step_row(&acting->joint[i], s, k, row);
        add_row(acting, acting->joint[i].side[s].system_body, row, factor);
    }
}

static struct acting_gear act(const sadmm_world *world, const struct sadmm_world_gear *gear,
                              const sadmm_settings *settings)
{
    struct acting_gear out = {.body = {-1, -1, -1}};
    double error = -gear->def.offset;
    for (int i = 0; i < 2; ++i) {
        const struct sadmm_world_joint *joint = &world->joints[gear->joint[i]];
        const int k = i ? gear->def.coordinate_2 : gear->def.coordinate_1;
        const double factor = i ? gear->def.ratio : 1;
        out.joint[i] = sadmm_world_act_joint(world, joint, settings);
        const struct joint_moving m = joint_moving_of(&joint->def, &joint->next, &out.joint[i], k, settings);
        error += factor * m.value;
        out.bias += factor * m.turned;
        add_coordinate(&out, i, k, factor);
    }
    out.bias += joint_feedback(error, settings->dt, settings->correction_speed);
    return out;
}

/* ---- a carrier that moves ---------------------------------------------------------------------------------------- */

/* The side of either joint that is on the body of both; the two bodies are the same. */
static void find_carrier(const struct acting_gear *acting, int side[2])
{
    side[0] = side[1] = 0;
    for (int s = 0; s < 2; ++s)
        for (int t = 0; t < 2; ++t)
            if (acting->joint[0].side[s].system_body == acting->joint[1].side[t].system_body) side[0] = s, side[1] = t;
}

/* The locked rows of both joints on the carrier. */
struct locked_rows {
    double on_carrier[2 * JOINT_COORDINATES][6]; /* forces, and torques over `length` */
    double scale[2 * JOINT_COORDINATES];         /* of each: the row is that times the one above */
    int joint[2 * JOINT_COORDINATES], coordinate[2 * JOINT_COORDINATES];
    int count;
};

/* A torque counts as a force on an arm as long as the carrier is wide. */
static double carrier_length(const struct acting_gear *acting, const int side[2])
{
    const struct joint_geometry *one = &acting->joint[0].middle, *two = &acting->joint[1].middle;
    const struct sadmm_rigid *rigid = acting->joint[0].side[side[0]].rigid;
    const vec3 apart = v3_sub(side[0] ? one->arm_b : one->arm_a, side[1] ? two->arm_b : two->arm_a);
    return v3_norm(apart) + sqrt(v3_max_abs(v3_load(rigid->inertia)) / rigid->mass);
}

static void list_locked(const sadmm_world *world, const struct sadmm_world_gear *gear, const struct acting_gear *acting,
                        const int side[2], double length, struct locked_rows *locked)
{
    locked->count = 0;
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < JOINT_COORDINATES; ++k) {
            const sadmm_joint_def *def = &world->joints[gear->joint[i]].def;
            if (!(def->locks >> k & 1)) continue;
            const int at = locked->count++;
            double *row = locked->on_carrier[at];
            locked->joint[at] = i;
            locked->coordinate[at] = k;
            locked->scale[at] = k < 3 ? 1 : length;
            joint_step_row(&acting->joint[i], side[i], k, row);
            for (int j = 0; j < 6; ++j) row[j] *= locked->scale[at] / (j < 3 ? 1 : length);
        }
}

/* The shares of locked rows of which the sum is -wanted, and which are the smallest; false: there are none. */
static bool find_shares(const struct locked_rows *locked, const double wanted[6], double share[2 * JOINT_COORDINATES])
{
    double S[36] = {0}, L[36], z[6], left = 0, size = 0, most = 0;
    for (int n = 0; n < locked->count; ++n)
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c < 6; ++c) S[6 * r + c] += locked->on_carrier[n][r] * locked->on_carrier[n][c];
    ldl6_factor(S, L);
    ldl6_solve(L, wanted, z);
    for (int n = 0; n < locked->count; ++n) {
        share[n] = -six_product(locked->on_carrier[n], z);
        most += share[n] * share[n];
    }
    for (int r = 0; r < 6; ++r) {
        double sum = wanted[r];
        for (int n = 0; n < locked->count; ++n) sum += share[n] * locked->on_carrier[n][r];
        left += sum * sum;
        size += wanted[r] * wanted[r];
    }
    return left <= MOST_LEFT * MOST_LEFT * size && most <= MOST_SHARE * MOST_SHARE * size;
}

/* The row without the carrier; false: the axes are such that nothing between the other two can turn both. */
static bool leave_carrier(const sadmm_world *world, const struct sadmm_world_gear *gear, const sadmm_settings *settings,
                          struct acting_gear *acting)
{
    struct locked_rows locked;
    double share[2 * JOINT_COORDINATES], wanted[6];
    int side[2], at = 0;
    find_carrier(acting, side);
    const double length = carrier_length(acting, side);
    while (acting->body[at] != acting->joint[0].side[side[0]].system_body) ++at;
    for (int j = 0; j < 6; ++j) wanted[j] = acting->row[at][j] / (j < 3 ? 1 : length);
    list_locked(world, gear, acting, side, length, &locked);
    if (!find_shares(&locked, wanted, share)) return false;
    for (int n = 0; n < locked.count; ++n) {
        const int i = locked.joint[n], k = locked.coordinate[n];
        const struct sadmm_world_joint *joint = &world->joints[gear->joint[i]];
        const struct joint_moving m = joint_moving_of(&joint->def, &joint->next, &acting->joint[i], k, settings);
        share[n] *= locked.scale[n];
        add_coordinate(acting, i, k, share[n]);
        acting->bias += share[n] * (m.turned + joint_feedback(m.value, settings->dt, settings->correction_speed));
    }
    --acting->count;
    acting->body[at] = acting->body[acting->count];
    memcpy(acting->row[at], acting->row[acting->count], sizeof acting->row[at]);
    return true;
}

bool sadmm_world_gear_reaches(const sadmm_world *world, const struct sadmm_world_gear *gear)
{
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    struct acting_gear acting = {.body = {-1, -1, -1}};
    for (int i = 0; i < 2; ++i) {
        const struct sadmm_world_joint *joint = &world->joints[gear->joint[i]];
        struct joint_body bodies[2] = {{-1, NULL, false, false}, {-1, NULL, false, false}};
        for (int s = 0; s < 2; ++s) {
            if (joint->body[s] < 0) continue;
            const struct sadmm_world_body *body = &world->bodies[joint->body[s]];
            const bool dynamic = body->type == SADMM_BODY_DYNAMIC;
            bodies[s] = (struct joint_body){dynamic ? joint->body[s] : -1, &body->rigid, false, false};
        }
        acting.joint[i] = joint_act(&joint->def, joint->frame, bodies, &settings);
        add_coordinate(&acting, i, i ? gear->def.coordinate_2 : gear->def.coordinate_1, i ? gear->def.ratio : 1);
    }
    return acting.count < GEAR_BODIES || leave_carrier(world, gear, &settings, &acting);
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* The constraint that the gear may have, with its row in this step or without. */
static bool add_slot(sadmm_world *world, const struct sadmm_row_constraint *constraint)
{
    const size_t at = world->joint_constraint_count;
    if (!sadmm_grow(&world->joint_constraints, &world->joint_constraint_capacity, at, at + 1,
                    sizeof *world->joint_constraints))
        return false;
    world->joint_constraints[world->joint_constraint_count++] = *constraint;
    return true;
}

sadmm_status sadmm_world_make_gear_rows(sadmm_world *world, const sadmm_settings *settings)
{
    struct sadmm_rows *rows = &world->start.rows;
    world->joint_rows = rows->row_count;
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot) {
        struct sadmm_world_gear *gear = &world->gears[slot];
        const size_t r = rows->row_count;
        if (!gear->alive) continue;
        struct acting_gear acting = act(world, gear, settings);
        gear->acts = acts(world, gear);
        if (acting.count == GEAR_BODIES) gear->acts = leave_carrier(world, gear, settings, &acting) && gear->acts;
        const int b = acting.count > 0 ? acting.count - 1 : 0, a = b > 0 ? 0 : 1; /* one body is b */
        const struct sadmm_row_constraint none = {.body_a = acting.body[a], .body_b = acting.body[b]};
        if (!gear->acts) {
            gear->next.force = 0;
            if (!add_slot(world, &none)) return sadmm_fail_memory(&world->error, "the gears' rows");
            continue;
        }
        if (!sadmm_grow(&world->joint_sources, &world->joint_source_capacity, r, r + 1,
                        sizeof *world->joint_sources) ||
            !sadmm_grow(&world->start.multiplier, &world->start.multiplier_capacity, r, r + 1,
                        sizeof *world->start.multiplier) ||
            sadmm_rows_add(rows, 1, acting.body[a], acting.body[b]) < 0 ||
            !add_slot(world, &rows->constraints[rows->constraint_count - 1]))
            return sadmm_fail_memory(&world->error, "the gears' rows");
        if (acting.body[a] >= 0) memcpy(rows->jacobian_a + 6 * r, acting.row[a], sizeof acting.row[a]);
        memcpy(rows->jacobian_b + 6 * r, acting.row[b], sizeof acting.row[b]);
        sadmm_row_hard(rows, (int32_t)r, acting.bias);
        rows->lambda[r] = world->start.multiplier[r] = gear->next.force * settings->dt;
        /* of its islands it is a row of the first joint's as any other */
        world->joint_sources[r] =
            (struct sadmm_joint_source){.joint = (int32_t)gear->joint[0], .role = SADMM_ROLE_LOCK, .sign = 1};
    }
    return SADMM_OK;
}

void sadmm_world_begin_gears(sadmm_world *world)
{
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot) {
        world->gears[slot].next = world->gears[slot].last;
        if (!acts(world, &world->gears[slot])) world->gears[slot].next.force = 0;
    }
}

void sadmm_world_keep_gear_rows(sadmm_world *world, double dt)
{
    size_t r = world->joint_rows;
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot)
        if (world->gears[slot].alive && world->gears[slot].acts)
            world->gears[slot].next.force = world->start.rows.lambda[r++] / dt;
}

void sadmm_world_commit_gears(sadmm_world *world)
{
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot)
        if (world->gears[slot].alive) world->gears[slot].last = world->gears[slot].next;
}

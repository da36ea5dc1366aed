/* Where the ends of a joint are (core/model/joint_law.h, joint_close.h): both ends in two poses, or those of two
 * joints, in a lane each. */
#include "core/math/lanes.h"
#include "joint_kernels.h"

/* Ends of a and b in a first pose, and in a second one. */
enum lane { FIRST_A, FIRST_B, SECOND_A, SECOND_B, LANES };

static const double unturned[4] = {1, 0, 0, 0}, nowhere[4] = {0, 0, 0, 0};

/* Of bodies, a row each. Of positions the fourth number is of no account. */
struct poses {
    lanes position[LANES], orientation[LANES];
};

static inline void put_pose(const struct joint_pose *pose, enum lane lane, struct poses *to)
{
    to->position[lane] = lanes_at(pose->position ? pose->position : nowhere);
    to->orientation[lane] = lanes_at(pose->orientation ? pose->orientation : unturned);
}

/* In the world. */
struct ends {
    struct lanes3 arm, point;
    struct lanes_quat orientation;
};

/* joint_end_of */
static inline struct ends find_ends(struct poses *at, const struct joint_frame *const frame[LANES])
{
    lanes own[LANES], place[LANES];
    for (int k = 0; k < LANES; ++k) {
        own[k] = lanes_at(&frame[k]->orientation.w);
        place[k] = lanes_at(&frame[k]->position.x);
    }
    lanes_transpose(own);
    lanes_transpose(place);
    lanes_transpose(at->position);
    lanes_transpose(at->orientation);
    const lanes *o = at->orientation, *x = at->position;
    const struct lanes_quat q = {o[0], o[1], o[2], o[3]};
    const struct lanes3 v = {place[0], place[1], place[2]};
    const struct lanes_matrix R = lanes_matrix_of(q);
    struct ends out;
    out.arm = lanes_turn(&R, v);
    out.point = lanes3_add((struct lanes3){x[0], x[1], x[2]}, out.arm);
    out.orientation = lanes_quat_mul(q, (struct lanes_quat){own[0], own[1], own[2], own[3]});
    return out;
}

/* From a's end to b's, in the lanes of both. */
static inline lanes way_of(lanes point)
{
    return __builtin_shufflevector(point, point, 1, 1, 3, 3) - __builtin_shufflevector(point, point, 0, 0, 2, 2);
}
static inline struct lanes3 find_way(const struct ends *e)
{
    return (struct lanes3){way_of(e->point.x), way_of(e->point.y), way_of(e->point.z)};
}

/* Axes of the frames. */
static inline void find_axes(const struct ends *e, struct lanes3 axis[3])
{
    const struct lanes_matrix R = lanes_matrix_of(e->orientation);
    axis[0] = (struct lanes3){R.r[0].x, R.r[1].x, R.r[2].x};
    axis[1] = (struct lanes3){R.r[0].y, R.r[1].y, R.r[2].y};
    axis[2] = (struct lanes3){R.r[0].z, R.r[1].z, R.r[2].z};
}

/* Lanes FIRST_A and SECOND_A of three numbers, or (b) of the other end, as vectors. */
struct two_vectors {
    lanes first, second;
};
static inline struct two_vectors vectors_of(struct lanes3 a, bool b)
{
    const lanes zero = lanes_fill(0);
    lanes xy = __builtin_shufflevector(a.x, a.y, 0, 4, 2, 6), z = __builtin_shufflevector(a.z, zero, 0, 4, 2, 6);
    if (b) {
        xy = __builtin_shufflevector(a.x, a.y, 1, 5, 3, 7);
        z = __builtin_shufflevector(a.z, zero, 1, 5, 3, 7);
    }
    return (struct two_vectors){__builtin_shufflevector(xy, z, 0, 1, 4, 5), __builtin_shufflevector(xy, z, 2, 3, 6, 7)};
}

/* The fourth lane is none of the three numbers: of the next member, which is written later. */
static inline void put_both(struct two_vectors v, vec3 *first, vec3 *second)
{
    lanes_put(v.first, &first->x);
    lanes_put(v.second, &second->x);
}

/* joint_geometry_with but for rotations; frames of both ends in both poses. */
static inline void put_geometry(const struct ends *e, struct joint_geometry *first, struct joint_geometry *second,
                                quat frame[LANES])
{
    const struct lanes3 way = find_way(e);
    struct lanes3 axis[3];
    struct two_vectors along[3];
    find_axes(e, axis);
    for (int k = 0; k < 3; ++k) along[k] = vectors_of(axis[k], false);
    for (int k = 0; k < JOINT_COORDINATES; ++k) put_both(along[k % 3], &first->axis[k], &second->axis[k]);
    put_both(vectors_of(lanes3_add(e->arm, way), false), &first->arm_a, &second->arm_a);
    put_both(vectors_of(e->arm, true), &first->arm_b, &second->arm_b);
    put_both(vectors_of(e->point, true), &first->point, &second->point);
    for (int k = 0; k < 3; ++k) {
        const lanes value = lanes3_dot(axis[k], way);
        first->value[k] = value[FIRST_A], second->value[k] = value[SECOND_A];
    }
    lanes turns[LANES] = {e->orientation.w, e->orientation.x, e->orientation.y, e->orientation.z};
    lanes_transpose(turns);
    for (int k = 0; k < LANES; ++k) lanes_put(turns[k], &frame[k].w);
}

/* Has the joint other axes than those of a's frame? */
static bool is_plain(const sadmm_joint_def *def)
{
    return joint_locked_rotations(def->locks) != 1 && !joint_is_radial(def->kind);
}

/* As the step starts, and halfway. */
static inline void put_side(const struct joint_side *side, double dt, enum lane first, struct poses *to)
{
    const struct joint_pose start = {side->rigid ? side->rigid->position : NULL,
                                     side->rigid ? side->rigid->orientation : NULL};
    const enum lane second = first + SECOND_A;
    put_pose(&start, first, to);
    put_pose(&start, second, to);
    if (side->system_body < 0 && !side->prescribed) return;
    to->position[second] += lanes_fill(dt / 2) * lanes_at(side->velocity);
    to->orientation[second] = lanes_at(&side->turned.w);
}

void SADMM_KERNEL(joint_act)(const sadmm_joint_def *def, const struct joint_frame frame[2], bool target,
                             const sadmm_settings *settings, struct acting_joint *acting)
{
    if (target || !is_plain(def)) {
        joint_act_between(def, frame, target, settings, acting);
        return;
    }
    const struct joint_frame *const of[LANES] = {&frame[0], &frame[1], &frame[0], &frame[1]};
    struct poses at;
    quat turned[LANES];
    put_side(&acting->side[0], settings->dt, FIRST_A, &at);
    put_side(&acting->side[1], settings->dt, FIRST_B, &at);
    const struct ends e = find_ends(&at, of);
    put_geometry(&e, &acting->start, &acting->middle, turned);
    joint_rotation_values(turned[FIRST_A], turned[FIRST_B], def->locks, true, acting->start.value + 3);
    acting->frame = turned[SECOND_A];
}

/* ---- at the end of a step ---------------------------------------------------------------------------------------- */

static struct joint_end end_at(const struct joint_frame *frame, const struct joint_pose *pose)
{
    if (!pose->position) return joint_end_on(frame, NULL);
    return joint_end_of(frame, v3_load(pose->position), q_load(pose->orientation));
}

void SADMM_KERNEL(joint_close)(const struct joint_opened *joint, const struct joint_pose start[2],
                               const sadmm_settings *settings, struct joint_closing *out)
{
    const struct joint_frame *frame = joint->joint->frame;
    double scale = 0;
    if (!is_plain(&joint->joint->def)) {
        struct joint_end first[2], last[2];
        for (int s = 0; s < 2; ++s) {
            first[s] = end_at(&frame[s], &start[s]);
            last[s] = end_at(&frame[s], &joint->pose[s]);
            scale += joint_closing_scale(last[s].arm, joint->moves[s]);
        }
        *out = joint_closing_of(&joint->joint->def, first, last, scale, settings);
        return;
    }
    const struct joint_frame *const of[LANES] = {&frame[0], &frame[1], &frame[0], &frame[1]};
    struct joint_geometry before;
    struct poses at;
    quat turned[LANES];
    for (int s = 0; s < 2; ++s) {
        put_pose(&start[s], FIRST_A + s, &at);
        put_pose(&joint->pose[s], SECOND_A + s, &at);
    }
    const struct ends e = find_ends(&at, of);
    put_geometry(&e, &before, &out->geometry, turned);
    joint_rotation_values(turned[FIRST_A], turned[FIRST_B], joint->joint->def.locks, false, before.value + 3);
    joint_rotation_values(turned[SECOND_A], turned[SECOND_B], joint->joint->def.locks, false, out->geometry.value + 3);
    for (int s = 0; s < 2; ++s)
        scale += joint_closing_scale(v3(e.arm.x[SECOND_A + s], e.arm.y[SECOND_A + s], e.arm.z[SECOND_A + s]),
                                     joint->moves[s]);
    joint_closing_errors(&joint->joint->def, before.value, scale, settings, out);
}

static void find_opening(struct joint_opened *joint)
{
    const struct joint_end end[2] = {end_at(&joint->joint->frame[0], &joint->pose[0]),
                                     end_at(&joint->joint->frame[1], &joint->pose[1])};
    const bool moves[2] = {joint->moves[0], joint->moves[1]};
    joint->off = joint_opening(&joint->joint->def, end);
    joint->little = joint_opens_little(&joint->joint->def, end, moves, joint->off);
}

/* Lanes of a and b, of which those of a are read. */
static inline lanes of_a(lanes x) { return __builtin_shufflevector(x, x, 0, 0, 2, 2); }
static inline lanes of_b(lanes x) { return __builtin_shufflevector(x, x, 1, 1, 3, 3); }

static void find_two_openings(struct joint_opened *const two[2])
{
    const struct joint_frame *const of[LANES] = {&two[0]->joint->frame[0], &two[0]->joint->frame[1],
                                                 &two[1]->joint->frame[0], &two[1]->joint->frame[1]};
    struct poses at;
    struct lanes3 axis[3];
    lanes value[3];
    for (int k = 0; k < LANES; ++k) put_pose(&two[k / 2]->pose[k % 2], k, &at);
    const struct ends e = find_ends(&at, of);
    const struct lanes3 way = find_way(&e);
    find_axes(&e, axis);
    for (int k = 0; k < 3; ++k) value[k] = lanes3_dot(axis[k], way);
    const struct lanes_quat q = e.orientation,
                            back = {of_a(q.w), -of_a(q.x), -of_a(q.y), -of_a(q.z)},
                            other = {of_b(q.w), of_b(q.x), of_b(q.y), of_b(q.z)}, turn = lanes_quat_mul(back, other);
    const lanes arm2 = lanes3_dot(e.arm, e.arm);
    for (int i = 0; i < 2; ++i) {
        struct joint_opened *joint = two[i];
        const uint32_t locks = joint->joint->def.locks;
        const int a = 2 * i, b = a + 1, odd = joint_odd_rotation(locks);
        const double most = JOINT_CLOSE_FROM / 4,
                     arms2 = (joint->moves[0] ? arm2[a] : 0) + (joint->moves[1] ? arm2[b] : 0);
        const vec3 part = v3(odd == 0 ? 0 : turn.x[a], odd == 1 ? 0 : turn.y[a], odd == 2 ? 0 : turn.z[a]);
        joint->off = 0;
        for (int k = 0; k < 3; ++k)
            if (locks >> k & 1) joint->off = max_of(joint->off, fabs(value[k][a]));
        joint->little = joint->off * joint->off <= JOINT_CLOSE_FROM * JOINT_CLOSE_FROM * arms2 &&
                        (!(locks >> 3) || v3_norm2(part) < most * most);
    }
}

void SADMM_KERNEL(joint_openings)(struct joint_opened *joints, size_t count)
{
    struct joint_opened *two[2];
    int waiting = 0;
    for (size_t j = 0; j < count; ++j) {
        if (!is_plain(&joints[j].joint->def)) {
            find_opening(&joints[j]);
            continue;
        }
        two[waiting++] = &joints[j];
        if (waiting == 2) find_two_openings(two), waiting = 0;
    }
    if (waiting) find_opening(two[0]);
}

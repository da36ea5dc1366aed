/* How fast a joint's coordinates change (joint_kernels.h), three at a time. */
#include "core/math/lanes.h"
#include "joint_kernels.h"

static inline struct lanes3 axes_of(const vec3 axis[3])
{
    return (struct lanes3){{axis[0].x, axis[1].x, axis[2].x, axis[2].x},
                           {axis[0].y, axis[1].y, axis[2].y, axis[2].y},
                           {axis[0].z, axis[1].z, axis[2].z, axis[2].z}};
}
static inline struct lanes3 scale(struct lanes3 a, double s)
{
    return (struct lanes3){a.x * lanes_fill(s), a.y * lanes_fill(s), a.z * lanes_fill(s)};
}
/* arm x a */
static inline struct lanes3 turn(vec3 arm, struct lanes3 a)
{
    const lanes x = lanes_fill(arm.x), y = lanes_fill(arm.y), z = lanes_fill(arm.z);
    return (struct lanes3){y * a.z - z * a.y, z * a.x - x * a.z, x * a.y - y * a.x};
}
/* v3_dot */
static inline lanes dot(struct lanes3 a, const double v[3])
{
    return a.x * lanes_fill(v[0]) + a.y * lanes_fill(v[1]) + a.z * lanes_fill(v[2]);
}
/* joint_row_product from `sum` on */
static inline lanes add_product(lanes sum, struct lanes3 a, const double v[3])
{
    sum = sum + a.x * lanes_fill(v[0]);
    sum = sum + a.y * lanes_fill(v[1]);
    return sum + a.z * lanes_fill(v[2]);
}

/* Of translations or rotations, whose linear parts are 0: a sum that begins with 0 is none the other for them. */
static inline lanes product(bool rotations, struct lanes3 linear, struct lanes3 angular, const double v[6])
{
    lanes sum = {0, 0, 0, 0};
    if (!rotations) sum = add_product(sum, linear, v);
    return add_product(sum, angular, v + 3);
}

static inline lanes rate_on(bool rotations, const vec3 axis[3], vec3 arm, const double v[6])
{
    const struct lanes3 a = axes_of(axis);
    if (rotations) return dot(a, v + 3);
    return dot(a, v) + dot(turn(arm, a), v + 3);
}

static inline void store_rows(struct lanes3 part, double to[3][6])
{
    for (int k = 0; k < 3; ++k) to[k][0] = part.x[k], to[k][1] = part.y[k], to[k][2] = part.z[k];
}

static inline __attribute__((always_inline)) void find_rates(const struct acting_joint *acting, bool rotations,
                                                             struct joint_rates *out)
{
    const int first = rotations ? 3 : 0;
    const vec3 *axis = acting->start.axis + first;
    const struct lanes3 a = axes_of(acting->middle.axis + first), zero = {{0}, {0}, {0}};
    lanes before = {0, 0, 0, 0}, start = before, middle = before, prescribed = before;
    before = before + -rate_on(rotations, axis, acting->start.arm_a, acting->side[0].velocity);
    before = before + rate_on(rotations, axis, acting->start.arm_b, acting->side[1].velocity);
    for (int s = 0; s < 2; ++s) {
        const struct joint_side *side = &acting->side[s];
        const double sign = s ? 1 : -1;
        if (side->system_body < 0 && !side->prescribed) continue;
        const struct lanes3 linear = scale(rotations ? zero : a, sign),
                            angular = scale(rotations ? a : turn(s ? acting->middle.arm_b : acting->middle.arm_a, a),
                                            sign);
        const lanes own = product(rotations, linear, angular, side->velocity);
        if (side->prescribed) {
            prescribed = prescribed + own;
            continue;
        }
        start = start + own;
        middle = middle + product(rotations, linear, angular, side->middle);
        store_rows(linear, (double (*)[6])&out->row[s][first][0]);
        store_rows(angular, (double (*)[6])&out->row[s][first][3]);
    }
    *(lanes *)(out->before + first) = before;
    *(lanes *)(out->start + first) = start;
    *(lanes *)(out->middle + first) = middle;
    *(lanes *)(out->prescribed + first) = prescribed;
}

void SADMM_KERNEL(joint_rates)(const struct acting_joint *acting, struct joint_rates *rates)
{
    find_rates(acting, false, rates); /* the fourth number is the first rotation's */
    find_rates(acting, true, rates);
}

#include "compound.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"

struct sadmm_part sadmm_part_at(sadmm_shape_type type, double x, double y, double z, double a, double b, double c,
                                double mass)
{
    struct sadmm_part part = {.shape = sadmm_shape_def_default(), .mass = mass};
    const double at[3] = {x, y, z}, size[3] = {a, b, c};
    part.shape.type = type;
    memcpy(part.shape.position, at, sizeof at);
    memcpy(part.shape.size, size, sizeof size);
    return part;
}

void sadmm_part_inertia(const struct sadmm_part *part, double inertia[3])
{
    const double *size = part->shape.size;
    switch (part->shape.type) {
    case SADMM_SHAPE_SPHERE: sadmm_sphere_inertia(part->mass, size[0], inertia); break;
    case SADMM_SHAPE_CAPSULE: sadmm_capsule_inertia(part->mass, size[0], size[1], inertia); break;
    default: sadmm_box_inertia(part->mass, size, inertia);
    }
}

/* Add a part's inertia about `centre`, in the layout's axes. */
static void add_inertia(const struct sadmm_part *part, vec3 centre, double total[3][3])
{
    const mat3 r = q_matrix(q_load(part->shape.orientation));
    const vec3 d = v3_sub(v3_load(part->shape.position), centre);
    double own[3], arm[3], rows[3][3];
    sadmm_part_inertia(part, own);
    v3_store(d, arm);
    for (int i = 0; i < 3; ++i) v3_store(r.r[i], rows[i]);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) total[i][j] += rows[i][k] * own[k] * rows[j][k];
            total[i][j] += part->mass * ((i == j ? v3_norm2(d) : 0) - arm[i] * arm[j]);
        }
    }
}

/* Jacobi: leaves the eigenvalues of the symmetric `a` on its diagonal; `axes`: from their frame, unit quaternion. */
static void diagonalize(double a[3][3], double axes[4])
{
    static const double unit[4] = {1, 0, 0, 0};
    quat turn = q_load(unit);
    for (int sweep = 0; sweep < 50; ++sweep) {
        for (int p = 0; p < 3; ++p) {
            const int i = (p + 1) % 3, j = (p + 2) % 3;
            if (fabs(a[i][j]) <= 1e-15 * (fabs(a[i][i]) + fabs(a[j][j]))) continue;
            /* about axis p, with c^2 - s^2 and 2 c s from the two diagonal entries */
            const double angle = 0.5 * atan2(2 * a[i][j], a[i][i] - a[j][j]), c = cos(angle), s = sin(angle);
            double half[4] = {cos(angle / 2), 0, 0, 0};
            half[1 + p] = sin(angle / 2);
            for (int k = 0; k < 3; ++k) {
                const double x = a[k][i], y = a[k][j];
                a[k][i] = c * x + s * y, a[k][j] = c * y - s * x;
            }
            for (int k = 0; k < 3; ++k) {
                const double x = a[i][k], y = a[j][k];
                a[i][k] = c * x + s * y, a[j][k] = c * y - s * x;
            }
            turn = q_normalize(q_mul(turn, q_load(half)));
        }
    }
    q_store(turn, axes);
}

sadmm_status sadmm_place_compound(sadmm_world *world, struct sadmm_frame frame, const struct sadmm_part *parts,
                                  int count, const char *name, sadmm_body_id *id, struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_body_id made;
    double total[3][3] = {{0}}, axes[4], at[3];
    vec3 centre = v3(0, 0, 0);
    body.mass = 0;
    for (int k = 0; k < count; ++k) {
        centre = v3_add(centre, v3_scale(v3_load(parts[k].shape.position), parts[k].mass));
        body.mass += parts[k].mass;
    }
    centre = v3_scale(centre, 1 / body.mass);
    for (int k = 0; k < count; ++k) add_inertia(&parts[k], centre, total);
    diagonalize(total, axes);
    for (int k = 0; k < 3; ++k) body.inertia[k] = total[k][k];
    v3_store(centre, at);
    frame = sadmm_frame_moved(frame, at[0], at[1], at[2]);
    memcpy(body.position, frame.origin, sizeof body.position);
    q_store(q_normalize(q_mul(q_load(frame.orientation), q_load(axes))), body.orientation);
    body.name = name;
    sadmm_status status = sadmm_world_add_body(world, &body, &made);
    const mat3 to_layout = q_matrix(q_load(axes));
    const double back[4] = {axes[0], -axes[1], -axes[2], -axes[3]};
    for (int k = 0; k < count && status == SADMM_OK; ++k) {
        sadmm_shape_def shape = parts[k].shape;
        v3_store(m3_tmul(to_layout, v3_sub(v3_load(shape.position), centre)), shape.position);
        q_store(q_normalize(q_mul(q_load(back), q_load(shape.orientation))), shape.orientation);
        status = sadmm_world_add_shape(world, made, &shape, NULL);
    }
    if (status == SADMM_OK && id) *id = made;
    return sadmm_scene_world_error(world, status, error);
}

#include "compound.h"

#include <string.h>

#include "core/math/principal.h"

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
    for (int k = 0; k < count; ++k) {
        double own[3];
        sadmm_part_inertia(&parts[k], own);
        principal_add(total, own, parts[k].shape.orientation, parts[k].mass,
                      v3_sub(v3_load(parts[k].shape.position), centre));
    }
    principal_axes(total, axes);
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

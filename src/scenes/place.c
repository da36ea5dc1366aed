#include "place.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"

struct sadmm_frame sadmm_frame_world(void)
{
    return (struct sadmm_frame){ .orientation = { 1, 0, 0, 0 } };
}

struct sadmm_frame sadmm_frame_turned(struct sadmm_frame frame, int axis, double angle)
{
    double turn[4] = { cos(0.5 * angle), 0, 0, 0 };
    turn[1 + axis] = sin(0.5 * angle);
    q_store(q_normalize(q_mul(q_load(frame.orientation), q_load(turn))), frame.orientation);
    return frame;
}

struct sadmm_frame sadmm_frame_moved(struct sadmm_frame frame, double x, double y, double z)
{
    vec3 offset = m3_mul(q_matrix(q_load(frame.orientation)), v3(x, y, z));
    v3_store(v3_add(v3_load(frame.origin), offset), frame.origin);
    return frame;
}

sadmm_status sadmm_scene_world_error(const sadmm_world *world, sadmm_status status, struct sadmm_error *error)
{
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_world_message(world));
}

/* A body with one shape. */
static sadmm_status place(sadmm_world *world, struct sadmm_frame frame, sadmm_body_def *body,
                          const sadmm_shape_def *shape, sadmm_body_id *id, struct sadmm_error *error)
{
    sadmm_body_id made;
    sadmm_status status;

    memcpy(body->position, frame.origin, sizeof body->position);
    memcpy(body->orientation, frame.orientation, sizeof body->orientation);
    status = sadmm_world_add_body(world, body, &made);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, made, shape, NULL);
    if (status == SADMM_OK && id) *id = made;
    return sadmm_scene_world_error(world, status, error);
}

sadmm_status sadmm_place_plane(sadmm_world *world, struct sadmm_frame frame, double friction,
                               struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();

    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    body.name = "ground";
    shape.type = SADMM_SHAPE_PLANE;
    shape.friction = friction;
    return place(world, frame, &body, &shape, NULL, error);
}

sadmm_status sadmm_place_box(sadmm_world *world, struct sadmm_frame frame, const struct sadmm_piece *piece,
                             sadmm_body_id *id, struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();

    body.name = piece->name;
    body.mass = piece->mass;
    sadmm_box_inertia(piece->mass, piece->half_extents, body.inertia);
    shape.type = SADMM_SHAPE_BOX;
    memcpy(shape.size, piece->half_extents, sizeof shape.size);
    shape.friction = piece->friction;
    shape.restitution = piece->restitution;
    return place(world, frame, &body, &shape, id, error);
}

sadmm_status sadmm_place_sphere(sadmm_world *world, struct sadmm_frame frame, const struct sadmm_piece *piece,
                                sadmm_body_id *id, struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();

    body.name = piece->name;
    body.mass = piece->mass;
    sadmm_sphere_inertia(piece->mass, piece->half_extents[0], body.inertia);
    shape.type = SADMM_SHAPE_SPHERE;
    shape.size[0] = piece->half_extents[0];
    shape.friction = piece->friction;
    shape.restitution = piece->restitution;
    return place(world, frame, &body, &shape, id, error);
}

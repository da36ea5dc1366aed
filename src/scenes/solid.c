#include "solid.h"

#include <stdio.h>
#include <string.h>

#include "subadmm/mass.h"

/* Hand on what a call without a world left in sadmm_last_message, which sadmm_fail writes to itself. */
static sadmm_status hand_on(sadmm_status status, struct sadmm_error *error)
{
    char message[SADMM_MESSAGE_SIZE];
    if (status == SADMM_OK) return status;
    snprintf(message, sizeof message, "%s", sadmm_last_message());
    return sadmm_fail(error, status, "%s", message);
}

sadmm_status sadmm_scene_hull(const double *points, int count, sadmm_hull **hull, struct sadmm_error *error)
{
    sadmm_hull_def def = sadmm_hull_def_default();
    def.points = points;
    def.point_count = (size_t)count;
    return hand_on(sadmm_hull_create(&def, hull), error);
}

sadmm_status sadmm_scene_mesh(const sadmm_mesh_def *def, sadmm_mesh **mesh, struct sadmm_error *error)
{
    return hand_on(sadmm_mesh_create(def, mesh), error);
}

sadmm_status sadmm_scene_heights(const sadmm_heightfield_def *def, sadmm_mesh **mesh, struct sadmm_error *error)
{
    return hand_on(sadmm_heightfield_create(def, mesh), error);
}

sadmm_shape_def sadmm_hull_shape(const sadmm_hull *hull, double friction)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_HULL;
    shape.hull = hull;
    shape.friction = friction;
    return shape;
}

sadmm_shape_def sadmm_mesh_shape(const sadmm_mesh *mesh, double friction)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_MESH;
    shape.mesh = mesh;
    shape.friction = friction;
    return shape;
}

static sadmm_status sum_masses(const sadmm_shape_def *shapes, int count, double density, sadmm_mass *sum)
{
    sadmm_mass parts[2];
    sadmm_status status = sadmm_shape_mass(&shapes[0], density, sum);
    for (int k = 1; k < count && status == SADMM_OK; ++k) {
        parts[0] = *sum;
        status = sadmm_shape_mass(&shapes[k], density, &parts[1]);
        if (status == SADMM_OK) status = sadmm_mass_sum(parts, 2, sum);
    }
    return status;
}

sadmm_status sadmm_place_solids(sadmm_world *world, struct sadmm_frame frame, const sadmm_shape_def *shapes, int count,
                                double density, const char *name, sadmm_body_id *id, struct sadmm_error *error)
{
    const bool dynamic = density > 0;
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_body_id made;
    sadmm_mass mass;
    sadmm_status status = SADMM_OK;
    memcpy(body.position, frame.origin, sizeof body.position);
    memcpy(body.orientation, frame.orientation, sizeof body.orientation);
    body.name = name;
    if (dynamic) {
        status = sum_masses(shapes, count, density, &mass);
        if (status == SADMM_OK) status = sadmm_mass_pose_of_body(&mass, body.position, body.orientation);
        if (status != SADMM_OK) return hand_on(status, error);
        body.mass = mass.mass;
        memcpy(body.inertia, mass.inertia, sizeof body.inertia);
    } else {
        body.type = SADMM_BODY_STATIC;
        body.environment = -1;
    }
    status = sadmm_world_add_body(world, &body, &made);
    for (int k = 0; k < count && status == SADMM_OK; ++k) {
        sadmm_shape_def shape = shapes[k];
        if (dynamic) {
            status = sadmm_mass_pose_in_body(&mass, shape.position, shape.orientation);
            if (status != SADMM_OK) return hand_on(status, error);
        }
        status = sadmm_world_add_shape(world, made, &shape, NULL);
    }
    if (status == SADMM_OK && id) *id = made;
    return sadmm_scene_world_error(world, status, error);
}

/* A body of two shapes: a hammer of a steel head and a wooden handle. Mass, centre of mass and principal axes are those
 * of both together. */
#include <stdio.h>
#include <string.h>

#include <subadmm/subadmm.h>

enum { PARTS = 2 };

/* Both shapes are placed in one frame, the layout. It starts at `position` in the world, with its axes along the
 * world's. */
static sadmm_status add_body_of(sadmm_world *world, sadmm_shape_def shapes[PARTS], const double densities[PARTS],
                                const double position[3], sadmm_body_id *id)
{
    sadmm_mass parts[PARTS], sum;
    sadmm_status status = SADMM_OK;
    for (int k = 0; status == SADMM_OK && k < PARTS; ++k)
        status = sadmm_shape_mass(&shapes[k], densities[k], &parts[k]);
    if (status == SADMM_OK) status = sadmm_mass_sum(parts, PARTS, &sum);
    if (status != SADMM_OK) return status;

    sadmm_body_def body = sadmm_body_def_default();
    body.mass = sum.mass;
    memcpy(body.inertia, sum.inertia, sizeof body.inertia);
    memcpy(body.position, position, sizeof body.position);
    status = sadmm_mass_pose_of_body(&sum, body.position, body.orientation); /* from the layout's pose to the body's */
    if (status == SADMM_OK) status = sadmm_world_add_body(world, &body, id);
    for (int k = 0; status == SADMM_OK && k < PARTS; ++k) {
        status = sadmm_mass_pose_in_body(&sum, shapes[k].position, shapes[k].orientation);
        if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, &shapes[k], NULL);
    }
    return status;
}

int main(void)
{
    const double densities[PARTS] = {7800, 700}; /* kg/m^3 */
    const double position[3] = {0, 0, 0.2};
    sadmm_shape_def shapes[PARTS] = {sadmm_shape_def_default(), sadmm_shape_def_default()};
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world;
    sadmm_body_id hammer;
    sadmm_body_def def;

    shapes[0].type = SADMM_SHAPE_BOX; /* the head, at the end of the handle */
    shapes[0].size[0] = 0.05;
    shapes[0].size[1] = shapes[0].size[2] = 0.015;
    shapes[0].position[2] = 0.15;
    shapes[1].type = SADMM_SHAPE_CYLINDER; /* the handle, along z */
    shapes[1].size[0] = 0.012;
    shapes[1].size[1] = 0.14;

    if (sadmm_world_create(&world_def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add_body_of(world, shapes, densities, position, &hammer);
    if (status == SADMM_OK) status = sadmm_world_body_def(world, hammer, &def);
    if (status == SADMM_OK) printf("%.3f kg, centre of mass at a height of %.4f m\n", def.mass, def.position[2]);
    else fprintf(stderr, "%s\n", sadmm_last_message());
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}

/* A motor in a hinge opens a door until the hinge's limit stops it; the motor's torque and the limit's are read
 * back. */
#include <stdio.h>

#include <subadmm/subadmm.h>

static sadmm_status add_door(sadmm_world *world, sadmm_body_id *door)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def panel = sadmm_shape_def_default();
    body.mass = 20;
    body.position[2] = 1.1;
    panel.type = SADMM_SHAPE_BOX;
    panel.size[0] = 0.4;
    panel.size[1] = 0.02;
    panel.size[2] = 1;
    sadmm_box_inertia(body.mass, panel.size, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &body, door);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *door, &panel, NULL);
    return status;
}

static sadmm_status add_hinge(sadmm_world *world, sadmm_body_id door, sadmm_joint_id *id)
{
    const double edge[3] = {-0.4, 0, 1.1}, upright[4] = {1, 0, 0, 0};
    sadmm_joint_def hinge = sadmm_joint_def_default();
    hinge.kind = SADMM_JOINT_REVOLUTE; /* turns about the z axis of its frames */
    hinge.body_b = door;               /* body_a stays zero: the static world */

    sadmm_joint_coordinate *angle = &hinge.coordinates[5];
    angle->drive = SADMM_DRIVE_SPEED;
    angle->target_speed = 1; /* rad/s */
    angle->drive_force = 15; /* N m, the most that the motor gives */
    angle->limited = true;
    angle->lower = 0;
    angle->upper = 1.5;    /* rad */
    angle->friction = 0.2; /* N m, dry */

    sadmm_status status = sadmm_world_place_joint(world, &hinge, edge, upright);
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &hinge, id);
    return status;
}

static void print_state(const char *when, const sadmm_joint_state *state)
{
    printf("%s: angle %.4f rad, %.4f rad/s, motor %.2f N m, limit %.2f N m\n", when, state->position[5],
           state->speed[5], state->drive_force[5], state->limit_force[5]);
}

int main(void)
{
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world;
    sadmm_body_id door;
    sadmm_joint_id hinge;
    sadmm_joint_state state;
    if (sadmm_world_create(&world_def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add_door(world, &door);
    if (status == SADMM_OK) status = add_hinge(world, door, &hinge);
    for (int step = 0; status == SADMM_OK && step < 200; ++step) status = sadmm_world_step(world);
    if (status == SADMM_OK) status = sadmm_world_joint_state(world, hinge, &state);
    if (status == SADMM_OK) print_state("after 1 s", &state);
    for (int step = 0; status == SADMM_OK && step < 200; ++step) status = sadmm_world_step(world);
    if (status == SADMM_OK) status = sadmm_world_joint_state(world, hinge, &state);
    if (status == SADMM_OK) print_state("after 2 s", &state);
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}

/* World level: a box falls on the ground and comes to rest; its contact forces add up to its weight. */
#include <stdio.h>

#include <subadmm/subadmm.h>

static int fail(const char *message)
{
    fprintf(stderr, "%s\n", message);
    return 1;
}

int main(void)
{
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world;
    if (sadmm_world_create(&world_def, &world) != SADMM_OK) return fail(sadmm_last_message());

    sadmm_body_def ground_def = sadmm_body_def_default();
    ground_def.type = SADMM_BODY_STATIC;
    sadmm_shape_def plane = sadmm_shape_def_default();
    plane.type = SADMM_SHAPE_PLANE;

    sadmm_body_def box_def = sadmm_body_def_default();
    sadmm_shape_def box = sadmm_shape_def_default();
    box.type = SADMM_SHAPE_BOX;
    box.size[0] = box.size[1] = box.size[2] = 0.1;
    box_def.mass = 2;
    sadmm_box_inertia(box_def.mass, box.size, box_def.inertia);
    box_def.position[2] = 0.15;

    sadmm_body_id ground, body;
    sadmm_status status = sadmm_world_add_body(world, &ground_def, &ground);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, ground, &plane, NULL);
    if (status == SADMM_OK) status = sadmm_world_add_body(world, &box_def, &body);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, body, &box, NULL);
    for (int step = 0; status == SADMM_OK && step < 200; ++step) status = sadmm_world_step(world);

    double wrench[6];
    sadmm_body_state state;
    if (status == SADMM_OK) status = sadmm_world_body_contact_wrench(world, body, wrench);
    if (status == SADMM_OK) status = sadmm_world_body_state(world, body, &state);
    if (status != SADMM_OK) return fail(sadmm_world_message(world));
    printf("height %.6f m, contact force %.6f N (weight %.6f N)\n", state.position[2], wrench[2], 2 * 9.81);
    sadmm_world_destroy(world);
    return 0;
}

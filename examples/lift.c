/* A kinematic platform lifts a box: it goes to one pose after the other, and nothing that rests on it can stop it. */
#include <stdio.h>

#include <subadmm/subadmm.h>

static sadmm_status add(sadmm_world *world, const sadmm_body_def *def, double half_width, double half_height,
                        sadmm_body_id *id)
{
    sadmm_body_def body = *def;
    sadmm_shape_def box = sadmm_shape_def_default();
    box.type = SADMM_SHAPE_BOX;
    box.size[0] = box.size[1] = half_width;
    box.size[2] = half_height;
    if (body.type == SADMM_BODY_DYNAMIC) sadmm_box_inertia(body.mass, box.size, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &body, id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, &box, NULL);
    return status;
}

int main(void)
{
    const double level[4] = {1, 0, 0, 0};
    double place[3] = {0, 0, 0};
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_body_def platform_def = sadmm_body_def_default(), crate_def = sadmm_body_def_default();
    sadmm_world *world;
    sadmm_body_id platform, crate;
    sadmm_body_state state;
    platform_def.type = SADMM_BODY_KINEMATIC;
    crate_def.mass = 50;
    crate_def.position[2] = 0.35;
    if (sadmm_world_create(&world_def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add(world, &platform_def, 1, 0.05, &platform);
    if (status == SADMM_OK) status = add(world, &crate_def, 0.3, 0.3, &crate);
    for (int step = 0; status == SADMM_OK && step < 400; ++step) {
        place[2] += 0.5 * world_def.settings.dt; /* 0.5 m/s */
        status = sadmm_world_move_body(world, platform, place, level);
        if (status == SADMM_OK) status = sadmm_world_step(world);
    }
    if (status == SADMM_OK) status = sadmm_world_body_state(world, crate, &state);
    if (status == SADMM_OK)
        printf("the crate is at %.4f m and goes up at %.4f m/s\n", state.position[2], state.linear_velocity[2]);
    else fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}

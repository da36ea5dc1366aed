/* Steps that the host does not wait for, on a GPU where there is one; elsewhere the same calls make ordinary steps. */
#include <stdio.h>

#include <subadmm/subadmm.h>

static sadmm_status add_box(sadmm_world *world, sadmm_body_id *id)
{
    sadmm_body_def ground = sadmm_body_def_default(), body = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default(), box = sadmm_shape_def_default();
    ground.type = SADMM_BODY_STATIC;
    plane.type = SADMM_SHAPE_PLANE;
    box.type = SADMM_SHAPE_BOX;
    box.size[0] = box.size[1] = box.size[2] = 0.1;
    body.mass = 1;
    body.position[2] = 0.1;
    sadmm_box_inertia(body.mass, box.size, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &ground, id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, &plane, NULL);
    if (status == SADMM_OK) status = sadmm_world_add_body(world, &body, id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, &box, NULL);
    return status;
}

int main(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_backend_info info;
    sadmm_status status = sadmm_backend_query(SADMM_BACKEND_CUDA, &info);
    if (status == SADMM_OK && info.available[SADMM_F32]) {
        def.backend = SADMM_BACKEND_CUDA;
        def.precision = SADMM_F32;
    } else if (status == SADMM_OK) {
        printf("no GPU: %s\n", info.reason);
    }

    sadmm_world *world;
    sadmm_body_id box;
    sadmm_body_state state;
    if (status != SADMM_OK || sadmm_world_create(&def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    status = add_box(world, &box);
    for (int step = 0; status == SADMM_OK && step < 100; ++step) {
        const double force[3] = {step < 50 ? 10 : 0, 0, 0}, torque[3] = {0, 0, 0};
        status = sadmm_world_set_body_wrench(world, box, force, torque); /* goes along with the step */
        if (status == SADMM_OK) status = sadmm_world_step_async(world);  /* begun, not waited for */
    }
    if (status == SADMM_OK) status = sadmm_world_wait(world); /* the first error of all these steps, if any */
    if (status == SADMM_OK) status = sadmm_world_body_state(world, box, &state);
    if (status == SADMM_OK) printf("the box is at x = %.4f m\n", state.position[0]);
    else fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}

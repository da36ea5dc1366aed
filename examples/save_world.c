/* A world is saved, goes on, is restored and goes on again: both ways end in the same state, to the last bit. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include <subadmm/subadmm.h>

static sadmm_status add_tumbling_box(sadmm_world *world)
{
    sadmm_body_def ground = sadmm_body_def_default(), body = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default(), box = sadmm_shape_def_default();
    sadmm_body_id id;
    ground.type = SADMM_BODY_STATIC;
    plane.type = SADMM_SHAPE_PLANE;
    box.type = SADMM_SHAPE_BOX;
    box.size[0] = box.size[1] = box.size[2] = 0.1;
    body.mass = 1;
    body.position[2] = 0.5;
    body.angular_velocity[0] = 5;
    body.angular_velocity[1] = 3;
    sadmm_box_inertia(body.mass, box.size, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &ground, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &plane, NULL);
    if (status == SADMM_OK) status = sadmm_world_add_body(world, &body, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &box, NULL);
    return status;
}

static sadmm_status steps_and_hash(sadmm_world *world, int steps, uint64_t *hash)
{
    sadmm_status status = SADMM_OK;
    for (int k = 0; status == SADMM_OK && k < steps; ++k) status = sadmm_world_step(world);
    if (status == SADMM_OK) status = sadmm_world_state_hash(world, hash);
    return status;
}

/* *buffer is the caller's, to be freed. */
static sadmm_status save(sadmm_world *world, void **buffer, size_t *size)
{
    sadmm_status status = sadmm_world_save(world, NULL, 0, size); /* asks for the size */
    if (status != SADMM_OK) return status;
    *buffer = malloc(*size);
    if (!*buffer) return SADMM_ERROR_OUT_OF_MEMORY;
    return sadmm_world_save(world, *buffer, *size, size);
}

int main(void)
{
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world;
    void *buffer = NULL;
    size_t size = 0;
    uint64_t middle, first = 0, second = 1;
    if (sadmm_world_create(&world_def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add_tumbling_box(world);
    if (status == SADMM_OK) status = steps_and_hash(world, 80, &middle);
    if (status == SADMM_OK) status = save(world, &buffer, &size);
    if (status == SADMM_OK) status = steps_and_hash(world, 80, &first);
    if (status == SADMM_OK) status = sadmm_world_restore(world, buffer, size);
    if (status == SADMM_OK) status = steps_and_hash(world, 80, &second);
    if (status == SADMM_OK) printf("%016" PRIx64 " and %016" PRIx64 "\n", first, second);
    else fprintf(stderr, "%s\n", sadmm_world_message(world));
    free(buffer);
    sadmm_world_destroy(world);
    return status == SADMM_OK && first == second ? 0 : 1;
}

/* The force of the ground on a box that is pushed: as a sum, point by point, and the event of its landing. */
#include <stdio.h>

#include <subadmm/subadmm.h>

enum { MOST = 64 };

static sadmm_status add_ground(sadmm_world *world)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default();
    sadmm_body_id ground;
    body.type = SADMM_BODY_STATIC;
    plane.type = SADMM_SHAPE_PLANE;
    plane.friction = 0.5;
    sadmm_status status = sadmm_world_add_body(world, &body, &ground);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, ground, &plane, NULL);
    return status;
}

static sadmm_status add_box(sadmm_world *world, sadmm_body_id *box)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    body.mass = 2;
    body.position[2] = 0.12;
    shape.type = SADMM_SHAPE_BOX;
    shape.size[0] = shape.size[1] = shape.size[2] = 0.1;
    shape.friction = 0.5;
    sadmm_box_inertia(body.mass, shape.size, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &body, box);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *box, &shape, NULL);
    return status;
}

/* What all contacts do to a body, and each of them. */
static sadmm_status print_forces(sadmm_world *world, sadmm_body_id box)
{
    double wrench[6];
    sadmm_contact contacts[MOST];
    int32_t count = sadmm_world_contact_count(world);
    sadmm_status status = sadmm_world_body_contact_wrench(world, box, wrench);
    if (count > MOST) count = MOST;
    if (status == SADMM_OK) status = sadmm_world_contacts(world, 0, count, contacts);
    if (status != SADMM_OK) return status;

    printf("contacts push the box with (%.3f, %.3f, %.3f) N\n", wrench[0], wrench[1], wrench[2]);
    for (int32_t k = 0; k < count; ++k) {
        const sadmm_contact *c = &contacts[k];
        double normal = 0;
        for (int axis = 0; axis < 3; ++axis) normal += c->force[axis] * c->normal[axis];
        printf("  point (%.2f, %.2f): normal force %.3f N, friction coefficient %g\n", c->position[0], c->position[1],
               normal, c->friction);
    }
    return SADMM_OK;
}

static sadmm_status print_events(sadmm_world *world)
{
    sadmm_event events[MOST];
    int32_t count;
    sadmm_status status = sadmm_world_take_events(world, MOST, events, &count, NULL);
    for (int32_t k = 0; status == SADMM_OK && k < count; ++k)
        if (events[k].type == SADMM_EVENT_CONTACT_BEGUN)
            printf("step %d: two shapes touch, at %.3f m/s\n", (int)events[k].step, events[k].speed);
    return status;
}

int main(void)
{
    const double push[3] = {8, 0, 0}, no_torque[3] = {0, 0, 0}; /* less than friction can hold: 0.5 x 19.62 N */
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world;
    sadmm_body_id box;
    if (sadmm_world_create(&world_def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add_ground(world);
    if (status == SADMM_OK) status = add_box(world, &box);
    if (status == SADMM_OK) status = sadmm_world_record_events(world, MOST);
    for (int step = 0; status == SADMM_OK && step < 100; ++step) status = sadmm_world_step(world);
    if (status == SADMM_OK) status = sadmm_world_set_body_wrench(world, box, push, no_torque);
    for (int step = 0; status == SADMM_OK && step < 100; ++step) status = sadmm_world_step(world);
    if (status == SADMM_OK) status = print_forces(world, box);
    if (status == SADMM_OK) status = print_events(world);
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}

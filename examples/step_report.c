/* Steps until a promised error, and what the report of a step says: a light box carries a heavy one. */
#include <stdio.h>

#include <subadmm/subadmm.h>

static sadmm_status add_box(sadmm_world *world, double mass, double height)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def box = sadmm_shape_def_default();
    sadmm_body_id id;
    body.mass = mass;
    body.position[2] = height;
    box.type = SADMM_SHAPE_BOX;
    box.size[0] = box.size[1] = box.size[2] = 0.1;
    sadmm_box_inertia(body.mass, box.size, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &body, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &box, NULL);
    return status;
}

static sadmm_status add_ground(sadmm_world *world)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    plane.type = SADMM_SHAPE_PLANE;
    sadmm_status status = sadmm_world_add_body(world, &body, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &plane, NULL);
    return status;
}

static sadmm_status print_report(sadmm_world *world)
{
    sadmm_step_report report;
    sadmm_status status = sadmm_world_report(world, &report);
    if (status != SADMM_OK) return status;
    printf("%.3f s: %d contacts, deepest overlap %.1e m\n", report.time, report.contacts, report.penetration_max);
    printf("  %d iterations, tolerance %s, %d islands limited\n", report.iterations,
           report.converged ? "met" : "not met", report.limited);
    printf("  natural map %.1e m/s, momentum error %.1e\n", report.certificate.ncp_max,
           report.certificate.momentum_max);
    return SADMM_OK;
}

int main(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.settings.tolerance = 1e-6;             /* m/s */
    def.settings.iterations = 1000;            /* at most; a step ends when the tolerance is met */
    def.settings.certify = true;

    sadmm_world *world;
    if (sadmm_world_create(&def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add_ground(world);
    if (status == SADMM_OK) status = add_box(world, 0.1, 0.1);
    if (status == SADMM_OK) status = add_box(world, 100, 0.31);
    for (int step = 1; status == SADMM_OK && step <= 200; ++step) {
        status = sadmm_world_step(world);
        if (status == SADMM_OK && (step == 5 || step == 10 || step == 200)) status = print_report(world);
    }
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}

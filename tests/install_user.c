/* A user's first program, compiled by test_install.sh as C and as C++ against the installed tree. */
#include <stdio.h>
#include <string.h>

#include <subadmm/subadmm.h>

#define MUST(call)                                                                       \
    do {                                                                                 \
        if ((call) != SADMM_OK) {                                                        \
            fprintf(stderr, "%s: %s: %s\n", argv[0], #call, sadmm_last_message());       \
            return 1;                                                                    \
        }                                                                                \
    } while (0)

int main(int argc, char **argv)
{
    /* The library that runs must be the one whose .pc file was read. */
    if (argc != 2 || strcmp(argv[1], sadmm_version()) != 0 || sadmm_version_number() != SADMM_VERSION) {
        fprintf(stderr, "linked with version %s\n", sadmm_version());
        return 1;
    }

    sadmm_problem *problem = NULL;
    MUST(sadmm_problem_create(&problem));
    sadmm_problem_destroy(problem);

    /* A pendulum: structs of every kind that may grow. */
    sadmm_world *world = NULL;
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_joint_def hinge = sadmm_joint_def_default();
    sadmm_joint_id joint;
    sadmm_step_report report;
    def.settings.dt = 0.002;
    shape.size[0] = 0.1;
    body.mass = 1;
    sadmm_sphere_inertia(1, 0.1, body.inertia);
    hinge.kind = SADMM_JOINT_REVOLUTE;
    hinge.position_a[0] = -1;
    hinge.orientation_a[0] = 0.5, hinge.orientation_a[1] = hinge.orientation_a[2] = hinge.orientation_a[3] = -0.5;
    for (int k = 0; k < 4; ++k) hinge.orientation_b[k] = hinge.orientation_a[k];
    hinge.position_b[0] = -1;
    hinge.coordinates[5].armature = 0.5;
    MUST(sadmm_world_create(&def, &world));
    MUST(sadmm_world_add_body(world, &body, &hinge.body_b));
    MUST(sadmm_world_add_shape(world, hinge.body_b, &shape, NULL));
    MUST(sadmm_world_add_joint(world, &hinge, &joint));
    for (int k = 0; k < 10; ++k) MUST(sadmm_world_step(world));
    MUST(sadmm_world_report(world, &report));
    MUST(sadmm_world_body_def(world, hinge.body_b, &body));
    MUST(sadmm_world_joint_def(world, joint, &hinge));
    if (report.step != 10 || report.joints != 1 || body.mass != 1 ||
        !(body.linear_velocity[2] * body.linear_velocity[2] > 1e-4) || hinge.coordinates[5].armature != 0.5 ||
        sadmm_world_settings(world).dt != 0.002) {
        fprintf(stderr, "%s: step %d, %d joints, %g kg, %g m/s, armature %g\n", argv[0], (int)report.step,
                report.joints, body.mass, body.linear_velocity[2], hinge.coordinates[5].armature);
        return 1;
    }
    sadmm_world_destroy(world);

    /* A scene, where the library has them. */
    sadmm_scene *scene = NULL;
    if (sadmm_scene_library_count() > 0) {
        MUST(sadmm_scene_create("two_balls", &scene));
        MUST(sadmm_scene_create_world(scene, NULL, &world));
        MUST(sadmm_scene_run_script(scene, world, 0));
        MUST(sadmm_world_step(world));
        sadmm_world_destroy(world);
        sadmm_scene_destroy(scene);
    }
    return 0;
}

/* Motions and reactions of joints against ADAMS' (joint_reference.h): root mean squares over the instants are within
 * what Project Chrono's own tests accept, and errors are of second order in the step. */
#include "../bench/joint_cases.h"
#include "fixed_work.h"
#include "joint_reference.h"
#include "scene_tools.h"

static const enum joint_quantity compared[] = {JOINT_POSITION, JOINT_VELOCITY, JOINT_ANGULAR_VELOCITY, JOINT_FORCE,
                                               JOINT_TORQUE};
enum { COMPARED = sizeof compared / sizeof *compared };

/* Chrono's steps are 5e-4 s as a rule and 1e-5 s for what whips; those here are longer, to be quick. */
static const struct {
    const char *name;
    double step;
    const double (*table)[NUMBERS];
} references[] = {
    {"Revolute_Case02", 5e-4, revolute_case02},           {"Spherical_Case02", 1e-3, spherical_case02},
    {"Cylindrical_Case03", 1e-3, cylindrical_case03},     {"Prismatic_Case02", 1e-3, prismatic_case02},
    {"Universal_Case03", 1e-3, universal_case03},         {"Distance_Case02", 5e-5, distance_case02},
    {"RevSpherical_Case02", 5e-5, revspherical_case02},   {"RotSpring_Case02", 1e-3, rotspring_case02},
    {"TranSpring_Case02", 1e-3, transpring_case02},
};
enum { REFERENCES = sizeof references / sizeof *references };

static const struct joint_case *find_case(const char *name)
{
    for (size_t k = 0; k < joint_case_count(); ++k)
        if (strcmp(joint_case_at(k)->name, name) == 0) return joint_case_at(k);
    ck_abort_msg("no case %s", name);
    return NULL;
}

/* Samples 0 to `count` - 1, every 0.2 s. */
static void run_case(const struct joint_case *which, double step, int count, struct joint_sample *samples)
{
    sadmm_world_def def = fixed_world_def();
    sadmm_world *world;
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = step;
    def.settings.gravity[2] = -9.80665;
    def.settings.iterations = 200;
    def.settings.tolerance = 1e-10;
    ck_assert_msg(joint_case_build(which, &def, &world) == SADMM_OK, "%s", sadmm_last_message());
    MUST(world, joint_case_run(which, world, (int)(0.2 / step + 0.5), count, samples));
    sadmm_world_destroy(world);
}

/* Both the table's accuracy and the step's error are well below the tolerances. */
START_TEST(motions_are_the_reference)
{
    const struct joint_case *which = find_case(references[_i].name);
    struct joint_sample samples[INSTANTS + 1];
    run_case(which, references[_i].step, INSTANTS + 1, samples);
    for (int q = 0; q < COMPARED; ++q)
        for (int k = 0; k < 3; ++k) {
            const double tolerance = which->tolerance[compared[q]];
            double sum = 0;
            for (int i = 0; i < INSTANTS; ++i) {
                const double off = samples[i + 1].value[compared[q]][k] - references[_i].table[i][3 * q + k];
                sum += off * off;
            }
            ck_assert_msg(sqrt(sum / INSTANTS) <= tolerance || tolerance == 0, "%s, quantity %d, component %d: %g",
                          which->name, (int)compared[q], k, sqrt(sum / INSTANTS));
        }
    for (int i = 0; i <= INSTANTS; ++i) ck_assert_double_lt(samples[i].violation, 1e-5);
}
END_TEST

static double distance_of(const struct joint_sample *a, const struct joint_sample *b, int count, int quantity)
{
    double most = 0;
    for (int i = 1; i < count; ++i)
        for (int k = 0; k < 3; ++k) most = fmax(most, fabs(a[i].value[quantity][k] - b[i].value[quantity][k]));
    return most;
}

/* Half of the step makes a quarter of the error: positions and reactions, against a step of an eighth; one of the cases
 * turns in space with principal moments that differ. */
START_TEST(errors_are_of_second_order)
{
    enum { COUNT = 8 };
    static const char *const names[] = {"Revolute_Case01", "Cylindrical_Case03", "RotSpring_Case01",
                                        "Universal_Case03"};
    const struct joint_case *which = find_case(names[_i]);
    struct joint_sample fine[COUNT], middle[COUNT], coarse[COUNT];
    run_case(which, 0.01, COUNT, coarse);
    run_case(which, 0.005, COUNT, middle);
    run_case(which, 0.00125, COUNT, fine);
    for (int q = 0; q < 2; ++q) {
        const int quantity = q ? JOINT_FORCE : JOINT_POSITION;
        const double ratio =
            distance_of(coarse, fine, COUNT, quantity) / distance_of(middle, fine, COUNT, quantity);
        ck_assert_msg(ratio > 3.5, "%s: %s, %g", which->name, q ? "force" : "position", ratio);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("joint_reference");
    TCase *cases = tcase_create("joint_reference");
    tcase_set_timeout(cases, 60);
    suite_add_tcase(suite, cases);
    tcase_add_loop_test(cases, motions_are_the_reference, 0, REFERENCES);
    tcase_add_loop_test(cases, errors_are_of_second_order, 0, 4);
    return run_suite(suite);
}

/* Problem level: bring your own A, b and contacts. One cube of 1 kg slides on a plane; the impulse that stops it is
 * limited by friction. */
#include <stdio.h>

#include <subadmm/problem.h>

int main(void)
{
    const double dt = 0.005, mass = 1, half = 0.1, g = 9.81;
    double A[36] = {0}, b[6] = {mass * 1.0, 0, -mass * g * dt, 0, 0, 0}; /* 1 m/s along x, gravity */
    for (int k = 0; k < 3; ++k) {
        A[7 * k] = mass;
        A[21 + 7 * k] = mass * 2 / 3 * half * half;
    }
    sadmm_problem_contact contacts[4] = {0};
    for (int k = 0; k < 4; ++k) {
        contacts[k].body_a = -1; /* the ground */
        contacts[k].body_b = 0;
        contacts[k].normal[2] = 1;
        contacts[k].arm_b[0] = k & 1 ? half : -half;
        contacts[k].arm_b[1] = k & 2 ? half : -half;
        contacts[k].arm_b[2] = -half;
        contacts[k].friction = 0.5;
    }
    sadmm_settings settings = sadmm_settings_default();
    settings.dt = dt;
    settings.tolerance = 1e-12;
    settings.iterations = 10000;

    sadmm_problem *problem = NULL;
    sadmm_solve_report report;
    double v[6];
    sadmm_status status = sadmm_problem_create(&problem);
    if (status == SADMM_OK) status = sadmm_problem_set_bodies(problem, 1, A, b, NULL);
    if (status == SADMM_OK) status = sadmm_problem_set_contacts(problem, 4, contacts, NULL);
    if (status == SADMM_OK) status = sadmm_problem_solve(problem, SADMM_BACKEND_AUTO, SADMM_F64, &settings, &report);
    if (status == SADMM_OK) status = sadmm_problem_get_solution(problem, v, NULL, NULL);
    if (status != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    printf("v_x = %.12f m/s (1 - mu g dt = %.12f), natural map %.1e m/s after %d iterations\n", v[0], 1 - 0.5 * g * dt,
           report.certificate.ncp_max, report.iterations);
    sadmm_problem_destroy(problem);
    return 0;
}

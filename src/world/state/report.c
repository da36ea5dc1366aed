/* What is reported of steps, whoever made them. */
#include "report.h"

#include <string.h>

void sadmm_report_numbers(const sadmm_step_report *report, double *row)
{
    const double numbers[] = {report->error,    (double)report->unsolved, report->penetration_max, report->joint_drift,
                              report->contacts, report->iterations,       (double)report->step,    report->time};
    memcpy(row, numbers, sizeof numbers);
}

void sadmm_world_report_steps(sadmm_world *world, int64_t steps, const struct sadmm_resident_report *done)
{
    sadmm_step_report *report = &world->report;
    report->step += steps;
    report->time = done->time;
    report->backend = world->kernels->backend;
    report->precision = world->kernels->precision;
    report->threads = done->plan.threads;
    report->bodies = done->plan.bodies;
    report->joints = done->joints;
    report->couplings = done->couplings;
    report->contacts = done->plan.points;
    report->pairs = done->plan.pairs;
    report->iterations = done->iterations;
    report->iterations_mean = done->iterations_mean;
    report->error = done->error;
    report->error_kind = done->error_kind;
    report->unsolved = done->unsolved;
    report->converged = done->converged;
    report->limited = done->limited;
    report->penetration_max = done->penetration_max;
    report->joint_drift = done->joint_drift;
    report->residual = done->residual;
    report->ms.collide = done->ms.collide;
    report->ms.assemble = done->ms.assemble;
    report->ms.solve = done->ms.solve;
    report->ms.finish = done->ms.finish;
    report->ms.total = done->ms.total;
    report->certify_ms = 0;
    report->certificate = sadmm_certificate_none();
}

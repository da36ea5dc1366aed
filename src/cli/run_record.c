#include "run_record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

bool run_record_start(struct run_record *record, sadmm_world *world)
{
    int32_t count = sadmm_world_body_count(world);
    memset(record, 0, sizeof *record);
    record->ncp_max = record->momentum_max = record->error = -1;
    record->bodies = sadmm_alloc((size_t)count, sizeof *record->bodies);
    if (!record->bodies) {
        cli_error(CLI_FAILED, "out of memory for %d bodies", count);
        return false;
    }
    for (int32_t k = 0; k < count; ++k) {
        struct run_body *body = &record->bodies[record->body_count];
        sadmm_body_def def;
        if (sadmm_world_body_at(world, k, &body->id) != SADMM_OK ||
            sadmm_world_body_def(world, body->id, &def) != SADMM_OK) {
            cli_error(CLI_FAILED, "%s", sadmm_world_message(world));
            return false;
        }
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        body->index = k;
        memcpy(body->start, def.position, sizeof body->start);
        ++record->body_count;
    }
    return true;
}

/* Unlike fmax: once NaN, always NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

bool run_record_step(struct run_record *record, sadmm_world *world)
{
    sadmm_step_report *r = &record->last;
    if (sadmm_world_report(world, r) != SADMM_OK) {
        cli_error(CLI_FAILED, "%s", sadmm_world_message(world));
        return false;
    }
    const double ms[RUN_PHASES] = {r->ms.total, r->ms.collide, r->ms.assemble, r->ms.solve, r->ms.finish};
    for (int k = 0; k < RUN_PHASES; ++k) {
        if (!SADMM_GROW(record->ms[k], record->steps, record->steps + 1)) {
            cli_error(CLI_FAILED, "out of memory for the times of %zu steps", record->steps + 1);
            return false;
        }
        record->ms[k][record->steps] = ms[k];
    }
    ++record->steps;
    record->limited_steps += r->limited > 0;
    record->contacts_sum += r->contacts;
    record->iterations_sum += r->iterations_mean;
    record->met += r->converged;
    record->unsolved_steps += r->unsolved > 0;
    if (r->error > record->error) {
        record->error = r->error;
        record->error_kind = r->error_kind;
    }
    if (r->contacts > record->contacts_max) record->contacts_max = r->contacts;
    record->penetration_max = fmax(record->penetration_max, r->penetration_max);
    record->joint_drift = fmax(record->joint_drift, r->joint_drift);
    if (r->certificate.ncp_max != -1) {
        record->ncp_max = larger(record->ncp_max, r->certificate.ncp_max);
        record->momentum_max = larger(record->momentum_max, r->certificate.momentum_max);
    }
    return true;
}

static double norm3(const double x[3])
{
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

bool run_record_finish(struct run_record *record, sadmm_world *world)
{
    record->finite = true;
    for (size_t k = 0; k < record->body_count; ++k) {
        const struct run_body *body = &record->bodies[k];
        sadmm_body_state s;
        if (sadmm_world_body_state(world, body->id, &s) != SADMM_OK) {
            cli_error(CLI_FAILED, "%s", sadmm_world_message(world));
            return false;
        }
        const double moved[3] = {s.position[0] - body->start[0], s.position[1] - body->start[1],
                                 s.position[2] - body->start[2]};
        double speed = norm3(s.linear_velocity), distance = norm3(moved);
        double all = speed + distance + norm3(s.angular_velocity) + norm3(s.orientation) + s.orientation[3];
        if (!isfinite(all)) record->finite = false;
        record->speed_max = fmax(record->speed_max, speed);
        record->displacement_max = fmax(record->displacement_max, distance);
    }
    if (sadmm_world_state_hash(world, &record->hash) == SADMM_OK) return true;
    cli_error(CLI_FAILED, "%s", sadmm_world_message(world));
    return false;
}

void run_record_free(struct run_record *record)
{
    sadmm_free(record->bodies);
    for (int k = 0; k < RUN_PHASES; ++k) sadmm_free(record->ms[k]);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

bool run_percentiles(const double *values, size_t count, double *median, double *p95)
{
    double *sorted = sadmm_alloc(count, sizeof *sorted);
    if (!sorted) return false;
    memcpy(sorted, values, count * sizeof *sorted);
    qsort(sorted, count, sizeof *sorted, ascending);
    *median = (sorted[(count - 1) / 2] + sorted[count / 2]) / 2;
    *p95 = sorted[(count * 95 + 99) / 100 - 1]; /* nearest rank */
    sadmm_free(sorted);
    return true;
}

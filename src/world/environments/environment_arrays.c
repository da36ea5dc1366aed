/* Arrays of environments: those of worlds, with one dimension more. */
#include "environment_arrays.h"

#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/base/names.h"
#include "core/model/joint_law.h"
#include "core/model/settings.h"
#include "environment_backend.h"
#include "environment_checks.h"
#include "environment_contacts.h"
#include "environment_merge.h"
#include "environment_numbers.h"
#include "environment_work.h"
#include "world/objects/joint.h"
#include "world/state/report.h"

/* Numbers of an environment. */
static size_t numbers_of(const struct sadmm_environments *environments, sadmm_array array)
{
    return (size_t)sadmm_environments_rows(environments, array) * (size_t)sadmm_array_columns(array);
}

static sadmm_status check_array(struct sadmm_environments *environments, sadmm_array array)
{
    if ((unsigned)array < SADMM_ARRAY_COUNT) return SADMM_OK;
    return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "array = %d: must be in [0, %d)", (int)array,
                      SADMM_ARRAY_COUNT);
}

/* ---- in steps ---------------------------------------------------------------------------------------------------- */

static sadmm_status open_joint(sadmm_world *world, struct sadmm_world_joint *joint)
{
    const sadmm_joint_def *def = &joint->def;
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        if (def->locks >> k & 1 || !joint_has_coordinate(def, k)) continue;
        joint->def.coordinates[k].lower = -INFINITY;
        joint->def.coordinates[k].upper = INFINITY;
        TRY(sadmm_world_take_update(world, joint, (enum sadmm_joint_update)k));
    }
    return SADMM_OK;
}

/* Limits are checked against each other: where both are an environment's own, none is left of another one's. */
static sadmm_status open_limits(const struct sadmm_environments *environments, sadmm_world *world)
{
    if (!sadmm_environments_bound(environments, SADMM_ARRAY_JOINT_LOWER, -1) ||
        !sadmm_environments_bound(environments, SADMM_ARRAY_JOINT_UPPER, -1))
        return SADMM_OK;
    for (SADMM_OBJECTS(slot, &world->joint_ids)) TRY(open_joint(world, &world->joints[slot]));
    return SADMM_OK;
}

/* All but those of one array. */
static sadmm_status read_inputs(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                int32_t environment, int but, bool good)
{
    TRY(open_limits(environments, worker->world));
    for (size_t k = 0; k < environments->bound_count; ++k) {
        const struct sadmm_bound_array *bound = &environments->bound[k];
        if (!sadmm_environments_is_input(bound->array) || (int)bound->array == but) continue;
        TRY(sadmm_bound_read(worker, bound, environment, good));
    }
    return SADMM_OK;
}

sadmm_status sadmm_environments_read_inputs(struct sadmm_environments *environments,
                                            struct sadmm_environment_worker *worker, int32_t environment)
{
    return read_inputs(environments, worker, environment, -1, false);
}

sadmm_status sadmm_environments_read_good_inputs(struct sadmm_environments *environments,
                                                 struct sadmm_environment_worker *worker, int32_t environment)
{
    return read_inputs(environments, worker, environment, -1, true);
}

sadmm_status sadmm_environments_read_good_forms(struct sadmm_environments *environments,
                                                struct sadmm_environment_worker *worker, int32_t environment)
{
    for (size_t k = 0; k < environments->bound_count; ++k) {
        const struct sadmm_bound_array *bound = &environments->bound[k];
        if (bound->array == SADMM_ARRAY_SHAPE_SIZE || bound->array == SADMM_ARRAY_SHAPE_FRAME)
            TRY(sadmm_bound_read(worker, bound, environment, true));
    }
    return SADMM_OK;
}

/* Gravity is the settings' of a world, of which the merged one has others only where its backend takes it over. What
 * that has of it by now is the same: it has taken the array by itself. */
static sadmm_status set_merged_gravity(struct sadmm_environments *environments, int32_t environment,
                                       const double *numbers)
{
    sadmm_world *world = environments->merged.world;
    sadmm_settings settings = world->def.settings;
    memcpy(settings.gravity, numbers, sizeof settings.gravity);
    TRY(sadmm_settings_validate(&settings, &world->error));
    memcpy(environments->merged.gravities + 3 * (size_t)environment, numbers, sizeof settings.gravity);
    return SADMM_OK;
}

/* Numbers of an environment that the merged world does not have yet. */
static sadmm_status give_merged(struct sadmm_environments *environments, struct sadmm_bound_array *bound,
                                int32_t environment, const double *numbers)
{
    sadmm_world *world = environments->merged.world;
    double *given = bound->given + bound->numbers * (size_t)environment;
    const int32_t rows = sadmm_environments_rows(environments, bound->array);
    if (!bound->given_unknown && memcmp(given, numbers, bound->numbers * sizeof *numbers) == 0) return SADMM_OK;
    const sadmm_status status =
        bound->array == SADMM_ARRAY_GRAVITY
            ? set_merged_gravity(environments, environment, numbers)
            : sadmm_world_set_array(world, bound->array, rows * environment, rows, numbers);
    if (status == SADMM_OK) memcpy(given, numbers, bound->numbers * sizeof *numbers);
    else {
        const struct sadmm_error cause = world->error;
        (void)sadmm_fail(&world->error, status, "%s: %s", sadmm_array_name(bound->array), cause.message);
    }
    return status;
}

/* Limits are checked against each other: where one is to be another one, both are set anew. */
static sadmm_status open_merged_limits(struct sadmm_environments *environments, int32_t environment)
{
    static const sadmm_array limits[2] = {SADMM_ARRAY_JOINT_LOWER, SADMM_ARRAY_JOINT_UPPER};
    struct sadmm_bound_array *bound[2];
    sadmm_world *world = environments->merged.world;
    bool differ = false;
    for (int k = 0; k < 2; ++k) {
        bound[k] = sadmm_environments_bound(environments, limits[k], -1);
        if (!bound[k]) return SADMM_OK;
        sadmm_bound_load(bound[k], environment, environments->worker[0].numbers);
        differ = differ || bound[k]->given_unknown || memcmp(bound[k]->given + bound[k]->numbers * (size_t)environment,
                                  environments->worker[0].numbers, bound[k]->numbers * sizeof(double)) != 0;
    }
    if (!differ) return SADMM_OK;
    const size_t joints = (size_t)environments->merged.joints.count;
    for (size_t i = 0; i < joints; ++i)
        TRY(open_joint(world, &world->joints[joints * (size_t)environment + i]));
    for (int k = 0; k < 2; ++k)
        for (size_t i = 0; i < bound[k]->numbers; ++i)
            bound[k]->given[bound[k]->numbers * (size_t)environment + i] = NAN; /* it has none of them now */
    return SADMM_OK;
}

sadmm_status sadmm_environments_read_merged_inputs(struct sadmm_environments *environments, int32_t environment)
{
    struct sadmm_environment_worker *worker = &environments->worker[0];
    TRY(open_merged_limits(environments, environment));
    for (size_t k = 0; k < environments->bound_count; ++k) {
        struct sadmm_bound_array *bound = &environments->bound[k];
        if (!bound->given) continue;
        sadmm_bound_load(bound, environment, worker->numbers);
        TRY(give_merged(environments, bound, environment, worker->numbers));
    }
    return SADMM_OK;
}

sadmm_status sadmm_environments_give_template_inputs(struct sadmm_environments *environments, int32_t environment)
{
    for (int pass = 0; pass < 2; ++pass) /* limits, one against the other */
        for (size_t k = 0; k < environments->bound_count; ++k) {
            struct sadmm_bound_array *bound = &environments->bound[k];
            if (!bound->given) continue;
            const sadmm_status status = give_merged(environments, bound, environment, bound->start);
            if (pass > 0 || status != SADMM_ERROR_INVALID_ARGUMENT) TRY(status);
        }
    return SADMM_OK;
}

sadmm_status sadmm_environments_write_outputs(struct sadmm_environments *environments,
                                              struct sadmm_environment_worker *worker, int32_t environment)
{
    for (size_t k = 0; k < environments->bound_count; ++k) {
        const struct sadmm_bound_array *bound = &environments->bound[k];
        if (sadmm_environments_is_input(bound->array) || (environments->merged.world && !bound->by_host)) continue;
        TRY(sadmm_bound_get_all(worker->world, bound->array, worker->numbers));
        sadmm_bound_store(bound, environment, worker->numbers);
    }
    return environments->merged.world ? SADMM_OK : sadmm_environments_keep_contacts(environments, worker, environment);
}

bool sadmm_environments_inputs_differ(const struct sadmm_environments *environments, int32_t environment)
{
    for (size_t k = 0; k < environments->bound_count; ++k) {
        const struct sadmm_bound_array *bound = &environments->bound[k];
        double *now = environments->worker[0].numbers;
        if (!bound->given || sadmm_environments_may_exchange(environments, bound)) continue;
        sadmm_bound_load(bound, environment, now);
        if (memcmp(bound->given + bound->numbers * (size_t)environment, now, bound->numbers * sizeof *now) != 0)
            return true;
    }
    return false;
}

sadmm_status sadmm_environments_pull_inputs(struct sadmm_environments *environments, bool all)
{
    for (size_t k = 0; k < environments->bound_count; ++k) {
        struct sadmm_bound_array *bound = &environments->bound[k];
        if (!bound->given || (!all && sadmm_environments_may_exchange(environments, bound))) continue;
        TRY(sadmm_environments_pull_array(environments, bound));
    }
    return SADMM_OK;
}

/* Of those whose last step has been measured, or that have made none since a state was put into them; the others' rows
 * are what they were. */
static sadmm_status write_reports(struct sadmm_environments *environments, struct sadmm_bound_array *bound)
{
    TRY(sadmm_environments_measure(environments));
    TRY(sadmm_environments_pull_array(environments, bound));
    for (int32_t e = 0; e < environments->count; ++e) {
        sadmm_step_report report;
        double row[8];
        if (environments->marked[e] || !sadmm_environments_report(environments, e, &report)) continue;
        sadmm_report_numbers(&report, row);
        sadmm_bound_store(bound, e, row);
    }
    return sadmm_environments_push_array(environments, bound);
}

static bool is_report(const struct sadmm_environments *environments, const struct sadmm_bound_array *bound)
{
    return bound->array == SADMM_ARRAY_REPORT && environments->merged.world->resident.loaded;
}

/* By the host. */
static sadmm_status write_by_host(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                  int32_t environment, int32_t place, void *argument)
{
    (void)place;
    (void)argument;
    if (environments->marked[environment]) return SADMM_OK;
    TRY(sadmm_environments_load(environments, worker, environment));
    return sadmm_environments_write_outputs(environments, worker, environment);
}

static bool is_output(const struct sadmm_bound_array *bound)
{
    return !sadmm_environments_is_input(bound->array) && bound->numbers > 0;
}

/* What environments were left as that are marked. */
static sadmm_status write_marked(struct sadmm_environments *environments)
{
    struct sadmm_environment_worker *worker = &environments->worker[0];
    struct sadmm_merged_world *merged = &environments->merged;
    struct sadmm_bound_array *bound = environments->bound, *end = bound + environments->bound_count, *output;
    if (!merged->any_unwritten) return SADMM_OK;
    for (output = bound; output < end; ++output)
        if (is_output(output)) TRY(sadmm_environments_pull_array(environments, output));
    for (int32_t e = 0; e < environments->count; ++e) {
        if (!merged->unwritten[e] || !environments->marked[e]) continue;
        sadmm_status status = sadmm_environments_load(environments, worker, e);
        for (output = bound; output < end && status == SADMM_OK; ++output) {
            if (!is_output(output)) continue;
            status = sadmm_bound_get_all(worker->world, output->array, worker->numbers);
            if (status == SADMM_OK) sadmm_bound_store(output, e, worker->numbers);
        }
        if (status != SADMM_OK)
            return sadmm_fail(&environments->error, status, "environment %d: %s", e, worker->world->error.message);
    }
    for (output = bound; output < end; ++output)
        if (is_output(output)) TRY(sadmm_environments_push_array(environments, output));
    memset(merged->unwritten, 0, (size_t)environments->count * sizeof *merged->unwritten);
    merged->any_unwritten = false;
    return SADMM_OK;
}

sadmm_status sadmm_environments_write_merged_outputs(struct sadmm_environments *environments, const int32_t *which,
                                                     int32_t count)
{
    bool by_host = false;
    for (size_t k = 0; k < environments->bound_count; ++k) {
        struct sadmm_bound_array *bound = &environments->bound[k];
        if (!is_output(bound)) continue;
        bound->by_host = !is_report(environments, bound) && !sadmm_environments_may_exchange(environments, bound);
        by_host = by_host || bound->by_host;
        TRY(is_report(environments, bound) ? write_reports(environments, bound)
            : bound->by_host               ? sadmm_environments_pull_array(environments, bound)
                                           : sadmm_environments_exchange(environments, bound));
    }
    if (by_host) TRY(sadmm_environments_each(environments, which, count, write_by_host, NULL));
    for (size_t k = 0; k < environments->bound_count; ++k) {
        struct sadmm_bound_array *bound = &environments->bound[k];
        if (is_output(bound) && bound->by_host) TRY(sadmm_environments_push_array(environments, bound));
    }
    TRY(write_marked(environments));
    return by_host || environments->bound_count == 0 ? SADMM_OK : sadmm_environments_wait_backend(environments);
}

/* ---- binding ----------------------------------------------------------------------------------------------------- */

/* Where an array's numbers are to be had without a look at the environment's state: of inputs, and of a merged world,
 * from which one environment is taken at the price of many. */
static struct sadmm_bound_array *source_of(const struct sadmm_environments *environments, sadmm_array array)
{
    if (sadmm_environments_is_input(array)) return sadmm_environments_bound(environments, array, -1);
    return environments->merged.world ? sadmm_environments_bound(environments, array, SADMM_F64) : NULL;
}

/* The report of an environment of a merged world, which it is not taken from there for. */
static sadmm_status read_report(struct sadmm_environments *environments, int32_t environment, double *row)
{
    sadmm_step_report report;
    TRY(sadmm_environments_measure(environments));
    (void)sadmm_environments_report(environments, environment, &report);
    sadmm_report_numbers(&report, row);
    return SADMM_OK;
}

/* What an array has of an environment. */
static sadmm_status read_environment(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                     int32_t environment, sadmm_array array, double *values)
{
    const struct sadmm_bound_array *bound = source_of(environments, array);
    if (bound) {
        sadmm_bound_load(bound, environment, values);
        return SADMM_OK;
    }
    if (environments->merged.world && array == SADMM_ARRAY_REPORT && !environments->marked[environment]) {
        const sadmm_status status = read_report(environments, environment, values);
        return status == SADMM_OK
                   ? status
                   : sadmm_fail(&worker->world->error, status, "%s", environments->error.message);
    }
    TRY(sadmm_environments_load(environments, worker, environment));
    return sadmm_bound_get_all(worker->world, array, values);
}

static sadmm_status fill(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                         int32_t environment, int32_t place, void *argument)
{
    const struct sadmm_bound_array *bound = (const struct sadmm_bound_array *)argument;
    (void)place;
    TRY(read_environment(environments, worker, environment, bound->array, worker->numbers));
    sadmm_bound_store(bound, environment, worker->numbers);
    return SADMM_OK;
}

/* Of an input array that is not bound yet: workers have what the template has. */
static sadmm_status read_template(struct sadmm_environments *environments, sadmm_array array, double *values)
{
    sadmm_world *world = environments->worker[0].world;
    sadmm_status status = sadmm_environment_state_load(world, &environments->kept[0]);
    if (status == SADMM_OK) status = sadmm_bound_get_all(world, array, values);
    return status == SADMM_OK ? status : sadmm_fail(&environments->error, status, "%s", world->error.message);
}

/* *out: the array that is bound, newly or before. */
static sadmm_status bind(struct sadmm_environments *environments, sadmm_array array, sadmm_precision precision,
                         struct sadmm_bound_array **out)
{
    struct sadmm_error *error = &environments->error;
    const size_t n = environments->bound_count;
    const bool input = sadmm_environments_is_input(array);
    *out = sadmm_environments_bound(environments, array, input ? -1 : (int)precision);
    if (*out && (*out)->precision != precision)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "precision = %s: must be %s, which the array %s has",
                          sadmm_precision_names[precision], sadmm_precision_names[(*out)->precision],
                          sadmm_array_name(array));
    if (*out) return SADMM_OK;
    const bool gravity = environments->merged.world && array == SADMM_ARRAY_GRAVITY;
    if (gravity && !sadmm_environments_may_have_gravities(environments))
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                          "array = gravity: environments on CUDA have one where the host drives the steps "
                          "(settings.residual_tolerance; settings.tolerance in the method 'paper', or with more than "
                          "64 checks a step)");
    if (!SADMM_GROW(environments->bound, n, n + 1)) return sadmm_fail_memory(error, "an array of environments");
    struct sadmm_bound_array fresh = {
        .array = array, .precision = precision, .numbers = numbers_of(environments, array)};
    fresh.host = sadmm_alloc((size_t)environments->count,
                               fresh.numbers * (precision == SADMM_F64 ? sizeof(double) : sizeof(float)));
    fresh.start = (double *)sadmm_alloc(input ? fresh.numbers : 0, sizeof *fresh.start);
    const bool merged = input && environments->merged.world;
    if (merged) fresh.given = (double *)sadmm_alloc((size_t)environments->count, fresh.numbers * sizeof *fresh.given);
    sadmm_status status = fresh.host && fresh.start && (!merged || fresh.given)
                              ? SADMM_OK
                              : sadmm_fail_memory(error, "an array of environments");
    if (status == SADMM_OK && input) status = read_template(environments, array, fresh.start);
    for (size_t e = 0; status == SADMM_OK && merged && e < (size_t)environments->count; ++e)
        memcpy(fresh.given + fresh.numbers * e, fresh.start, fresh.numbers * sizeof *fresh.start);
    struct sadmm_bound_array *source = source_of(environments, array);
    if (status == SADMM_OK && source) status = sadmm_environments_pull_array(environments, source);
    if (status == SADMM_OK) status = sadmm_environments_each(environments, NULL, environments->count, fill, &fresh);
    if (status == SADMM_OK) status = sadmm_environments_place_array(environments, &fresh);
    if (status == SADMM_OK && gravity) status = sadmm_environments_open_gravities(environments);
    if (status != SADMM_OK) {
        sadmm_environments_release_array(environments, &fresh);
        return status;
    }
    environments->bound[n] = fresh;
    environments->bound_count = n + 1;
    *out = &environments->bound[n];
    return SADMM_OK;
}

sadmm_status sadmm_environments_bind(sadmm_environments *environments, sadmm_array array, sadmm_precision precision,
                                     sadmm_environments_array *out)
{
    struct sadmm_bound_array *bound;
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    struct sadmm_error *error = &environments->error;
    TRY(sadmm_check_given(out, "out", error));
    TRY(check_array(environments, array));
    if (precision != SADMM_F32 && precision != SADMM_F64)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "precision = %d: must be SADMM_F32 or SADMM_F64",
                          (int)precision);
    TRY(bind(environments, array, precision, &bound));
    *out = (sadmm_environments_array){.values = bound->values,
                                      .environments = environments->count,
                                      .rows = sadmm_environments_rows(environments, array),
                                      .columns = sadmm_array_columns(array),
                                      .precision = precision,
                                      .device = bound->in_backend ? environments->merged.world->def.device : -1};
    return SADMM_OK;
}

/* ---- some environments ------------------------------------------------------------------------------------------- */

struct rows_of {
    sadmm_array array;
    size_t numbers;
    double *out;
    const double *in;
    struct sadmm_bound_array *bound; /* NULL: it is a state */
};

static sadmm_status get_one(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                            int32_t environment, int32_t place, void *argument)
{
    const struct rows_of *rows = (const struct rows_of *)argument;
    return read_environment(environments, worker, environment, rows->array, rows->out + rows->numbers * (size_t)place);
}

sadmm_status sadmm_environments_get(sadmm_environments *environments, sadmm_array array, const int32_t *which,
                                    int32_t count, double *values)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    TRY(check_array(environments, array));
    TRY(sadmm_environments_check_which(environments, which, &count));
    struct rows_of rows = {.array = array, .numbers = numbers_of(environments, array), .out = values};
    if (rows.numbers > 0 && count > 0) TRY(sadmm_check_given(values, "values", &environments->error));
    struct sadmm_bound_array *bound = source_of(environments, array);
    if (bound) TRY(sadmm_environments_pull_array(environments, bound));
    return sadmm_environments_each(environments, which, count, get_one, &rows);
}

/* Can it be set, with the other inputs that the environment has? The worker's world is left with it. */
static sadmm_status try_one(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                            int32_t environment, int32_t place, void *argument)
{
    const struct rows_of *rows = (const struct rows_of *)argument;
    const double *given = rows->in + rows->numbers * (size_t)place;
    TRY(sadmm_environments_load(environments, worker, environment));
    if (!rows->bound) {
        /* positions of joints are by frames to come */
        const struct sadmm_bound_array *frames = sadmm_environments_bound(environments, SADMM_ARRAY_JOINT_FRAME, -1);
        if (frames) TRY(sadmm_bound_read(worker, frames, environment, true));
        return sadmm_bound_set_all(worker->world, rows->array, given);
    }
    TRY(read_inputs(environments, worker, environment, (int)rows->array, true));
    const bool single = rows->bound->precision == SADMM_F32; /* as it will be stored */
    for (size_t k = 0; k < rows->numbers; ++k) worker->numbers[k] = single ? (double)(float)given[k] : given[k];
    sadmm_bound_mend(rows->bound, worker->numbers);
    return sadmm_bound_set_all(worker->world, rows->array, worker->numbers);
}

static sadmm_status set_one(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                            int32_t environment, int32_t place, void *argument)
{
    const struct rows_of *rows = (const struct rows_of *)argument;
    if (rows->bound) {
        sadmm_bound_store(rows->bound, environment, rows->in + rows->numbers * (size_t)place);
        return SADMM_OK;
    }
    TRY(try_one(environments, worker, environment, place, argument));
    TRY(sadmm_environments_store(environments, worker, environment));
    if (environments->merged.world && environments->marked[environment])
        environments->merged.unwritten[environment] = environments->merged.any_unwritten = true;
    return environments->merged.world ? SADMM_OK : sadmm_environments_write_outputs(environments, worker, environment);
}

sadmm_status sadmm_environments_set(sadmm_environments *environments, sadmm_array array, const int32_t *which,
                                    int32_t count, const double *values)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    TRY(check_array(environments, array));
    TRY(sadmm_environments_check_which(environments, which, &count));
    struct rows_of rows = {.array = array, .numbers = numbers_of(environments, array), .in = values};
    if (rows.numbers > 0 && count > 0) TRY(sadmm_check_given(values, "values", &environments->error));
    if (!sadmm_array_is_settable(array))
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "array = %s: must be one that can be set",
                          sadmm_array_name(array));
    /* From here on every environment has its own, so that what a worker tries is of no other one. */
    if (sadmm_environments_is_input(array)) {
        const struct sadmm_bound_array *before = sadmm_environments_bound(environments, array, -1);
        TRY(bind(environments, array, before ? before->precision : SADMM_F64, &rows.bound));
    }
    TRY(sadmm_environments_pull_inputs(environments, true));
    TRY(sadmm_environments_each(environments, which, count, try_one, &rows));
    TRY(sadmm_environments_each(environments, which, count, set_one, &rows));
    if (rows.bound) return sadmm_environments_push_array(environments, rows.bound);
    if (!environments->merged.world) return SADMM_OK;
    sadmm_environments_forget_contacts(environments, which, count);
    return sadmm_environments_write_merged_outputs(environments, which, count);
}

#include "check_runs.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "interrupt.h"

enum { STATE = 13 }; /* numbers of a body's state: check_reference.states */

static bool fail(struct sadmm_error *error, const char *what, const char *message)
{
    sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s: %s", what, message);
    return false;
}

/* Not fmax: a NaN stays. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

static double largest(const double *x, size_t count, double start)
{
    for (size_t k = 0; k < count; ++k) start = larger(start, fabs(x[k]));
    return start;
}

static double largest_difference(const double *a, const double *b, size_t count, double start)
{
    for (size_t k = 0; k < count; ++k) start = larger(start, fabs(a[k] - b[k]));
    return start;
}

static bool read_gyration(sadmm_world *world, size_t count, double *gyration)
{
    for (size_t k = 0; k < count; ++k) {
        sadmm_body_id id;
        sadmm_body_def def;
        if (sadmm_world_body_at(world, (int32_t)k, &id) != SADMM_OK ||
            sadmm_world_body_def(world, id, &def) != SADMM_OK)
            return false;
        if (def.type == SADMM_BODY_DYNAMIC) gyration[k] = sqrt(largest(def.inertia, 3, 0) / def.mass);
    }
    return true;
}

static bool read_states(sadmm_world *world, size_t count, const double *gyration, double *states)
{
    for (size_t k = 0; k < count; ++k) {
        sadmm_body_id id;
        sadmm_body_state s;
        if (sadmm_world_body_at(world, (int32_t)k, &id) != SADMM_OK ||
            sadmm_world_body_state(world, id, &s) != SADMM_OK)
            return false;
        double *out = states + STATE * k;
        memcpy(out, s.position, sizeof s.position);
        for (int i = 0; i < 4; ++i) out[3 + i] = 2 * gyration[k] * s.orientation[i];
        memcpy(out + 7, s.linear_velocity, sizeof s.linear_velocity);
        for (int i = 0; i < 3; ++i) out[10 + i] = gyration[k] * s.angular_velocity[i];
    }
    return true;
}

/* ---- the frozen problems ----------------------------------------------------------------------------------------- */

static void frozen_free(struct check_frozen *f)
{
    sadmm_problem_destroy(f->problem);
    sadmm_free(f->start_v);
    sadmm_free(f->start_impulses);
    sadmm_free(f->start_lambda);
    sadmm_free(f->whole.v);
    sadmm_free(f->whole.impulses);
    sadmm_free(f->once.v);
    sadmm_free(f->once.impulses);
}

static bool answer_allocate(struct check_answer *a, size_t bodies, size_t contacts)
{
    a->v = sadmm_alloc(6 * bodies, sizeof(double));
    a->impulses = sadmm_alloc(3 * contacts, sizeof(double));
    return a->v && a->impulses;
}

static bool frozen_allocate(struct check_frozen *f)
{
    size_t bodies = (size_t)sadmm_problem_body_count(f->problem),
           contacts = (size_t)sadmm_problem_contact_count(f->problem);
    f->start_v = sadmm_alloc(6 * bodies, sizeof(double));
    f->start_impulses = sadmm_alloc(3 * contacts, sizeof(double));
    f->start_lambda = sadmm_alloc(6 * (size_t)sadmm_problem_block_count(f->problem), sizeof(double));
    return answer_allocate(&f->whole, bodies, contacts) && answer_allocate(&f->once, bodies, contacts) && f->start_v &&
           f->start_impulses && f->start_lambda;
}

/* From what the step started from, so that every table gets the same problem. */
static sadmm_status solve_frozen(const struct check_frozen *f, const struct sadmm_settings *settings,
                                 sadmm_backend backend, sadmm_precision precision, double *v, double *impulses)
{
    sadmm_status status = sadmm_problem_set_solution(f->problem, f->start_v, f->start_impulses, f->start_lambda);
    if (status == SADMM_OK) status = sadmm_problem_solve(f->problem, backend, precision, settings, NULL);
    if (status == SADMM_OK) status = sadmm_problem_get_solution(f->problem, v, impulses, NULL);
    return status;
}

/* Without contacts one iteration gives v = A^-1 b: the other scale of velocities in a step. */
static sadmm_status free_speed(const struct check_frozen *f, const struct sadmm_settings *settings, double *speed)
{
    size_t bodies = (size_t)sadmm_problem_body_count(f->problem);
    sadmm_problem *loose = NULL;
    double *A = sadmm_alloc(42 * bodies, sizeof *A), *b = A ? A + 36 * bodies : NULL;
    sadmm_status status = A ? sadmm_problem_create(&loose) : SADMM_ERROR_OUT_OF_MEMORY;
    if (status == SADMM_OK) status = sadmm_problem_get_bodies(f->problem, A, b, NULL);
    if (status == SADMM_OK) status = sadmm_problem_set_bodies(loose, (int32_t)bodies, A, b, NULL);
    if (status == SADMM_OK) status = sadmm_problem_solve(loose, SADMM_BACKEND_REF, SADMM_F64, settings, NULL);
    if (status == SADMM_OK) status = sadmm_problem_get_solution(loose, b, NULL, NULL);
    if (status == SADMM_OK) *speed = largest(b, 6 * bodies, *speed);
    sadmm_problem_destroy(loose);
    sadmm_free(A);
    return status;
}

/* The same with one iteration: every kernel once. */
static sadmm_settings once(const sadmm_settings *settings)
{
    sadmm_settings s = *settings;
    s.iterations = 1;
    return s;
}

static bool answer_by_ref(const struct check_frozen *f, const sadmm_settings *settings, struct check_answer *a)
{
    if (solve_frozen(f, settings, SADMM_BACKEND_REF, SADMM_F64, a->v, a->impulses) != SADMM_OK) return false;
    a->v_scale = largest(a->v, 6 * (size_t)sadmm_problem_body_count(f->problem), 0);
    a->impulse_scale = largest(a->impulses, 3 * (size_t)sadmm_problem_contact_count(f->problem), 0);
    return true;
}

static bool freeze(sadmm_world *world, long step, struct check_frozen *f, struct sadmm_error *error)
{
    sadmm_settings settings = sadmm_world_settings(world);
    f->step = step;
    if (sadmm_problem_create(&f->problem) != SADMM_OK) return fail(error, "ref", "out of memory");
    if (sadmm_world_freeze(world, f->problem) != SADMM_OK) return fail(error, "ref", sadmm_world_message(world));
    if (!frozen_allocate(f)) return fail(error, "ref", "out of memory");
    const sadmm_settings one = once(&settings);
    if (sadmm_problem_get_solution(f->problem, f->start_v, f->start_impulses, f->start_lambda) != SADMM_OK ||
        !answer_by_ref(f, &settings, &f->whole) || !answer_by_ref(f, &one, &f->once))
        return fail(error, "ref", sadmm_problem_message(f->problem));
    if (free_speed(f, &settings, &f->whole.v_scale) != SADMM_OK) return fail(error, "ref", sadmm_last_message());
    f->once.v_scale = larger(f->once.v_scale, f->whole.v_scale);
    return true;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* Called after every step (0 is the first); false stops the run with `error` filled. */
typedef bool (*step_visitor)(void *data, sadmm_world *world, long step, struct sadmm_error *error);

static bool run_scene(const struct sadmm_scene *scene, sadmm_backend backend, sadmm_precision precision, long steps,
                      step_visitor visit, void *data, struct sadmm_error *error)
{
    struct sadmm_scene own = *scene;
    sadmm_world *world = NULL;
    own.def.backend = backend;
    own.def.precision = precision;
    if (sadmm_scene_build(&own, &world, error) != SADMM_OK) return false;
    bool ok = true;
    for (long step = 0; ok && step < steps && !interrupted(); ++step) {
        if (sadmm_scene_before_step(&own, world, step, error) != SADMM_OK) ok = false;
        else if (sadmm_world_step(world) != SADMM_OK) ok = fail(error, "step", sadmm_world_message(world));
        else ok = visit(data, world, step, error);
    }
    sadmm_world_destroy(world);
    return ok;
}

static bool record_reference(void *data, sadmm_world *world, long step, struct sadmm_error *error)
{
    struct check_reference *r = data;
    if (step == 0) {
        r->bodies = (size_t)sadmm_world_body_count(world);
        r->gyration = sadmm_alloc(r->bodies, sizeof(double));
        r->states = sadmm_alloc((size_t)r->steps * r->bodies, STATE * sizeof(double));
        if (!r->gyration || !r->states) return fail(error, "ref", "out of memory");
        if (!read_gyration(world, r->bodies, r->gyration)) return fail(error, "ref", sadmm_world_message(world));
        sadmm_settings s = sadmm_world_settings(world);
        r->speed = s.dt * sqrt(s.gravity[0] * s.gravity[0] + s.gravity[1] * s.gravity[1] + s.gravity[2] * s.gravity[2]);
    }
    double *states = r->states + (size_t)step * r->bodies * STATE;
    if (!read_states(world, r->bodies, r->gyration, states)) return fail(error, "ref", sadmm_world_message(world));
    for (size_t k = 0; k < r->bodies; ++k) r->speed = largest(states + STATE * k + 7, 6, r->speed);
    /* The last step, and others evenly before it. */
    long most = r->steps < CHECK_MOST_FROZEN ? r->steps : CHECK_MOST_FROZEN;
    long wanted = r->steps * (long)(r->frozen_count + 1) / most;
    if (step + 1 != wanted) return true;
    return freeze(world, wanted, &r->frozen[r->frozen_count++], error);
}

bool check_reference_make(struct check_reference *reference, const struct sadmm_scene *scene, long steps,
                          struct sadmm_error *error)
{
    memset(reference, 0, sizeof *reference);
    reference->scene = scene;
    reference->steps = steps;
    if (run_scene(scene, SADMM_BACKEND_REF, SADMM_F64, steps, record_reference, reference, error)) return true;
    check_reference_free(reference);
    return false;
}

void check_reference_free(struct check_reference *reference)
{
    for (size_t k = 0; k < reference->frozen_count; ++k) frozen_free(&reference->frozen[k]);
    sadmm_free(reference->gyration);
    sadmm_free(reference->states);
    memset(reference, 0, sizeof *reference);
}

struct comparison {
    const struct check_reference *reference;
    double *states;
    struct check_difference *difference;
};

static bool compare_step(void *data, sadmm_world *world, long step, struct sadmm_error *error)
{
    const struct comparison *c = data;
    const struct check_reference *r = c->reference;
    const double *theirs = r->states + (size_t)step * r->bodies * STATE;
    if (!read_states(world, r->bodies, r->gyration, c->states)) return fail(error, "state", sadmm_world_message(world));
    for (size_t k = 0; k < r->bodies; ++k) {
        const double *a = c->states + STATE * k, *b = theirs + STATE * k;
        c->difference->position = largest_difference(a, b, 7, c->difference->position);
        c->difference->velocity = largest_difference(a + 7, b + 7, 6, c->difference->velocity);
    }
    return true;
}

/* Differences from ref's answer, into the larger of what was there. */
static bool compare_frozen(const struct check_frozen *f, const struct check_answer *wanted,
                           const struct sadmm_settings *settings, sadmm_backend backend, sadmm_precision precision,
                           double *velocity, double *impulse, struct sadmm_error *error)
{
    size_t v_count = 6 * (size_t)sadmm_problem_body_count(f->problem);
    size_t impulse_count = 3 * (size_t)sadmm_problem_contact_count(f->problem);
    double *v = sadmm_alloc(v_count + impulse_count, sizeof *v), *impulses = v ? v + v_count : NULL;
    if (!v) return fail(error, "frozen step", "out of memory");
    bool ok = solve_frozen(f, settings, backend, precision, v, impulses) == SADMM_OK;
    if (ok) {
        double dv = largest_difference(v, wanted->v, v_count, 0),
               di = largest_difference(impulses, wanted->impulses, impulse_count, 0);
        *velocity = larger(*velocity, wanted->v_scale > 0 ? dv / wanted->v_scale : dv);
        *impulse = larger(*impulse, wanted->impulse_scale > 0 ? di / wanted->impulse_scale : di);
    } else {
        fail(error, "frozen step", sadmm_problem_message(f->problem));
    }
    sadmm_free(v);
    return ok;
}

bool check_table(const struct check_reference *r, sadmm_backend backend, sadmm_precision precision,
                 struct check_difference *difference, struct sadmm_error *error)
{
    memset(difference, 0, sizeof *difference);
    struct comparison c = {r, sadmm_alloc(r->bodies, STATE * sizeof(double)), difference};
    if (!c.states) return fail(error, "states", "out of memory");
    bool ok = run_scene(r->scene, backend, precision, r->steps, compare_step, &c, error);
    sadmm_free(c.states);
    const sadmm_settings *settings = &r->scene->def.settings, one = once(settings);
    struct check_difference *d = difference;
    for (size_t k = 0; ok && k < r->frozen_count && !interrupted(); ++k) {
        const struct check_frozen *f = &r->frozen[k];
        ok = compare_frozen(f, &f->whole, settings, backend, precision, &d->step_velocity, &d->step_impulse, error) &&
             compare_frozen(f, &f->once, &one, backend, precision, &d->kernel_velocity, &d->kernel_impulse, error);
    }
    return ok;
}

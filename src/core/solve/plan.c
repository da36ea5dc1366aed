#include "plan.h"

#include <math.h>

#include "core/base/parallel.h"
#include "core/math/rigid.h"

/* An iteration of this many contacts takes some 3 us: about what two barriers cost. */
enum { POINTS_PER_THREAD = 1500 };

int sadmm_plan_threads(const struct sadmm_team *team, int wanted, size_t points)
{
    return sadmm_team_threads(team, wanted, points / POINTS_PER_THREAD + 1);
}

/* Fewer are done before other threads have come. */
enum { PASS_ITEMS = 1000 };

int sadmm_pass_threads(int threads, size_t count)
{
    return count < PASS_ITEMS && !sadmm_test_forces_threads() ? 1 : threads;
}

static bool any_nonzero(const double *x, int count)
{
    for (int k = 0; k < count; ++k)
        if (x[k] != 0) return true;
    return false;
}

static bool pair_is_warm(const struct sadmm_contact_set *contacts, const struct sadmm_contact_pair *pair)
{
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
        if (any_nonzero(contacts->points[k].impulse, 3)) return true;
    return false;
}

static bool any_pair_is_rough(const struct sadmm_contact_set *contacts)
{
    for (size_t p = 0; p < contacts->pair_count; ++p)
        if (contacts->pairs[p].friction > 0) return true;
    return false;
}

static bool constraint_is_warm(const struct sadmm_rows *rows, const struct sadmm_row_constraint *constraint)
{
    return any_nonzero(rows->lambda + constraint->first, constraint->count);
}

struct warm_count {
    const struct sadmm_contact_set *contacts;
    size_t warm[SADMM_MOST_THREADS]; /* by each member */
};

static void count_warm(void *argument, int thread, int threads)
{
    struct warm_count *count = (struct warm_count *)argument;
    size_t begin, end, warm = 0;
    sadmm_share(count->contacts->pair_count, thread, threads, &begin, &end);
    for (size_t p = begin; p < end; ++p) warm += pair_is_warm(count->contacts, &count->contacts->pairs[p]);
    count->warm[thread] = warm;
}

/* Constraints, and those that start with an impulse. Contacts count by pairs: the points of a pair that are a little
 * apart (the far edge of a leaning card) carry nothing, and do not make a settled scene a cold one. */
static void count_constraints(const struct sadmm_system *system, int plan_threads, size_t *total, size_t *warm)
{
    struct warm_count count;
    *total = system->contacts->pair_count + sadmm_row_constraint_count(system);
    *warm = 0;
    count.contacts = system->contacts;
    const int ran = sadmm_parallel(system->team, sadmm_pass_threads(plan_threads, system->contacts->pair_count),
                                   count_warm, &count);
    for (int t = 0; t < ran; ++t) *warm += count.warm[t];
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k)
        *warm += constraint_is_warm(system->rows, &system->rows->constraints[k]);
}

bool sadmm_plan_is_gyroscopic(const struct sadmm_rigid *rigid, int32_t count)
{
    for (int32_t i = 0; i < count; ++i)
        if (!rigid_is_isotropic(v3_load(rigid[i].inertia))) return true;
    return false;
}

bool sadmm_plan_is_uneven(const struct sadmm_rigid *rigid, int32_t count)
{
    double lightest = INFINITY, heaviest = 0;
    for (int32_t i = 0; i < count; ++i) {
        lightest = fmin(lightest, rigid[i].mass);
        heaviest = fmax(heaviest, rigid[i].mass);
    }
    return weight_is_uneven(lightest, heaviest);
}

static bool may_update_penalty(const struct sadmm_settings *settings)
{
    return settings->method == SADMM_METHOD_PAPER && settings->penalty_period > 0 &&
           settings->penalty_ratio_limit > 1 && settings->iterations > settings->penalty_period;
}

bool sadmm_plan_is_constrained(const struct sadmm_plan *plan) { return plan->points > 0 || plan->row_constraints > 0; }

bool sadmm_plan_depends_on_warmth(const struct sadmm_settings *settings)
{
    return settings->warm_start && may_update_penalty(settings) && !settings->penalty_update_warm;
}

void sadmm_plan_complete(struct sadmm_plan *plan, const struct sadmm_settings *settings, bool mostly_warm, bool cold)
{
    bool constrained = sadmm_plan_is_constrained(plan);
    plan->warm_start = settings->warm_start;
    plan->warm = plan->warm_start && mostly_warm;
    plan->penalty_updates =
        constrained && may_update_penalty(settings) && (settings->penalty_update_warm || !plan->warm);
    bool fast = constrained && settings->method == SADMM_METHOD_FAST;
    plan->weight_updates = fast && cold;
    plan->momentum = plan->rigid && plan->points > 0;
    plan->energy_limit = fast && plan->momentum;
    plan->certificate = settings->certify;
    plan->residuals = constrained && (plan->penalty_updates || settings->measure_residuals ||
                                      settings->residual_tolerance > 0 || settings->tolerance > 0);
    plan->wrenches = settings->recover_wrenches;
}

struct sadmm_plan sadmm_plan_make(const struct sadmm_system *system, const struct sadmm_settings *settings)
{
    struct sadmm_plan plan = {0};
    plan.bodies = system->body_count;
    plan.pairs = (int32_t)system->contacts->pair_count;
    plan.points = (int32_t)system->contacts->point_count;
    plan.contact_rows = plan_contact_rows(plan.points, any_pair_is_rough(system->contacts));
    plan.row_constraints = (int32_t)sadmm_row_constraint_count(system);
    plan.rigid = system->rigid != NULL;
    plan.threads =
        sadmm_plan_threads(system->team, settings->threads, (size_t)plan.points + 4 * (size_t)plan.row_constraints);
    plan.gyroscopic = plan.rigid && sadmm_plan_is_gyroscopic(system->rigid, system->body_count);
    size_t constraints = 0, warm = 0;
    if (settings->warm_start) count_constraints(system, plan.threads, &constraints, &warm);
    const bool some_cold = !settings->warm_start || warm < constraints;
    sadmm_plan_complete(&plan, settings, plan_mostly_warm((int64_t)constraints, (int64_t)warm),
                        some_cold && plan_updates_weights(settings, plan.rigid, system->first, system->uneven));
    plan.initialise = settings->method == SADMM_METHOD_FAST && plan.points > 0 && system->first && warm == 0;
    if (plan.initialise) plan.warm_start = true; /* initialised impulses are the system's start values then */
    return plan;
}

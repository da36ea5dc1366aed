#include "plan.h"

#ifdef _OPENMP
#include <omp.h>
#endif

#include "math/rigid.h"

/* An iteration of this many contacts takes some 3 us: about what two barriers cost. */
enum { POINTS_PER_THREAD = 1500 };

int sadmm_plan_threads(int wanted, size_t points)
{
#ifdef _OPENMP
    if (wanted > 0) return wanted;
    size_t busy = points / POINTS_PER_THREAD + 1, all = (size_t)omp_get_max_threads();
    return (int)(busy < all ? busy : all);
#else
    (void)wanted;
    (void)points;
    return 1;
#endif
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

/* Does at least half of the constraints start with an impulse? Contacts count by pairs: the points of a pair that are
 * a little apart (the far edge of a leaning card) carry nothing, and do not make a settled scene a cold one. */
static bool starts_warm(const struct sadmm_system *system)
{
    size_t total = system->contacts->pair_count + (size_t)system->block_count, warm = 0;
    for (size_t p = 0; p < system->contacts->pair_count; ++p)
        warm += pair_is_warm(system->contacts, &system->contacts->pairs[p]);
    for (size_t k = 0; k < (size_t)system->block_count; ++k) warm += any_nonzero(system->block_lambda + 6 * k, 6);
    return total > 0 && 2 * warm >= total;
}

struct sadmm_plan sadmm_plan_make(const struct sadmm_system *system, const struct sadmm_settings *settings)
{
    struct sadmm_plan plan = {0};
    plan.bodies = system->body_count;
    plan.pairs = (int32_t)system->contacts->pair_count;
    plan.points = (int32_t)system->contacts->point_count;
    if (plan.points > 0) {
        plan.contact_rows = 1;
        for (size_t p = 0; p < system->contacts->pair_count && plan.contact_rows == 1; ++p)
            if (system->contacts->pairs[p].friction > 0) plan.contact_rows = 3;
    }
    for (int32_t k = 0; k < system->block_count; ++k) ++plan.blocks[system->blocks[k].kind];
    plan.rigid = system->rigid != NULL;
    for (int32_t i = 0; plan.rigid && !plan.gyroscopic && i < system->body_count; ++i) {
        const double *inertia = system->rigid[i].inertia;
        plan.gyroscopic = !rigid_is_isotropic(v3_load(inertia));
    }
    bool constrained = plan.points > 0 || system->block_count > 0;
    plan.warm_start = settings->warm_start;
    plan.warm = plan.warm_start && starts_warm(system);
    plan.weight_refresh = constrained && settings->method == SADMM_METHOD_FAST && !plan.warm;
    plan.limit = constrained && settings->method == SADMM_METHOD_FAST && plan.rigid && system->block_count == 0;
    plan.penalty_updates = constrained && settings->method == SADMM_METHOD_PAPER && settings->penalty_period > 0 && settings->penalty_ratio_limit > 1 &&
                           settings->iterations > settings->penalty_period &&
                           (settings->penalty_update_warm || !plan.warm);
    plan.certificate = settings->certify || settings->certificate_tolerance > 0;
    plan.residuals = constrained && (plan.penalty_updates || settings->measure_residuals ||
                                     settings->residual_tolerance > 0);
    plan.wrenches = settings->recover_wrenches;
    plan.threads = sadmm_plan_threads(settings->threads, (size_t)plan.points + 4 * (size_t)system->block_count);
    return plan;
}

#include "stages.h"

#include <limits.h>

#include "core/math/weight.h"

struct sadmm_stages sadmm_stages_of(const struct sadmm_plan *plan, const struct sadmm_settings *settings, bool world)
{
    struct sadmm_stages stages = {.plan = plan, .settings = settings, .world = world};
    return stages;
}

int sadmm_stages_budget(const struct sadmm_plan *plan, const struct sadmm_settings *settings)
{
    return sadmm_plan_is_constrained(plan) ? settings->iterations : 1;
}

bool sadmm_stages_in_last_substep(const struct sadmm_stages *s)
{
    return !s->world || s->substep + 1 >= s->settings->substeps;
}

/* Iterations until the next multiple of `period` after `done`, at most `limit`. */
static int until(int done, int period, int limit)
{
    int left = period - done % period;
    return left < limit ? left : limit;
}

/* The first update of the weights after `done` iterations, or WEIGHT_NO_UPDATE. */
static int next_weight_update(int done)
{
    int at = WEIGHT_FIRST_UPDATE;
    while (at <= done) at = weight_next_update(at);
    return at;
}

/* The batch of iterations that begins now, and what comes after it. Returns its iterations. */
static int begin_batch(struct sadmm_stages *s)
{
    const struct sadmm_plan *plan = s->plan;
    const struct sadmm_settings *settings = s->settings;
    const bool has_stop_rule =
        sadmm_plan_is_constrained(plan) && (settings->residual_tolerance > 0 || settings->tolerance > 0);
    const int budget = sadmm_stages_budget(plan, settings), done = s->batch.done;
    const int update = plan->weight_updates ? next_weight_update(done) : INT_MAX;
    int count = budget - done;
    if (plan->penalty_updates) count = until(done, settings->penalty_period, count);
    if (update - done < count) count = update - done;
    if (has_stop_rule) count = until(done, settings->check_period, count);
    const int after = done + count;
    s->batch.done = after;
    s->batch.last = after == budget;
    s->batch.check = has_stop_rule && (s->batch.last || after % settings->check_period == 0);
    s->batch.weights = !s->batch.last && after == update;
    s->batch.balance = plan->penalty_updates && !s->batch.last && after % settings->penalty_period == 0;
    /* Asked for, they are those of the last iteration, and any check may end the iterations. */
    const bool may_end = s->batch.last || s->batch.check;
    s->batch.goes_on = s->batch.weights && !s->batch.check && !s->batch.balance;
    s->batch.measure =
        plan->residuals && (s->batch.balance || (may_end && settings->measure_residuals) || s->batch.check);
    return count;
}

/* May an island have a dense contact solve? Those without joints do for the tolerance. */
static bool takes_islands(const struct sadmm_stages *s)
{
    return s->world && s->settings->ncp_points > 0 &&
           (s->plan->row_constraints > 0 || (s->plan->points > 0 && s->settings->tolerance > 0));
}

static bool is_needed(const struct sadmm_stages *s, enum sadmm_stage_kind kind)
{
    const struct sadmm_plan *plan = s->plan;
    switch (kind) {
    case SADMM_STAGE_GATHER:
    case SADMM_STAGE_HITS:
    case SADMM_STAGE_FIND:
    case SADMM_STAGE_JOINT_ROWS:
    case SADMM_STAGE_PLAN:
    case SADMM_STAGE_INTEGRATE:
    case SADMM_STAGE_KINEMATIC:
    case SADMM_STAGE_KEEP:
    case SADMM_STAGE_COMMIT: return s->world;
    case SADMM_STAGE_PUSH_CHOICE:
    case SADMM_STAGE_PUSH_SOLVE:
    case SADMM_STAGE_PUSH_MOTION: return s->world && plan->points > 0;
    case SADMM_STAGE_BLOCK_SOLVE: return s->world && plan->row_constraints > 0 && plan->warm_start;
    case SADMM_STAGE_NCP_SOLVE: return takes_islands(s) && plan->warm_start;
    case SADMM_STAGE_BLOCK_SOLVE_AGAIN: return s->world && plan->row_constraints > 0 && !s->solved;
    case SADMM_STAGE_NCP_SOLVE_AGAIN: return takes_islands(s) && !s->solved;
    case SADMM_STAGE_REACTIONS:
    case SADMM_STAGE_JOINT_MOTION: return s->world && plan->row_constraints > 0;
    case SADMM_STAGE_TURN: return !sadmm_stages_in_last_substep(s);
    case SADMM_STAGE_WRENCHES: return s->world && plan->wrenches;
    case SADMM_STAGE_CERTIFY: return s->world && plan->certificate;
    case SADMM_STAGE_INITIALISE: return plan->initialise;
    case SADMM_STAGE_CONTACTS: return plan->points > 0;
    case SADMM_STAGE_ROWS: return plan->row_constraints > 0;
    case SADMM_STAGE_RESIDUALS: return s->batch.measure;
    case SADMM_STAGE_CHECK: return s->batch.check;
    case SADMM_STAGE_WEIGHTS: return s->batch.weights && !s->stopped;
    case SADMM_STAGE_BALANCE: return s->batch.balance && !s->stopped;
    case SADMM_STAGE_ENERGY_LIMIT: return plan->momentum;
    default: return true;
    }
}

enum sadmm_phase sadmm_stage_phase(enum sadmm_stage_kind kind)
{
    if (kind <= SADMM_STAGE_FIND || kind == SADMM_STAGE_TURN) return SADMM_PHASE_COLLIDE;
    if (kind == SADMM_STAGE_BLOCK_SOLVE || kind == SADMM_STAGE_NCP_SOLVE) return SADMM_PHASE_SOLVE;
    if (kind <= SADMM_STAGE_PUSH_CHOICE || kind == SADMM_STAGE_COMMIT) return SADMM_PHASE_OTHER;
    if (kind <= SADMM_STAGE_PENALTY) return SADMM_PHASE_ASSEMBLE;
    if (kind <= SADMM_STAGE_PUSH_SOLVE) return SADMM_PHASE_SOLVE;
    return kind == SADMM_STAGE_CERTIFY ? SADMM_PHASE_CERTIFY : SADMM_PHASE_FINISH;
}

static void begin_substep(struct sadmm_stages *s)
{
    const struct sadmm_stages begun = sadmm_stages_of(s->plan, s->settings, s->world);
    const int substep = s->substep + 1;
    *s = begun;
    s->substep = substep;
    s->next = SADMM_STAGE_HITS;
}

bool sadmm_stages_next(struct sadmm_stages *s, struct sadmm_stage *stage)
{
    while (s->next < SADMM_STAGE_COUNT) {
        if (s->solved && s->next > SADMM_STAGE_NCP_SOLVE && s->next < SADMM_STAGE_INTEGRATE)
            s->next = SADMM_STAGE_INTEGRATE;
        const enum sadmm_stage_kind kind = (enum sadmm_stage_kind)s->next++;
        const int count = kind == SADMM_STAGE_ITERATE ? begin_batch(s) : 0;
        if (kind == SADMM_STAGE_BALANCE && !s->batch.last && !s->stopped) s->next = SADMM_STAGE_ITERATE;
        if (!is_needed(s, kind)) continue;
        if (kind == SADMM_STAGE_TURN) begin_substep(s);
        stage->kind = kind;
        stage->count = count;
        stage->measure = s->batch.measure;
        stage->done = s->batch.done;
        stage->goes_on = s->batch.goes_on;
        stage->last = s->batch.last;
        stage->checked = s->batch.check;
        return true;
    }
    return false;
}

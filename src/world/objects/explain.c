/* --explain: what the last step ran, what it left out, and why. */
#include <stdarg.h>
#include <stdio.h>

#include "world/resident/resident.h"

struct text {
    char *out;
    size_t size, length;
};

__attribute__((format(printf, 2, 3))) static void line(struct text *text, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *at = text->length < text->size ? text->out + text->length : NULL;
    int written = vsnprintf(at, at ? text->size - text->length : 0, format, arguments);
    va_end(arguments);
    if (written > 0) text->length += (size_t)written;
}

static void explain_constraints(struct text *t, const struct sadmm_plan *plan, int32_t joints,
                                int32_t couplings)
{
    if (plan->contact_rows == 3)
        line(t, "contacts     %d points in %d pairs, 3 rows each (friction)\n", plan->points, plan->pairs);
    else if (plan->contact_rows == 1)
        line(t, "contacts     %d points in %d pairs, 1 row each (every friction coefficient is 0)\n", plan->points,
             plan->pairs);
    else
        line(t, "contacts     left out: nothing touches\n");
    if (plan->row_constraints)
        line(t, "rows         %d constraints of %d joints and %d couplings%s\n", plan->row_constraints, joints,
             couplings, plan->rows_apart ? ", apart: nothing touches their bodies" : "");
    else line(t, "rows         left out: there are none\n");
}

static void explain_kinematic(struct text *t, int32_t count)
{
    if (count > 0) line(t, "kinematic    %d bodies\n", count);
}

static void explain_decisions(struct text *t, const sadmm_world *world)
{
    if (world->moving_surfaces > 0) line(t, "surfaces     %d move\n", world->moving_surfaces);
    if (world->decider.call) line(t, "manifolds    go through a callback\n");
}

static void explain_options(struct text *t, const struct sadmm_plan *plan, const sadmm_settings *s)
{
    line(t, plan->gyroscopic
                ? "gyroscopic   midpoint rule on either side of impulses, for bodies of unequal principal moments\n"
                : "gyroscopic   left out: every body has equal principal moments\n");
    line(t, plan->initialise   ? "start        impulses initialised where possible, else cold: no step came before\n"
            : plan->warm_start ? "start        warm: impulses and velocities of the last step\n"
                               : "start        cold: impulses 0, velocities A^-1 b (asked for)\n");
    if (s->method == SADMM_METHOD_FAST)
        line(t, "weights      by load, relaxation %g; %s\n", s->relaxation,
             plan->weight_updates              ? "recomputed during the step in islands that start cold"
             : sadmm_plan_is_constrained(plan) ? "kept during the step"
                                               : "kept: no constraints");
    else if (plan->penalty_updates)
        line(t, "penalty      eq. (13) with M = %g, c = %g kg/s^2; updated (15) every %d iterations\n",
             s->penalty_mass_factor, s->penalty_offset, s->penalty_period);
    else
        line(t, "penalty      eq. (13) with M = %g, c = %g kg/s^2; updates left out: %s\n", s->penalty_mass_factor,
             s->penalty_offset,
             s->penalty_period <= 0             ? "asked for"
             : s->penalty_ratio_limit <= 1      ? "alpha is 1"
             : s->iterations <= s->penalty_period ? "fewer iterations than their period"
             : plan->warm                         ? "the step starts warm"
                                                  : "no constraints");
    line(t,
         plan->residuals ? "residuals    measured when needed (16), (17)\n" : "residuals    left out: nobody asks\n");
    line(t, plan->wrenches ? "wrenches     recovered (12)\n" : "wrenches     left out: not asked for\n");
    line(t, plan->certificate ? "certificate  computed\n" : "certificate  left out: not asked for\n");
}

size_t sadmm_world_explain(sadmm_world *world, char *out, size_t size)
{
    struct text t = {out, out ? size : 0, 0};
    if (out && size > 0) out[0] = 0;
    if (!world) return 0;
    const struct sadmm_plan *plan = &world->plan;
    const sadmm_settings settings = sadmm_settings_of_substep(&world->step_settings);
    line(&t, "backend      %s\n", world->why[0] ? world->why : "chosen at the first step");
    sadmm_world_synchronise_quietly(world);
    if (!world->stepped) return t.length;
    line(&t, "precision    %s, %d thread%s\n", sadmm_precision_names[world->report.precision],
         world->report.threads, world->report.threads == 1 ? "" : "s");
    if (world->resident.loaded)
        line(&t, "world        kept by the backend: contacts are found there, the host reads on demand\n");
    else line(&t, "broad phase  %s\n", sadmm_collision_broad_phase_name());
    line(&t, "bodies       %d dynamic (static ones take no part in the solve)\n", plan->bodies);
    if (settings.substeps > 1)
        line(&t, "sub-steps    %d of %g s with up to %d iterations each; what follows is the last one's\n",
             settings.substeps, settings.dt, settings.iterations);
    explain_constraints(&t, plan, world->report.joints, world->report.couplings);
    explain_kinematic(&t, world->kinematic_count);
    explain_decisions(&t, world);
    explain_options(&t, plan, &settings);
    line(&t, "iterations   %d of at most %d%s\n", world->report.iterations, settings.iterations * settings.substeps,
         world->report.iterations == settings.substeps && !plan->points ? ": without constraints Step 1 is exact" : "");
    if (world->report.converged || world->report.iterations_mean != world->report.iterations)
        line(&t, "stopped      by the stop rule%s, after %.1f iterations in the mean of islands\n",
             world->report.converged ? "" : " in part", world->report.iterations_mean);
    if (world->report.unsolved > 0)
        line(&t, "unsolved     %lld islands miss the tolerance of %g m/s\n", (long long)world->report.unsolved,
             settings.tolerance);
    if (world->report.error >= 0)
        line(&t, "error        %.3g m/s (%s)\n", world->report.error, sadmm_step_error_names[world->report.error_kind]);
    if (world->report.repeated)
        line(
            &t,
            "repeated     %lld steps so far outgrew the capacities or the plan they were begun with; nothing is lost\n",
            (long long)world->report.repeated);
    if (world->report.limited)
        line(&t, "limited      %d islands had more energy than contacts can leave them with: too few iterations\n",
             world->report.limited);
    return t.length;
}

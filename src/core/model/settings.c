#include "settings.h"

#include <math.h>
#include <string.h>

sadmm_settings sadmm_settings_default(void)
{
    sadmm_settings s = {
        .dt = 0.005,
        .substeps = 1,
        .gravity = {0, 0, -9.81},
        .method = SADMM_METHOD_FAST,
        .iterations = 20,
        .relaxation = 1.8,
        .penalty_period = 30,
        .penalty_mass_factor = 16,
        .penalty_offset = 1e5,
        .penalty_ratio_limit = 4,
        .warm_start = true,
        .residual_tolerance = 0,
        .certificate_tolerance = 0,
        .certificate_momentum_tolerance = 1e-6,
        .check_period = 10,
        .measure_residuals = false,
        .certify = false,
        .recover_wrenches = true,
        .baumgarte = 0.2,
        .slop = 1e-5,
        .correction_speed = 1,
        .restitution_threshold = 0.1,
        .hits = 16,
        .threads = 0,
    };
    return s;
}

/* Comparisons are written so that NaN fails them. */
static bool in_range(double x, double lo, double hi) { return x >= lo && x <= hi; }

sadmm_status sadmm_settings_validate(const struct sadmm_settings *s, struct sadmm_error *error)
{
    if (!s)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "settings = NULL: must be given (sadmm_settings_default())");

    const struct {
        const char *name;
        double value, lo, hi;
    } reals[] = {
        {"dt", s->dt, 1e-6, 1},
        {"penalty_mass_factor", s->penalty_mass_factor, 0, 1e12},
        {"penalty_offset", s->penalty_offset, 0, 1e15},
        {"penalty_ratio_limit", s->penalty_ratio_limit, 1, 1e6},
        {"baumgarte", s->baumgarte, 0, 1},
        {"slop", s->slop, 0, 1},
        {"correction_speed", s->correction_speed, 0, 1e3},
    };
    const struct {
        const char *name;
        int value, lo, hi;
    } integers[] = {
        {"substeps", s->substeps, 1, SADMM_MOST_SUBSTEPS},
        {"iterations", s->iterations, 1, 1000000},
        {"direct_points", s->direct_points, 0, SADMM_MOST_DIRECT_POINTS},
        {"check_period", s->check_period, 1, 1000000},
        {"hits", s->hits, 0, SADMM_MOST_HITS},
        {"threads", s->threads, 0, 1024},
    };
    const struct {
        const char *name;
        double value;
    } nonnegative[] = {
        {"residual_tolerance", s->residual_tolerance},
        {"certificate_tolerance", s->certificate_tolerance},
        {"restitution_threshold", s->restitution_threshold},
    };

    for (size_t i = 0; i < sizeof reals / sizeof *reals; ++i)
        if (!in_range(reals[i].value, reals[i].lo, reals[i].hi))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.%s = %g: must be in [%g, %g]",
                              reals[i].name, reals[i].value, reals[i].lo, reals[i].hi);
    for (size_t i = 0; i < sizeof integers / sizeof *integers; ++i)
        if (integers[i].value < integers[i].lo || integers[i].value > integers[i].hi)
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.%s = %d: must be in [%d, %d]",
                              integers[i].name, integers[i].value, integers[i].lo, integers[i].hi);
    for (size_t i = 0; i < sizeof nonnegative / sizeof *nonnegative; ++i)
        if (!(nonnegative[i].value >= 0) || isinf(nonnegative[i].value))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.%s = %g: must be finite and >= 0",
                              nonnegative[i].name, nonnegative[i].value);

    if (s->dt < 1e-6 * s->substeps)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "settings.dt / settings.substeps = %g / %d: must be >= 1e-06", s->dt, s->substeps);
    if ((int)s->method < 0 || s->method >= SADMM_METHOD_COUNT)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.method = %d: must be in [0, %d]",
                          (int)s->method, SADMM_METHOD_COUNT - 1);
    if (!(s->relaxation >= 1 && s->relaxation < 2))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.relaxation = %g: must be in [1, 2)",
                          s->relaxation);
    if (s->penalty_period < 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.penalty_period = %d: must be >= 0 (0: never)",
                          s->penalty_period);
    if (!(s->penalty_mass_factor > 0) && !(s->penalty_offset > 0))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "settings.penalty_mass_factor = 0 and settings.penalty_offset = 0: one must be > 0");
    if (!(s->certificate_momentum_tolerance > 0) || isinf(s->certificate_momentum_tolerance))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "settings.certificate_momentum_tolerance = %g: must be finite and > 0",
                          s->certificate_momentum_tolerance);

    const double *g = s->gravity;
    for (int i = 0; i < 3; ++i)
        if (!isfinite(g[i]))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.gravity[%d] = %g: must be finite", i,
                              g[i]);
    double norm = hypot(hypot(g[0], g[1]), g[2]);
    if (!(norm <= 1e6))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.gravity: norm = %g: must be <= 1e6 m/s^2",
                          norm);
    return SADMM_OK;
}

sadmm_settings sadmm_settings_of_substep(const sadmm_settings *whole)
{
    sadmm_settings s = *whole;
    if (s.substeps <= 1) return s; /* 0: of no step yet */
    s.dt = whole->dt / whole->substeps;
    s.iterations = whole->iterations / whole->substeps + (whole->iterations % whole->substeps > 0);
    return s;
}

/* ---- equality ------------------------------------------------------------------------------------------------- */

/* Every member, and which of them are arrays of three. */
#define MEMBERS(ONE, THREE)                                                                                      \
    ONE(dt) ONE(substeps) THREE(gravity)                                                                         \
    ONE(method) ONE(iterations) ONE(relaxation) ONE(penalty_period) ONE(penalty_mass_factor) ONE(penalty_offset) \
    ONE(penalty_ratio_limit) ONE(penalty_update_warm) ONE(warm_start) ONE(direct_points)                         \
    ONE(residual_tolerance) ONE(certificate_tolerance) ONE(certificate_momentum_tolerance) ONE(check_period)     \
    ONE(measure_residuals) ONE(certify) ONE(recover_wrenches)                                                    \
    ONE(baumgarte) ONE(slop) ONE(correction_speed) ONE(restitution_threshold)                                    \
    ONE(hits) ONE(threads)

/* A struct with too few initialisers is an error here: no new member can be left out of the list. */
#pragma GCC diagnostic push
#pragma GCC diagnostic error "-Wmissing-field-initializers"
#define ZERO(member) 0,
#define ZEROS(member) {0, 0, 0},
_Static_assert(sizeof((sadmm_settings){MEMBERS(ZERO, ZEROS)}) == sizeof(sadmm_settings), "every member is listed");
#pragma GCC diagnostic pop

bool sadmm_settings_equal(const struct sadmm_settings *a, const struct sadmm_settings *b)
{
#define SAME(member) && memcmp(&a->member, &b->member, sizeof a->member) == 0
    return true MEMBERS(SAME, SAME);
#undef SAME
}

/* ---- numbers, and the rest ------------------------------------------------------------------------------------- */

void sadmm_settings_numbers(const sadmm_settings *s, double numbers[SADMM_SETTING_NUMBERS])
{
    int k = 0;
#define TAKE(name) numbers[k++] = s->name;
    SADMM_EACH_SETTING_NUMBER(TAKE)
#undef TAKE
}

/* A setting that nobody named a number belongs to it. `threads` are a host's. */
static sadmm_settings without_numbers(const sadmm_settings *s)
{
    sadmm_settings rest = *s;
#define DROP(name) rest.name = 0;
    SADMM_EACH_SETTING_NUMBER(DROP)
#undef DROP
    rest.penalty_ratio_limit = s->penalty_ratio_limit > 1;
    rest.certificate_tolerance = s->certificate_tolerance > 0;
    rest.residual_tolerance = s->residual_tolerance > 0;
    rest.threads = 0;
    return rest;
}

bool sadmm_settings_same_but_numbers(const sadmm_settings *a, const sadmm_settings *b)
{
    const sadmm_settings rest_a = without_numbers(a), rest_b = without_numbers(b);
    return sadmm_settings_equal(&rest_a, &rest_b);
}

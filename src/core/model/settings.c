#include "settings.h"

#include <math.h>
#include <string.h>

static const sadmm_settings defaults = SADMM_DEFAULT_SETTINGS;
const struct sadmm_growing sadmm_growing_settings = SADMM_GROWING(sadmm_settings, &defaults, threads);

void sadmm_settings_init(sadmm_settings *settings, size_t size)
{
    sadmm_growing_init(&sadmm_growing_settings, settings, size, 0);
}

sadmm_status sadmm_settings_take(sadmm_settings *settings, const sadmm_settings *given, struct sadmm_error *error)
{
    TRY(sadmm_growing_take(&sadmm_growing_settings, settings, given, "settings", error));
    return sadmm_settings_validate(settings, error);
}

/* ---- ranges ------------------------------------------------------------------------------------------------------ */

_Static_assert((int)SADMM_MOST_SUBSTEPS == 64 && (int)SADMM_MOST_NCP_POINTS == 128 && (int)SADMM_MOST_HITS == 64,
               "ranges are as in the list");

sadmm_status sadmm_settings_validate(const struct sadmm_settings *s, struct sadmm_error *error)
{
    TRY(sadmm_fields_check(sadmm_settings_table, SADMM_SETTING_COUNT, s, "settings.", error));
    if (s->dt < 1e-6 * s->substeps)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "settings.dt / settings.substeps = %g / %d: must be >= 1e-06", s->dt, s->substeps);
    if (!(s->penalty_mass_factor > 0) && !(s->penalty_offset > 0))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "settings.penalty_mass_factor = 0 and settings.penalty_offset = 0: one must be > 0");
    const double *g = s->gravity;
    for (int i = 0; i < 3; ++i)
        if (!isfinite(g[i]))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "settings.gravity[%d] = %g: must be finite", i,
                              g[i]);
    double norm = hypot(hypot(g[0], g[1]), g[2]);
    if (!(norm <= SADMM_GRAVITY_LIMIT))
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

bool sadmm_settings_equal(const struct sadmm_settings *a, const struct sadmm_settings *b)
{
#define SAME(X, kind, role, name, ...) &&memcmp(&a->name, &b->name, sizeof a->name) == 0
    return true SADMM_SETTINGS(SAME, );
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
    rest.tolerance = s->tolerance > 0;
    rest.residual_tolerance = s->residual_tolerance > 0;
    rest.threads = 0;
    return rest;
}

bool sadmm_settings_same_but_numbers(const sadmm_settings *a, const sadmm_settings *b)
{
    const sadmm_settings rest_a = without_numbers(a), rest_b = without_numbers(b);
    return sadmm_settings_equal(&rest_a, &rest_b);
}

/* fclib.h in a build without HDF5. */
#include "fclib.h"

#include <stddef.h>

static sadmm_status missing(struct sadmm_error *error)
{
    return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "FCLIB files need HDF5, and this library was built without it");
}

bool sadmm_fclib_available(void)
{
    return false;
}

sadmm_status sadmm_fclib_load(const char *path, sadmm_problem **out, struct sadmm_error *error)
{
    (void)path;
    if (out) *out = NULL;
    return missing(error);
}

sadmm_status sadmm_fclib_save(sadmm_problem *problem, const char *path, const char *title,
                              struct sadmm_error *error)
{
    (void)problem, (void)path, (void)title;
    return missing(error);
}

sadmm_status sadmm_fclib_save_solution(sadmm_problem *problem, const char *source, const char *path,
                                       struct sadmm_error *error)
{
    (void)problem, (void)source, (void)path;
    return missing(error);
}

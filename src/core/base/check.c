#include "check.h"

#include <math.h>

sadmm_status sadmm_check_given(const void *pointer, const char *name, struct sadmm_error *error)
{
    if (pointer) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s = NULL: must be given", name);
}

sadmm_status sadmm_check_vector(const char *name, const double *x, int count, double limit, struct sadmm_error *error)
{
    for (int k = 0; k < count; ++k)
        if (isinf(limit) && !isfinite(x[k]))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s[%d] = %g: must be finite", name, k, x[k]);
        else if (!(fabs(x[k]) <= limit))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s[%d] = %g: must be in [-%g, %g]", name, k, x[k],
                              limit, limit);
    return SADMM_OK;
}

sadmm_status sadmm_check_range(const char *name, double x, double low, double high, struct sadmm_error *error)
{
    if (!(x >= low && x <= high))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %g: must be in [%g, %g]", name, x, low, high);
    return SADMM_OK;
}

sadmm_status sadmm_check_orientation(const char *name, const double q[4], double out[4], struct sadmm_error *error)
{
    double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(fabs(norm - 1) <= 1e-6))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%s = (%g, %g, %g, %g) of norm %g: must be a unit quaternion within 1e-6", name, q[0], q[1],
                          q[2], q[3], norm);
    for (int k = 0; k < 4; ++k) out[k] = q[k] / norm;
    return SADMM_OK;
}

bool sadmm_all_finite(const double *x, size_t count)
{
    for (size_t k = 0; k < count; ++k)
        if (!isfinite(x[k])) return false;
    return true;
}

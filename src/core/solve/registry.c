#include "registry.h"

#include <stdio.h>

#include "backends.h"
#include "config.h"
#include "core/base/check.h"
#include "core/base/growing.h"
#include "core/base/names.h"

#define FINDER(value, find) [value] = find,
static const struct sadmm_kernels *(*const finders[SADMM_BACKEND_COUNT])(sadmm_precision precision,
                                                                         const char **reason) = {
    SADMM_BACKEND_FINDERS(FINDER)};

const struct sadmm_kernels *sadmm_kernels_find(sadmm_backend backend, sadmm_precision precision, const char **reason)
{
    const char *unused;
    if ((unsigned)backend >= SADMM_BACKEND_COUNT || !finders[backend] || (unsigned)precision > SADMM_F64) {
        if (reason) *reason = "no such backend or precision";
        return NULL;
    }
    return finders[backend](precision, reason ? reason : &unused);
}

const struct sadmm_kernels *sadmm_kernels_at(size_t index)
{
    for (int backend = SADMM_BACKEND_REF; backend < SADMM_BACKEND_COUNT; ++backend)
        for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
            const struct sadmm_kernels *found =
                sadmm_kernels_find((sadmm_backend)backend, (sadmm_precision)precision, NULL);
            if (found && index-- == 0) return found;
        }
    return NULL;
}

sadmm_status sadmm_backend_query_sized(sadmm_backend backend, sadmm_backend_info *out, size_t size)
{
    sadmm_backend_info info = {.backend = backend};
    TRY(sadmm_check_given(out, "info", NULL));
    if (backend < SADMM_BACKEND_REF || backend >= SADMM_BACKEND_COUNT)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "backend = %d: must be in [%d, %d]", (int)backend,
                          SADMM_BACKEND_REF, SADMM_BACKEND_COUNT - 1);
    info.name = sadmm_backend_names[backend];
    /* An unavailable precision explains itself; else the f32 line says what it runs on. */
    const char *reasons[2] = {"", ""};
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision)
        info.available[precision] =
            sadmm_kernels_find(backend, (sadmm_precision)precision, &reasons[precision]) != NULL;
    info.reason = reasons[info.available[SADMM_F32] ? SADMM_F64 : SADMM_F32];
    return sadmm_give_bytes(out, size, &info, sizeof info, SADMM_SIZE_TO(sadmm_backend_info, reason), "info", NULL);
}

/* From this many contacts on a step on the GPU is the shorter one. */
enum { AUTO_CUDA_CONTACTS = 500 };

sadmm_status sadmm_backend_choose(sadmm_backend wanted, sadmm_precision precision, int64_t expected_contacts,
                                  const struct sadmm_kernels **out, char *why, size_t why_size,
                                  struct sadmm_error *error)
{
    const char *reason = "";
    if ((unsigned)precision > SADMM_F64)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "precision = %d: must be SADMM_F32 (0) or SADMM_F64 (1)",
                          (int)precision);
    if ((unsigned)wanted >= SADMM_BACKEND_COUNT)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "backend = %d: must be in [0, %d]", (int)wanted,
                          SADMM_BACKEND_COUNT - 1);
    if (wanted != SADMM_BACKEND_AUTO) {
        *out = sadmm_kernels_find(wanted, precision, &reason);
        if (!*out)
            return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "backend %s in %s is not available: %s",
                              sadmm_backend_names[wanted], sadmm_precision_names[precision], reason);
        if (why) snprintf(why, why_size, "%s (%s), as asked", sadmm_backend_names[wanted], (*out)->variant);
        return SADMM_OK;
    }
    const struct sadmm_kernels *cuda = sadmm_kernels_find(SADMM_BACKEND_CUDA, precision, &reason);
    if (cuda && expected_contacts >= AUTO_CUDA_CONTACTS) {
        *out = cuda;
        if (why) snprintf(why, why_size, "cuda: a device is present and the scene is large (%lld contacts expected)",
                          (long long)expected_contacts);
        return SADMM_OK;
    }
    *out = sadmm_kernels_find(SADMM_BACKEND_CPU, precision, NULL);
    if (!*out) return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "no backend is available");
    if (why) {
        if (cuda)
            snprintf(why, why_size, "cpu (%s): too few contacts for the GPU to pay (%lld expected, %d needed)",
                     (*out)->variant, (long long)expected_contacts, AUTO_CUDA_CONTACTS);
        else
            snprintf(why, why_size, "cpu (%s): cuda is not available (%s)", (*out)->variant, reason);
    }
    return SADMM_OK;
}

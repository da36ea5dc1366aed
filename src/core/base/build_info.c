#include "subadmm/status.h"

#include "build_info.h"
#include "config.h"

_Static_assert(SADMM_VERSION == SADMM_BUILD_VERSION_NUMBER, "subadmm/status.h has the version of the project");

int sadmm_version_number(void)
{
    return SADMM_VERSION;
}

const char *sadmm_version(void)
{
    return SADMM_BUILD_VERSION;
}

const char *sadmm_build_commit(void)
{
    return SADMM_BUILD_COMMIT;
}

const char *sadmm_build_compiler(void)
{
    return SADMM_BUILD_COMPILER;
}

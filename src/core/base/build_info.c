#include "subadmm/status.h"

#include "build_info.h"
#include "config.h"

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

/* Settings of tests of the iterations themselves, and of what is the same with any: so many a step, no tolerance, no
 * dense contact solve. */
#ifndef SADMM_TESTS_FIXED_WORK_H
#define SADMM_TESTS_FIXED_WORK_H

#include "core/base/settings_fields.h"
#include "subadmm/world.h"

static inline sadmm_settings fixed_settings(void)
{
    sadmm_settings settings = sadmm_settings_default();
    sadmm_settings_fix_work(&settings);
    return settings;
}

static inline sadmm_world_def fixed_world_def(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_settings_fix_work(&def.settings);
    return def;
}

#endif

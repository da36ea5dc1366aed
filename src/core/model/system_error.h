/* e of a contact as a system's raw data gives it, but for restitution (system_math.h). In double in every precision. */
#ifndef SADMM_CORE_MODEL_SYSTEM_ERROR_H
#define SADMM_CORE_MODEL_SYSTEM_ERROR_H

#include "core/math/contact.h"
#include "system.h"

/* e of a point along the normal, m/s, of a pair without restitution. */
SADMM_INLINE double sadmm_contact_e_plain(const struct sadmm_system *system, const struct sadmm_settings *settings,
                                           const struct sadmm_contact_point *point)
{
    return system->errors_given ? point->error
                                : contact_error(point->gap, settings->dt, settings->baumgarte, settings->slop,
                                                settings->correction_speed);
}

/* Does e depend on how fast the bodies approach? */
SADMM_INLINE bool sadmm_pair_bounces(const struct sadmm_system *system, const struct sadmm_contact_pair *pair)
{
    return !system->errors_given && system->rigid && pair->restitution > 0;
}

#endif

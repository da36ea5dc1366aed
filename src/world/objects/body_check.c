#include "body_check.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/model/moments.h"

/* Of a state that is set: whatever a step can make. */
static const double ANY = HUGE_VAL;

static sadmm_status check_inertia_ratio(const char *name, const double inertia[3], sadmm_precision precision,
                                        struct sadmm_error *error)
{
    const bool single = precision == SADMM_F32;
    if (!moments_ratio_fits(inertia, single))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%s = (%g, %g, %g): the largest must be at most %g times the smallest in %s precision, "
                          "which cannot resolve more", name, inertia[0], inertia[1], inertia[2],
                          moments_most_ratio(single), single ? "single" : "double");
    return SADMM_OK;
}

sadmm_status sadmm_world_check_inertias(sadmm_world *world, sadmm_precision precision)
{
    for (SADMM_OBJECTS(slot, &world->body_ids)) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        char name[96];
        if (body->type != SADMM_BODY_DYNAMIC) continue;
        snprintf(name, sizeof name, "inertia of body (slot %zu, generation %u)", slot + 1,
                 world->body_ids.generations[slot]);
        TRY(check_inertia_ratio(name, body->rigid.inertia, precision, &world->error));
    }
    return SADMM_OK;
}

/* name: of the argument. */
static sadmm_status check_inertia(const char *name, const double inertia[3], sadmm_precision precision,
                                  struct sadmm_error *error)
{
    const struct sadmm_field *const range = SADMM_BODY_FIELD(inertia);
    for (int k = 0; k < 3; ++k)
        if (!(inertia[k] >= range->lo && inertia[k] <= range->hi))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s[%d] = %g: must be in [%g, %g] kg m^2", name, k,
                              inertia[k], range->lo, range->hi);
    for (int k = 0; k < 3; ++k) {
        const double others = inertia[(k + 1) % 3] + inertia[(k + 2) % 3];
        if (!moments_sum_fits(inertia, k))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "%s[%d] = %g: must be at most the sum of the other two, %g (no rigid body has more)",
                              name, k, inertia[k], others);
    }
    return check_inertia_ratio(name, inertia, precision, error);
}

sadmm_status sadmm_world_check_mass(const sadmm_world *world, double mass, const double inertia[3],
                                    struct sadmm_error *error)
{
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(mass), &mass, "mass", error));
    return check_inertia("inertia", inertia, world->def.precision, error);
}

static sadmm_status check_motion(const char *linear_name, const char *angular_name, const double linear[3],
                                 const double angular[3], sadmm_body_type type, struct sadmm_error *error)
{
    for (int k = 0; k < 6 && type == SADMM_BODY_STATIC; ++k) {
        double x = k < 3 ? linear[k] : angular[k - 3];
        if (!(x == 0))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s[%d] = %g: must be 0, for the body is static",
                              k < 3 ? linear_name : angular_name, k % 3, x);
    }
    TRY(sadmm_check_vector(linear_name, linear, 3, ANY, error));
    return sadmm_check_vector(angular_name, angular, 3, ANY, error);
}

sadmm_status sadmm_world_check_body_def(const sadmm_body_def *def, sadmm_precision precision, double orientation[4],
                                        struct sadmm_error *error)
{
    for (int k = 0; k < SADMM_BODY_FIELDS_COUNT; ++k)
        if (def->type == SADMM_BODY_DYNAMIC || sadmm_body_table[k].role != SADMM_IS_DYNAMIC)
            TRY(sadmm_field_check(&sadmm_body_table[k], def, "def->", error));
    if (def->type == SADMM_BODY_DYNAMIC) TRY(check_inertia("def->inertia", def->inertia, precision, error));
    TRY(sadmm_check_orientation("def->orientation", def->orientation, orientation, error));
    TRY(check_motion("def->linear_velocity", "def->angular_velocity", def->linear_velocity, def->angular_velocity,
                     def->type, error));
    if (def->type == SADMM_BODY_DYNAMIC && def->environment < 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->environment = %d: must be >= 0", def->environment);
    return SADMM_OK;
}

sadmm_status sadmm_world_check_turn(const char *name, const double given[4], double unit[4], struct sadmm_error *error)
{
    double most = 0;
    TRY(sadmm_check_orientation(name, given, unit, error));
    for (int k = 0; k < 4; ++k) most = fmax(most, fabs(unit[k] - given[k]));
    if (most <= 2 * DBL_EPSILON) memcpy(unit, given, 4 * sizeof *unit);
    return SADMM_OK;
}

sadmm_status sadmm_world_check_body_state(const struct sadmm_world_body *body, const sadmm_body_state *state,
                                          double orientation[4], struct sadmm_error *error)
{
    TRY(sadmm_check_vector("state->position", state->position, 3, ANY, error));
    TRY(sadmm_world_check_turn("state->orientation", state->orientation, orientation, error));
    return check_motion("state->linear_velocity", "state->angular_velocity", state->linear_velocity,
                        state->angular_velocity, body->type, error);
}

sadmm_status sadmm_world_check_wrench(const double force[3], const double torque[3], struct sadmm_error *error)
{
    TRY(sadmm_check_vector("force", force, 3, SADMM_WRENCH_LIMIT, error));
    return sadmm_check_vector("torque", torque, 3, SADMM_WRENCH_LIMIT, error);
}

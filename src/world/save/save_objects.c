/* What a world is made of, in a saved one: settings and bodies; shapes and joints have files of their own. */
#include "save_objects.h"

#include <string.h>

#include "core/base/check.h"
#include "core/model/rolling.h"
#include "save_joints.h"
#include "save_parts.h"
#include "save_shapes.h"
#include "world/objects/body_check.h"
#include "world/step/kinematic.h"

LISTED(struct sadmm_rigid, 320);
LISTED(struct sadmm_extrapolation, 72);

/* ---- settings and definitions ------------------------------------------------------------------------------------ */

void sadmm_archive_settings(struct sadmm_archive *archive, sadmm_settings *s)
{
    sadmm_archive_fields(archive, sadmm_settings_table, SADMM_SETTING_COUNT, s);
    if (archive->reading && archive->status == SADMM_OK)
        sadmm_archive_expect(archive, sadmm_settings_validate(s, archive->error) == SADMM_OK, "settings");
}

static void archive_def(struct sadmm_archive *archive, sadmm_world_def *def)
{
    SADMM_ARCHIVE(archive, def->backend);
    SADMM_ARCHIVE(archive, def->precision);
    SADMM_ARCHIVE(archive, def->device);
    SADMM_ARCHIVE(archive, def->contact_margin);
    sadmm_archive_settings(archive, &def->settings);
    if (archive->reading)
        sadmm_archive_expect(archive,
                             (unsigned)def->backend < SADMM_BACKEND_COUNT && (unsigned)def->precision <= SADMM_F64 &&
                                 def->device >= 0 && def->contact_margin >= 0 && def->contact_margin <= 1,
                             "the definition of a world");
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static bool body_fits(const sadmm_world *world, const struct sadmm_world_body *body, struct sadmm_error *error)
{
    const struct sadmm_rigid *rigid = &body->rigid;
    const bool dynamic = body->type == SADMM_BODY_DYNAMIC;
    sadmm_body_state state;
    double ignored[4];
    memcpy(state.position, rigid->position, sizeof state.position);
    memcpy(state.orientation, rigid->orientation, sizeof state.orientation);
    memcpy(state.linear_velocity, rigid->velocity, sizeof state.linear_velocity);
    memcpy(state.angular_velocity, rigid->velocity + 3, sizeof state.angular_velocity);
    if ((unsigned)body->type > SADMM_BODY_KINEMATIC || body->environment < (dynamic ? 0 : -1) ||
        sadmm_world_check_body_state(body, &state, ignored, error) != SADMM_OK)
        return false;
    if (dynamic && (sadmm_world_check_mass(world, rigid->mass, rigid->inertia, error) != SADMM_OK ||
                    sadmm_world_check_wrench(rigid->wrench, rigid->wrench + 3, error) != SADMM_OK ||
                    !(rigid->damping[0] >= 0 && rigid->damping[1] >= 0)))
        return false;
    if (body->target.set &&
        (!sadmm_all_finite(body->target.position, 3) ||
         sadmm_check_orientation("orientation", body->target.orientation, ignored, error) != SADMM_OK))
        return false;
    if (!sadmm_all_finite(rigid->owed, 6) || !sadmm_all_finite(rigid->stiffness, 6) ||
        (rigid->rolls & ~(ROLLING_OWES | ROLLING_IS_STIFF | ROLLING_TURNS_ON)))
        return false;
    return sadmm_all_finite(&rigid->gravity_scale, 1) && sadmm_all_finite(rigid->damping, 2) &&
           sadmm_all_finite(body->extrapolation.change, 6) && body->extrapolation.dt >= 0 &&
           sadmm_all_finite(&body->extrapolation.dt, 1) && body->extrapolation.streak[0] >= 0 &&
           body->extrapolation.streak[1] >= 0 && sadmm_all_finite(body->contact_wrench, 6);
}

static void archive_body(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_body *body = &world->bodies[slot];
    SADMM_ARCHIVE(archive, body->type);
    SADMM_ARCHIVE(archive, body->environment);
    rolling_clear(&body->rigid); /* equal worlds have equal saves */
    SADMM_ARCHIVE(archive, body->rigid);
    SADMM_ARCHIVE(archive, body->contact_wrench);
    SADMM_ARCHIVE(archive, body->extrapolation);
    sadmm_archive_flag(archive, &body->target.set);
    SADMM_ARCHIVE(archive, body->target.position);
    SADMM_ARCHIVE(archive, body->target.orientation);
    if (!archive->reading) return;
    body->system_body = -1;
    if (archive->status != SADMM_OK || !sadmm_archive_expect(archive, body_fits(world, body, archive->error), "a body"))
        return;
    world->dynamic_count += body->type == SADMM_BODY_DYNAMIC;
    if (body->type == SADMM_BODY_KINEMATIC) sadmm_world_count_kinematic(world, 1);
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

void sadmm_archive_objects(struct sadmm_archive *archive, sadmm_world *world)
{
    archive_def(archive, &world->def);
    sadmm_archive_list(archive, world, &world->body_ids, &world->bodies, sizeof *world->bodies, archive_body);
    sadmm_archive_shapes(archive, world);
    sadmm_archive_pairs(archive, &world->disabled_pairs, world->body_ids.slots);
    sadmm_archive_pairs(archive, &world->friction_pairs, world->shape_ids.slots);
    sadmm_archive_joints(archive, world);
}

/* What is between bodies, as JSON: joints, couplings, gears, what was set for pairs. */
#include "write_parts.h"

/* The number of a body; null: the static world. */
static json_t *body_number(const struct sadmm_writer *w, sadmm_body_id id)
{
    return id.slot ? json_integer(sadmm_slot_number(&w->body_slots, id.slot)) : json_null();
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* Positions and loads; null where there is none. */
static sadmm_status write_table(struct sadmm_writer *w, json_t *coordinate, sadmm_joint_id id, int32_t index)
{
    double positions[SADMM_MOST_SPRING_POINTS], forces[SADMM_MOST_SPRING_POINTS];
    int32_t count = 0;
    TRY(sadmm_pass_on(w, sadmm_world_joint_spring_table(w->world, id, index, positions, forces, &count)));
    if (count == 0) return SADMM_OK;
    json_t *table = sadmm_put(w, coordinate, "spring_table", json_object());
    sadmm_put(w, table, "positions", sadmm_json_reals(positions, (size_t)count));
    sadmm_put(w, table, "forces", sadmm_json_reals(forces, (size_t)count));
    return SADMM_OK;
}

static sadmm_status write_joint(struct sadmm_writer *w, json_t *joints, sadmm_joint_id id, const sadmm_joint_def *def)
{
    json_t *joint = sadmm_append_object(w, joints, &sadmm_joint_fields, def),
           *coordinates = sadmm_put(w, joint, "coordinates", json_array());
    sadmm_put_name(w, joint, def->name);
    sadmm_put(w, joint, "body_a", body_number(w, def->body_a));
    sadmm_put(w, joint, "body_b", body_number(w, def->body_b));
    for (int32_t k = 0; k < 6; ++k) {
        const sadmm_joint_coordinate *c = &def->coordinates[k];
        const double limits[2] = {c->lower, c->upper};
        json_t *coordinate = sadmm_append_object(w, coordinates, &sadmm_coordinate_fields, c);
        if (c->limited) sadmm_put(w, coordinate, "limits", sadmm_json_reals(limits, 2));
        TRY(write_table(w, coordinate, id, k));
    }
    return SADMM_OK;
}

static sadmm_status write_joints(struct sadmm_writer *w)
{
    json_t *joints = sadmm_put(w, w->root, "joints", json_array());
    for (int32_t k = 0; k < sadmm_world_joint_count(w->world); ++k) {
        sadmm_joint_id id;
        sadmm_joint_def def;
        TRY(sadmm_pass_on(w, sadmm_world_joint_at(w->world, k, &id)));
        TRY(sadmm_pass_on(w, sadmm_world_joint_def(w->world, id, &def)));
        TRY(write_joint(w, joints, id, &def));
    }
    return SADMM_OK;
}

/* ---- couplings and gears ----------------------------------------------------------------------------------------- */

static sadmm_status write_couplings(struct sadmm_writer *w)
{
    json_t *couplings = sadmm_put(w, w->root, "couplings", json_array());
    for (int32_t k = 0; k < sadmm_world_coupling_count(w->world); ++k) {
        sadmm_coupling_id id;
        sadmm_coupling_def def;
        TRY(sadmm_pass_on(w, sadmm_world_coupling_at(w->world, k, &id)));
        TRY(sadmm_pass_on(w, sadmm_world_coupling_def(w->world, id, &def)));
        json_t *coupling = sadmm_append_object(w, couplings, &sadmm_coupling_fields, &def);
        sadmm_put_name(w, coupling, def.name);
        sadmm_put(w, coupling, "body", body_number(w, def.body));
    }
    return SADMM_OK;
}

static sadmm_status write_gears(struct sadmm_writer *w)
{
    json_t *gears = sadmm_put(w, w->root, "gears", json_array());
    for (int32_t k = 0; k < sadmm_world_gear_count(w->world); ++k) {
        sadmm_gear_id id;
        sadmm_gear_def def;
        TRY(sadmm_pass_on(w, sadmm_world_gear_at(w->world, k, &id)));
        TRY(sadmm_pass_on(w, sadmm_world_gear_def(w->world, id, &def)));
        json_t *gear = sadmm_append_object(w, gears, &sadmm_gear_fields, &def);
        sadmm_put_name(w, gear, def.name);
        sadmm_put(w, gear, "joint_1", json_integer(sadmm_slot_number(&w->joint_slots, def.joint_1.slot)));
        sadmm_put(w, gear, "joint_2", json_integer(sadmm_slot_number(&w->joint_slots, def.joint_2.slot)));
    }
    return SADMM_OK;
}

/* ---- pairs ------------------------------------------------------------------------------------------------------- */

static sadmm_status write_frictions(struct sadmm_writer *w)
{
    json_t *pairs = sadmm_put(w, w->root, "pair_friction", json_array());
    for (int32_t k = 0; k < sadmm_world_pair_friction_count(w->world); ++k) {
        sadmm_shape_id a, b;
        struct sadmm_shape_pair pair;
        TRY(sadmm_pass_on(w, sadmm_world_pair_friction_at(w->world, k, &a, &b, &pair.friction)));
        const int32_t number_a = sadmm_slot_number(&w->shape_slots, a.slot),
                      number_b = sadmm_slot_number(&w->shape_slots, b.slot);
        pair.shape_a = (int32_t)w->shape_place[number_a];
        pair.shape_b = (int32_t)w->shape_place[number_b];
        json_t *object = sadmm_append_object(w, pairs, &sadmm_friction_fields, &pair);
        sadmm_put(w, object, "body_a", json_integer(w->shape_body[number_a]));
        sadmm_put(w, object, "body_b", json_integer(w->shape_body[number_b]));
    }
    return SADMM_OK;
}

static sadmm_status write_contact_off(struct sadmm_writer *w)
{
    json_t *pairs = sadmm_put(w, w->root, "contact_off", json_array());
    for (int32_t k = 0; k < sadmm_world_body_pair_off_count(w->world); ++k) {
        sadmm_body_id a, b;
        TRY(sadmm_pass_on(w, sadmm_world_body_pair_off_at(w->world, k, &a, &b)));
        json_t *object = sadmm_append_object(w, pairs, &sadmm_off_fields, NULL);
        sadmm_put(w, object, "body_a", body_number(w, a));
        sadmm_put(w, object, "body_b", body_number(w, b));
    }
    return SADMM_OK;
}

sadmm_status sadmm_write_parts(struct sadmm_writer *w)
{
    TRY(write_joints(w));
    TRY(write_couplings(w));
    TRY(write_gears(w));
    TRY(write_frictions(w));
    return write_contact_off(w);
}

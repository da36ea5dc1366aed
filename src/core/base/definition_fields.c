#include "definition_fields.h"

#include <math.h>

#include "settings_fields.h"

#define TABLE(of, NAME, type) \
    const struct sadmm_field sadmm_##of##_table[NAME##_FIELDS_COUNT] = {NAME##_FIELDS(SADMM_FIELD_ROW, type)};

const struct sadmm_field sadmm_settings_table[SADMM_SETTING_COUNT] = {SADMM_SETTINGS(SADMM_FIELD_ROW, sadmm_settings)};
TABLE(body, SADMM_BODY, sadmm_body_def)
TABLE(shape, SADMM_SHAPE, sadmm_shape_def)
TABLE(coordinate, SADMM_COORDINATE, sadmm_joint_coordinate)
TABLE(joint, SADMM_JOINT, sadmm_joint_def)
TABLE(coupling, SADMM_COUPLING, sadmm_coupling_def)
TABLE(gear, SADMM_GEAR, sadmm_gear_def)
TABLE(hull, SADMM_HULL, sadmm_hull_def)

SADMM_EVERY_FIELD_IS_LISTED(sadmm_settings, SADMM_SETTINGS, SADMM_ONE_SIZE)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_joint_coordinate, SADMM_COORDINATE_FIELDS, SADMM_NO_SIZE)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_body_def, SADMM_BODY_FIELDS, SADMM_ONE_SIZE)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_shape_def, SADMM_SHAPE_FIELDS, SADMM_ONE_SIZE)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_joint_def, SADMM_JOINT_FIELDS, SADMM_TWO_SIZES)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_coupling_def, SADMM_COUPLING_FIELDS, SADMM_ONE_SIZE)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_gear_def, SADMM_GEAR_FIELDS, SADMM_ONE_SIZE)
SADMM_EVERY_FIELD_IS_LISTED(sadmm_hull_def, SADMM_HULL_FIELDS, SADMM_ONE_SIZE)

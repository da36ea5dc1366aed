#include "names.h"

#define NAME(X, value, name, ...) [value] = name,
#define SIZES(X, value, name, sizes) [value] = sizes,
#define LOCKS(X, value, name, locks, free, use) [value] = locks,

const char *const sadmm_backend_names[SADMM_BACKEND_COUNT] = {SADMM_BACKENDS(NAME, )};
const char *const sadmm_precision_names[SADMM_PRECISION_COUNT] = {SADMM_PRECISIONS(NAME, )};
const char *const sadmm_step_error_names[SADMM_STEP_ERROR_COUNT] = {SADMM_STEP_ERRORS(NAME, )};
const char *const sadmm_method_names[SADMM_METHOD_COUNT] = {SADMM_METHODS(NAME, )};
const char *const sadmm_body_type_names[SADMM_BODY_TYPE_COUNT] = {SADMM_BODY_TYPES(NAME, )};
const char *const sadmm_shape_type_names[SADMM_SHAPE_TYPE_COUNT] = {SADMM_SHAPE_TYPES(NAME, )};
const char *const sadmm_joint_kind_names[SADMM_JOINT_KIND_COUNT] = {SADMM_JOINT_KINDS(NAME, )};
const char *const sadmm_drive_names[SADMM_DRIVE_COUNT] = {SADMM_DRIVES(NAME, )};
const int sadmm_shape_sizes[SADMM_SHAPE_TYPE_COUNT] = {SADMM_SHAPE_TYPES(SIZES, )};
const uint32_t sadmm_joint_locks[SADMM_JOINT_KIND_COUNT] = {SADMM_JOINT_KINDS(LOCKS, )};

/* All values have names. */
#define ONE(X, ...) +1
_Static_assert(0 SADMM_BACKENDS(ONE, ) == SADMM_BACKEND_COUNT, "every backend is listed");
_Static_assert(0 SADMM_PRECISIONS(ONE, ) == SADMM_PRECISION_COUNT, "every precision is listed");
_Static_assert(0 SADMM_STEP_ERRORS(ONE, ) == SADMM_STEP_ERROR_COUNT, "every error of a step is listed");
_Static_assert(0 SADMM_METHODS(ONE, ) == SADMM_METHOD_COUNT, "every method is listed");
_Static_assert(0 SADMM_BODY_TYPES(ONE, ) == SADMM_BODY_TYPE_COUNT, "every type of body is listed");
_Static_assert(0 SADMM_SHAPE_TYPES(ONE, ) == SADMM_SHAPE_TYPE_COUNT, "every type of shape is listed");
_Static_assert(0 SADMM_JOINT_KINDS(ONE, ) == SADMM_JOINT_KIND_COUNT, "every kind of joint is listed");
_Static_assert(0 SADMM_DRIVES(ONE, ) == SADMM_DRIVE_COUNT, "every drive is listed");

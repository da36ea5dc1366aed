/* The names of values, once: what scene files, commands and the Python package call them.
 *
 * F(X, value, name, ...), X passed through. */
#ifndef SADMM_CORE_BASE_NAMES_H
#define SADMM_CORE_BASE_NAMES_H

#include <stdint.h>

#include "subadmm/joint.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SADMM_BACKENDS(F, X)         \
    F(X, SADMM_BACKEND_AUTO, "auto") \
    F(X, SADMM_BACKEND_REF, "ref")   \
    F(X, SADMM_BACKEND_CPU, "cpu")   \
    F(X, SADMM_BACKEND_CUDA, "cuda")
#define SADMM_PRECISIONS(F, X) F(X, SADMM_F32, "f32") F(X, SADMM_F64, "f64")
#define SADMM_METHODS(F, X) F(X, SADMM_METHOD_PAPER, "paper") F(X, SADMM_METHOD_FAST, "fast")
#define SADMM_STEP_ERRORS(F, X)                 \
    F(X, SADMM_STEP_ERROR_NONE, "none")         \
    F(X, SADMM_STEP_ERROR_LAW, "law")           \
    F(X, SADMM_STEP_ERROR_MOMENTUM, "momentum") \
    F(X, SADMM_STEP_ERROR_LIMITER, "limiter")   \
    F(X, SADMM_STEP_ERROR_JOINTS, "joints")
#define SADMM_BODY_TYPES(F, X)          \
    F(X, SADMM_BODY_DYNAMIC, "dynamic") \
    F(X, SADMM_BODY_STATIC, "static")   \
    F(X, SADMM_BODY_KINEMATIC, "kinematic")
/* How many numbers of its size it has. */
#define SADMM_SHAPE_TYPES(F, X)               \
    F(X, SADMM_SHAPE_PLANE, "plane", 0)       \
    F(X, SADMM_SHAPE_SPHERE, "sphere", 1)     \
    F(X, SADMM_SHAPE_CAPSULE, "capsule", 2)   \
    F(X, SADMM_SHAPE_BOX, "box", 3)           \
    F(X, SADMM_SHAPE_HULL, "hull", 0)         \
    F(X, SADMM_SHAPE_MESH, "mesh", 0)         \
    F(X, SADMM_SHAPE_CYLINDER, "cylinder", 2) \
    F(X, SADMM_SHAPE_CONE, "cone", 2)         \
    F(X, SADMM_SHAPE_ELLIPSOID, "ellipsoid", 3)
/* What it locks; the free coordinates and the use, for documents. */
#define SADMM_JOINT_KINDS(F, X)                                                                                        \
    F(X, SADMM_JOINT_FIXED, "fixed", SADMM_LOCK_ALL, "none", "weld")                                                   \
    F(X, SADMM_JOINT_REVOLUTE, "revolute", SADMM_LOCK_ALL - SADMM_LOCK_RZ, "5", "hinge about z")                       \
    F(X, SADMM_JOINT_PRISMATIC, "prismatic", SADMM_LOCK_ALL - SADMM_LOCK_Z, "2", "slide along z")                      \
    F(X, SADMM_JOINT_CYLINDRICAL, "cylindrical", SADMM_LOCK_ALL - SADMM_LOCK_Z - SADMM_LOCK_RZ, "2, 5",                \
      "slide and hinge on one axis")                                                                                   \
    F(X, SADMM_JOINT_SPHERICAL, "spherical", SADMM_LOCK_X + SADMM_LOCK_Y + SADMM_LOCK_Z, "3, 4, 5", "ball joint")      \
    F(X, SADMM_JOINT_UNIVERSAL, "universal", SADMM_LOCK_X + SADMM_LOCK_Y + SADMM_LOCK_Z + SADMM_LOCK_RZ, "3, 4",       \
      "cardan joint")                                                                                                  \
    F(X, SADMM_JOINT_PLANAR, "planar", SADMM_LOCK_Z + SADMM_LOCK_RX + SADMM_LOCK_RY, "0, 1, 5", "motion in a plane")   \
    F(X, SADMM_JOINT_CARTESIAN, "cartesian", SADMM_LOCK_RX + SADMM_LOCK_RY + SADMM_LOCK_RZ, "0, 1, 2", "no rotation")  \
    F(X, SADMM_JOINT_CUSTOM, "custom", 0, "all but those in `locks`", "anything else")                                 \
    F(X, SADMM_JOINT_DISTANCE, "distance", SADMM_LOCK_X, "all but 0, which is the distance of the two origins", "rod") \
    F(X, SADMM_JOINT_SPRING, "spring", 0, "all; 0 is the distance", "spring, rope, actuator between two points")       \
    F(X, SADMM_JOINT_LINK, "link", SADMM_LOCK_X + SADMM_LOCK_Z, "all but the distance and translation 2",              \
      "rod with a hinge at a and a ball joint at b")
#define SADMM_DRIVES(F, X)           \
    F(X, SADMM_DRIVE_OFF, "off")     \
    F(X, SADMM_DRIVE_SPEED, "speed") \
    F(X, SADMM_DRIVE_POSITION, "position")

/* Bits of coordinates. */
enum sadmm_lock {
    SADMM_LOCK_X = 1,
    SADMM_LOCK_Y = 2,
    SADMM_LOCK_Z = 4,
    SADMM_LOCK_RX = 8,
    SADMM_LOCK_RY = 16,
    SADMM_LOCK_RZ = 32,
    SADMM_LOCK_ALL = 63
};

enum { SADMM_PRECISION_COUNT = SADMM_F64 + 1, SADMM_BODY_TYPE_COUNT = SADMM_BODY_KINEMATIC + 1 };

extern const char *const sadmm_backend_names[SADMM_BACKEND_COUNT];
extern const char *const sadmm_precision_names[SADMM_PRECISION_COUNT];
extern const char *const sadmm_step_error_names[SADMM_STEP_ERROR_COUNT];
extern const char *const sadmm_method_names[SADMM_METHOD_COUNT];
extern const char *const sadmm_body_type_names[SADMM_BODY_TYPE_COUNT];
extern const char *const sadmm_shape_type_names[SADMM_SHAPE_TYPE_COUNT];
extern const char *const sadmm_joint_kind_names[SADMM_JOINT_KIND_COUNT];
extern const char *const sadmm_drive_names[SADMM_DRIVE_COUNT];
extern const int sadmm_shape_sizes[SADMM_SHAPE_TYPE_COUNT];
extern const uint32_t sadmm_joint_locks[SADMM_JOINT_KIND_COUNT]; /* of CUSTOM: 0, they are the definition's */

#ifdef __cplusplus
}
#endif
#endif

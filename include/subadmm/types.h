/* What worlds, bodies and shapes are made from, and a body's state: units and frames as in world.h. */
#ifndef SUBADMM_TYPES_H
#define SUBADMM_TYPES_H

#include "hull.h"
#include "id.h"
#include "mesh.h"
#include "settings.h"
#include "tasks.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_world sadmm_world;

/* ---- world ------------------------------------------------------------------------------------------------------ */

typedef struct sadmm_world_def {
    size_t struct_size;         /* set by sadmm_world_def_default() */
    sadmm_backend backend;      /* default AUTO */
    sadmm_precision precision;  /* default F64 */
    int device;                 /* accelerator index, >= 0; default 0 */
    double contact_margin;      /* speculative margin as a share of the thinner shape's smallest extent, in [0, 1];
                                   default 0.02. Contacts are made up to a distance of the margin (or of acceleration x
                                   dt^2 by gravity and external wrenches, if larger) plus what the velocities can close
                                   in one step */
    sadmm_tasks tasks;          /* threads of the host to work on steps; default all zero: OpenMP's (tasks.h) */
    sadmm_settings settings;
} sadmm_world_def;

/* The defaults named above. settings_size: of a sadmm_settings. Thread-safe. */
SADMM_API void sadmm_world_def_init(sadmm_world_def *def, size_t size, size_t settings_size);
static inline sadmm_world_def sadmm_world_def_default(void)
{
    sadmm_world_def def;
    sadmm_world_def_init(&def, sizeof def, sizeof def.settings);
    return def;
}

/* ---- bodies ----------------------------------------------------------------------------------------------------- */

typedef enum sadmm_body_type {
    SADMM_BODY_DYNAMIC = 0,
    SADMM_BODY_STATIC,
    SADMM_BODY_KINEMATIC /* moves with its velocity, which only the caller changes (sadmm_world_set_body_state,
                            sadmm_world_move_body); acts on dynamic bodies as if its mass were infinite. Joints may be
                            attached to it. It does not collide with static or kinematic bodies. On CUDA, what is set is
                            sent with the next step */
} sadmm_body_type;

typedef struct sadmm_body_def {
    size_t struct_size;          /* set by sadmm_body_def_default() */
    const char *name;            /* UTF-8; copied, as many whole characters as fit into 63 bytes; NULL = "" */
    sadmm_body_type type;        /* default DYNAMIC */
    double mass;                 /* kg, in [1e-9, 1e12]; of dynamic bodies, ignored for others; no default */
    double inertia[3];           /* principal moments, kg m^2, in [1e-24, 1e24], each <= the sum of the other two
                                    (relative 1e-9), the largest <= 1e6 (F32) or 1e12 (F64) times the smallest; of
                                    dynamic bodies, ignored for others; no default */
    double position[3];          /* centre of mass, m, |x| <= 1e9; default 0 */
    double orientation[4];       /* w x y z, | |q| - 1 | <= 1e-6 (then normalised); default identity */
    double linear_velocity[3];   /* m/s, |v| <= 1e6; 0 for static bodies; default 0 */
    double angular_velocity[3];  /* rad/s, |w| <= 1e6; 0 for static bodies; default 0 */
    int32_t environment;         /* bodies of different environments never collide; >= 0, or -1 (not for dynamic
                                    bodies): collides with all; default 0 (static: -1 is the usual choice) */
    /* Of dynamic bodies, ignored for others: */
    double gravity_scale;        /* the body's gravity over settings.gravity, in [-1e6, 1e6]; default 1 */
    double linear_damping;       /* 1/s, in [0, 1e6]; default 0. c: a force -c mass velocity, so that free motion decays
                                    as exp(-c t), exactly and at any dt */
    double angular_damping;      /* the same of the angular velocity: a torque -c inertia velocity */
    void *user_data;             /* the caller's, never used by the library; default NULL */
} sadmm_body_def;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_body_def_init(sadmm_body_def *def, size_t size);
static inline sadmm_body_def sadmm_body_def_default(void)
{
    sadmm_body_def def;
    sadmm_body_def_init(&def, sizeof def);
    return def;
}

typedef struct sadmm_body_state {
    double position[3];          /* m */
    double orientation[4];       /* w x y z */
    double linear_velocity[3];   /* m/s */
    double angular_velocity[3];  /* rad/s, world frame */
} sadmm_body_state;

/* ---- shapes ----------------------------------------------------------------------------------------------------- */

typedef enum sadmm_shape_type {
    SADMM_SHAPE_PLANE = 0, /* half-space z <= 0 of the shape's frame; static bodies only. size unused */
    SADMM_SHAPE_SPHERE,    /* size[0] radius */
    SADMM_SHAPE_CAPSULE,   /* size[0] radius, size[1] half length of the segment along the shape's z */
    SADMM_SHAPE_BOX,       /* size: half extents */
    SADMM_SHAPE_HULL,      /* convex hull (hull.h) in the frame of its points. size ignored; read back: the half extents
                              of the box that contacts are found with, in m */
    SADMM_SHAPE_MESH,      /* triangle mesh or heightfield (mesh.h) in the frame of its vertices, or of its grid; static
                              and kinematic bodies only. size ignored; read back: the half extents of the box around it,
                              in m */
    SADMM_SHAPE_CYLINDER,  /* size[0] radius, size[1] half height along the shape's z, m; its origin is the centre */
    SADMM_SHAPE_CONE,      /* size[0] radius of the base, size[1] half height along the shape's z, m: apex at +size[1],
                              base at -size[1]. The shape's origin is halfway up the axis, the centre of mass
                              size[1] / 2 below it (sadmm_shape_mass) */
    SADMM_SHAPE_ELLIPSOID, /* size: semi-axes along the shape's x, y and z, m; its origin is the centre */
    SADMM_SHAPE_TYPE_COUNT
} sadmm_shape_type;

typedef struct sadmm_shape_def {
    size_t struct_size;          /* set by sadmm_shape_def_default() */
    sadmm_shape_type type;       /* default SPHERE */
    double size[3];              /* m, each used entry in [1e-6, 1e6]; no default */
    double position[3];          /* of the shape's frame in the body's, m, |x| <= 1e6; default 0 */
    double orientation[4];       /* shape to body, w x y z; default identity */
    double friction;             /* mu >= 0, <= 1e6; a pair uses the geometric mean; default 0.5 */
    double restitution;          /* in [0, 1]; a pair uses the larger; default 0 */
    uint32_t category, mask;     /* two shapes meet if (a.category & b.mask) and (b.category & a.mask); default 1,
                                    all */
    bool sensor;                 /* has no contacts but reports what overlaps it (events.h); not for a MESH, which has
                                    no inside; default false */
    const sadmm_hull *hull;      /* of HULL; NULL, the default, for all others. The world keeps its own reference while
                                    it has shapes of it, so the caller may destroy it at once. Read back: the same
                                    pointer */
    const sadmm_mesh *mesh;      /* of MESH; likewise */
    double surface_velocity[3];  /* how the surface moves, as a conveyor belt's does, while the shape stays: m/s, in the
                                    shape's frame, |x| <= 1e6. Contacts see what of it is across their normal. 0 on a
                                    dynamic body; default 0 */
    const char *name;            /* UTF-8; copied, as many whole characters as fit into 63 bytes; NULL = "" */
    void *user_data;             /* the caller's, never used by the library; default NULL */
} sadmm_shape_def;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_shape_def_init(sadmm_shape_def *def, size_t size);
static inline sadmm_shape_def sadmm_shape_def_default(void)
{
    sadmm_shape_def def;
    sadmm_shape_def_init(&def, sizeof def);
    return def;
}

#ifdef __cplusplus
}
#endif

#endif

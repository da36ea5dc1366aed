/* Worlds of a few bodies by every solver: the CPU backends, or the device, real or emulated (BODIES_ON_CUDA). */
#ifndef TESTS_BODY_WORLDS_H
#define TESTS_BODY_WORLDS_H

#include <float.h>

#ifdef BODIES_ON_CUDA
#include "cuda_worlds.h"
#endif
#include "fixed_work.h"
#include "scene_tools.h"

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
} solvers[] = {
#ifdef BODIES_ON_CUDA
    {SADMM_BACKEND_CUDA, SADMM_F32},
#ifndef TESTS_UNDER_SANITIZERS /* what they search for is the same in both */
    {SADMM_BACKEND_CUDA, SADMM_F64},
#endif
#else
    {SADMM_BACKEND_REF, SADMM_F64},
    {SADMM_BACKEND_CPU, SADMM_F64},
    {SADMM_BACKEND_CPU, SADMM_F32},
#endif
};
enum { SOLVERS = sizeof solvers / sizeof *solvers };

/* Unit roundoff of velocities and impulses; poses are double in both. */
static inline double epsilon_of(int solver)
{
    return (solvers[solver].precision == SADMM_F32 ? FLT_EPSILON : DBL_EPSILON) / 2;
}

static const double G = 9.81;

static inline sadmm_world_def bodies_def(void)
{
    sadmm_world_def def = fixed_world_def();
    def.settings.threads = 1;
    def.settings.iterations = 100;
    return def;
}

static inline sadmm_world *bodies_world(const sadmm_world_def *def, int solver)
{
    sadmm_world_def own = *def;
    own.precision = solvers[solver].precision;
#ifdef BODIES_ON_CUDA
    own.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = create_world(&own);
    use_device(world, solvers[solver].precision, 0);
    return world;
#else
    own.backend = solvers[solver].backend;
    return create_world(&own);
#endif
}

/* Without a shape: mass 2 kg, moments all 0.5 kg m^2. */
static inline sadmm_body_def point_def(double x, double y, double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.mass = 2;
    for (int k = 0; k < 3; ++k) def.inertia[k] = 0.5;
    def.position[0] = x, def.position[1] = y, def.position[2] = z;
    return def;
}

static inline sadmm_body_id add_defined(sadmm_world *world, const sadmm_body_def *def)
{
    sadmm_body_id id;
    MUST(world, sadmm_world_add_body(world, def, &id));
    return id;
}

/* A box shape on a body. */
static inline void give_box(sadmm_world *world, sadmm_body_id id, double hx, double hy, double hz, double friction)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_BOX;
    shape.size[0] = hx, shape.size[1] = hy, shape.size[2] = hz;
    shape.friction = friction;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
}

/* A cube of 0.2 m and 2 kg. */
static inline sadmm_body_def cube_def(double x, double y, double z)
{
    static const double half[3] = {0.1, 0.1, 0.1};
    sadmm_body_def def = point_def(x, y, z);
    sadmm_box_inertia(def.mass, half, def.inertia);
    return def;
}

static inline sadmm_body_id add_cube(sadmm_world *world, const sadmm_body_def *def, double friction)
{
    const sadmm_body_id id = add_defined(world, def);
    give_box(world, id, 0.1, 0.1, 0.1, friction);
    return id;
}

static inline void expect_near(double got, double wanted, double tolerance, const char *what)
{
    ck_assert_msg(fabs(got - wanted) <= tolerance, "%s: %.9g, wanted %.9g +- %.2g", what, got, wanted, tolerance);
}

#ifdef BODIES_ON_CUDA
#define RUN_BODIES_SUITE run_cuda_suite
#else
#define RUN_BODIES_SUITE run_suite
#endif

#endif

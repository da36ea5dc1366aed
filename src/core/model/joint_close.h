/* What is locked, closed at the end of a step (docs/algorithm.md, section 10): the errors that turning bodies leave joints
 * with are of third order in the step, and where bodies turn by much of a radian in one they are a good part of a link.
 * Bodies are then moved by the least displacement, weighed by their inertia, that takes the errors away. In double. */
#ifndef SADMM_CORE_MODEL_JOINT_CLOSE_H
#define SADMM_CORE_MODEL_JOINT_CLOSE_H

#include "joint_law.h"

/* A joint is closed once it is off by more than this share of its bodies' arms and radii of gyration, or rad. */
#define JOINT_CLOSE_FROM 1e-4
/* By so many Newton steps at most. */
enum { JOINT_CLOSE_STEPS = 5 };
/* What is left of an error that a step begins with: joints that were made apart are drawn together at the speed of
 * corrections. */
SADMM_INLINE double joint_closing_left(double error, double dt, double most)
{
    const double left = fabs(error) - dt * most;
    return left > 0 ? copysign(left, error) : 0;
}

/* A joint as its bodies' poses have it: locks in order. */
struct joint_closing {
    struct joint_geometry geometry;
    int count, coordinate[JOINT_COORDINATES];
    double error[JOINT_COORDINATES]; /* m, rad */
    double off, share;               /* largest translation, m; largest error, over its scale */
};

/* lever: of the step. */
SADMM_INLINE struct joint_closing joint_closing_of(const sadmm_joint_def *def, const struct joint_end *a,
                                                   const struct joint_end *b, const struct joint_lever *lever,
                                                   const struct sadmm_settings *settings)
{
    const int radial = joint_is_radial(def->kind);
    struct joint_closing c;
    int k;
    c.geometry = joint_geometry_of(a, b, def->locks, radial);
    c.count = 0;
    c.off = c.share = 0;
    for (k = 0; k < JOINT_COORDINATES; ++k) {
        double error = c.geometry.value[k], share;
        if (!(def->locks >> k & 1)) continue;
        if (k == 0 && radial) error -= def->length;
        if (k < 3 && fabs(error) > c.off) c.off = fabs(error);
        error -= joint_closing_left(lever->error[k], settings->dt, settings->correction_speed);
        share = fabs(error) / (k < 3 ? lever->size : 1);
        if (share > c.share) c.share = share;
        c.coordinate[c.count] = k;
        c.error[c.count++] = error;
    }
    return c;
}

/* The row of lock i on a side. */
SADMM_INLINE void joint_closing_row(const struct joint_closing *c, int i, int s, double row[6])
{
    vec3 linear, angular;
    const double sign = s ? 1 : -1;
    joint_row(&c->geometry, c->coordinate[i], s ? c->geometry.arm_b : c->geometry.arm_a, &linear, &angular);
    v3_store(v3_scale(linear, sign), row);
    v3_store(v3_scale(angular, sign), row + 3);
}

#endif

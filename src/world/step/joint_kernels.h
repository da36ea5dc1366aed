/* What takes the time of joints in a (sub-)step, compiled once per instruction set: core/model/joint_law.h for all
 * coordinates of a joint at once, with the same bits. */
#ifndef SADMM_WORLD_STEP_JOINT_KERNELS_H
#define SADMM_WORLD_STEP_JOINT_KERNELS_H

#include "core/base/variant.h"
#include "core/model/joint_close.h"
#include "core/model/joint_law.h"
#include "core/model/joint_trapezoid.h"
#include "world/state/world_joint.h"

/* joint_act_between */
typedef void sadmm_joint_act(const sadmm_joint_def *def, const struct joint_frame frame[2], bool target,
                             const sadmm_settings *settings, struct acting_joint *acting);

/* By coordinate; SIX_RATES: whole vectors. */
enum { SIX_RATES = 8 };
struct joint_rates {
    double before[SIX_RATES];        /* joint_rate at the step's start */
    double start[SIX_RATES];         /* of the step's rows, by velocities at the start, */
    double middle[SIX_RATES];        /* halfway, */
    double prescribed[SIX_RATES];    /* and of sides of prescribed motion */
    double row[2][JOINT_COORDINATES][6]; /* joint_step_row of sides that move */
};
typedef void sadmm_joint_rates(const struct acting_joint *acting, struct joint_rates *rates);

/* Rows in the step's lists, from the first one on that a joint may write. */
struct joint_row_lists {
    double *jacobian[2]; /* x 6 */
    double *gain, *bias, *compliance, *lo, *hi, *lambda, *multiplier;
    struct sadmm_joint_source *source;
};
enum { JOINT_MOST_ROWS = JOINT_COORDINATES * JOINT_COORDINATE_LAWS };

/* A joint's rows, locked coordinates first: they are held together. Returns how many they are. */
typedef int sadmm_joint_laws(struct sadmm_world_joint *joint, const struct acting_joint *acting,
                             const struct joint_rates *rates, const sadmm_settings *settings,
                             const struct joint_row_lists *to);

/* spin_of_system of `count` bodies. */
typedef void sadmm_joint_spins(const struct sadmm_rigid *bodies, size_t count, double dt, struct spin_system *out);

/* joint_move of `count` bodies, with the trapezoid correction. */
struct joint_movement {
    const struct sadmm_rigid *from;
    const double *halfway, *velocity; /* its orientation halfway; the solution */
    struct sadmm_rigid *next;
};
typedef void sadmm_joint_moves(const struct joint_movement *bodies, size_t count, double dt);

/* Of a body; NULL: of the static world. */
struct joint_pose {
    const double *position, *orientation;
};
/* A joint that is to stay closed. */
struct joint_opened {
    const struct sadmm_world_joint *joint;
    struct joint_pose pose[2];
    const struct sadmm_rigid *moves[2]; /* its dynamic bodies, as the step began */
    double off;                         /* joint_opening */
    bool little;                        /* joint_opens_little */
};
typedef void sadmm_joint_openings(struct joint_opened *joints, size_t count);
/* joint_closing_of; start: as the step began. */
typedef void sadmm_joint_close(const struct joint_opened *joint, const struct joint_pose start[2],
                               const sadmm_settings *settings, struct joint_closing *out);

struct sadmm_joint_kernels {
    sadmm_joint_spins *spins;
    sadmm_joint_moves *moves;
    sadmm_joint_act *act;
    sadmm_joint_rates *rates;
    sadmm_joint_laws *laws;
    sadmm_joint_openings *openings;
    sadmm_joint_close *close;
};

extern sadmm_joint_spins sadmm_joint_spins_baseline, sadmm_joint_spins_avx2;
extern sadmm_joint_moves sadmm_joint_moves_baseline, sadmm_joint_moves_avx2;
extern sadmm_joint_act sadmm_joint_act_baseline, sadmm_joint_act_avx2;
extern sadmm_joint_rates sadmm_joint_rates_baseline, sadmm_joint_rates_avx2;
extern sadmm_joint_laws sadmm_joint_laws_baseline, sadmm_joint_laws_avx2;
extern sadmm_joint_openings sadmm_joint_openings_baseline, sadmm_joint_openings_avx2;
extern sadmm_joint_close sadmm_joint_close_baseline, sadmm_joint_close_avx2;

#endif

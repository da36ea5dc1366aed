/* The weight of a constraint in the method `fast` (docs/internals/algorithm.md, "Method fast"): the mass it carries.
 *
 *     B = min(load / V, m) + phi / w          V^2 = sum g . A^-1 g / m,   g = J^T lambda, over the bodies of an island
 *
 * An impulse of size `load` changes velocities of its island by about V, so load / V is the mass behind the constraint.
 * Where impulses cancel in g (bodies clamped between each other) V says nothing: m, the mass of the island, is the cap.
 * phi / w, with w the constraint's own response, is what a constraint without a load gets. Double in every precision:
 * it runs a few times a step. */
#ifndef SADMM_MATH_WEIGHT_H
#define SADMM_MATH_WEIGHT_H

#include <limits.h>

#include "max.h"

/* Iterations after which an island that started cold gets new weights, from the loads it has found by then: 5, 10,
 * 20, 40, and from there half as many again each time. Changes as late as that are small, and a change disturbs. */
enum { WEIGHT_FIRST_UPDATE = 5, WEIGHT_DOUBLE_BELOW = 40 }; /* measured: bench/constants.py, cold */

/* ADMM is known to converge with weights that change finitely often (He, Yang and Wang, J. Optim. Theory Appl. 106,
 * 2000). So many iterations have found the loads; a later change would only throw back what has converged. */
enum { WEIGHT_LAST_UPDATE = 1000, WEIGHT_NO_UPDATE = INT_MAX };

SADMM_INLINE int weight_next_update(int at)
{
    const int next = at < WEIGHT_DOUBLE_BELOW ? 2 * at : at + at / 2;
    return next <= WEIGHT_LAST_UPDATE ? next : WEIGHT_NO_UPDATE;
}

/* phi. Contacts: loads that have not been found yet are the ones to come. Joints and springs hold in all directions,
 * loaded or not; but a mechanism moves along what none of its joints holds, which no body knows by itself, and an
 * iteration brings that motion on by a share of 1 / phi or so. Steps of a world (rigid) with few iterations rather miss
 * some of what joints hold, which the next steps make good, than of how bodies move, which none does. */
#define WEIGHT_FLOOR_CONTACT 3.0 /* measured: bench/constants.py, cold heaps standing */
#define WEIGHT_FLOOR_ROW 30.0 /* measured: bench/constants.py, cold mechanisms */
#define WEIGHT_FLOOR_ROW_LEAST 3.0 /* measured: bench/constants.py, mechanisms */
/* From as many iterations on it is the whole. */
#define WEIGHT_FLOOR_ROW_ITERATIONS 200.0 /* measured: bench/constants.py, mechanisms */

SADMM_INLINE double weight_row_floor(int rigid, int iterations)
{
    const double share = WEIGHT_FLOOR_ROW * iterations / WEIGHT_FLOOR_ROW_ITERATIONS;
    return rigid ? min_of(max_of(share, WEIGHT_FLOOR_ROW_LEAST), WEIGHT_FLOOR_ROW) : WEIGHT_FLOOR_ROW;
}

/* Masses that differ by more are uneven: phi / w of a light body is far from what it has to carry, and loads that are
 * found over some steps come late. Up to 1e7 a landing is the same with and without weight updates
 * (tests/test_impacts.c, a_gram_carries_any_mass). */
#define WEIGHT_UNEVEN 1e6 /* measured: bench/constants.py, motion */

SADMM_INLINE int weight_is_uneven(double lightest, double heaviest) { return heaviest > WEIGHT_UNEVEN * lightest; }

/* Less is rounding of the impulses, and says nothing about loads; m/s. */
#define WEIGHT_LEAST_SPEED 1e-6

/* Sums over the bodies of an island; with g = J^T lambda, r = A v - b - g. */
struct weight_sums {
    double energy, mass;                 /* g . A^-1 g, J; kg */
    double kinetic, push;                /* v . A v, J; the sizes of the impulses that the bodies feel, N s */
    double momentum_residual, violation; /* r . A^-1 r; contact residual (math/contact.h); J, for the weight scale */
};

/* What the weights of an island's constraints are made of. */
struct weight_island {
    double speed, mass; /* V in m/s; kg */
    double separation_share; /* of separations within the slop, that a step closes */
    double scale;            /* the weight scale */
};

SADMM_INLINE struct weight_island weight_new_island(void)
{
    const struct weight_island fresh = {0, 0, 1, 1};
    return fresh;
}

/* V of an island from sum g . A^-1 g over its bodies and its mass, m/s. */
SADMM_INLINE double weight_speed(double energy, double mass)
{
    return sqrt(energy / mass + WEIGHT_LEAST_SPEED * WEIGHT_LEAST_SPEED);
}

/* min(load / V, m), kg; load in N s. */
SADMM_INLINE double weight_mass(double load, double speed, double mass)
{
    return min_of(load / speed, mass);
}

/* The weight scale of an island under contacts, a factor of its weights, from the sixth weight update on:
 *
 *     q^2 = sum w |lambda - Pi_C(lambda - (x + e n)/w)|^2 / sum r . A^-1 r,      r = A v - b - J^T lambda
 *
 * the residual of the contacts over that of the momentum, both energies in J. This is the primal-dual imbalance; near
 * 0.1 is usual. Where it is small, momentum converges slower than contacts do (masses that differ by decades, in no
 * order): the weights are too large. Where nothing but the contacts is left, impulses move at constant speed along
 * directions that no body feels; then the island stagnates, and keeps its weights, times what the weight scale rises
 * by: new ones would disturb the bodies. */
enum { WEIGHT_FIRST_SCALE = 6 }; /* measured: bench/constants.py, cold */
#define WEIGHT_IMBALANCE_LEAST (1 / 3.0) /* measured: bench/constants.py, cold */
#define WEIGHT_STAGNATION 30.0 /* measured: bench/constants.py, cold */
#define WEIGHT_SCALE_POWER 0.3 /* measured: bench/constants.py, cold */
#define WEIGHT_SCALE_STEP 4.0 /* measured: bench/constants.py, cold */
#define WEIGHT_SCALE_LEAST 0.1 /* measured: bench/constants.py, cold */
#define WEIGHT_SCALE_MOST 5.0 /* measured: bench/constants.py, cold */

/* Less than this is rounding, m/s. */
#define WEIGHT_SCALE_ROUNDING 1e-12

/* The imbalance, q, of an island. */
SADMM_INLINE double weight_imbalance(double violation, double momentum_residual, double mass)
{
    double least = WEIGHT_SCALE_ROUNDING * WEIGHT_SCALE_ROUNDING * mass;
    return sqrt((violation + least) / (momentum_residual + least));
}

SADMM_INLINE int weight_stagnates(double imbalance) { return imbalance > WEIGHT_STAGNATION; }

SADMM_INLINE double weight_next_scale(double scale, double imbalance)
{
    double off = weight_stagnates(imbalance) ? imbalance / WEIGHT_STAGNATION
                                             : min_of(imbalance / WEIGHT_IMBALANCE_LEAST, 1.0);
    double factor = min_of(max_of(pow(off, WEIGHT_SCALE_POWER), 1 / WEIGHT_SCALE_STEP), WEIGHT_SCALE_STEP);
    return min_of(max_of(scale * factor, WEIGHT_SCALE_LEAST), WEIGHT_SCALE_MOST);
}

/* The next weight scale. Returns the factor of the weights of an island that stagnates, 0: it does not stagnate, and
 * takes new ones. */
SADMM_INLINE double weight_update_scale(struct weight_island *island, const struct weight_sums *sums)
{
    const double imbalance = weight_imbalance(sums->violation, sums->momentum_residual, sums->mass);
    const double next = weight_next_scale(island->scale, imbalance);
    const double rise = weight_stagnates(imbalance) ? next / island->scale : 0;
    island->scale = next;
    return rise;
}

/* ---- contacts as springs -----------------------------------------------------------------------------------------
 *
 * An island that starts warm goes on from the impulses of the last step, and its K iterations change them by B K x, x
 * the velocity at the contact: from step to step a contact is a spring of stiffness B K / dt^2. At rest B is the load
 * over g dt. A column of n bodies on such springs buckles under its own weight (Euler) where
 *
 *     n^2 > 5.8 K a^2 / (g dt^2 h)       a: half the width of a body, h: its height; 5.8: the square of a root of J_0
 *
 * so that B K must grow as n^2. What it should be over what it is, with d = max(n / WEIGHT_SPRING_DEPTH, 1):
 *
 *     need = WEIGHT_SPRING_ITERATIONS / K d^2
 *
 * B is raised by that, up to WEIGHT_STIFFEST. Beyond, separations are closed slowly: closed in one step they act on the
 * springs as an integral controller, which excites slow swaying, and shakes light bodies that are clamped. A step
 * closes the share lack^-3 of them, lack = WEIGHT_SEPARATION_NEED need. Few iterations alone are no reason to: lack is
 * at most d^2. */
#define WEIGHT_SPRING_ITERATIONS 60 /* measured: bench/constants.py, heaps standing */
#define WEIGHT_SPRING_DEPTH 20.0 /* measured: bench/constants.py, heaps standing */
#define WEIGHT_STIFFEST 6.0 /* measured: bench/constants.py, heaps standing */
#define WEIGHT_SEPARATION_NEED 3.3333333333333335 /* measured: bench/constants.py, heaps standing */
#define WEIGHT_SEPARATION_LEAST 0.001 /* measured: bench/constants.py, heaps standing */

/* Does an island start warm: do at least half of its constraints? `balance`: constraints that start with an impulse,
 * less those that start without, each shared out over its dynamic bodies. */
SADMM_INLINE int weight_starts_warm(double balance) { return balance >= 0; }

/* K of an island whose contacts are springs, 0: they are none. A problem that is solved in short batches is no row of
 * steps: this is for worlds (`rigid`). */
SADMM_INLINE int weight_spring_iterations(int warm, int rigid, int iterations)
{
    return warm && rigid ? iterations : 0;
}

/* d^2. `push`, the sum of the sizes of the impulses that the bodies feel, N s, over m V is n in a column. */
SADMM_INLINE double weight_depth2(double speed, double push, double mass)
{
    const double depth = max_of(push / (mass * speed * WEIGHT_SPRING_DEPTH), 1.0);
    return depth * depth;
}

SADMM_INLINE double weight_spring_need(double depth2, int iterations)
{
    return depth2 * WEIGHT_SPRING_ITERATIONS / iterations;
}

/* V: an island whose bodies move is no spring, and heavy weights are slow: no less than their speed. */
SADMM_INLINE double weight_spring_speed(double speed, double need, double kinetic, double mass)
{
    const double stiffer = min_of(max_of(need, 1.0), WEIGHT_STIFFEST);
    return min_of(max_of(speed / stiffer, sqrt(kinetic / mass)), speed);
}

/* The share of a separation within the slop that a step closes. */
SADMM_INLINE double weight_separation_share(double depth2, double need)
{
    const double lack = min_of(WEIGHT_SEPARATION_NEED * need, depth2);
    return min_of(max_of(1 / (lack * lack * lack), WEIGHT_SEPARATION_LEAST), 1.0);
}

/* e with that share; `slop` over dt, m/s. */
SADMM_INLINE double weight_separation_error(double error, double share, double slop)
{
    double eased = share * error, beyond = error - (1 - share) * slop;
    return error <= 0 ? error : eased > beyond ? eased : beyond;
}

/* V, and what goes with it; iterations: weight_spring_iterations. */
SADMM_INLINE void weight_update_speed(struct weight_island *island, const struct weight_sums *sums, int iterations)
{
    const double mass = sums->mass, speed = weight_speed(sums->energy, mass);
    double depth2, need;
    island->mass = mass;
    island->speed = speed;
    island->separation_share = 1;
    if (iterations == 0) return;
    depth2 = weight_depth2(speed, sums->push, mass);
    need = weight_spring_need(depth2, iterations);
    island->speed = weight_spring_speed(speed, need, sums->kinetic, mass);
    island->separation_share = weight_separation_share(depth2, need);
}

/* ---- B ----------------------------------------------------------------------------------------------------------- */

/* The most that a point of a pair carries, kg, by how many constraints each of its bodies has (0: it is not dynamic)
 * and their masses. On a body that nothing else touches nothing rests: its pair carries no more than it, times what V
 * may be divided by. V is the island's, and says nothing of a light body that hits a heavy one: by that it would have
 * the weight of what is heavy, and pass on its momentum slower than there are iterations. */
SADMM_INLINE double weight_most(const int constraints[2], const double mass[2], int points)
{
    double most = HUGE_VAL;
    int side;
    for (side = 0; side < 2; ++side)
        if (constraints[side] == 1) most = min_of(most, WEIGHT_STIFFEST * mass[side] / points);
    return most;
}

/* B of a pair, kg. load: the mean size of its impulses, N s; most: weight_most. phi / w does not sink with the weight
 * scale: it is for contacts whose load is not known. */
SADMM_INLINE double weight_of_pair(const struct weight_island *island, double load, double most, double response)
{
    const double scale = island->scale;
    return scale * weight_mass(load, island->speed, min_of(island->mass, most)) +
           max_of(scale, 1.0) * WEIGHT_FLOOR_CONTACT / response;
}

/* Sums over the rows of a constraint given by rows: squares of loads (N s) and of multipliers; the mean response. */
struct weight_row_sums {
    double load2, lambda2, response;
};

/* What a row's multiplier counts for in the load of its constraint: of a row that pushes by how much, `push`; of a row
 * that only turns the push that would take as much energy. inverse_mass: of its bodies. */
SADMM_INLINE double weight_row_scale(double push, double response, double inverse_mass)
{
    return push > 0 ? push : sqrt(response / inverse_mass);
}

/* One of `count` rows; scale: weight_row_scale. */
SADMM_INLINE void weight_add_row(struct weight_row_sums *sums, double lambda, double scale, double response, int count)
{
    const double load = scale * lambda;
    sums->load2 += load * load;
    sums->lambda2 += lambda * lambda;
    sums->response += response / count;
}

/* B of a constraint given by rows is diag(weight) + along along^T. By share = min(load / V, m) / load^2: of the rows
 * that have neither bounds nor compliance together share lambda lambda^T + phi / w, of each other row
 * share lambda_r^2 + phi / w, so that its bounds and its compliance are met by itself; of a contact (cone)
 * share |lambda|^2 + phi / w. A row nobody feels (w = 0) has no weight.
 *
 * An iteration brings a velocity on by a share of about 1 / (1 + w B) of the residual, so that rows that do not hold
 * their bodies should not weigh on them: one whose multiplier is at a bound (a drive at its largest force, friction
 * that slips, a limit that is not met) has 1 / w, with which it lets go or holds in one iteration by itself; a soft
 * one has no more than some times what it resists with, gain / compliance in kg. */
struct weight_row {
    double weight, along;
};

/* What the weight of a row depends on; coupled: neither bounds nor compliance (core/model/rows.h); floor:
 * weight_row_floor. */
struct weight_law {
    int cone, coupled;
    double gain, compliance, lo, hi, floor;
};

#define WEIGHT_SOFT_MOST 3.0 /* measured: bench/constants.py, mechanisms */

SADMM_INLINE double weight_share(const struct weight_island *island, double load2)
{
    return load2 > 0 ? weight_mass(sqrt(load2), island->speed, island->mass) / load2 : 0;
}

/* Of a row with bounds or compliance; response > 0. */
SADMM_INLINE double weight_of_own(const struct weight_law *law, double share, double lambda, double response)
{
    const double held = share * lambda * lambda + law->floor / response;
    if (lambda <= law->lo || lambda >= law->hi) return min_of(1 / response, held);
    if (!(law->compliance > 0)) return held;
    return min_of(WEIGHT_SOFT_MOST * law->gain / law->compliance + 1 / response, held);
}

SADMM_INLINE struct weight_row weight_of_row(const struct weight_row_sums *sums, double share,
                                             const struct weight_law *law, double lambda, double response)
{
    struct weight_row out = {0, 0};
    if (law->cone) {
        out.weight = share * sums->lambda2 + (sums->response > 0 ? WEIGHT_FLOOR_CONTACT / sums->response : 1);
    } else if (law->coupled) {
        out.weight = response > 0 ? law->floor / response : 0;
        out.along = sqrt(share) * lambda;
    } else {
        out.weight = response > 0 ? weight_of_own(law, share, lambda, response) : 1;
    }
    return out;
}

#endif

/* What rounding leaves of a solve, of host and device: a share of the fastest body's speed, in units of the precision's
 * rounding. A solution is a sum of tens of terms; contacts of bodies at 10 m/s end some 5 units off in single
 * precision. */
#ifndef SADMM_CORE_MATH_SOLVE_ROUNDING_H
#define SADMM_CORE_MATH_SOLVE_ROUNDING_H

enum { SOLVE_ROUNDING = 16 };

/* The dense contact solve, of host and device. What is a solution, m/s, of the natural map and of the momentum
 * residual; and what rounding leaves of the natural map, of the largest speed that a drive makes by itself, with room:
 * a drive of 4e5 N on a jaw of 0.1 kg makes 3e4 m/s, and 1e-8 m/s are left. Forces of drives are given: impulses of
 * contacts and locks may be large because nothing meets them. */
#define NCP_ENOUGH 1e-9
#define NCP_DRIVE_ROUNDING 1e-12

#endif

/* What rounding leaves of a solve, of host and device: a share of the fastest body's speed, in units of the precision's
 * rounding. A solution is a sum of tens of terms; contacts of bodies at 10 m/s end some 5 units off in single
 * precision. */
#ifndef SADMM_CORE_MATH_SOLVE_ROUNDING_H
#define SADMM_CORE_MATH_SOLVE_ROUNDING_H

enum { SOLVE_ROUNDING = 16 };

#endif

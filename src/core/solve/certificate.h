/* The certificate: the true error of (v, lambda) in double, from the raw data every backend reads (system.h).
 *
 * It knows nothing of a backend or of the iteration: x comes from v, J^T lambda from lambda; A, b, e from the system.
 *
 *   contact  |lambda - Pi_C(lambda - (x + e)/w)| w     w: largest diagonal entry of the contact's own J A^-1 J^T
 *   row      |lambda - clamp(lambda - (g x + b + d lambda)/(d + g w))| w      the largest of a constraint; w: that
 *            row's own diagonal entry; gain g, bias b, compliance d, bounds (math/row.h). Without bounds that is
 *            |x + e| of a hard row and |lambda + k e + c x| w / (1 + c w) of a soft one. Rows that are zero on both
 *            bodies do not count
 *
 * All three are one thing, the natural map: how far (as a velocity) an exact solve of the constraint on its own, with
 * everything else held, would move it. For a soft row the factor 1/(1 + c w) makes it |lambda + k e| w for a plain
 * force and |x + (k e + lambda)/c| for a stiff spring, so that it tends to the hard row's |x + e|. A contact without
 * friction has one row: w is its normal entry. All errors are finite, or there is no certificate: NON_FINITE where (v,
 * lambda) holds a NaN or a product overflows (squares alone do not: their unit is chosen).
 */
#ifndef SADMM_CORE_SOLVE_CERTIFICATE_H
#define SADMM_CORE_SOLVE_CERTIFICATE_H

#include "core/base/error.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Certify system->velocity, ->contacts' impulses and ->rows' multipliers. `settings` gives dt, gravity and
 * stabilisation for systems with rigid bodies or separations; may be NULL when A, b and e are given. Errors:
 * OUT_OF_MEMORY, INVALID_ARGUMENT (a body's A is not positive definite), NON_FINITE; *certificate is unchanged then. */
sadmm_status sadmm_certify(const struct sadmm_system *system, const struct sadmm_settings *settings,
                           sadmm_certificate *certificate, struct sadmm_error *error);

/* The same without allocating once the workspace has grown. Start it from zero. */
struct sadmm_certificate_workspace {
    double *values;
    double *contact_errors; /* natural map of each contact point, m/s, of the last certificate */
};
sadmm_status sadmm_certify_with(struct sadmm_certificate_workspace *workspace, const struct sadmm_system *system,
                                const struct sadmm_settings *settings, sadmm_certificate *certificate,
                                struct sadmm_error *error);
void sadmm_certificate_workspace_free(struct sadmm_certificate_workspace *workspace);

/* A certificate that says "not computed": ncp_max = -1. */
sadmm_certificate sadmm_certificate_none(void);

#ifdef __cplusplus
}
#endif
#endif

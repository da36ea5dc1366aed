/* What solves on the host: tests of articulations go through all of them. */
#ifndef SADMM_TESTS_SOLVERS_H
#define SADMM_TESTS_SOLVERS_H

#include "subadmm/settings.h"

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
} solvers[] = {{SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST},
               {SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_FAST},
               {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_PAPER},
               {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_FAST}};
enum { SOLVERS = sizeof solvers / sizeof *solvers };

#endif

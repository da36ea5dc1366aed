/* Motions with a known answer, on the CUDA backend. */
#define ANALYTIC_ON_CUDA
#include "test_analytic.c"

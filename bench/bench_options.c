#include "bench_options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool bench_parse_list(const char *text, long low, long high, long *values, int *count)
{
    *count = 0;
    while (*count < BENCH_LIST) {
        char *end;
        long value = strtol(text, &end, 10);
        if (end == text || value < low || value > high || (*end && *end != ',')) return false;
        values[(*count)++] = value;
        if (!*end) return true;
        text = end + 1;
    }
    return false;
}

bool bench_parse_number(const char *text, long low, long high, long *value)
{
    char *end;
    long number = strtol(text, &end, 10);
    if (end == text || *end || number < low || number > high) return false;
    *value = number;
    return true;
}

bool bench_parse_seconds(const char *text, double high, double *seconds)
{
    char *end;
    double number = strtod(text, &end);
    if (end == text || *end || !(number > 0 && number <= high)) return false;
    *seconds = number;
    return true;
}

bool bench_parse_backend(const char *text, sadmm_backend *backend)
{
    static const char *const names[] = {"all", "ref", "cpu", "cuda"};
    for (int k = 0; k < 4; ++k)
        if (!strcmp(text, names[k])) {
            *backend = (sadmm_backend)k;
            return true;
        }
    return false;
}

bool bench_parse_precision(const char *text, int *precision)
{
    if (!strcmp(text, "f32")) *precision = SADMM_F32;
    else if (!strcmp(text, "f64")) *precision = SADMM_F64;
    else if (!strcmp(text, "both")) *precision = -1;
    else return false;
    return true;
}

bool bench_parse_method(const char *text, sadmm_method *method)
{
    if (!strcmp(text, "paper")) *method = SADMM_METHOD_PAPER;
    else if (!strcmp(text, "fast")) *method = SADMM_METHOD_FAST;
    else return false;
    return true;
}

const char *bench_precision_name(sadmm_precision precision) { return precision == SADMM_F32 ? "f32" : "f64"; }

int bench_bad_option(const char *command, const char *option, const char *value, const char *allowed)
{
    fprintf(stderr, "subadmm-bench %s: --%s %s: must be %s\n", command, option, value, allowed);
    return 2;
}

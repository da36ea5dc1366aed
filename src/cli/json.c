#include <math.h>
#include <string.h>
#include <sys/utsname.h>

#include "cli.h"

json_t *cli_json_real(double x)
{
    return isfinite(x) ? json_real(x) : json_null();
}

json_t *cli_json_reals(const double *x, size_t count)
{
    json_t *array = json_array();
    for (size_t k = 0; k < count; ++k) json_array_append_new(array, cli_json_real(x[k]));
    return array;
}

/* "model name : ..." of Linux on x86; elsewhere the kind of machine. */
static bool processor_name(char *text, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    bool found = false;
    while (file && !found && fgets(line, sizeof line, file)) {
        const char *value = strncmp(line, "model name", 10) == 0 ? strchr(line, ':') : NULL;
        if (!value) continue;
        snprintf(text, size, "%s", value + 1 + strspn(value + 1, " \t"));
        text[strcspn(text, "\n")] = 0;
        found = true;
    }
    if (file) fclose(file);
    struct utsname machine;
    if (!found && uname(&machine) == 0) {
        snprintf(text, size, "%s", machine.machine);
        found = true;
    }
    return found;
}

json_t *cli_json_device(sadmm_backend backend)
{
    char text[256];
    sadmm_backend_info info;
    if (backend == SADMM_BACKEND_CUDA)
        return sadmm_backend_query(backend, &info) == SADMM_OK ? json_string(info.reason) : json_null();
    return processor_name(text, sizeof text) ? json_string(text) : json_null();
}

void cli_json_add_build(json_t *object)
{
    json_object_set_new(object, "version", json_string(sadmm_version()));
    json_object_set_new(object, "commit", json_string(sadmm_build_commit()));
    json_object_set_new(object, "compiler", json_string(sadmm_build_compiler()));
}

json_t *cli_json_settings(const sadmm_settings *s)
{
    json_t *o = json_object();
    json_object_set_new(o, "dt", cli_json_real(s->dt));
    json_object_set_new(o, "substeps", json_integer(s->substeps));
    json_object_set_new(o, "gravity", cli_json_reals(s->gravity, 3));
    json_object_set_new(o, "method", json_string(cli_method_name(s->method)));
    json_object_set_new(o, "iterations", json_integer(s->iterations));
    json_object_set_new(o, "relaxation", cli_json_real(s->relaxation));
    json_object_set_new(o, "penalty_period", json_integer(s->penalty_period));
    json_object_set_new(o, "penalty_mass_factor", cli_json_real(s->penalty_mass_factor));
    json_object_set_new(o, "penalty_offset", cli_json_real(s->penalty_offset));
    json_object_set_new(o, "penalty_ratio_limit", cli_json_real(s->penalty_ratio_limit));
    json_object_set_new(o, "penalty_update_warm", json_boolean(s->penalty_update_warm));
    json_object_set_new(o, "warm_start", json_boolean(s->warm_start));
    json_object_set_new(o, "residual_tolerance", cli_json_real(s->residual_tolerance));
    json_object_set_new(o, "certificate_tolerance", cli_json_real(s->certificate_tolerance));
    json_object_set_new(o, "certificate_momentum_tolerance", cli_json_real(s->certificate_momentum_tolerance));
    json_object_set_new(o, "check_period", json_integer(s->check_period));
    json_object_set_new(o, "baumgarte", cli_json_real(s->baumgarte));
    json_object_set_new(o, "slop", cli_json_real(s->slop));
    json_object_set_new(o, "correction_speed", cli_json_real(s->correction_speed));
    json_object_set_new(o, "restitution_threshold", cli_json_real(s->restitution_threshold));
    return o;
}

int cli_open_json(const char *name, struct output **output)
{
    *output = NULL;
    return name ? output_open("--json", name, OUTPUT_STREAM, output) : CLI_DONE;
}

int cli_write_json(json_t *object, struct output *output)
{
    FILE *stream = output_stream(output);
    bool complete = json_dumpf(object, stream, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) == 0;
    json_decref(object);
    fputc('\n', stream);
    if (complete || ferror(stream)) return output_close(output);
    output_drop(output);
    return cli_error(CLI_FAILED, "out of memory for the JSON");
}

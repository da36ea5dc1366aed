#include <string.h>
#include <sys/utsname.h>

#include "cli.h"
#include "scene_file/fields.h"

json_t *cli_json_real(double x) { return sadmm_json_real(x); }
json_t *cli_json_reals(const double *x, size_t count) { return sadmm_json_reals(x, count); }

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

void cli_json_add_build(json_t *object) { sadmm_json_add_build(object); }

json_t *cli_json_settings(const sadmm_settings *s)
{
    json_t *o = json_object();
    sadmm_write_fields(o, &sadmm_settings_fields, s);
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

/* subadmm backends: what this build and this machine can run, and why not the rest. */
#include "cli.h"

enum { OPTION_JSON };

static const struct cli_option options[] = {
    [OPTION_JSON] = {"json", "[FILE|-]", "write JSON to FILE, or to standard output (-, the default)"},
};

static int set_option(void *target, size_t index, const char *value)
{
    (void)index;
    return cli_read_output("--json", value, target) ? CLI_DONE : CLI_USAGE;
}

static json_t *backends_json(void)
{
    json_t *root = json_object(), *array = json_array();
    for (int k = SADMM_BACKEND_REF; k < SADMM_BACKEND_COUNT; ++k) {
        sadmm_backend_info info;
        json_t *o = json_object();
        if (sadmm_backend_query((sadmm_backend)k, &info) == SADMM_OK) {
            json_object_set_new(o, "name", json_string(info.name));
            json_object_set_new(o, "f32", json_boolean(info.available[SADMM_F32]));
            json_object_set_new(o, "f64", json_boolean(info.available[SADMM_F64]));
            json_object_set_new(o, "reason", json_string(info.reason));
        }
        json_array_append_new(array, o);
    }
    cli_json_add_build(root);
    json_object_set_new(root, "backends", array);
    return root;
}

static int run(int argc, char **argv)
{
    const char *name = NULL;
    struct output *json;
    int code = cli_parse(&cli_backends, argc, argv, set_option, &name, NULL);
    if (code >= 0) return code;
    if ((code = cli_open_json(name, &json)) != CLI_DONE) return code;
    if (json) return cli_write_json(backends_json(), json);
    printf("%-8s %-5s %-5s %s\n", "backend", "f32", "f64", "");
    for (int k = SADMM_BACKEND_REF; k < SADMM_BACKEND_COUNT; ++k) {
        sadmm_backend_info info;
        if (sadmm_backend_query((sadmm_backend)k, &info) != SADMM_OK) continue;
        printf("%-8s %-5s %-5s %s\n", info.name, info.available[SADMM_F32] ? "yes" : "no",
               info.available[SADMM_F64] ? "yes" : "no", info.reason);
    }
    return CLI_DONE;
}

const struct cli_command cli_backends = {
    .name = "backends",
    .operands = "",
    .summary = "list the backends and precisions, and why one is missing",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .run = run,
};

/* subadmm settings: what a step can be set to, from the list of settings (core/base/settings_fields.h); and the option
 * --set of other commands. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "core/base/settings_fields.h"

static const struct sadmm_field *const list = sadmm_settings_table;

/* ---- --set ------------------------------------------------------------------------------------------------------- */

static bool read_flag(const char *name, const char *text, bool *out)
{
    *out = strcmp(text, "true") == 0;
    if (*out || strcmp(text, "false") == 0) return true;
    cli_error(CLI_USAGE, "--set %s '%s': must be true or false", name, text);
    return false;
}

static bool read_vector(const char *name, const char *text, double out[3])
{
    const char *at = text;
    for (int k = 0; k < 3; ++k) {
        char *end;
        out[k] = strtod(at, &end);
        if (end == at || *end != (k < 2 ? ',' : 0)) {
            cli_error(CLI_USAGE, "--set %s '%s': must be three numbers, x,y,z", name, text);
            return false;
        }
        at = end + 1;
    }
    return true;
}

bool cli_read_setting(const char *text, sadmm_settings *settings)
{
    const char *equals = strchr(text, '=');
    const size_t length = equals ? (size_t)(equals - text) : 0;
    for (int k = 0; equals && k < SADMM_SETTING_COUNT; ++k) {
        const struct sadmm_field *s = &list[k];
        void *at = (char *)settings + s->offset;
        char name[64];
        long whole;
        if (strlen(s->name) != length || strncmp(s->name, text, length) != 0) continue;
        snprintf(name, sizeof name, "--set %s", s->name);
        switch (s->kind) {
        case SADMM_FIELD_REALS:
            return s->count == 1 ? cli_read_real(name, equals + 1, -HUGE_VAL, HUGE_VAL, at)
                                 : read_vector(s->name, equals + 1, at);
        case SADMM_FIELD_FLAG: return read_flag(s->name, equals + 1, at);
        case SADMM_FIELD_NAMED: return cli_read_name(name, equals + 1, s->names, s->count, at);
        case SADMM_FIELD_WHOLE:
            if (!cli_read_int(name, equals + 1, INT_MIN, INT_MAX, &whole)) return false;
            *(int *)at = (int)whole;
            return true;
        default: break; /* no setting is */
        }
    }
    cli_error(CLI_USAGE, "--set '%s': must be NAME=VALUE; subadmm settings lists the names", text);
    return false;
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

enum { OPTION_JSON };

static const struct cli_option options[] = {
    [OPTION_JSON] = {"json", "[FILE|-]", "write a JSON schema to FILE, or to standard output (-, the default)"},
};

static int set_option(void *target, size_t index, const char *value)
{
    (void)index;
    return cli_read_output("--json", value, target) ? CLI_DONE : CLI_USAGE;
}

static const void *default_of(const sadmm_settings *defaults, const struct sadmm_field *s)
{
    return (const char *)defaults + s->offset;
}

static json_t *number_json(const struct sadmm_field *s, double x)
{
    return s->kind == SADMM_FIELD_WHOLE || x == floor(x) ? json_integer((json_int_t)x) : json_real(x);
}

static void put_range(json_t *o, const struct sadmm_field *s)
{
    const bool above = s->ends == SADMM_ENDS_ABOVE, below = s->ends == SADMM_ENDS_BELOW;
    if (s->ends == SADMM_ENDS_ANY) return;
    json_object_set_new(o, above ? "exclusiveMinimum" : "minimum", number_json(s, s->lo));
    if (below || s->ends == SADMM_ENDS_CLOSED)
        json_object_set_new(o, below ? "exclusiveMaximum" : "maximum", number_json(s, s->hi));
}

static json_t *setting_json(const struct sadmm_field *s, const void *value)
{
    json_t *o = json_object(), *array;
    switch (s->kind) {
    case SADMM_FIELD_REALS:
        if (s->count == 1) {
            json_object_set_new(o, "type", json_string("number"));
            json_object_set_new(o, "default", number_json(s, *(const double *)value));
            break;
        }
        json_object_set_new(o, "type", json_string("array"));
        json_object_set_new(o, "minItems", json_integer(s->count));
        json_object_set_new(o, "maxItems", json_integer(s->count));
        json_object_set_new(o, "items", array = json_object());
        json_object_set_new(array, "type", json_string("number"));
        json_object_set_new(array, "minimum", number_json(s, s->lo));
        json_object_set_new(array, "maximum", number_json(s, s->hi));
        json_object_set_new(o, "default", cli_json_reals(value, (size_t)s->count));
        break;
    case SADMM_FIELD_WHOLE:
        json_object_set_new(o, "type", json_string("integer"));
        json_object_set_new(o, "default", json_integer(*(const int *)value));
        break;
    case SADMM_FIELD_FLAG:
        json_object_set_new(o, "type", json_string("boolean"));
        json_object_set_new(o, "default", json_boolean(*(const bool *)value));
        break;
    case SADMM_FIELD_NAMED:
        json_object_set_new(o, "enum", array = json_array());
        for (int k = 0; k < s->count; ++k) json_array_append_new(array, json_string(s->names[k]));
        json_object_set_new(o, "default", json_string(s->names[*(const int *)value]));
        break;
    default: break; /* no setting is */
    }
    put_range(o, s);
    json_object_set_new(o, "description", json_string(s->text));
    return o;
}

static json_t *settings_json(const sadmm_settings *defaults)
{
    json_t *root = json_object(), *properties = json_object();
    for (int k = 0; k < SADMM_SETTING_COUNT; ++k)
        json_object_set_new(properties, list[k].name, setting_json(&list[k], default_of(defaults, &list[k])));
    json_object_set_new(root, "type", json_string("object"));
    json_object_set_new(root, "additionalProperties", json_false());
    json_object_set_new(root, "properties", properties);
    return root;
}

static void print_default(const struct sadmm_field *s, const void *value)
{
    const double *x = value;
    char text[64];
    switch (s->kind) {
    case SADMM_FIELD_REALS:
        if (s->count == 1) snprintf(text, sizeof text, "%g", *x);
        else snprintf(text, sizeof text, "%g,%g,%g", x[0], x[1], x[2]);
        break;
    case SADMM_FIELD_WHOLE: snprintf(text, sizeof text, "%d", *(const int *)value); break;
    case SADMM_FIELD_FLAG: snprintf(text, sizeof text, "%s", *(const bool *)value ? "true" : "false"); break;
    case SADMM_FIELD_NAMED: snprintf(text, sizeof text, "%s", s->names[*(const int *)value]); break;
    default: break; /* no setting is */
    }
    printf("%-31s %-10s ", s->name, text);
}

static void print_range(const struct sadmm_field *s)
{
    char text[64] = "";
    switch (s->ends) {
    case SADMM_ENDS_CLOSED: snprintf(text, sizeof text, "[%g, %.10g]", s->lo, s->hi); break;
    case SADMM_ENDS_BELOW: snprintf(text, sizeof text, "[%g, %g)", s->lo, s->hi); break;
    case SADMM_ENDS_FROM: snprintf(text, sizeof text, ">= %g", s->lo); break;
    case SADMM_ENDS_ABOVE: snprintf(text, sizeof text, "> %g", s->lo); break;
    case SADMM_ENDS_ANY: break;
    }
    printf("%-16s %s\n", text, s->text);
}

static int run(int argc, char **argv)
{
    const sadmm_settings defaults = sadmm_settings_default();
    const char *name = NULL;
    struct output *json;
    int code = cli_parse(&cli_settings, argc, argv, set_option, &name, NULL);
    if (code >= 0) return code;
    if ((code = cli_open_json(name, &json)) != CLI_DONE) return code;
    if (json) return cli_write_json(settings_json(&defaults), json);
    for (int k = 0; k < SADMM_SETTING_COUNT; ++k) {
        print_default(&list[k], default_of(&defaults, &list[k]));
        print_range(&list[k]);
    }
    return CLI_DONE;
}

const struct cli_command cli_settings = {
    .name = "settings",
    .operands = "",
    .summary = "list the settings of a step: defaults, ranges, meaning",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .run = run,
};

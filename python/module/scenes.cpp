// The scenes of the library, by name.
#include <cstdio>
#include <cstdlib>

#include "common.h"
#include "tags.h"

static nb::list list_scenes()
{
    nb::list out;
    for (size_t k = 0; k < sadmm_scene_count(); ++k) {
        const sadmm_scene_info *info = sadmm_scene_at(k);
        nb::dict d;
        d["name"] = info->name, d["arguments"] = info->arguments, d["description"] = info->description;
        d["duration"] = info->duration, d["chaotic"] = info->chaotic;
        out.append(d);
    }
    return out;
}

static void check_error(sadmm_status status, const sadmm_error &error)
{
    if (status != SADMM_OK) raise_status(status, error.message);
}

// Of `spec`, or (a text) of a scene file's text. As `subadmm run` does it.
static std::unique_ptr<world> build(const std::string &spec, bool is_text, const std::string &backend,
                                    const std::optional<std::string> &precision,
                                    const std::optional<std::string> &method, whole device, nb::handle settings)
{
    auto made = std::make_unique<world>();
    sadmm_error error{};
    if (!is_text) without_null("scene", spec);
    check_error(is_text ? sadmm_scene_open_text(spec.data(), spec.size(), nullptr, &made->scene, &error)
                        : sadmm_scene_open(spec.c_str(), &made->scene, &error), error);
    sadmm_world_def &def = made->scene.def;
    def.backend = named<sadmm_backend>("backend", backend);
    def.device = device.as_int("device");
    if (precision) def.precision = named<sadmm_precision>("precision", *precision);
    if (method) sadmm_scene_set_method(&made->scene, named<sadmm_method>("method", *method));
    if (!settings.is_none()) {
        if (!nb::isinstance<nb::dict>(settings))
            refuse_type("settings", settings, "must be a dict of changes, as {'dt': 0.002}");
        nb::object changed = settings_read(def.settings, nb::none(), nullptr);
        set_members(changed, settings);
        def.settings = read_settings(changed);
    }
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        sadmm_world *built = nullptr;
        status = sadmm_scene_build(&made->scene, &built, &error);
        made->take(built);
        if (status == SADMM_OK) status = sadmm_scene_observe(&made->scene, made->handle, 0, &made->result, &error);
    }
    check_error(status, error);
    made->scripted = true;
    if (!is_text) made->spec = spec;
    made->def = def;
    return made;
}

// Another world with the same state, which makes the same steps; with the scene's script and where that is.
static std::unique_ptr<world> clone_of(world &w)
{
    auto made = std::make_unique<world>();
    sadmm_error error{};
    sadmm_status status;
    const bool tagged = !w.user_data.by_key.empty();
    {
        nb::gil_scoped_release release;
        world_lock lock(w);
        std::vector<char> bytes;
        size_t size = 0;
        sadmm_world *copy = nullptr;
        status = sadmm_world_save(w.handle, nullptr, 0, &size);
        if (status == SADMM_OK) {
            bytes.resize(size);
            status = sadmm_world_save(w.handle, bytes.data(), size, &size);
        }
        if (status != SADMM_OK) snprintf(error.message, sizeof error.message, "%s", sadmm_world_message(w.handle));
        if (status == SADMM_OK) {
            sadmm_world_def def = w.def;
            def.settings = sadmm_world_settings(w.handle);
            status = sadmm_world_create(&def, &copy);
            if (status != SADMM_OK) snprintf(error.message, sizeof error.message, "%s", sadmm_last_message());
        }
        if (status == SADMM_OK) {
            made->take(copy);
            status = sadmm_world_restore(copy, bytes.data(), bytes.size());
            if (status != SADMM_OK) snprintf(error.message, sizeof error.message, "%s", sadmm_world_message(copy));
        }
        if (status == SADMM_OK && tagged)
            each_key(w.handle, [&](auto id, void *key) { tag_calls<decltype(id)>::set(copy, id, key); });
        made->def = w.def, made->steps = w.steps, made->warned = w.warned;
        // A scene of the library belongs to nobody; one of a file has no script, and is its world's own.
        if (w.scripted && !w.scene.loaded) {
            made->scripted = true;
            made->script_on = w.script_on, made->spec = w.spec, made->scene = w.scene, made->result = w.result;
        }
    }
    check_error(status, error);
    made->user_data = w.user_data;
    made->user_data.placing.clear();
    return made;
}

// As a scene file: of a scene what `subadmm scenes SPEC --json` writes, where nothing else is given.
static std::string to_json(world &w, const std::optional<std::string> &name,
                           const std::optional<std::string> &description, std::optional<double> duration)
{
    if (name) without_null("name", *name);
    if (description) without_null("description", *description);
    char *text = nullptr;
    size_t size = 0;
    sadmm_error error{};
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        world_lock lock(w);
        FILE *stream = open_memstream(&text, &size);
        if (!stream) {
            status = SADMM_ERROR_OUT_OF_MEMORY;
        } else if (w.scripted && !name && !description) {
            sadmm_scene scene = w.scene;
            scene.def = w.def;
            if (duration) scene.duration = *duration;
            status = sadmm_scene_write(&scene, w.spec.empty() ? nullptr : w.spec.c_str(), w.handle, stream, &error);
        } else {
            const sadmm_settings settings = sadmm_world_settings(w.handle);
            const std::string own = name.value_or("world"), about_it = description.value_or("");
            sadmm_scene_about about{};
            about.spec = about.name = own.c_str();
            about.description = about_it.c_str();
            about.n = about.m = -1;
            about.duration = duration.value_or(w.scripted ? w.scene.duration : 10.0);
            for (int k = 0; k < SADMM_METHOD_COUNT; ++k)
                about.iterations[k] = settings.iterations, about.substeps[k] = settings.substeps;
            status = sadmm_scene_file_write(&about, &w.def, w.handle, stream, &error);
        }
        if (stream) fclose(stream);
    }
    const std::string out = text ? std::string(text, size) : std::string();
    free(text);
    check_error(status, error);
    return out;
}

static nb::object result(world &w)
{
    nb::list tasks;
    const auto now = ask(w, [&](sadmm_world *) { return w.result; });
    for (int k = 0; k < now.task_count; ++k) {
        const sadmm_scene_task &task = now.tasks[k];
        nb::dict d, figures;
        for (int f = 0; f < task.figure_count; ++f) figures[task.figures[f].name] = task.figures[f].value;
        d["name"] = task.name, d["finished"] = task.finished, d["passed"] = task.passed, d["figures"] = figures;
        tasks.append(d);
    }
    return tasks;
}

void bind_scenes(nb::module_ &m, nb::class_<world> &w)
{
    m.def("scenes", &list_scenes,
          "The scenes of the library: a list of dicts with name, arguments, description, duration (s), "
          "chaotic.");
    m.def("_scene", &build, "spec"_a, "is_text"_a, nb::kw_only(), "backend"_a = "auto", "precision"_a = nb::none(),
          "method"_a = nb::none(), "device"_a = 0, "settings"_a = nb::none());
    w.def("clone", &clone_of,
          "Another World with the same state, which makes the same steps, bit for bit; events that wait are not "
          "copied. The\nscript of a scene of the library goes on in both.");
    w.def("_to_json", &to_json, "name"_a.none(), "description"_a.none(), "duration"_a.none());
    w.def_prop_ro(
        "has_script",
        [](world &w) { return w.scripted && ask(w, [&](sadmm_world *) { return sadmm_scene_has_script(&w.scene); }); },
        "Whether the scene has a script: inputs that steps apply and that scene files do not contain.");
    w.def_prop_ro("duration", [](world &w) -> nb::object {
        return w.scripted ? nb::cast(ask(w, [&](sadmm_world *) { return w.scene.duration; })) : nb::none();
    }, "Duration of the scene, s; None for other worlds.");
    w.def_prop_rw(
        "script", [](world &w) { return w.scripted && ask(w, [&](sadmm_world *) { return w.script_on; }); },
        [](world &w, bool on) {
            if (on && !w.scripted)
                throw nb::value_error("script: the world has none; only a scene's world can have one");
            ask(w, [&](sadmm_world *) { return w.script_on = on; });
        },
        "Whether the scene's script runs: its motions and measurements. While it is off, the caller sets the "
        "targets of joints\n"
        "and couplings; switched on again, it continues at the current time.");
    w.def_prop_ro("tasks", &result, "What the scene measures of its task, after steps that were waited for.");
}

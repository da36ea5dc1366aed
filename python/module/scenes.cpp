// The scenes of the library, by name.
#include <cstdio>
#include <cstdlib>

#include "common.h"

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
                                    const std::optional<std::string> &precision, const std::optional<std::string> &method,
                                    int device, nb::handle settings)
{
    auto made = std::make_unique<world>();
    sadmm_error error{};
    check_error(is_text ? sadmm_scene_open_text(spec.data(), spec.size(), nullptr, &made->scene, &error)
                        : sadmm_scene_open(spec.c_str(), &made->scene, &error), error);
    sadmm_world_def &def = made->scene.def;
    def.backend = named("backend", backend, backend_names);
    def.device = device;
    if (precision) def.precision = named("precision", *precision, precision_names);
    if (method) sadmm_scene_set_method(&made->scene, named("method", *method, method_names));
    if (!settings.is_none()) {
        nb::object changed = nb::cast(def.settings);
        for (auto [name, value] : nb::cast<nb::dict>(settings)) nb::setattr(changed, nb::cast<nb::str>(name), value);
        def.settings = nb::cast<sadmm_settings>(changed);
    }
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        status = sadmm_scene_build(&made->scene, &made->handle, &error);
        if (status == SADMM_OK) status = sadmm_scene_observe(&made->scene, made->handle, 0, &made->result, &error);
    }
    check_error(status, error);
    made->scripted = true;
    made->def = def;
    return made;
}

static std::string to_json(world &w, const std::string &name, const std::string &description, double duration)
{
    char *text = nullptr;
    size_t size = 0;
    sadmm_error error{};
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        std::lock_guard<std::mutex> lock(w.mutex);
        const sadmm_settings settings = sadmm_world_settings(w.handle);
        sadmm_scene_about about{};
        about.spec = about.name = name.c_str();
        about.description = description.c_str();
        about.n = about.m = -1;
        about.duration = duration;
        for (int k = 0; k < SADMM_METHOD_COUNT; ++k) about.iterations[k] = settings.iterations, about.substeps[k] = settings.substeps;
        FILE *stream = open_memstream(&text, &size);
        status = stream ? sadmm_scene_file_write(&about, &w.def, w.handle, stream, &error) : SADMM_ERROR_OUT_OF_MEMORY;
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
    for (int k = 0; k < w.result.task_count; ++k) {
        const sadmm_scene_task &task = w.result.tasks[k];
        nb::dict d, figures;
        for (int f = 0; f < task.figure_count; ++f) figures[task.figures[f].name] = task.figures[f].value;
        d["name"] = task.name, d["finished"] = task.finished, d["passed"] = task.passed, d["figures"] = figures;
        tasks.append(d);
    }
    return tasks;
}

void bind_scenes(nb::module_ &m, nb::class_<world> &w)
{
    m.def("scenes", &list_scenes, "The scenes of the library: a list of dicts with name, arguments, description, duration (s), "
                                  "chaotic.");
    m.def("_scene", &build, "spec"_a, "is_text"_a, nb::kw_only(), "backend"_a = "auto", "precision"_a = nb::none(), "method"_a = nb::none(),
          "device"_a = 0, "settings"_a = nb::none());
    w.def("_to_json", &to_json, "name"_a, "description"_a, "duration"_a);
    w.def_prop_ro("duration", [](world &w) -> nb::object {
        return w.scripted ? nb::cast(w.scene.duration) : nb::none();
    }, "Of a scene: how long it is meant to be run for, s; None of other worlds.");
    w.def_prop_rw("script", [](world &w) { return w.scripted && w.script_on; },
                  [](world &w, bool on) {
                      if (on && !w.scripted) throw nb::value_error("script: the world has none; only a scene's world can have one");
                      w.script_on = on;
                  },
                  "Does a scene's script act: the motions that come with its steps, and what it measures? Switched off, joints' and\n"
                  "couplings' targets are the caller's; on again, it goes on at the time that has come by then.");
    w.def_prop_ro("tasks", &result, "Of a scene: what it measures of its own success, after steps that were waited for.");
}

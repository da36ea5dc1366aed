// The scenes of the library, by name.
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

// As `subadmm run` does it.
static std::unique_ptr<world> build(const std::string &spec, const std::string &backend,
                                    const std::optional<std::string> &precision, const std::optional<std::string> &method,
                                    int device, nb::handle settings)
{
    auto made = std::make_unique<world>();
    sadmm_error error{};
    check_error(sadmm_scene_open(spec.c_str(), &made->scene, &error), error);
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
    return made;
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
    m.def("scene", &build, "spec"_a, nb::kw_only(), "backend"_a = "auto", "precision"_a = nb::none(), "method"_a = nb::none(),
          "device"_a = 0, "settings"_a = nb::none(),
          "A world of a scene by name, 'pile:300' say, as the subadmm command builds and steps it. `settings`: a dict of changes "
          "to the scene's own, as {'dt': 0.002}.");
    w.def_prop_ro("duration", [](world &w) -> nb::object {
        return w.scripted ? nb::cast(w.scene.duration) : nb::none();
    }, "Of a scene: how long it is meant to be run for, s; None of other worlds.");
    w.def_prop_ro("tasks", &result, "Of a scene: what it measures of its own success, after steps that were waited for.");
}

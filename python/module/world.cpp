// Worlds: bodies, shapes, steps, saved states.
#include <chrono>

#include "common.h"

static void init_world(world *self, const std::string &backend, const std::string &precision, int device,
                       double contact_margin, std::optional<sadmm_settings> settings)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = named("backend", backend, backend_names);
    def.precision = named("precision", precision, precision_names);
    def.device = device;
    def.contact_margin = contact_margin;
    if (settings) def.settings = *settings;
    new (self) world();
    self->def = def;
    const sadmm_status status = sadmm_world_create(&def, &self->handle);
    if (status != SADMM_OK) {
        self->~world();
        raise_status(status, sadmm_last_message());
    }
}

// One step, with the scene's script before it. Under the world's lock, without the interpreter's.
static sadmm_status step_once(world &w, bool wait, std::string &message)
{
    sadmm_error error{};
    sadmm_status status = SADMM_OK;
    const bool script = w.scripted && w.script_on;
    if (script) {
        status = sadmm_scene_before_step(&w.scene, w.handle, w.steps, &error);
        message = error.message;
    }
    if (status == SADMM_OK) {
        status = wait ? sadmm_world_step(w.handle) : sadmm_world_step_async(w.handle);
        if (status != SADMM_OK) message = sadmm_world_message(w.handle);
    }
    if (status == SADMM_OK) ++w.steps;
    if (status == SADMM_OK && script && wait) {
        status = sadmm_scene_observe(&w.scene, w.handle, w.steps, &w.result, &error);
        message = error.message;
    }
    return status;
}

// Many, with a look at whether the user has interrupted them now and then.
static void step(world &w, int64_t n, bool wait)
{
    if (n < 0) throw nb::value_error("n: must be 0 or more");
    for (int64_t k = 0; k < n;) {
        sadmm_status status = SADMM_OK;
        std::string message;
        {
            nb::gil_scoped_release release;
            std::lock_guard<std::mutex> lock(w.mutex);
            const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
            do {
                status = step_once(w, wait, message);
                ++k;
            } while (status == SADMM_OK && k < n && std::chrono::steady_clock::now() < end);
        }
        if (status != SADMM_OK) raise_status(status, message);
        if (k < n && PyErr_CheckSignals() != 0) throw nb::python_error();
    }
}

// ---- bodies ----------------------------------------------------------------------------------------------------------

static body add_body(nb::handle_t<world> self, const std::string &type, double mass, vec3 inertia, vec3 position,
                     quat orientation, vec3 linear_velocity, vec3 angular_velocity, int32_t environment,
                     const std::string &name, double gravity_scale, double linear_damping, double angular_damping)
{
    world &w = nb::cast<world &>(self);
    sadmm_body_def def = sadmm_body_def_default();
    body out{nb::borrow(self), &w, {}};
    def.type = named("type", type, body_type_names);
    def.mass = mass;
    put(inertia, def.inertia), put(position, def.position), put(orientation, def.orientation);
    put(linear_velocity, def.linear_velocity), put(angular_velocity, def.angular_velocity);
    def.environment = environment;
    def.name = name.c_str();
    def.gravity_scale = gravity_scale, def.linear_damping = linear_damping, def.angular_damping = angular_damping;
    call(w, [&](sadmm_world *h) { return sadmm_world_add_body(h, &def, &out.id); });
    return out;
}

static sadmm_body_state state_of(const body &b)
{
    sadmm_body_state state;
    call(*b.w, [&](sadmm_world *h) { return sadmm_world_body_state(h, b.id, &state); });
    return state;
}

static void set_state(const body &b, const sadmm_body_state &state)
{
    call(*b.w, [&](sadmm_world *h) { return sadmm_world_set_body_state(h, b.id, &state); });
}

static sadmm_body_def def_of(const body &b)
{
    sadmm_body_def def;
    call(*b.w, [&](sadmm_world *h) { return sadmm_world_body_def(h, b.id, &def); });
    return def;
}

template <size_t N> using member = double (sadmm_body_state::*)[N];

template <size_t N> static void bind_member(nb::class_<body> &c, const char *name, member<N> at, const char *doc)
{
    c.def_prop_rw(name, [at](const body &b) { return array_of<N>(state_of(b).*at); },
                  [at](const body &b, std::array<double, N> x) {
                      sadmm_body_state state = state_of(b);
                      put(x, state.*at);
                      set_state(b, state);
                  }, doc);
}

static shape add_shape(const body &b, const shape_def &def)
{
    shape out{b.owner, b.w, {}};
    call(*b.w, [&](sadmm_world *h) { return sadmm_world_add_shape(h, b.id, &def.def, &out.id); });
    return out;
}

static void bind_body(nb::module_ &m)
{
    nb::class_<body> c(m, "Body", "A body of a world. Body(...) is made by World.add_body, World.add_solid, World.bodies.");
    c.def("__eq__", [](const body &a, const body &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_body_id>)
        .def("__repr__", [](const body &b) { return "<subadmm.Body " + std::to_string(b.id.slot) + "." + std::to_string(b.id.generation) + ">"; })
        .def_prop_ro("world", [](const body &b) { return b.owner; })
        .def_prop_ro("index", [](const body &b) {
            int32_t index;
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_body_index(h, b.id, &index); });
            return index;
        }, "Row of the world's arrays.")
        .def_prop_ro("name", [](const body &b) { return std::string(def_of(b).name); })
        .def_prop_ro("type", [](const body &b) { return name_of(def_of(b).type, body_type_names); }, "'dynamic', 'static' or 'kinematic'.")
        .def_prop_ro("mass", [](const body &b) { return def_of(b).mass; }, "kg.")
        .def_prop_ro("inertia", [](const body &b) { return array_of<3>(def_of(b).inertia); }, "Principal moments, kg m^2.")
        .def("set_mass", [](const body &b, double mass, vec3 inertia) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_set_body_mass(h, b.id, mass, inertia.data()); });
        }, "mass"_a, "inertia"_a, "From the next step on.");
    bind_member<3>(c, "position", &sadmm_body_state::position, "Centre of mass, m.");
    bind_member<4>(c, "orientation", &sadmm_body_state::orientation, "w x y z, body to world.");
    bind_member<3>(c, "linear_velocity", &sadmm_body_state::linear_velocity, "m/s.");
    bind_member<3>(c, "angular_velocity", &sadmm_body_state::angular_velocity, "rad/s, world frame.");
    c.def("add_shape", &add_shape, "shape"_a, "Put a shape on the body, at the definition's position and orientation.")
        .def("move_to", [](const body &b, vec3 x, quat q) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_move_body(h, b.id, x.data(), q.data()); });
        }, "position"_a, "orientation"_a, "Let a kinematic body go to a pose within the next step.")
        .def("set_wrench", [](const body &b, vec3 f, vec3 t) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_set_body_wrench(h, b.id, f.data(), t.data()); });
        }, "force"_a, "torque"_a = vec3{}, "External force (N) at the centre of mass and torque (N m), world frame, kept until set again.")
        .def("add_force_at", [](const body &b, vec3 f, vec3 x) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_add_body_force_at(h, b.id, f.data(), x.data()); });
        }, "force"_a, "point"_a, "Add a force (N) at a point (m, world) to the external wrench.")
        .def("apply_impulse_at", [](const body &b, vec3 p, vec3 x) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_apply_body_impulse_at(h, b.id, p.data(), x.data()); });
        }, "impulse"_a, "point"_a, "Change the velocities at once by an impulse (N s) at a point (m, world).")
        .def("set_gravity_scale", [](const body &b, double s) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_set_body_gravity_scale(h, b.id, s); });
        }, "scale"_a)
        .def("set_damping", [](const body &b, double linear, double angular) {
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_set_body_damping(h, b.id, linear, angular); });
        }, "linear"_a, "angular"_a, "1/s.")
        .def_prop_ro("contact_wrench", [](const body &b) {
            vec6 out;
            call(*b.w, [&](sadmm_world *h) { return sadmm_world_body_contact_wrench(h, b.id, out.data()); });
            return out;
        }, "Force (N) and torque about the centre of mass (N m) of the last step's contacts.")
        .def("ignore", [](const body &a, const body &b, bool off) {
            call(*a.w, [&](sadmm_world *h) { return sadmm_world_set_body_pair_contact(h, a.id, b.id, !off); });
        }, "other"_a, "off"_a = true, "Turn contact with another body off, or on again.")
        .def("remove", [](const body &b) { call(*b.w, [&](sadmm_world *h) { return sadmm_world_remove_body(h, b.id); }); },
             "With its shapes, joints and couplings.");

    nb::class_<shape>(m, "BodyShape", "A shape on a body.")
        .def("__eq__", [](const shape &a, const shape &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_shape_id>)
        .def_prop_ro("world", [](const shape &s) { return s.owner; })
        .def_prop_ro("index", [](const shape &s) {
            int32_t index;
            call(*s.w, [&](sadmm_world *h) { return sadmm_world_shape_index(h, s.id, &index); });
            return index;
        })
        .def_prop_ro("body", [](const shape &s) {
            body out{s.owner, s.w, {}};
            sadmm_shape_def def;
            call(*s.w, [&](sadmm_world *h) { return sadmm_world_shape_def(h, s.id, &def, &out.id); });
            return out;
        })
        .def_prop_ro("definition", [](const shape &s) {
            shape_def out;
            call(*s.w, [&](sadmm_world *h) {
                const sadmm_status status = sadmm_world_shape_def(h, s.id, &out.def, nullptr);
                if (status == SADMM_OK) hold_parts(out); // the world could let go of them
                return status;
            });
            return out;
        }, "As it is now.")
        .def("set_material", [](const shape &s, double mu, double e) {
            call(*s.w, [&](sadmm_world *h) { return sadmm_world_set_shape_material(h, s.id, mu, e); });
        }, "friction"_a, "restitution"_a = 0.0)
        .def("set_pair_friction", [](const shape &a, const shape &b, double mu) {
            call(*a.w, [&](sadmm_world *h) { return sadmm_world_set_pair_friction(h, a.id, b.id, mu); });
        }, "other"_a, "friction"_a, "Of the two shapes; -1: the geometric mean again.")
        .def("remove", [](const shape &s) { call(*s.w, [&](sadmm_world *h) { return sadmm_world_remove_shape(h, s.id); }); });
}

void bind_world(nb::module_ &m, nb::class_<world> &w)
{
    bind_body(m);
    w.def("__init__", &init_world, nb::kw_only(), "backend"_a = "auto", "precision"_a = "f64", "device"_a = 0,
          "contact_margin"_a = 0.02, "settings"_a = nb::none(),
          "backend: 'auto', 'ref', 'cpu' or 'cuda'; precision: 'f64' or 'f32'; device: which accelerator; contact_margin: "
          "speculative margin as a share of the thinner shape's extent; settings: Settings, or the defaults.");
    w.def_prop_rw("settings", [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_settings(h); }); },
                  [](world &w, const sadmm_settings &s) { call(w, [&](sadmm_world *h) { return sadmm_world_set_settings(h, &s); }); },
                  "A copy: change it and set it again. From the next step on.");
    w.def("set_backend", [](world &w, const std::string &backend, const std::string &precision, int device) {
        const auto b = named("backend", backend, backend_names);
        const auto p = named("precision", precision, precision_names);
        call(w, [&](sadmm_world *h) {
            const sadmm_status status = sadmm_world_set_backend(h, b, p, device);
            if (status == SADMM_OK) w.def.precision = p;
            return status;
        });
    }, "backend"_a, "precision"_a = "f64", "device"_a = 0, "Who makes the steps from the next one on.");
    w.def("add_body", &add_body, nb::kw_only(), "type"_a = "dynamic", "mass"_a = 0.0, "inertia"_a = vec3{}, "position"_a = vec3{},
          "orientation"_a = quat{1, 0, 0, 0}, "linear_velocity"_a = vec3{}, "angular_velocity"_a = vec3{},
          "environment"_a = 0, "name"_a = "", "gravity_scale"_a = 1.0, "linear_damping"_a = 0.0, "angular_damping"_a = 0.0,
          "A body without shapes. SI units; `inertia`: principal moments. World.add_solid computes masses.");
    w.def_prop_ro("body_count", [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_body_count(h); }); });
    w.def_prop_ro("shape_count", [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_shape_count(h); }); });
    w.def_prop_ro("bodies", [](nb::handle_t<world> self) {
        return all_of<body>(self, sadmm_world_body_count(nb::cast<world &>(self).handle), &sadmm_world_body_at);
    }, "All bodies, in the order of the arrays' rows.");
    w.def_prop_ro("shapes", [](nb::handle_t<world> self) {
        return all_of<shape>(self, sadmm_world_shape_count(nb::cast<world &>(self).handle), &sadmm_world_shape_at);
    }, "All shapes.");
    w.def("step", [](world &w, int64_t n) { step(w, n, true); }, "n"_a = 1,
          "Make n steps. A scene's scripted inputs come with them.");
    w.def("step_async", [](world &w, int64_t n) { step(w, n, false); }, "n"_a = 1,
          "Begin n steps without waiting for them, where the backend can.");
    w.def("wait", [](world &w) { call(w, [](sadmm_world *h) { return sadmm_world_wait(h); }); }, "Until all steps begun are done.");
    w.def_prop_ro("report", [](world &w) {
        sadmm_step_report r;
        call(w, [&](sadmm_world *h) { return sadmm_world_report(h, &r); });
        return r;
    }, "Of the last step.");
    w.def_prop_ro("contact_count", [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_contact_count(h); }); });
    w.def("state_hash", [](world &w) {
        uint64_t hash;
        call(w, [&](sadmm_world *h) { return sadmm_world_state_hash(h, &hash); });
        return hash;
    }, "64-bit hash of all bodies' poses and velocities, as the command prints it.");
    w.def("explain", [](world &w) {
        return ask(w, [](sadmm_world *h) {
            std::string text(sadmm_world_explain(h, nullptr, 0), '\0');
            sadmm_world_explain(h, text.data(), text.size() + 1);
            return text;
        });
    }, "What the last step ran, what it left out and why.");
    w.def("save", [](world &w) {
        std::string bytes;
        call(w, [&](sadmm_world *h) {
            size_t size;
            sadmm_status status = sadmm_world_save(h, nullptr, 0, &size);
            if (status == SADMM_OK) {
                bytes.resize(size);
                status = sadmm_world_save(h, bytes.data(), size, &size);
            }
            return status;
        });
        return nb::bytes(bytes.data(), bytes.size());
    }, "The whole state as bytes, for restore() in this build, here or in another process.");
    w.def("restore", [](world &w, nb::bytes bytes) {
        call(w, [&](sadmm_world *h) {
            sadmm_status status = sadmm_world_restore(h, bytes.data(), bytes.size());
            sadmm_step_report report;
            if (status == SADMM_OK) status = sadmm_world_report(h, &report);
            if (status == SADMM_OK) w.steps = report.step; // where a scene's script goes on
            return status;
        });
    }, "bytes"_a, "Become what was saved, to the last bit. What save() did not write is refused, and nothing changes.");
}

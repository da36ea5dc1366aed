// Worlds: bodies, shapes, steps, saved states.
#include <chrono>
#include <utility>

#include "fields.h"
#include "tags.h"

static void set_settings(nb::handle owner, const std::function<void(settings_of &)> &change)
{
    call(nb::cast<world &>(owner), [&](sadmm_world *h) {
        settings_of now;
        now.values = sadmm_world_settings(h);
        change(now);
        return sadmm_world_set_settings(h, &now.values);
    });
}

static void init_world(world *self, const std::string &backend, const std::string &precision, whole device,
                       double contact_margin, nb::object settings)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = named<sadmm_backend>("backend", backend);
    def.precision = named<sadmm_precision>("precision", precision);
    def.device = device.as_int("device");
    def.contact_margin = contact_margin;
    if (!settings.is_none()) def.settings = read_settings(settings);
    sadmm_world *made = nullptr;
    check(sadmm_world_create(&def, &made));
    new (self) world();
    self->take(made);
    self->def = def;
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

// Has the last step missed its tolerance, for the first time? Then what the warning says.
static bool misses_tolerance(world &w, std::string &warning)
{
    sadmm_step_report report;
    if (w.warned || sadmm_world_report(w.handle, &report) != SADMM_OK || report.unsolved <= 0) return false;
    char text[256], error[64] = "";
    if (report.error >= 0)
        snprintf(error, sizeof error, ": error %.2g m/s (%s)", report.error, name_of(report.error_kind));
    snprintf(text, sizeof text,
             "step %lld has missed its tolerance in %lld islands%s. Watch report.error and report.unsolved; more "
             "iterations or a shorter step help. This warning comes once a world",
             (long long)report.step, (long long)report.unsolved, error);
    warning = text;
    return w.warned = true;
}

// Many, with a look at whether the user has interrupted them now and then.
static void step(world &w, const whole &steps, bool wait)
{
    const int64_t n = steps.in("n", 0, INT64_MAX);
    std::string warning;
    for (int64_t k = 0; k < n;) {
        sadmm_status status = SADMM_OK;
        std::string message;
        {
            nb::gil_scoped_release release;
            world_lock lock(w);
            const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
            do {
                status = step_once(w, wait, message);
                ++k;
                if (wait && status == SADMM_OK) misses_tolerance(w, warning);
            } while (status == SADMM_OK && k < n && std::chrono::steady_clock::now() < end);
        }
        if (w.raised) throw nb::python_error(*std::exchange(w.raised, nullptr));
        if (status != SADMM_OK) raise_status(status, message);
        if (!warning.empty() && PyErr_WarnEx(PyExc_RuntimeWarning, warning.c_str(), 1) < 0) throw nb::python_error();
        warning.clear();
        if (k < n && PyErr_CheckSignals() != 0) throw nb::python_error();
    }
}

// ---- bodies ---------------------------------------------------------------------------------------------------------

// The shapes of a new body; of several, `which` is one that is refused.
static sadmm_status add_shapes(sadmm_world *h, sadmm_body_id body, const std::vector<shape_def> &shapes,
                               std::string &which)
{
    for (size_t k = 0; k < shapes.size(); ++k) {
        const sadmm_shape_def def = shapes[k].named();
        const sadmm_status status = sadmm_world_add_shape(h, body, &def, nullptr);
        if (status == SADMM_OK) continue;
        if (shapes.size() > 1) which = "shapes[" + std::to_string(k) + "]: ";
        return status;
    }
    return SADMM_OK;
}

// All of it or nothing, and nobody sees a part of it: under one lock.
static body add_body(nb::handle_t<world> self, const std::string &name SADMM_BODY_FIELDS(PARAMETER, ),
                     nb::object shapes)
{
    world &w = nb::cast<world &>(self);
    sadmm_body_def def = sadmm_body_def_default();
    body out{nb::borrow(self), &w, {}};
    SADMM_BODY_FIELDS(PUT, def)
    def.name = without_null("name", name).c_str();
    const std::vector<shape_def> parts = read_shapes("shapes", shapes);
    std::string message;
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        world_lock lock(w);
        status = sadmm_world_add_body(w.handle, &def, &out.id);
        const bool added = status == SADMM_OK;
        if (added) status = add_shapes(w.handle, out.id, parts, message);
        if (status != SADMM_OK) message += sadmm_world_message(w.handle);
        if (added && status != SADMM_OK) sadmm_world_remove_body(w.handle, out.id);
    }
    if (status != SADMM_OK) raise_status(status, message);
    return out;
}

static sadmm_body_state state_of(const body &b)
{
    sadmm_body_state state;
    call(b.in(), [&](sadmm_world *h) { return sadmm_world_body_state(h, b.id, &state); });
    return state;
}

// Without its name, which is the world's own.
static sadmm_body_def def_of(const body &b)
{
    sadmm_body_def def;
    call(b.in(), [&](sadmm_world *h) { return sadmm_world_body_def(h, b.id, &def); });
    def.name = nullptr;
    return def;
}

template <size_t N> using member = double (sadmm_body_state::*)[N];

template <size_t N> static void bind_member(nb::class_<body> &c, const char *name, member<N> at, const char *doc)
{
    c.def_prop_rw(name, [at, name](const body &b) { return array_of<N>(state_of(b).*at, name); },
                  [at, name](const body &b, const numbers<N> &given) {
                      const std::array<double, N> x = given.as(name);
                      call(b.in(), [&](sadmm_world *h) { // no step in between
                          sadmm_body_state state;
                          const sadmm_status status = sadmm_world_body_state(h, b.id, &state);
                          if (status != SADMM_OK) return status;
                          put(x, state.*at);
                          return sadmm_world_set_body_state(h, b.id, &state);
                      });
                  }, doc);
}

static shape add_shape(const body &b, const shape_def &given)
{
    shape out{b.owner, b.w, {}};
    const shape_def taken(given); // another thread may change it
    const sadmm_shape_def def = taken.named();
    call(b.in(), [&](sadmm_world *h) { return sadmm_world_add_shape(h, b.id, &def, &out.id); });
    return out;
}

// Poses and velocities are those of the state, and can be set.
#define BODY_IS(X, kind, role, name, value, lo, hi, ends, text) BODY_IS_##role##_##kind(name, text)
#define BODY_IS_OWN_OTHER(name, text) c.def_prop_ro(#name, &tagged_name<sadmm_body_id>, text);
#define BODY_IS_HIDDEN_OTHER(name, text) bind_user_data(c);
#define BODY_IS_PLAIN_BODY_TYPE(name, text) READ_ONLY(c, body, name, text);
#define BODY_IS_PLAIN_WHOLE(name, text) READ_ONLY(c, body, name, text);
#define BODY_IS_DYNAMIC_REAL(name, text) READ_ONLY(c, body, name, text);
#define BODY_IS_DYNAMIC_VECTOR(name, text) READ_ONLY(c, body, name, text);
#define BODY_IS_PLAIN_VECTOR(name, text) bind_member<3>(c, #name, &sadmm_body_state::name, text);
#define BODY_IS_PLAIN_TURN(name, text) bind_member<4>(c, #name, &sadmm_body_state::name, text);

static void bind_body(nb::module_ &m)
{
    nb::class_<body> c(m, "Body", collected<sadmm_body_id>(),
                       "A body of a world. Body(...) is made by World.add_body, World.add_solid, World.bodies.");
    c.def(
         "__eq__", [](const body &a, const body &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_body_id>)
        .def("__repr__",
             [](const body &b) {
                 return "<subadmm.Body " + std::to_string(b.id.slot) + "." + std::to_string(b.id.generation) + ">";
             })
        .def_prop_ro("world", [](const body &b) { return b.owner; })
        .def_prop_ro(
            "id", [](const body &b) { return std::make_pair(b.id.slot, b.id.generation); },
            "(slot, generation), as contacts and events have it.")
        .def_prop_ro(
            "index",
            [](const body &b) {
                int32_t index;
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_body_index(h, b.id, &index); });
                return index;
            },
            "Row of the world's arrays.")
        .def(
            "set_mass",
            [](const body &b, double mass, numbers<3> moments) {
                const vec3 inertia = moments.as("inertia");
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_set_body_mass(h, b.id, mass, inertia.data()); });
            },
            "mass"_a, "inertia"_a, "From the next step on.");
    SADMM_BODY_FIELDS(BODY_IS, )
    c.def("add_shape", &add_shape, "shape"_a, "Put a shape on the body, at the definition's position and orientation.")
        .def(
            "move_to",
            [](const body &b, numbers<3> position, numbers<4> orientation) {
                const vec3 x = position.as("position");
                const quat q = orientation.as("orientation");
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_move_body(h, b.id, x.data(), q.data()); });
            },
            "position"_a, "orientation"_a, "Move a kinematic body to a pose within the next step.")
        .def(
            "set_wrench",
            [](const body &b, numbers<3> force, numbers<3> torque) {
                const vec3 f = force.as("force"), t = torque.as("torque");
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_set_body_wrench(h, b.id, f.data(), t.data()); });
            },
            "force"_a, "torque"_a = vec3{},
            "External force (N) at the centre of mass and torque (N m), world frame, kept until set again.")
        .def(
            "add_force_at",
            [](const body &b, numbers<3> force, numbers<3> point) {
                const vec3 f = force.as("force"), x = point.as("point");
                call(b.in(),
                     [&](sadmm_world *h) { return sadmm_world_add_body_force_at(h, b.id, f.data(), x.data()); });
            },
            "force"_a, "point"_a, "Add a force (N) at a point (m, world) to the external wrench.")
        .def(
            "apply_impulse_at",
            [](const body &b, numbers<3> impulse, numbers<3> point) {
                const vec3 p = impulse.as("impulse"), x = point.as("point");
                call(b.in(),
                     [&](sadmm_world *h) { return sadmm_world_apply_body_impulse_at(h, b.id, p.data(), x.data()); });
            },
            "impulse"_a, "point"_a, "Change the velocities at once by an impulse (N s) at a point (m, world).")
        .def(
            "set_gravity_scale",
            [](const body &b, double s) {
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_set_body_gravity_scale(h, b.id, s); });
            },
            "scale"_a)
        .def(
            "set_damping",
            [](const body &b, double linear, double angular) {
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_set_body_damping(h, b.id, linear, angular); });
            },
            "linear"_a, "angular"_a, "1/s.")
        .def_prop_ro(
            "contact_wrench",
            [](const body &b) {
                vec6 out;
                call(b.in(), [&](sadmm_world *h) { return sadmm_world_body_contact_wrench(h, b.id, out.data()); });
                return array_of<6>(out.data());
            },
            "Force (N) and torque about the centre of mass (N m) of the last step's contacts.")
        .def(
            "ignore",
            [](const body &a, const body &b, bool off) {
                const sadmm_body_id other = id_in(a.in(), b, "other");
                call(a.in(), [&](sadmm_world *h) { return sadmm_world_set_body_pair_contact(h, a.id, other, !off); });
            },
            "other"_a, "off"_a = true, "Turn contact with another body off, or on again.")
        .def(
            "remove",
            [](const body &b) { call(b.in(), [&](sadmm_world *h) { return sadmm_world_remove_body(h, b.id); }); },
            "Remove the body with its shapes, joints and couplings.");

    nb::class_<shape> s(m, "BodyShape", collected<sadmm_shape_id>(), "A shape on a body.");
    bind_tags(s);
    s.def(
            "__eq__", [](const shape &a, const shape &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_shape_id>)
        .def_prop_ro("world", [](const shape &s) { return s.owner; })
        .def_prop_ro(
            "id", [](const shape &s) { return std::make_pair(s.id.slot, s.id.generation); },
            "(slot, generation), as contacts and events have it.")
        .def_prop_ro("index",
                     [](const shape &s) {
                         int32_t index;
                         call(s.in(), [&](sadmm_world *h) { return sadmm_world_shape_index(h, s.id, &index); });
                         return index;
                     })
        .def_prop_ro("body",
                     [](const shape &s) {
                         body out{s.owner, s.w, {}};
                         sadmm_shape_def def;
                         call(s.in(), [&](sadmm_world *h) { return sadmm_world_shape_def(h, s.id, &def, &out.id); });
                         return out;
                     })
        .def_prop_ro(
            "definition",
            [](const shape &s) {
                shape_def out;
                call(s.in(), [&](sadmm_world *h) {
                    const sadmm_status status = sadmm_world_shape_def(h, s.id, &out.def, nullptr);
                    if (status == SADMM_OK) hold_parts(out); // the world could let go of them
                    if (status == SADMM_OK) out.name = out.def.name;
                    return status;
                });
                out.def.name = nullptr, out.def.user_data = nullptr;
                out.of_world = true;
                return out;
            },
            "As it is now; a copy, which is not to be written to.")
        .def(
            "set_material",
            [](const shape &s, double mu, double e) {
                call(s.in(), [&](sadmm_world *h) { return sadmm_world_set_shape_material(h, s.id, mu, e); });
            },
            "friction"_a, "restitution"_a = 0.0)
        .def(
            "set_surface_velocity",
            [](const shape &s, numbers<3> velocity) {
                const vec3 v = velocity.as("velocity");
                call(s.in(), [&](sadmm_world *h) { return sadmm_world_set_shape_surface_velocity(h, s.id, v.data()); });
            },
            "velocity"_a, "How its surface moves while it stays, as a belt's, in its own frame, m/s.")
        .def(
            "set_size",
            [](const shape &s, nb::object size) {
                sadmm_shape_def def;
                vec3 given = {0, 0, 0};
                call(s.in(), [&](sadmm_world *h) { return sadmm_world_shape_def(h, s.id, &def, nullptr); });
                read_numbers("size", size, (size_t)sadmm_shape_sizes[def.type], given.data());
                call(s.in(), [&](sadmm_world *h) { return sadmm_world_set_shape_size(h, s.id, given.data()); });
            },
            "size"_a,
            "Other sizes, m, as many as its type has; the mass of the body stays. Contacts of the shape begin anew.")
        .def(
            "set_frame",
            [](const shape &s, numbers<3> position, numbers<4> orientation) {
                const vec3 x = position.as("position");
                const quat q = orientation.as("orientation");
                call(s.in(), [&](sadmm_world *h) { return sadmm_world_set_shape_frame(h, s.id, x.data(), q.data()); });
            },
            "position"_a, "orientation"_a = quat{1, 0, 0, 0},
            "Another place in its body's frame (m; w x y z); the mass of the body stays. Contacts of the shape begin "
            "anew.")
        .def(
            "set_pair_friction",
            [](const shape &a, const shape &b, double mu) {
                const sadmm_shape_id other = id_in(a.in(), b, "other");
                call(a.in(), [&](sadmm_world *h) { return sadmm_world_set_pair_friction(h, a.id, other, mu); });
            },
            "other"_a, "friction"_a, "Friction of the two shapes; -1: the geometric mean again.")
        .def("remove",
             [](const shape &s) { call(s.in(), [&](sadmm_world *h) { return sadmm_world_remove_shape(h, s.id); }); });
}

void bind_world(nb::module_ &m, nb::class_<world> &w)
{
    bind_body(m);
    w.def("__init__", &init_world, nb::kw_only(), "backend"_a = "auto", "precision"_a = "f64", "device"_a = 0,
          "contact_margin"_a = 0.02, "settings"_a = nb::none(),
          "backend: 'auto', 'ref', 'cpu' or 'cuda'; precision: 'f64' or 'f32'; device: which accelerator; "
          "contact_margin: speculative margin as a share of the thinner shape's extent; settings: Settings, or the "
          "defaults.");
    w.def_prop_rw("settings",
                  [](nb::handle_t<world> self) {
                      const sadmm_settings now =
                          ask(nb::cast<world &>(self), [](sadmm_world *h) { return sadmm_world_settings(h); });
                      return settings_read(now, self, &set_settings);
                  },
                  [](world &w, nb::object given) {
                      const sadmm_settings s = read_settings(given);
                      call(w, [&](sadmm_world *h) { return sadmm_world_set_settings(h, &s); });
                  },
                  "As they are now. What is set of them, as world.settings.dt = 0.002, is set in the world, from the "
                  "next step on; copy() is of nobody.",
                  nb::for_getter(nb::sig("def settings(self) -> Settings")),
                  nb::for_setter(nb::sig("def settings(self, settings: Settings, /) -> None")));
    w.def("set_backend", [](world &w, const std::string &backend, const std::string &precision, whole which) {
        const int device = which.as_int("device");
        const auto b = named<sadmm_backend>("backend", backend);
        const auto p = named<sadmm_precision>("precision", precision);
        call(w, [&](sadmm_world *h) {
            const sadmm_status status = sadmm_world_set_backend(h, b, p, device);
            if (status == SADMM_OK) w.def.precision = p;
            return status;
        });
    }, "backend"_a, "precision"_a = "f64", "device"_a = 0, "Change the backend from the next step on.");
    w.def("add_body", &add_body, nb::kw_only(), "name"_a = "" SADMM_BODY_FIELDS(ARGUMENT, ), "shapes"_a = nb::tuple(),
          "A body. SI units; `inertia`: principal moments; `shapes`: Shapes to put on it, none by default. If one of "
          "them is\n"
          "refused, no body is added. World.add_solid computes masses.");
    w.def_prop_ro("body_count",
                  [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_body_count(h); }); });
    w.def_prop_ro("shape_count",
                  [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_shape_count(h); }); });
    w.def_prop_ro("bodies", [](nb::handle_t<world> self) {
        return all_of<body>(self, &sadmm_world_body_count, &sadmm_world_body_at);
    }, "All bodies, in the order of the arrays' rows.");
    w.def_prop_ro("shapes", [](nb::handle_t<world> self) {
        return all_of<shape>(self, &sadmm_world_shape_count, &sadmm_world_shape_at);
    }, "All shapes.");
    w.def("_body_ids",
          [](world &w) { return ids_of<sadmm_body_id>(w, &sadmm_world_body_count, &sadmm_world_body_at); });
    w.def("_shape_ids",
          [](world &w) { return ids_of<sadmm_shape_id>(w, &sadmm_world_shape_count, &sadmm_world_shape_at); });
    w.def_prop_ro("names", [](world &w) {
        std::vector<std::string> names;
        call(w, [&](sadmm_world *h) {
            sadmm_status status = SADMM_OK;
            const int32_t count = sadmm_world_body_count(h);
            for (int32_t k = 0; k < count && status == SADMM_OK; ++k) {
                sadmm_body_id id;
                sadmm_body_def def;
                status = sadmm_world_body_at(h, k, &id);
                if (status == SADMM_OK) status = sadmm_world_body_def(h, id, &def);
                if (status == SADMM_OK) names.push_back(def.name);
            }
            return status;
        });
        return names;
    }, "Of all bodies, in the order of the arrays' rows; '' of those without one.");
    w.def("step", [](world &w, whole n) { step(w, n, true); }, "n"_a = 1,
          "Make n steps. Scenes also run their script.");
    w.def("step_async", [](world &w, whole n) { step(w, n, false); }, "n"_a = 1,
          "Begin n steps without waiting for them, if the backend can.");
    w.def(
        "wait", [](world &w) { call(w, [](sadmm_world *h) { return sadmm_world_wait(h); }); },
        "Wait until all steps begun are done.");
    w.def_prop_ro("report", [](world &w) {
        sadmm_step_report r;
        call(w, [&](sadmm_world *h) { return sadmm_world_report(h, &r); });
        return r;
    }, "Of the last step.");
    w.def_prop_ro("contact_count",
                  [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_contact_count(h); }); });
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
    }, "The whole state as bytes, for restore() with the same build, in this process or another.");
    w.def("restore", [](world &w, nb::bytes bytes) {
        call(w, [&](sadmm_world *h) {
            sadmm_status status = sadmm_world_restore(h, bytes.data(), bytes.size());
            sadmm_step_report report;
            if (status == SADMM_OK) status = sadmm_world_report(h, &report);
            if (status == SADMM_OK) w.steps = report.step; // where a scene's script goes on
            return status;
        });
    }, "bytes"_a, "Replace the state by a saved one, to the last bit. Invalid bytes are refused, and nothing changes.");
}

// The callback for manifolds.
#include "common.h"

// What a callback sees, while it runs.
struct manifold {
    sadmm_manifold *now;
    nb::object owner;
    world *w;
    sadmm_manifold &in() const
    {
        if (!now) throw std::runtime_error("a manifold can be looked at within its callback alone");
        return *now;
    }
};

// With the world's lock, within a step that lets no other thread in: the interpreter's lock alone is taken.
static void decide(void *context, sadmm_manifold *now)
{
    world &w = *(world *)context;
    nb::gil_scoped_acquire acquire;
    if (w.raised) return; // the step is given up
    try {
        nb::object seen = nb::cast(manifold{now, nb::find(w), &w});
        struct end {
            nb::handle seen;
            ~end()
            {
                nb::cast<manifold &>(seen).now = nullptr;
                nb::cast<manifold &>(seen).owner.reset(); // kept, it keeps no world
            }
        } end{seen};
        w.decide(seen);
    } catch (nb::python_error &error) {
        w.raised = std::make_unique<nb::python_error>(error);
        now->enabled = true;
        now->friction = -1; // out of range: the step ends, and nothing of it is done
    }
}

static void set_callback(world &w, nb::object function)
{
    if (!function.is_none() && !PyCallable_Check(function.ptr()))
        refuse_type("callback", function, "must be a function of a manifold, or None");
    const bool none = function.is_none();
    call(w, [&](sadmm_world *h) { return sadmm_world_set_manifold_callback(h, none ? nullptr : &decide, &w); });
    w.decide = none ? nb::object() : std::move(function);
}

void end_callback(world &w)
{
    if (w.decide.is_valid()) sadmm_world_set_manifold_callback(w.handle, nullptr, nullptr);
    nb::object dropped = std::move(w.decide);
}

void bind_manifold(nb::module_ &m, nb::class_<world> &w)
{
    nb::class_<manifold>(m, "Manifold",
        "What two shapes have in common, as the callback of World.set_manifold_callback sees it: one normal, and "
        "points. Of use within the callback alone.")
        .def_prop_ro("shape_a", [](const manifold &x) { return shape{x.owner, x.w, x.in().shape_a}; })
        .def_prop_ro("shape_b", [](const manifold &x) { return shape{x.owner, x.w, x.in().shape_b}; })
        .def_prop_ro("body_a", [](const manifold &x) { return body{x.owner, x.w, x.in().body_a}; })
        .def_prop_ro("body_b", [](const manifold &x) { return body{x.owner, x.w, x.in().body_b}; })
        .def_prop_ro("triangle", [](const manifold &x) { return x.in().triangle; },
                     "Index of the triangle of a mesh; -1: neither shape is a mesh.")
        .def_prop_ro("begun", [](const manifold &x) { return x.in().begun; },
                     "The two shapes had no manifold in the last step.")
        .def_prop_ro("hit", [](const manifold &x) { return x.in().hit; }, "A hit within the step, at its moment.")
        .def_prop_ro("normal", [](const manifold &x) { return array_of<3>(x.in().normal); },
                     "Unit, world frame, from a to b.")
        .def_prop_ro("speed", [](const manifold &x) { return x.in().speed; },
                     "How fast they approach along the normal, m/s; < 0: they part.")
        .def_prop_ro(
            "positions",
            [](const manifold &x) {
                const size_t n = (size_t)x.in().count;
                return numpy_of(std::vector<double>(x.in().positions[0], x.in().positions[0] + 3 * n), {n, 3});
            },
            "Points, m, world frame: n x 3.", nb::for_getter(nb::sig("def positions(self) -> Array")))
        .def_prop_ro(
            "separations",
            [](const manifold &x) {
                const size_t n = (size_t)x.in().count;
                return numpy_of(std::vector<double>(x.in().separations, x.in().separations + n), {n});
            },
            "Of the points, m; negative: overlap.", nb::for_getter(nb::sig("def separations(self) -> Array")))
        .def_prop_rw("enabled", [](const manifold &x) { return x.in().enabled; },
                     [](manifold &x, bool enabled) { x.in().enabled = enabled; },
                     "False leaves the points out, for this step alone.")
        .def_prop_rw("friction", [](const manifold &x) { return x.in().friction; },
                     [](manifold &x, double friction) { x.in().friction = friction; }, "mu in [0, 1e6].")
        .def_prop_rw("restitution", [](const manifold &x) { return x.in().restitution; },
                     [](manifold &x, double restitution) { x.in().restitution = restitution; }, "In [0, 1].")
        .def_prop_rw("surface_velocity",
                     [](const manifold &x) {
                         return array_of<3>(x.in().surface_velocity, "manifold.surface_velocity");
                     },
                     [](manifold &x, numbers<3> v) { put(v.as("surface_velocity"), x.in().surface_velocity); },
                     "How b's surface moves against a's beside the motion of the bodies, m/s, world frame.");
    w.def("set_manifold_callback", &set_callback, "callback"_a.none(),
          "Call callback(manifold) for every Manifold of every step, after contacts are found and before they are "
          "solved; None: no callback. It may change `enabled`, `friction`, `restitution` and `surface_velocity`, for "
          "the step alone, and must not call the world. What it raises, step() raises, and the step is not done. On a "
          "GPU, the host finds contacts and drives the steps of such a world.",
          nb::sig("def set_manifold_callback(self, callback: Callable[[Manifold], object] | None) -> None"));
}

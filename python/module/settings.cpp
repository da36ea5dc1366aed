// Settings of steps, and what a step reports.
#include "fields.h"

using S = settings_of;

static std::string shown_number(const sadmm_field &field, double x)
{
    char text[32];
    snprintf(text, sizeof text, field.kind == SADMM_FIELD_WHOLE ? "%.10g" : "%g", x);
    return text;
}

std::string documented(const sadmm_field &field)
{
    const std::string lo = shown_number(field, field.lo), hi = shown_number(field, field.hi), text = field.text;
    if (field.kind == SADMM_FIELD_BOUND) return text + " >= " + lo + ", may be infinite.";
    switch (field.ends) {
    case SADMM_ENDS_CLOSED: return text + " In [" + lo + ", " + hi + "].";
    case SADMM_ENDS_BELOW: return text + " In [" + lo + ", " + hi + ").";
    case SADMM_ENDS_FROM: return text + " Finite, >= " + lo + ".";
    case SADMM_ENDS_ABOVE: return text + " Finite, > " + lo + ".";
    case SADMM_ENDS_ANY: break;
    }
    return text;
}

#define BIND(X, kind, role, name, ...) \
    bind_##kind(c, #name, [](auto &o) -> auto & { return o.values.name; }, documented(*field++));

nb::object settings_read(const sadmm_settings &values, nb::handle owner,
                         void (*set)(nb::handle owner, const std::function<void(settings_of &)> &change))
{
    S out;
    out.values = values;
    if (set) out.owner = nb::borrow(owner);
    out.set = set;
    return nb::cast(std::move(out));
}

sadmm_settings read_settings(nb::handle given)
{
    if (!nb::isinstance<S>(given)) refuse_type("settings", given, "must be a subadmm.Settings");
    return nb::cast<S &>(given).values;
}

// The garbage collector is told of the owner, as of that of a Body (common.h).
static int traverse_settings(PyObject *self, visitproc visit, void *arg) noexcept
{
    Py_VISIT(Py_TYPE(self));
    if (nb::inst_ready(self)) Py_VISIT(nb::inst_ptr<S>(self)->owner.ptr());
    return 0;
}
static int clear_settings(PyObject *self) noexcept
{
    if (!nb::inst_ready(self)) return 0;
    S *settings = nb::inst_ptr<S>(self);
    settings->set = nullptr;
    nb::object dropped = std::move(settings->owner);
    return 0;
}

#define NAME_OF(X, kind, role, name, ...) out.append(#name);

void bind_settings(nb::module_ &m)
{
    static PyType_Slot slots[] = {
        {Py_tp_traverse, (void *)&traverse_settings}, {Py_tp_clear, (void *)&clear_settings}, {0, nullptr}};
    nb::class_<S> c(m, "Settings", nb::type_slots(slots),
                    "Settings of steps. Settings(dt=0.002, iterations=50): the defaults, with changes. "
                    "Checked when they are set in a world. Those that are read of a world set their members there, "
                    "too.");
    c.def("__init__", [](nb::pointer_and_handle<S> self, nb::kwargs values) {
        new (self.p) S();
        nb::inst_mark_ready(self.h);
        set_members(self.h, values);
    });
    c.def("_set", [](nb::handle_t<S> self, nb::dict values) { set_members(self, values); }, "values"_a);
    c.def_prop_ro_static("_names", [](nb::handle) {
        nb::list out;
        SADMM_SETTINGS(NAME_OF, )
        return nb::tuple(out);
    });
    const sadmm_field *field = sadmm_settings_table;
    SADMM_SETTINGS(BIND, )
#undef BIND

    using C = sadmm_certificate;
    nb::class_<C>(m, "Certificate", "True error of a step, computed in double from raw data.")
        .def_ro("ncp_max", &C::ncp_max, "Natural map, largest over constraints, m/s; -1: not measured.")
        .def_ro("ncp_mean", &C::ncp_mean, "The same, mean, m/s.")
        .def_ro("ncp_worst", &C::ncp_worst, "Index of the worst constraint; -1: none.")
        .def_ro("momentum_max", &C::momentum_max, "Momentum error of the worst body, relative.")
        .def_ro("momentum_worst", &C::momentum_worst, "Index of that body among the dynamic ones; -1: none.")
        .def_ro("siconos", &C::siconos, "siconos' measure, or -1.");

    using R = sadmm_step_report;
    nb::class_<R>(m, "Report", "What the last step did.")
        .def_prop_ro("backend", [](const R &r) { return name_of(r.backend); }, "'ref', 'cpu' or 'cuda'.")
        .def_prop_ro("precision", [](const R &r) { return name_of(r.precision); }, "'f32' or 'f64'.")
        .def_ro("threads", &R::threads, "CPU threads that worked on the step.")
        .def_ro("step", &R::step, "Steps done since creation.")
        .def_ro("time", &R::time, "Simulated time after the step, s.")
        .def_ro("bodies", &R::bodies, "Dynamic bodies.")
        .def_ro("joints", &R::joints, "Joints that took part.")
        .def_ro("couplings", &R::couplings, "Couplings that took part.")
        .def_ro("contacts", &R::contacts, "Contact points.")
        .def_ro("pairs", &R::pairs, "Pairs of shapes that touch.")
        .def_ro("iterations", &R::iterations, "Iterations done.")
        .def_ro("iterations_mean", &R::iterations_mean, "Mean over islands.")
        .def_ro("error", &R::error, "How far the step is from the laws, m/s; -1: not known.")
        .def_prop_ro("error_kind", [](const R &r) { return name_of(r.error_kind); },
                     "What the error is: 'law', 'momentum', 'limiter', 'joints', or 'none'.")
        .def_ro("unsolved", &R::unsolved, "Islands that miss settings.tolerance; -1: it is 0.")
        .def_ro("converged", &R::converged, "A stop rule was met, by every island.")
        .def_ro("limited", &R::limited, "Islands that had more energy than contacts can leave them with.")
        .def_ro("repeated", &R::repeated, "Steps that an asynchronous backend repeated since creation.")
        .def_ro("penetration_max", &R::penetration_max, "Deepest overlap at the start of the step, m.")
        .def_ro("joint_drift", &R::joint_drift,
                "Largest error of a locked translation of a joint after the step, m; 0 without joints.")
        .def_prop_ro("ms", [](const R &r) {
            nb::dict d;
            d["total"] = r.ms.total, d["collide"] = r.ms.collide, d["assemble"] = r.ms.assemble,
            d["solve"] = r.ms.solve, d["finish"] = r.ms.finish, d["certify"] = r.certify_ms;
            return d;
        }, "Times, ms: total, collide, assemble, solve, finish; certify.")
        .def_prop_ro("residual_primal", [](const R &r) { return r.residual.primal; }, "m/s; -1: not measured.")
        .def_prop_ro("residual_dual", [](const R &r) { return r.residual.dual; }, "N s; -1: not measured.")
        .def_ro("certificate", &R::certificate, "True error, if settings.certify is on.");
}

// Settings of steps, and what a step reports.
#include "common.h"

// A member that is a whole number.
static void bind_whole(nb::class_<sadmm_settings> &c, const char *name, int sadmm_settings::*at, const char *doc)
{
    c.def_prop_rw(name, [at](const sadmm_settings &s) { return s.*at; },
                  [at, name](sadmm_settings &s, const whole &x) { s.*at = x.as_int(name); }, doc);
}

void bind_settings(nb::module_ &m)
{
    using S = sadmm_settings;
    nb::class_<S> c(m, "Settings", "Settings of steps. Settings(dt=0.002, iterations=50): the defaults, with changes. A world "
                                 "checks them when they are given to it.");
    c.def("__init__", [](nb::pointer_and_handle<S> self, nb::kwargs values) {
            new (self.p) S(sadmm_settings_default());
            nb::inst_mark_ready(self.h);
            set_members(self.h, values);
        })
        .def_rw("dt", &S::dt, "Time step, s, in [1e-6, 1].")
        .def_prop_rw("gravity", [](const S &s) { return array_of<3>(s.gravity); },
                     [](S &s, numbers<3> g) { put(g.as("gravity"), s.gravity); }, "m/s^2, world frame.")
        .def_prop_rw("method", [](const S &s) { return name_of(s.method, method_names); },
                     [](S &s, const std::string &name) { s.method = named("method", name, method_names); },
                     "'fast' or 'paper'.")
        .def_rw("relaxation", &S::relaxation, "Over-relaxation of 'fast', in [1, 2).")
        .def_rw("penalty_mass_factor", &S::penalty_mass_factor, "'paper': M of eq. (13).")
        .def_rw("penalty_offset", &S::penalty_offset, "'paper': c of eq. (13), kg/s^2.")
        .def_rw("penalty_ratio_limit", &S::penalty_ratio_limit, "'paper': alpha of eq. (15).")
        .def_rw("penalty_update_warm", &S::penalty_update_warm, "'paper': also update in steps that start warm.")
        .def_rw("warm_start", &S::warm_start, "Start from the last step's impulses and velocities.")
        .def_rw("residual_tolerance", &S::residual_tolerance, "Stop when both residuals are at most this; 0: never.")
        .def_rw("certificate_tolerance", &S::certificate_tolerance, "Stop when the natural map (m/s) is at most this; 0: never.")
        .def_rw("certificate_momentum_tolerance", &S::certificate_momentum_tolerance, "... and the momentum error this.")
        .def_rw("measure_residuals", &S::measure_residuals, "Report the residuals of the last iteration.")
        .def_rw("certify", &S::certify, "Report the true error of every step.")
        .def_rw("recover_wrenches", &S::recover_wrenches, "Compute the contact wrench of every body.")
        .def_rw("baumgarte", &S::baumgarte, "Share of penetration beyond the slop removed a (sub-)step, in [0, 1].")
        .def_rw("slop", &S::slop, "Penetration left alone, m.")
        .def_rw("correction_speed", &S::correction_speed, "Cap of the corrective speed, m/s.")
        .def_rw("restitution_threshold", &S::restitution_threshold, "Approach speed under which restitution is ignored, m/s.");
    bind_whole(c, "substeps", &S::substeps, "Sub-steps of a step, which share its iterations, in [1, 64].");
    bind_whole(c, "iterations", &S::iterations, "Iterations a step, in [1, 1000000].");
    bind_whole(c, "penalty_period", &S::penalty_period, "'paper': iterations between penalty updates, 0: never.");
    bind_whole(c, "direct_points", &S::direct_points,
               "Islands with joints and at most so many contact points are solved directly, in [0, 128].");
    bind_whole(c, "check_period", &S::check_period, "Iterations between convergence checks, in [1, 1000000].");
    bind_whole(c, "hits", &S::hits,
               "Hits of a body in flight, with restitution or so fast that two pass by their own size, that are taken at their\n"
               "moment within a (sub-)step, at most, in [0, 64]; 0: none, the solve has them all.");
    bind_whole(c, "threads", &S::threads, "CPU threads at most, in [0, 1024]; 0: no bound. Results do not depend on it.");

    using C = sadmm_certificate;
    nb::class_<C>(m, "Certificate", "True error of a step, computed in double from raw data.")
        .def_ro("ncp_max", &C::ncp_max, "Natural map, largest over constraints, m/s; -1: not measured.")
        .def_ro("ncp_mean", &C::ncp_mean, "The same, mean, m/s.")
        .def_ro("ncp_worst", &C::ncp_worst, "Index of the worst constraint; -1: none.")
        .def_ro("momentum_max", &C::momentum_max, "Momentum error of the worst body, relative.")
        .def_ro("momentum_worst", &C::momentum_worst, "Index of that body among the dynamic ones; -1: none.")
        .def_ro("siconos", &C::siconos, "siconos' measure, or -1.")
        .def_ro("islands_above", &C::islands_above, "Islands above the certificate tolerances; -1: there are none set.");

    using R = sadmm_step_report;
    nb::class_<R>(m, "Report", "What the last step did.")
        .def_prop_ro("backend", [](const R &r) { return name_of(r.backend, backend_names); }, "'ref', 'cpu' or 'cuda'.")
        .def_prop_ro("precision", [](const R &r) { return name_of(r.precision, precision_names); }, "'f32' or 'f64'.")
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
        .def_ro("converged", &R::converged, "A stop rule was met, by every island.")
        .def_ro("limited", &R::limited, "Islands that had more energy than contacts can leave them with.")
        .def_ro("repeated", &R::repeated, "Steps that a backend running ahead repeated, since creation.")
        .def_ro("penetration_max", &R::penetration_max, "Deepest overlap at the start of the step, m.")
        .def_ro("joint_drift", &R::joint_drift,
                "Largest error of a locked translation of a joint after the step, m; 0: there are none; -1: not measured, "
                "where a device keeps the world (CUDA).")
        .def_prop_ro("ms", [](const R &r) {
            nb::dict d;
            d["total"] = r.ms.total, d["collide"] = r.ms.collide, d["assemble"] = r.ms.assemble, d["solve"] = r.ms.solve,
            d["finish"] = r.ms.finish, d["certify"] = r.certify_ms;
            return d;
        }, "Times, ms: total, collide, assemble, solve, finish; certify.")
        .def_prop_ro("residual_primal", [](const R &r) { return r.residual.primal; }, "m/s; -1: not measured.")
        .def_prop_ro("residual_dual", [](const R &r) { return r.residual.dual; }, "N s; -1: not measured.")
        .def_ro("certificate", &R::certificate, "True error, where settings ask for it.");
}

// The module subadmm._core: exceptions, versions, backends. Each other file binds one subject.
#include <cstring>

#include "common.h"

static nb::object exceptions[SADMM_STATUS_COUNT];

void raise_status(sadmm_status status, const std::string &message)
{
    const bool known = (unsigned)status < SADMM_STATUS_COUNT && exceptions[status].is_valid();
    const nb::object &type = exceptions[known ? status : SADMM_ERROR_INVALID_ARGUMENT];
    const char *text = message.empty() ? sadmm_status_name(status) : message.c_str();
    nb::object said = nb::steal(PyUnicode_DecodeUTF8(text, (Py_ssize_t)strlen(text), "replace")); // of files: any bytes
    if (!said.is_valid()) throw nb::python_error();
    nb::object error = type(said);
    nb::setattr(error, "status", nb::str(sadmm_status_name(status)));
    PyErr_SetObject(type.ptr(), error.ptr());
    throw nb::python_error();
}

void check(sadmm_status status)
{
    if (status != SADMM_OK) raise_status(status, sadmm_last_message());
}

static nb::object make_exception(nb::module_ &m, const char *name, nb::handle base, const char *doc)
{
    nb::object made =
        nb::steal(PyErr_NewExceptionWithDoc((std::string("subadmm.") + name).c_str(), doc, base.ptr(), nullptr));
    m.attr(name) = made;
    return made;
}

NB_MODULE(_core, m)
{
    m.doc() = "Rigid bodies in exact frictional contact, on CPU cores and NVIDIA GPUs.";
    nb::object base = make_exception(m, "Error", PyExc_RuntimeError,
                                     "A call of the library failed; `status` is its name, the text says why. Nothing "
                                     "was changed.");
    const auto with = [&](nb::handle second) { return nb::make_tuple(base, second); };
    exceptions[SADMM_ERROR_INVALID_ARGUMENT] =
        make_exception(m, "InvalidArgument", with(PyExc_ValueError), "An argument is out of its range.");
    exceptions[SADMM_ERROR_STALE_ID] = make_exception(m, "StaleId", with(PyExc_LookupError), "The object was removed.");
    exceptions[SADMM_ERROR_UNAVAILABLE] =
        make_exception(m, "Unavailable", base, "Not in this build, on this machine, or not now.");
    exceptions[SADMM_ERROR_OUT_OF_MEMORY] =
        make_exception(m, "OutOfMemory", with(PyExc_MemoryError), "Memory ran out.");
    exceptions[SADMM_ERROR_NON_FINITE] =
        make_exception(m, "NonFinite", with(PyExc_ArithmeticError), "A step produced a number that is not finite.");
    exceptions[SADMM_ERROR_UNSUPPORTED] = make_exception(m, "Unsupported", base, "Not supported by the library.");
    exceptions[SADMM_ERROR_IO] =
        make_exception(m, "FileError", with(PyExc_OSError), "A file could not be read or written.");
    exceptions[SADMM_ERROR_DEVICE] = make_exception(m, "DeviceError", base, "A device failed.");
    exceptions[SADMM_ERROR_LIMIT] = make_exception(m, "LimitExceeded", base, "More than the library can hold.");
    // They outlive the interpreter's last uses of them.
    for (nb::object &type : exceptions)
        if (type.is_valid()) type.inc_ref();

    m.def("_set_members", &set_members, "object"_a, "values"_a);
    m.def("version", &sadmm_version, "The library's version.");
    m.def("build_commit", &sadmm_build_commit, "The commit that the library was built from.");
    m.def("build_compiler", &sadmm_build_compiler, "The compiler that it was built with.");
    m.def(
        "backends",
        []() {
            nb::list out;
            for (int k = SADMM_BACKEND_REF; k < SADMM_BACKEND_COUNT; ++k) {
                sadmm_backend_info info;
                check(sadmm_backend_query((sadmm_backend)k, &info));
                nb::dict d;
                d["name"] = info.name;
                d["f32"] = info.available[SADMM_F32];
                d["f64"] = info.available[SADMM_F64];
                d["reason"] = info.reason;
                out.append(d);
            }
            return out;
        },
        "What each backend can do in this build and on this machine: a list of dicts with name, f32, f64 (is the "
        "precision available?) and reason.");
    nb::dict names;
    names["backend"] = all_names<sadmm_backend>();
    names["precision"] = all_names<sadmm_precision>();
    names["method"] = all_names<sadmm_method>();
    m.attr("_names") = names;

    bind_settings(m);
    bind_shapes(m);
    nb::class_<world> w(m, "World", nb::is_weak_referenceable(), collected_world(),
        "Bodies with shapes, joints and forces, stepped through time. SI units; the world's frame for positions, "
        "orientations (unit quaternions w x y z, body to world) and velocities. Calls on one world are serialised; "
        "different worlds run in parallel. The GIL is released while a world works.");
    bind_world(m, w);
    bind_arrays(m, w);
    bind_joints(m, w);
    bind_queries(w);
    bind_events(m, w);
    bind_manifold(m, w);
    bind_scenes(m, w);
    bind_environments(m);
    bind_draw(m);
    bind_debug_draw(w);
}

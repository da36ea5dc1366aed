// Many copies of a world (include/subadmm/environments.h). What is checked of arguments in Python, and how they are
// called, is in subadmm/environments.py.
#include <limits>

#include "common.h"

namespace
{

struct environments {
    std::shared_ptr<sadmm_environments> kept; // by arrays as well, which hold no Python object
    std::mutex mutex;
    explicit environments(sadmm_environments *made) : kept(made, sadmm_environments_destroy) {}
    sadmm_environments *handle() const { return kept.get(); }
};

template <class F> void call(environments &e, F f)
{
    sadmm_status status;
    std::string message;
    {
        nb::gil_scoped_release release;
        std::lock_guard<std::mutex> lock(e.mutex);
        status = f(e.handle());
        if (status != SADMM_OK) message = sadmm_environments_message(e.handle());
    }
    if (status != SADMM_OK) raise_status(status, message);
}

void set_settings(nb::handle owner, const std::function<void(settings_of &)> &change)
{
    call(nb::cast<environments &>(owner), [&](sadmm_environments *h) {
        settings_of now;
        now.values = sadmm_environments_settings(h);
        change(now);
        return sadmm_environments_set_settings(h, &now.values);
    });
}

using which_rows = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using in_values = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// NULL: all.
const int32_t *rows_of(const std::optional<which_rows> &which, int32_t *count)
{
    *count = which ? (int32_t)which->shape(0) : 0;
    return which ? which->data() : nullptr;
}

environments *replicate(world &w, whole count)
{
    sadmm_environments *made = nullptr;
    const int32_t n = (int32_t)count.in("count", INT32_MIN, INT32_MAX);
    call(w, [&](sadmm_world *h) { return sadmm_world_replicate(h, n, &made); });
    return new environments(made);
}

// An array keeps the C environments, and not their Python object: an attribute of that may hold the array. One on a
// device is for DLPack, of which torch takes no arrays that are not to be written to.
template <class T> nb::object view_of(environments &e, const sadmm_environments_array &a, bool writable)
{
    const size_t shape[3] = {(size_t)a.environments, (size_t)a.rows, (size_t)a.columns};
    nb::capsule owner(new std::shared_ptr<sadmm_environments>(e.kept),
                      [](void *p) noexcept { delete (std::shared_ptr<sadmm_environments> *)p; });
    if (a.device >= 0)
        return nb::cast(
            nb::ndarray<T>(a.values, 3, shape, owner, nullptr, nb::dtype<T>(), nb::device::cuda::value, a.device));
    if (writable) return nb::cast(nb::ndarray<nb::numpy, T>((T *)a.values, 3, shape, owner));
    return nb::cast(nb::ndarray<nb::numpy, const T>((const T *)a.values, 3, shape, owner));
}

// Where arrays lie: by one that costs steps nothing, where couplings are none.
int32_t device_of(environments &e)
{
    sadmm_environments_array a;
    call(e, [&](sadmm_environments *h) {
        const bool empty = sadmm_environments_rows(h, SADMM_ARRAY_COUPLING_TARGET) == 0;
        return sadmm_environments_bind(h, empty ? SADMM_ARRAY_COUPLING_TARGET : SADMM_ARRAY_BODY_STATE, SADMM_F64, &a);
    });
    return a.device;
}

nb::object bind(environments &e, const std::string &name, const std::string &precision)
{
    const sadmm_array array = named<sadmm_array>("array", name);
    const sadmm_precision of = named<sadmm_precision>("precision", precision);
    const bool input = sadmm_environments_is_input(array);
    sadmm_environments_array a;
    call(e, [&](sadmm_environments *h) { return sadmm_environments_bind(h, array, of, &a); });
    return of == SADMM_F64 ? view_of<double>(e, a, input) : view_of<float>(e, a, input);
}

nb::object get(environments &e, const std::string &name, std::optional<which_rows> which)
{
    const sadmm_array array = named<sadmm_array>("array", name);
    int32_t count;
    const int32_t *rows = rows_of(which, &count);
    const size_t n = (size_t)(rows ? count : sadmm_environments_count(e.handle())),
                 of = (size_t)sadmm_environments_rows(e.handle(), array), columns = (size_t)sadmm_array_columns(array);
    std::vector<double> values(n * of * columns + 1);
    call(e, [&](sadmm_environments *h) { return sadmm_environments_get(h, array, rows, count, values.data()); });
    return numpy_of(std::move(values), {n, of, columns});
}

void set(environments &e, const std::string &name, in_values values, std::optional<which_rows> which)
{
    const sadmm_array array = named<sadmm_array>("array", name);
    int32_t count;
    const int32_t *rows = rows_of(which, &count);
    const size_t n = (size_t)(rows ? count : sadmm_environments_count(e.handle())),
                 of = (size_t)sadmm_environments_rows(e.handle(), array), columns = (size_t)sadmm_array_columns(array);
    if (values.shape(0) != n || values.shape(1) != of || values.shape(2) != columns)
        throw nb::value_error(("values: must have shape (" + std::to_string(n) + ", " + std::to_string(of) + ", " +
                               std::to_string(columns) + ")")
                                  .c_str());
    call(e, [&](sadmm_environments *h) { return sadmm_environments_set(h, array, rows, count, values.data()); });
}

// origins, directions: environments x rays x 3.
nb::tuple cast_rays(environments &e, in_values origins, in_values directions, double length,
                    std::optional<which_rows> which, const std::optional<body> &ignore,
                    const std::vector<std::string> &types)
{
    int32_t count;
    const int32_t *rows = rows_of(which, &count);
    const size_t n = (size_t)(rows ? count : sadmm_environments_count(e.handle())), each = origins.shape(1);
    sadmm_query_filter filter = sadmm_query_filter_default();
    if (ignore) filter.ignored = ignore->id; // ids are the template's
    if (!types.empty()) filter.body_types = 0;
    for (const std::string &type : types) filter.body_types |= 1u << named<sadmm_body_type>("types", type);
    std::vector<sadmm_ray> rays(n * each + 1);
    std::vector<sadmm_ray_hit> hits(n * each + 1);
    for (size_t i = 0; i < n * each; ++i) {
        for (size_t k = 0; k < 3; ++k)
            rays[i].origin[k] = origins.data()[3 * i + k], rays[i].direction[k] = directions.data()[3 * i + k];
        rays[i].length = length;
    }
    call(e, [&](sadmm_environments *h) {
        return sadmm_environments_cast_rays(h, rows, count, (int32_t)each, rays.data(), &filter, hits.data());
    });
    std::vector<double> distances(n * each), points(3 * n * each), normals(3 * n * each);
    for (size_t i = 0; i < n * each; ++i) {
        distances[i] = hits[i].shape.slot != 0 ? hits[i].distance : std::numeric_limits<double>::infinity();
        for (size_t k = 0; k < 3; ++k) points[3 * i + k] = hits[i].point[k], normals[3 * i + k] = hits[i].normal[k];
    }
    return nb::make_tuple(numpy_of(std::move(distances), {n, each}), numpy_of(std::move(points), {n, each, 3}),
                          numpy_of(std::move(normals), {n, each, 3}));
}

} // namespace

void bind_environments(nb::module_ &m)
{
    nb::class_<environments>(m, "_Environments")
        .def_prop_ro("count", [](environments &e) { return sadmm_environments_count(e.handle()); })
        .def_prop_ro("memory",
                     [](environments &e) {
                         nb::gil_scoped_release release;
                         std::lock_guard<std::mutex> lock(e.mutex);
                         return sadmm_environments_memory(e.handle());
                     })
        .def(
            "step",
            [](environments &e, whole steps) {
                const int32_t n = (int32_t)steps.in("steps", 1, INT32_MAX);
                call(e, [&](sadmm_environments *h) { return sadmm_environments_step(h, n); });
            },
            "steps"_a)
        .def(
            "reset",
            [](environments &e, std::optional<which_rows> which, std::optional<which_rows> states) {
                int32_t count;
                const int32_t *rows = rows_of(which, &count);
                call(e, [&](sadmm_environments *h) {
                    return sadmm_environments_reset(h, rows, count, states ? states->data() : nullptr);
                });
            },
            "which"_a.none(), "states"_a.none())
        .def(
            "keep",
            [](environments &e, int32_t environment) {
                int32_t state;
                call(e, [&](sadmm_environments *h) { return sadmm_environments_keep(h, environment, &state); });
                return state;
            },
            "environment"_a)
        .def("forget",
             [](environments &e, int32_t state) {
                 call(e, [&](sadmm_environments *h) { return sadmm_environments_forget(h, state); });
             },
             "state"_a)
        .def(
            "save",
            [](environments &e, int32_t environment) {
                std::string bytes;
                call(e, [&](sadmm_environments *h) {
                    size_t size;
                    sadmm_status status = sadmm_environments_save(h, environment, nullptr, 0, &size);
                    if (status == SADMM_OK) {
                        bytes.resize(size);
                        status = sadmm_environments_save(h, environment, bytes.data(), size, &size);
                    }
                    return status;
                });
                return nb::bytes(bytes.data(), bytes.size());
            },
            "environment"_a)
        .def("bind", &bind, "array"_a, "precision"_a)
        .def("device", &device_of)
        .def(
            "set_stream",
            [](environments &e, uintptr_t stream) {
                call(e, [&](sadmm_environments *h) { return sadmm_environments_set_stream(h, (void *)stream); });
            },
            "stream"_a)
        .def("get", &get, "array"_a, "which"_a.none())
        .def("set", &set, "array"_a, "values"_a, "which"_a.none())
        .def("marked",
             [](environments &e) {
                 const size_t n = (size_t)sadmm_environments_count(e.handle());
                 nb::capsule owner(new std::shared_ptr<sadmm_environments>(e.kept),
                                   [](void *p) noexcept { delete (std::shared_ptr<sadmm_environments> *)p; });
                 return nb::cast(nb::ndarray<nb::numpy, const bool>((const bool *)sadmm_environments_marked(e.handle()),
                                                                    1, &n, owner));
             })
        .def(
            "mark",
            [](environments &e, int32_t environment) {
                std::lock_guard<std::mutex> lock(e.mutex);
                return std::string(sadmm_environments_mark(e.handle(), environment));
            },
            "environment"_a)
        .def("record_contacts",
             [](environments &e, bool record) {
                 call(e, [&](sadmm_environments *h) { return sadmm_environments_record_contacts(h, record); });
             },
             "record"_a)
        .def("contacts",
             [](environments &e, int32_t environment) {
                 std::vector<sadmm_contact> all;
                 call(e, [&](sadmm_environments *h) {
                     const sadmm_contact *contacts;
                     int32_t count;
                     const sadmm_status status = sadmm_environments_contacts(h, environment, &contacts, &count);
                     if (status == SADMM_OK) all.assign(contacts, contacts + count);
                     return status;
                 });
                 return nb::bytes((const char *)all.data(), all.size() * sizeof(sadmm_contact));
             },
             "environment"_a)
        .def("cast_rays", &cast_rays, "origins"_a, "directions"_a, "length"_a, "which"_a.none(), "ignore"_a.none(),
             "types"_a)
        .def_prop_rw(
            "settings",
            [](nb::handle_t<environments> self) {
                environments &e = nb::cast<environments &>(self);
                sadmm_settings now;
                {
                    nb::gil_scoped_release release;
                    std::lock_guard<std::mutex> lock(e.mutex);
                    now = sadmm_environments_settings(e.handle());
                }
                return settings_read(now, self, &set_settings);
            },
            [](environments &e, nb::object given) {
                const sadmm_settings settings = read_settings(given);
                call(e, [&](sadmm_environments *h) { return sadmm_environments_set_settings(h, &settings); });
            });
    m.def("_replicate", &replicate, "world"_a, "count"_a, nb::rv_policy::take_ownership);
}

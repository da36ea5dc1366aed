// Many numbers at once, as arrays of numpy, and where a device has them, by DLPack.
#include <cstring>

#include "common.h"

static constexpr std::pair<const char *, sadmm_array> array_names[] = {
    {"body_state", SADMM_ARRAY_BODY_STATE},
    {"body_wrench", SADMM_ARRAY_BODY_WRENCH},
    {"body_contact_wrench", SADMM_ARRAY_BODY_CONTACT_WRENCH},
    {"body_inertia", SADMM_ARRAY_BODY_INERTIA},
    {"joint_position", SADMM_ARRAY_JOINT_POSITION},
    {"joint_speed", SADMM_ARRAY_JOINT_SPEED},
    {"joint_drive_force", SADMM_ARRAY_JOINT_DRIVE_FORCE},
    {"joint_wrench", SADMM_ARRAY_JOINT_WRENCH},
    {"joint_target_position", SADMM_ARRAY_JOINT_TARGET_POSITION},
    {"joint_target_speed", SADMM_ARRAY_JOINT_TARGET_SPEED},
    {"coupling_target", SADMM_ARRAY_COUPLING_TARGET},
    {"coupling_felt", SADMM_ARRAY_COUPLING_FELT},
};

using matrix = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using given = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using given_const = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

static int32_t count_rows(world &w, sadmm_array array, int32_t first, std::optional<int32_t> count)
{
    return count ? *count : ask(w, [&](sadmm_world *h) { return sadmm_world_array_rows(h, array); }) - first;
}

static nb::object get(world &w, const std::string &name, int32_t first, std::optional<int32_t> rows, std::optional<given> out)
{
    const sadmm_array array = named("array", name, array_names);
    const int32_t count = count_rows(w, array, first, rows), columns = sadmm_array_columns(array);
    const size_t shape[2] = {(size_t)(count > 0 ? count : 0), (size_t)columns};
    if (out && (out->shape(0) != shape[0] || out->shape(1) != shape[1]))
        throw nb::value_error(("out: must have shape (" + std::to_string(shape[0]) + ", " + std::to_string(shape[1]) + ")").c_str());
    double *to = out ? out->data() : new double[shape[0] * shape[1] + 1];
    nb::object made;
    if (out) made = nb::cast(*out);
    else {
        nb::capsule owner(to, [](void *p) noexcept { delete[] (double *)p; });
        made = nb::cast(matrix(to, 2, shape, owner));
    }
    call(w, [&](sadmm_world *h) { return sadmm_world_get_array(h, array, first, count, to); });
    return made;
}

static void set(world &w, const std::string &name, given_const values, int32_t first)
{
    const sadmm_array array = named("array", name, array_names);
    if (values.shape(1) != (size_t)sadmm_array_columns(array))
        throw nb::value_error(("values: must have " + std::to_string(sadmm_array_columns(array)) + " columns").c_str());
    if (values.shape(0) > INT32_MAX) throw nb::value_error("values: too many rows");
    call(w, [&](sadmm_world *h) { return sadmm_world_set_array(h, array, first, (int32_t)values.shape(0), values.data()); });
}

// The world is kept as long as the array is; how long its numbers are there is said below.
static nb::object device_array(nb::handle_t<world> self, const std::string &name)
{
    world &w = nb::cast<world &>(self);
    const sadmm_array array = named("array", name, array_names);
    sadmm_device_array a;
    call(w, [&](sadmm_world *h) { return sadmm_world_device_array(h, array, &a); });
    const size_t shape[2] = {(size_t)a.rows, (size_t)a.columns};
    const int64_t strides[2] = {a.stride, 1};
    return nb::cast(nb::ndarray<double>((void *)a.values, 2, shape, self, strides, nb::dtype<double>(),
                                        nb::device::cuda::value, a.device));
}

static nb::object contacts(world &w)
{
    // As sadmm_contact is in memory: numpy reads its members where they are.
    std::vector<sadmm_contact> all;
    call(w, [&](sadmm_world *h) {
        all.resize((size_t)sadmm_world_contact_count(h));
        return sadmm_world_contacts(h, 0, (int32_t)all.size(), all.data());
    });
    return nb::bytes((const char *)all.data(), all.size() * sizeof(sadmm_contact));
}

static nb::object contact_errors(world &w)
{
    std::vector<double> all;
    call(w, [&](sadmm_world *h) {
        all.resize((size_t)sadmm_world_contact_count(h));
        return sadmm_world_contact_errors(h, 0, (int32_t)all.size(), all.data());
    });
    const size_t count = all.size();
    return numpy_of(std::move(all), {count});
}

static nb::list contact_members()
{
    nb::list out;
#define MEMBER(name, format, count) out.append(nb::make_tuple(#name, format, count, offsetof(sadmm_contact, name)))
    MEMBER(body_a, "u4", 2);
    MEMBER(body_b, "u4", 2);
    MEMBER(shape_a, "u4", 2);
    MEMBER(shape_b, "u4", 2);
    MEMBER(position, "f8", 3);
    MEMBER(normal, "f8", 3);
    MEMBER(gap, "f8", 1);
    MEMBER(friction, "f8", 1);
    MEMBER(impulse, "f8", 3);
    MEMBER(force, "f8", 3);
    MEMBER(feature, "u4", 1);
    MEMBER(triangle, "i4", 1);
#undef MEMBER
    return out;
}

void bind_arrays(nb::module_ &m, nb::class_<world> &w)
{
    nb::list names;
    for (const auto &entry : array_names) names.append(nb::make_tuple(entry.first, sadmm_array_columns(entry.second), sadmm_array_is_settable(entry.second)));
    m.attr("_arrays") = names;
    m.attr("_contact_members") = contact_members();
    m.attr("_contact_size") = sizeof(sadmm_contact);
    w.def("get", &get, "array"_a, "first"_a = 0, "count"_a = nb::none(), "out"_a = nb::none(),
          "Rows [first, first + count) of an array as float64, or into `out`. Rows are bodies (World.bodies), joints or couplings.\n\n"
          "body_state (13 columns: position m, orientation w x y z, linear velocity m/s, angular velocity rad/s), body_wrench (6: N, N m),\n"
          "body_contact_wrench (6), body_inertia (4: kg, kg m^2), joint_position, joint_speed, joint_drive_force, joint_wrench,\n"
          "joint_target_position, joint_target_speed (6 each: coordinates), coupling_target (13, as body_state), coupling_felt (6).");
    w.def("set", &set, "array"_a, "values"_a, "first"_a = 0,
          "Set rows of an array that can be set: body_state, body_wrench, body_inertia, joint_target_position, joint_target_speed,\n"
          "coupling_target. All of them, or, where one is refused, none.");
    w.def("device_array", &device_array, "array"_a,
          "body_state or body_contact_wrench of the dynamic bodies where the CUDA backend has them, without a copy: an object for\n"
          "torch.from_dlpack and the like. Valid until the next step or change; not to be written to. Rows: World.dynamic_bodies().");
    w.def("device_stream", [](world &w) {
        sadmm_device_array a;
        call(w, [&](sadmm_world *h) { return sadmm_world_device_array(h, SADMM_ARRAY_BODY_STATE, &a); });
        return (uintptr_t)a.stream;
    }, "The CUDA stream that steps run on, as an integer.");
    w.def("dynamic_bodies", [](world &w) {
        std::vector<int32_t> rows;
        call(w, [&](sadmm_world *h) {
            int32_t count;
            sadmm_status status = sadmm_world_dynamic_bodies(h, nullptr, 0, &count);
            if (status != SADMM_OK) return status;
            rows.resize((size_t)count + 1);
            return sadmm_world_dynamic_bodies(h, rows.data(), count + 1, &count);
        });
        const size_t count = rows.size() - 1; // one more, so that there is always a place to write to
        return numpy_of(std::move(rows), {count});
    }, "Index of each dynamic body, ascending.");
    w.def("_contacts", &contacts);
    w.def("contact_errors", &contact_errors,
          "Natural map of each of contacts(), m/s: how far it is from its law. Unavailable where settings.certify is off.");
}

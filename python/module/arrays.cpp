// Many numbers at once, as arrays of numpy, and where a device has them, by DLPack.
#include <cstring>

#include "common.h"

using matrix = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using out_rows = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using in_rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// What an error says of an array that does not fit.
static std::string described(nb::handle given)
{
    const auto text = [&](const char *name) {
        return std::string(nb::str(nb::getattr(given, name, nb::str("?"))).c_str());
    };
    if (!nb::hasattr(given, "dtype") || !nb::hasattr(given, "shape")) return nb::type_name(given.type()).c_str();
    std::string out = text("dtype") + " of shape " + text("shape");
    if (nb::hasattr(given, "strides")) out += " and strides " + text("strides");
    if (nb::hasattr(given, "flags") &&
        !nb::cast<bool>(nb::bool_(nb::getattr(given.attr("flags"), "writeable", nb::bool_(true)))))
        out += ", not to be written to";
    return out;
}

// Some rows of an array.
struct range {
    int32_t rows, first, count;
    bool to_the_end; // whatever `count` was
    // Are they rows that it has? Under the world's lock.
    bool fits(sadmm_world *h, sadmm_array array)
    {
        rows = sadmm_world_array_rows(h, array);
        if (to_the_end) count = first > rows ? 0 : rows - first;
        return first <= rows && count <= rows - first;
    }
    [[noreturn]] void refuse() const
    {
        const std::string said = to_the_end ? "" : ", count = " + std::to_string(count);
        raise_status(SADMM_ERROR_INVALID_ARGUMENT, "first = " + std::to_string(first) + said +
                                                       ": must be rows of the array, which has " +
                                                       std::to_string(rows));
    }
};

static nb::object get(world &w, const std::string &name, whole first, std::optional<whole> count, nb::object out)
{
    const sadmm_array array = named<sadmm_array>("array", name);
    const size_t columns = (size_t)sadmm_array_columns(array);
    range r{0, (int32_t)first.in("first", 0, INT32_MAX), count ? (int32_t)count->in("count", 0, INT32_MAX) : 0, !count};
    const auto is_sized = [&](const out_rows &to) { return to.shape(0) == (size_t)r.count && to.shape(1) == columns; };
    // where `out` has its numbers: itself, no copy of another type or layout, which would be filled in its place
    out_rows to;
    const bool given = !out.is_none(), usable = given && nb::try_cast(out, to, false);
    std::unique_ptr<double[]> made;
    bool fits = false, sized = true;
    // How many rows there are, and what they are, in one: another thread may add some in between.
    call(w, [&](sadmm_world *h) {
        fits = r.fits(h, array);
        sized = !given || (usable && is_sized(to));
        if (!fits || !sized) return SADMM_OK;
        if (!given) made.reset(new double[(size_t)r.count * columns + 1]);
        return sadmm_world_get_array(h, array, r.first, r.count, given ? to.data() : made.get());
    });
    if (!fits) r.refuse();
    if (!sized)
        throw nb::value_error(("out: must have shape (" + std::to_string(r.count) + ", " + std::to_string(columns) +
                               "), be of float64, in C order without gaps, and writable; is " + described(out))
                                  .c_str());
    if (given) return out;
    const size_t shape[2] = {(size_t)r.count, columns};
    double *values = made.release();
    nb::capsule owner(values, [](void *p) noexcept { delete[] (double *)p; });
    return nb::cast(matrix(values, 2, shape, owner));
}

static void set(world &w, const std::string &name, nb::object given, whole first)
{
    const sadmm_array array = named<sadmm_array>("array", name);
    const int32_t columns = sadmm_array_columns(array), begin = (int32_t)first.in("first", 0, INT32_MAX);
    in_rows values;
    if (!nb::try_cast(given, values, false) || values.shape(1) != (size_t)columns)
        values = nb::cast<in_rows>(nb::module_::import_("subadmm.given").attr("numbers")("values", given, columns));
    if (values.shape(0) > INT32_MAX) throw nb::value_error("values: too many rows");
    call(w, [&](sadmm_world *h) {
        return sadmm_world_set_array(h, array, begin, (int32_t)values.shape(0), values.data());
    });
}

// The C world is kept as long as the array is, its Python object is not: an attribute of it may hold the array. How
// long the numbers are there is said below.
static nb::object device_array(world &w, const std::string &name)
{
    const sadmm_array array = named<sadmm_array>("array", name);
    sadmm_device_array a;
    call(w, [&](sadmm_world *h) { return sadmm_world_device_array(h, array, &a); });
    const size_t shape[2] = {(size_t)a.rows, (size_t)a.columns};
    const int64_t strides[2] = {a.stride, 1};
    nb::capsule owner(new std::shared_ptr<sadmm_world>(w.kept),
                      [](void *p) noexcept { delete (std::shared_ptr<sadmm_world> *)p; });
    return nb::cast(nb::ndarray<double>((void *)a.values, 2, shape, owner, strides, nb::dtype<double>(),
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
    MEMBER(separation, "f8", 1);
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
    for (int k = 0; k < SADMM_ARRAY_COUNT; ++k)
        names.append(nb::make_tuple(sadmm_array_name((sadmm_array)k), sadmm_array_columns((sadmm_array)k),
                                    sadmm_array_is_settable((sadmm_array)k)));
    m.attr("_arrays") = names;
    m.attr("_contact_members") = contact_members();
    m.attr("_contact_size") = sizeof(sadmm_contact);
    w.def("get", &get, "array"_a, "first"_a = 0, "count"_a = nb::none(), "out"_a = nb::none(),
          "Rows [first, first + count) of an array as float64, or into `out`, an array of float64 with as many rows "
          "and columns,\n"
          "in C order without gaps, which is returned then. Rows are bodies (World.bodies), joints or couplings.\n\n"
          "body_state (13 columns: position m, orientation w x y z, linear velocity m/s, angular velocity rad/s), "
          "body_wrench (6: N, N m),\n"
          "body_contact_wrench (6), body_inertia (4: kg, kg m^2), joint_position, joint_speed, joint_drive_force, "
          "joint_wrench,\n"
          "joint_target_position, joint_target_speed (6 each: coordinates), coupling_target (13, as body_state), "
          "coupling_reaction (6).");
    w.def("set", &set, "array"_a, "values"_a, "first"_a = 0,
          "Set rows of an array that can be set: body_state, body_wrench, body_inertia, joint_target_position, "
          "joint_target_speed,\n"
          "coupling_target. If a row is refused, nothing is set.");
    w.def("device_array", &device_array, "array"_a,
          "body_state or body_contact_wrench of the dynamic bodies on the device (CUDA), without a copy: an object "
          "for\n"
          "torch.from_dlpack and the like. Valid until the next step or change; read only. Rows: "
          "World.dynamic_bodies().");
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
          "Natural map of each of contacts(), m/s: how far it is from satisfying its law. Needs settings.certify.");
}

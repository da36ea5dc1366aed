// What the files of this module share: a world with its lock, and the way from a status to an exception.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>

#include "core/base/names.h"
#include "scene_file/scene_file.h"
#include "scenes/scenes.h"
#include "subadmm/subadmm.h"

namespace nb = nanobind;
using namespace nb::literals;

using vec3 = std::array<double, 3>;
using quat = std::array<double, 4>;
using vec6 = std::array<double, 6>;

// ---- arguments ------------------------------------------------------------------------------------------------------

// An argument as it was given. It is read where its name is known, so that an error can say which one it was, and
// nothing is made to fit: no float becomes an index, no other shape the one that is meant.
struct whole {
    nb::object given;
    int64_t in(const char *name, int64_t low, int64_t high) const;
    // Of an int whose range the library knows.
    int as_int(const char *name) const;
    uint32_t as_bits(const char *name) const { return (uint32_t)in(name, 0, UINT32_MAX); }
};
template <size_t N> struct numbers {
    nb::object given;
    std::array<double, N> as(const char *name) const;
};

// TypeError or InvalidArgument: "name = given: must be ...".
[[noreturn]] void refuse_type(const char *name, nb::handle given, const std::string &must_be);
[[noreturn]] void refuse_value(const char *name, nb::handle given, const std::string &must_be);
void read_numbers(const char *name, nb::handle given, size_t count, double *out);
// Of a text that C code reads up to its first 0: that it has none.
const std::string &without_null(const char *name, const std::string &text);
// Set attributes of `object` by their names.
void set_members(nb::handle object, nb::handle values);

template <size_t N> std::array<double, N> numbers<N>::as(const char *name) const
{
    std::array<double, N> out;
    read_numbers(name, given, N, out.data());
    return out;
}

// Numbers that a property reads: a subadmm.vectors.Vector, which cannot be written to. setter: the attribute that sets
// them; NULL: none does.
template <size_t N> struct seen {
    std::array<double, N> values;
    const char *setter;
};
nb::object vector_of(const double *values, size_t count, const char *setter);

namespace nanobind::detail {
template <size_t N> struct type_caster<seen<N>> {
    NB_TYPE_CASTER(seen<N>, const_name("numpy.typing.NDArray[numpy.float64]"))
    bool from_python(handle, uint32_t, cleanup_list *) noexcept { return false; }
    static handle from_cpp(const seen<N> &x, rv_policy, cleanup_list *) noexcept
    {
        try {
            return vector_of(x.values.data(), N, x.setter).release();
        } catch (python_error &error) {
            error.restore();
            return handle();
        }
    }
};
template <> struct type_caster<whole> {
    NB_TYPE_CASTER(whole, const_name("int"))
    bool from_python(handle src, uint32_t, cleanup_list *) noexcept
    {
        value.given = borrow(src);
        return true;
    }
};
template <size_t N> struct type_caster<numbers<N>> {
    NB_TYPE_CASTER(numbers<N>, const_name("numpy.typing.ArrayLike"))
    bool from_python(handle src, uint32_t, cleanup_list *) noexcept
    {
        value.given = borrow(src);
        return true;
    }
};
} // namespace nanobind::detail

// ---- errors ---------------------------------------------------------------------------------------------------------

// Raise the exception of a status.
[[noreturn]] void raise_status(sadmm_status status, const std::string &message);
// `status` of a call without a world: its message is this thread's last one.
void check(sadmm_status status);

struct hull_holder {
    sadmm_hull *hull = nullptr;
    ~hull_holder() { sadmm_hull_destroy(hull); }
};
struct mesh_holder {
    sadmm_mesh *mesh = nullptr;
    ~mesh_holder() { sadmm_mesh_destroy(mesh); }
};

// A shape's definition with what it points to.
struct shape_def {
    sadmm_shape_def def = sadmm_shape_def_default();
    std::shared_ptr<hull_holder> hull;
    std::shared_ptr<mesh_holder> mesh;
    std::string name;
    // To be given to the library; valid as long as this.
    sadmm_shape_def named() const
    {
        sadmm_shape_def out = def;
        out.name = name.c_str();
        return out;
    }
    bool of_world = false; // it was read of a BodyShape
};

// What acts along a coordinate of a joint.
struct coordinate_of {
    sadmm_joint_coordinate values = sadmm_joint_def_default().coordinates[0];
    bool of_joint = false; // it was read of a Joint
};

// One more use of the hull or mesh that a definition points to.
void hold_parts(shape_def &shape);
// Copies of the Shapes that an argument is a sequence of.
std::vector<shape_def> read_shapes(const char *name, nb::handle given);

// Objects of Python's that objects of a world have as user data, by keys, 1 and up (tags.h). Under the interpreter's
// lock.
struct world;
struct kept_objects {
    std::unordered_map<uintptr_t, nb::object> by_key;
    std::unordered_set<uintptr_t> placing; // on their way to an object
    uintptr_t last = 0;
    size_t limit = 64;
    nb::object get(uintptr_t key) const;
    uintptr_t add(world &w, nb::object value); // 0: of None
    void drop(uintptr_t key);
    void sweep(world &w);
};
nb::type_slots collected_world();

// A world, and the script of the scene that it was built from, where there is one. Calls are made without the
// interpreter's lock and one at a time: it is let go first, then the world's own is taken, and the other way round, so
// that no thread waits for one while it has the other.
//
// Everything but `scripted` and `spec` is read and written under the lock: another thread may be making a step.
struct world {
    std::shared_ptr<sadmm_world> kept; // by arrays on a device as well, which hold no Python object
    sadmm_world *handle = nullptr;
    std::mutex mutex;
    std::atomic<std::thread::id> by{}; // whose call is being made
    nb::object decide;  // the callback for manifolds, and what it has raised
    std::unique_ptr<nb::python_error> raised;
    bool scripted = false; // is there a script?
    bool script_on = true; // does it act?
    std::string spec;      // of the scene; of one from a text: none
    sadmm_scene scene{};
    sadmm_scene_result result{};
    int64_t steps = 0; // of the scene
    bool warned = false; // of a step that missed its tolerance
    sadmm_world_def def = sadmm_world_def_default(); // as it was created, with the precision that it has now
    kept_objects user_data;
    // From now on `made` is its own.
    void take(sadmm_world *made)
    {
        kept.reset(made, sadmm_world_destroy);
        handle = made;
    }
    ~world()
    {
        kept.reset();
        sadmm_scene_close(&scene);
    }
};

// A call on a world: one at a time, and none from within another one, as a callback could make it.
class world_lock {
  public:
    explicit world_lock(world &given) : w(given)
    {
        if (w.by.load() == std::this_thread::get_id())
            throw std::runtime_error("a callback of a world must not call the world");
        w.mutex.lock();
        w.by = std::this_thread::get_id();
    }
    ~world_lock()
    {
        w.by = std::thread::id();
        w.mutex.unlock();
    }
    world_lock(const world_lock &) = delete;
    world_lock &operator=(const world_lock &) = delete;

  private:
    world &w;
};

// Settings: those of a world, as they were read, whose members are set there, too; or some of nobody.
struct settings_of {
    sadmm_settings values = sadmm_settings_default();
    nb::object owner; // a World or Environments, or none
    // Set a member of the owner's settings: it reads them, lets `change` do so, and sets them, and no one else does so
    // in between.
    void (*set)(nb::handle owner, const std::function<void(settings_of &)> &change) = nullptr;
};
nb::object settings_read(const sadmm_settings &values, nb::handle owner,
                         void (*set)(nb::handle owner, const std::function<void(settings_of &)> &change));
// Those of an argument.
sadmm_settings read_settings(nb::handle given);

// f: a call that gives a status. Its message is read under the world's lock.
template <class F> void call(world &w, F f)
{
    sadmm_status status;
    std::string message;
    {
        nb::gil_scoped_release release;
        world_lock lock(w);
        status = f(w.handle);
        if (status != SADMM_OK) message = sadmm_world_message(w.handle);
    }
    if (status != SADMM_OK) raise_status(status, message);
}

// f: a call that gives something else and cannot fail.
template <class F> auto ask(world &w, F f)
{
    nb::gil_scoped_release release;
    world_lock lock(w);
    return f(w.handle);
}

// Objects of a world: its Python object, which they keep alive, and an id. The garbage collector is told of that
// reference, since the world's object may be of a class of the user's, whose attributes hold objects of the world.
template <class Id> struct object_of {
    nb::object owner;
    world *w;
    Id id;
    world &in() const
    {
        if (!w) throw std::runtime_error("the world of this object was deleted"); // by the garbage collector
        return *w;
    }
};
template <class Id> int traverse(PyObject *self, visitproc visit, void *arg) noexcept
{
    Py_VISIT(Py_TYPE(self));
    if (nb::inst_ready(self)) Py_VISIT(nb::inst_ptr<object_of<Id>>(self)->owner.ptr());
    return 0;
}
template <class Id> int clear(PyObject *self) noexcept
{
    if (!nb::inst_ready(self)) return 0;
    auto *object = nb::inst_ptr<object_of<Id>>(self);
    object->w = nullptr;
    nb::object dropped = std::move(object->owner); // whatever that leads to finds this one cleared
    return 0;
}
template <class Id> nb::type_slots collected()
{
    static PyType_Slot slots[] = {
        {Py_tp_traverse, (void *)&traverse<Id>}, {Py_tp_clear, (void *)&clear<Id>}, {0, nullptr}};
    return nb::type_slots(slots);
}

// The id of an object that has to be of this world.
template <class Id> Id id_in(const world &w, const object_of<Id> &object, const char *name)
{
    if (object.w != &w) refuse_value(name, nb::cast(object), "must be of this world, and is of another one");
    return object.id;
}
using body = object_of<sadmm_body_id>;
using shape = object_of<sadmm_shape_id>;
using joint = object_of<sadmm_joint_id>;
using coupling = object_of<sadmm_coupling_id>;
using gear = object_of<sadmm_gear_id>;

template <class Id> bool same_id(const object_of<Id> &a, const object_of<Id> &b)
{
    return a.w == b.w && a.id.slot == b.id.slot && a.id.generation == b.id.generation;
}
template <class Id> size_t hash_of(const object_of<Id> &a)
{
    return (size_t)a.w ^ ((size_t)a.id.slot << 32 | a.id.generation);
}

template <size_t N> seen<N> array_of(const double *x, const char *setter = nullptr)
{
    seen<N> out{{}, setter};
    for (size_t k = 0; k < N; ++k) out.values[k] = x[k];
    return out;
}
template <size_t N> void put(const std::array<double, N> &from, double *to)
{
    for (size_t k = 0; k < N; ++k) to[k] = from[k];
}

// All objects of a kind. count, at: the library's calls that give their number, and the id of the k-th.
template <class T, class Count, class At> std::vector<T> all_of(nb::handle self, Count count, At at)
{
    world &w = nb::cast<world &>(self);
    std::vector<decltype(T::id)> ids;
    call(w, [&](sadmm_world *h) {
        sadmm_status status = SADMM_OK;
        ids.resize((size_t)count(h));
        for (size_t k = 0; k < ids.size() && status == SADMM_OK; ++k) status = at(h, (int32_t)k, &ids[k]);
        return status;
    });
    std::vector<T> out;
    out.reserve(ids.size());
    for (const auto &id : ids) out.push_back(T{nb::borrow(self), &w, id});
    return out;
}

// Their ids, n x 2 (slot, generation), in the order of their rows.
template <class T> nb::object numpy_of(std::vector<T> values, std::vector<size_t> shape);
template <class Id, class Count, class At> nb::object ids_of(world &w, Count count, At at)
{
    std::vector<uint32_t> ids;
    call(w, [&](sadmm_world *h) {
        sadmm_status status = SADMM_OK;
        const size_t n = (size_t)count(h);
        ids.resize(2 * n);
        for (size_t k = 0; k < n && status == SADMM_OK; ++k) {
            Id id;
            status = at(h, (int32_t)k, &id);
            ids[2 * k] = id.slot, ids[2 * k + 1] = id.generation;
        }
        return status;
    });
    const size_t n = ids.size() / 2;
    return numpy_of(std::move(ids), {n, 2});
}

// A numpy array that owns its numbers.
template <class T> nb::object numpy_of(std::vector<T> values, std::vector<size_t> shape)
{
    auto *kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void *p) noexcept { delete (std::vector<T> *)p; });
    return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner));
}

// The names of an enumeration's values (core/base/names.h).
template <class E> struct names_of;
#define NAMES_OF(type, names, of)                              \
    template <> struct names_of<type> {                        \
        static constexpr const char *const *list = names;      \
        static constexpr int count = of;                       \
    };
NAMES_OF(sadmm_backend, sadmm_backend_names, SADMM_BACKEND_COUNT)
NAMES_OF(sadmm_precision, sadmm_precision_names, SADMM_PRECISION_COUNT)
NAMES_OF(sadmm_step_error, sadmm_step_error_names, SADMM_STEP_ERROR_COUNT)
NAMES_OF(sadmm_method, sadmm_method_names, SADMM_METHOD_COUNT)
NAMES_OF(sadmm_body_type, sadmm_body_type_names, SADMM_BODY_TYPE_COUNT)
NAMES_OF(sadmm_shape_type, sadmm_shape_type_names, SADMM_SHAPE_TYPE_COUNT)
NAMES_OF(sadmm_joint_kind, sadmm_joint_kind_names, SADMM_JOINT_KIND_COUNT)
NAMES_OF(sadmm_drive, sadmm_drive_names, SADMM_DRIVE_COUNT)

// The value with that name, or ValueError.
template <class E> E named(const char *what, const std::string &name)
{
    std::string all;
    for (int k = 0; k < names_of<E>::count; ++k) {
        if (name == names_of<E>::list[k]) return (E)k;
        all += std::string(k == 0 ? "" : ", ") + "'" + names_of<E>::list[k] + "'";
    }
    throw nb::value_error((std::string(what) + " = '" + name + "': must be one of " + all).c_str());
}
template <> inline sadmm_array named<sadmm_array>(const char *what, const std::string &name)
{
    std::string all;
    for (int k = 0; k < SADMM_ARRAY_COUNT; ++k) {
        const char *of = sadmm_array_name((sadmm_array)k);
        if (name == of) return (sadmm_array)k;
        all += std::string(k == 0 ? "" : ", ") + "'" + of + "'";
    }
    throw nb::value_error((std::string(what) + " = '" + name + "': must be one of " + all).c_str());
}
template <class E> nb::tuple all_names()
{
    nb::list all;
    for (int k = 0; k < names_of<E>::count; ++k) all.append(names_of<E>::list[k]);
    return nb::tuple(all);
}
template <class E> std::enable_if_t<(names_of<E>::count > 0), const char *> name_of(E value)
{
    return (int)value >= 0 && (int)value < names_of<E>::count ? names_of<E>::list[value] : "?";
}

void bind_settings(nb::module_ &m);
void bind_shapes(nb::module_ &m);
void bind_world(nb::module_ &m, nb::class_<world> &w);
void bind_arrays(nb::module_ &m, nb::class_<world> &w);
void bind_joints(nb::module_ &m, nb::class_<world> &w);
void bind_queries(nb::class_<world> &w);
void bind_events(nb::module_ &m, nb::class_<world> &w);
void bind_manifold(nb::module_ &m, nb::class_<world> &w);
// Of a world that no call is being made on.
void end_callback(world &w);
void bind_scenes(nb::module_ &m, nb::class_<world> &w);
void bind_environments(nb::module_ &m);
void bind_draw(nb::module_ &m);
void bind_debug_draw(nb::class_<world> &w);

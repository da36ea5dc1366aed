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

#include <memory>
#include <mutex>
#include <string>

#include "scene_file/scene_file.h"
#include "scenes/scenes.h"
#include "subadmm/subadmm.h"

namespace nb = nanobind;
using namespace nb::literals;

using vec3 = std::array<double, 3>;
using quat = std::array<double, 4>;
using vec6 = std::array<double, 6>;

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
};

// One more use of the hull or mesh that a definition points to.
void hold_parts(shape_def &shape);

// A world, and the script of the scene that it was built from, where there is one. Calls are made without the
// interpreter's lock and one at a time: it is let go first, then the world's own is taken, and the other way round, so
// that no thread waits for one while it has the other.
struct world {
    sadmm_world *handle = nullptr;
    std::mutex mutex;
    bool scripted = false; // is there a script?
    bool script_on = true; // does it act?
    std::string spec;      // of the scene; of one from a text: none
    sadmm_scene scene{};
    sadmm_scene_result result{};
    int64_t steps = 0; // of the scene
    sadmm_world_def def = sadmm_world_def_default(); // as it was created, with the precision that it has now
    ~world()
    {
        sadmm_world_destroy(handle);
        sadmm_scene_close(&scene);
    }
};

// f: a call that gives a status. Its message is read under the world's lock.
template <class F> void call(world &w, F f)
{
    sadmm_status status;
    std::string message;
    {
        nb::gil_scoped_release release;
        std::lock_guard<std::mutex> lock(w.mutex);
        status = f(w.handle);
        if (status != SADMM_OK) message = sadmm_world_message(w.handle);
    }
    if (status != SADMM_OK) raise_status(status, message);
}

// f: a call that gives something else and cannot fail.
template <class F> auto ask(world &w, F f)
{
    nb::gil_scoped_release release;
    std::lock_guard<std::mutex> lock(w.mutex);
    return f(w.handle);
}

// Objects of a world: its Python object, which they keep alive, and an id.
template <class Id> struct object_of {
    nb::object owner;
    world *w;
    Id id;
};
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

template <size_t N> std::array<double, N> array_of(const double *x)
{
    std::array<double, N> out;
    for (size_t k = 0; k < N; ++k) out[k] = x[k];
    return out;
}
template <size_t N> void put(const std::array<double, N> &from, double *to)
{
    for (size_t k = 0; k < N; ++k) to[k] = from[k];
}

// Objects of a world by their index in [0, count). at: the library's call that gives an id.
template <class T, class At> std::vector<T> all_of(nb::handle self, int32_t count, At at)
{
    world &w = nb::cast<world &>(self);
    std::vector<T> out;
    for (int32_t k = 0; k < count; ++k) {
        T one{nb::borrow(self), &w, {}};
        call(w, [&](sadmm_world *h) { return at(h, k, &one.id); });
        out.push_back(one);
    }
    return out;
}

// A numpy array that owns its numbers.
template <class T> nb::object numpy_of(std::vector<T> values, std::vector<size_t> shape)
{
    auto *kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void *p) noexcept { delete (std::vector<T> *)p; });
    return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner));
}

// One of a list of names, or ValueError.
template <class E, size_t N> E named(const char *what, const std::string &name, const std::pair<const char *, E> (&names)[N])
{
    std::string all;
    for (const auto &entry : names) {
        if (name == entry.first) return entry.second;
        all += std::string(all.empty() ? "" : ", ") + "'" + entry.first + "'";
    }
    throw nb::value_error((std::string(what) + " = '" + name + "': must be one of " + all).c_str());
}
template <class E, size_t N> const char *name_of(E value, const std::pair<const char *, E> (&names)[N])
{
    for (const auto &entry : names)
        if (entry.second == value) return entry.first;
    return "?";
}

inline constexpr std::pair<const char *, sadmm_backend> backend_names[] = {
    {"auto", SADMM_BACKEND_AUTO}, {"ref", SADMM_BACKEND_REF}, {"cpu", SADMM_BACKEND_CPU}, {"cuda", SADMM_BACKEND_CUDA}};
inline constexpr std::pair<const char *, sadmm_precision> precision_names[] = {{"f32", SADMM_F32}, {"f64", SADMM_F64}};
inline constexpr std::pair<const char *, sadmm_method> method_names[] = {{"paper", SADMM_METHOD_PAPER},
                                                                         {"fast", SADMM_METHOD_FAST}};
inline constexpr std::pair<const char *, sadmm_body_type> body_type_names[] = {
    {"dynamic", SADMM_BODY_DYNAMIC}, {"static", SADMM_BODY_STATIC}, {"kinematic", SADMM_BODY_KINEMATIC}};

void bind_settings(nb::module_ &m);
void bind_shapes(nb::module_ &m);
void bind_world(nb::module_ &m, nb::class_<world> &w);
void bind_arrays(nb::module_ &m, nb::class_<world> &w);
void bind_joints(nb::module_ &m, nb::class_<world> &w);
void bind_queries(nb::class_<world> &w);
void bind_events(nb::module_ &m, nb::class_<world> &w);
void bind_scenes(nb::module_ &m, nb::class_<world> &w);

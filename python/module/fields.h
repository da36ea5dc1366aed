// Properties and arguments from the lists of members (core/base/fields.h).
#pragma once

#include "common.h"
#include "core/base/definition_fields.h"
#include "core/base/settings_fields.h"

// ---- properties -----------------------------------------------------------------------------------------------------

// "Text. In [lo, hi]."
std::string documented(const sadmm_field &field);

// at: from an object to the member, [](auto &o) -> auto & { return o.member; }.

// Change an object that a property was set of: by itself, or as what it belongs to wants it.
template <class T, class F> void change(T &object, F f) { f(object); }
template <class F> void change(settings_of &settings, F f)
{
    if (settings.set) settings.set(settings.owner, f);
    f(settings);
}
template <class F> void change(coordinate_of &coordinate, F f)
{
    if (coordinate.of_joint)
        throw nb::value_error("what Joint.coordinate gives is a copy, which is not to be written to; change its "
                              "copy() and give that to set_coordinate, or use set_target");
    f(coordinate);
}
template <class F> void change(shape_def &shape, F f)
{
    if (shape.of_world)
        throw nb::value_error("a BodyShape's definition is a copy, which is not to be written to; set_material, "
                              "set_frame and set_size change the shape, and copy() is a definition of your own");
    f(shape);
}
template <class T, class At> void bind_REAL(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    c.def_prop_rw(
        name, [at](const T &o) { return at(o); }, [at](T &o, double x) { change(o, [&](T &t) { at(t) = x; }); },
        doc.c_str());
}
template <class T, class At> void bind_BOUND(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    bind_REAL(c, name, at, doc);
}
template <class T, class At> void bind_FLAG(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    c.def_prop_rw(
        name, [at](const T &o) { return at(o); }, [at](T &o, bool x) { change(o, [&](T &t) { at(t) = x; }); },
        doc.c_str());
}
template <class T, class At> void bind_WHOLE(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    c.def_prop_rw(
        name, [at](const T &o) { return at(o); }, [at, name](T &o, const whole &given) {
            const int x = given.as_int(name);
            change(o, [&](T &t) { at(t) = x; });
        },
        doc.c_str());
}
template <class T, class At> void bind_BITS(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    c.def_prop_rw(
        name, [at](const T &o) { return at(o); }, [at, name](T &o, const whole &given) {
            const uint32_t x = given.as_bits(name);
            change(o, [&](T &t) { at(t) = x; });
        },
        doc.c_str());
}
template <size_t N, class T, class At>
void bind_numbers(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    c.def_prop_rw(name, [at, name](const T &o) { return array_of<N>(at(o), name); },
                  [at, name](T &o, const numbers<N> &given) {
                      const std::array<double, N> x = given.as(name);
                      change(o, [&](T &t) { put(x, at(t)); });
                  }, doc.c_str());
}
template <class T, class At> void bind_VECTOR(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    bind_numbers<3>(c, name, at, doc);
}
template <class T, class At> void bind_TURN(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    bind_numbers<4>(c, name, at, doc);
}
template <class T, class At> void bind_named(nb::class_<T> &c, const char *name, At at, const std::string &doc)
{
    c.def_prop_rw(name, [at](const T &o) { return name_of(at(o)); },
                  [at, name](T &o, const std::string &given) {
                      const auto x = named<std::decay_t<decltype(at(o))>>(name, given);
                      change(o, [&](T &t) { at(t) = x; });
                  }, doc.c_str());
}
#define bind_METHOD bind_named
#define bind_DRIVE bind_named

// ---- what is read of an object --------------------------------------------------------------------------------------

inline double shown(double x) { return x; }
inline bool shown(bool x) { return x; }
inline int shown(int x) { return x; }
inline uint32_t shown(uint32_t x) { return x; }
template <size_t N> seen<N> shown(const double (&x)[N]) { return array_of<N>(x); }
template <class E> std::enable_if_t<std::is_enum_v<E>, const char *> shown(E x) { return name_of(x); }

// of: def_of(object) gives the definition.
#define READ_ONLY(c, object, name, text) \
    c.def_prop_ro(#name, [](const object &o) { return shown(def_of(o).name); }, text)

// ---- arguments ------------------------------------------------------------------------------------------------------

// Of a function that adds an object: parameters, their names and defaults (each behind a comma), and from them into a
// definition. What has another form in Python (role OWN) is left out.
#define PARAMETER(X, kind, role, name, ...) PARAMETER_##role(PARAMETER_OF_##kind(name))
#define PARAMETER_PLAIN(...) __VA_ARGS__
#define PARAMETER_DYNAMIC(...) __VA_ARGS__
#define PARAMETER_OWN(...)
#define PARAMETER_HIDDEN(...)
#define PARAMETER_OF_REAL(name) , double name
#define PARAMETER_OF_BOUND(name) , double name
#define PARAMETER_OF_FLAG(name) , bool name
#define PARAMETER_OF_WHOLE(name) , const whole &name
#define PARAMETER_OF_BITS(name) , const whole &name
#define PARAMETER_OF_VECTOR(name) , const numbers<3> &name
#define PARAMETER_OF_TURN(name) , const numbers<4> &name
#define PARAMETER_OF_TWIST(name) , const numbers<6> &name
#define PARAMETER_OF_BODY_TYPE(name) , const std::string &name
#define PARAMETER_OF_JOINT_KIND(name) // comes first
#define PARAMETER_OF_ID(name)
#define PARAMETER_OF_OTHER(name)

#define ARGUMENT(X, kind, role, name, value, ...) ARGUMENT_##role(ARGUMENT_OF_##kind(name, value))
#define ARGUMENT_PLAIN(...) __VA_ARGS__
#define ARGUMENT_DYNAMIC(...) __VA_ARGS__
#define ARGUMENT_OWN(...)
#define ARGUMENT_HIDDEN(...)
#define ARGUMENT_OF_REAL(name, value) , nb::arg(#name) = (double)(value)
#define ARGUMENT_OF_BOUND(name, value) , nb::arg(#name) = (double)(value)
#define ARGUMENT_OF_FLAG(name, value) , nb::arg(#name) = value
#define ARGUMENT_OF_WHOLE(name, value) , nb::arg(#name) = value
#define ARGUMENT_OF_BITS(name, value) , nb::arg(#name) = value
#define ARGUMENT_OF_VECTOR(name, ...) , nb::arg(#name) = vec3 __VA_ARGS__
#define ARGUMENT_OF_TURN(name, ...) , nb::arg(#name) = quat __VA_ARGS__
#define ARGUMENT_OF_TWIST(name, ...) , nb::arg(#name) = vec6 __VA_ARGS__
#define ARGUMENT_OF_BODY_TYPE(name, value) , nb::arg(#name) = name_of(value)
#define ARGUMENT_OF_JOINT_KIND(name, value)
#define ARGUMENT_OF_ID(name, ...)
#define ARGUMENT_OF_OTHER(name, ...)

#define PUT(def, kind, role, name, ...) PUT_##role(PUT_OF_##kind(def, name))
#define PUT_PLAIN(statement) statement
#define PUT_DYNAMIC(statement) statement
#define PUT_OWN(statement)
#define PUT_HIDDEN(statement)
#define PUT_OF_REAL(def, name) def.name = name;
#define PUT_OF_BOUND(def, name) def.name = name;
#define PUT_OF_FLAG(def, name) def.name = name;
#define PUT_OF_WHOLE(def, name) def.name = name.as_int(#name);
#define PUT_OF_BITS(def, name) def.name = name.as_bits(#name);
#define PUT_OF_VECTOR(def, name) put(name.as(#name), def.name);
#define PUT_OF_TURN(def, name) put(name.as(#name), def.name);
#define PUT_OF_TWIST(def, name) put(name.as(#name), def.name);
#define PUT_OF_BODY_TYPE(def, name) def.name = named<sadmm_body_type>(#name, name);
#define PUT_OF_JOINT_KIND(def, name)
#define PUT_OF_ID(def, name)
#define PUT_OF_OTHER(def, name)

// Names and user data of bodies, shapes, joints, gears and couplings.
#pragma once

#include "common.h"

// The library's calls for a kind of object.
template <class Id> struct tag_calls;
#define TAG_CALLS(object)                                                \
    template <> struct tag_calls<sadmm_##object##_id> {                  \
        static constexpr auto name = &sadmm_world_##object##_name;       \
        static constexpr auto get = &sadmm_world_##object##_user_data;   \
        static constexpr auto set = &sadmm_world_set_##object##_user_data; \
        static constexpr auto count = &sadmm_world_##object##_count;     \
        static constexpr auto at = &sadmm_world_##object##_at;           \
    };
TAG_CALLS(body)
TAG_CALLS(shape)
TAG_CALLS(joint)
TAG_CALLS(gear)
TAG_CALLS(coupling)

// An object's user data in the library is the key of the Python object in world::user_data; NULL: None. So the library
// says whose it is, and what becomes of it when worlds are restored.

template <class Id> std::string tagged_name(const object_of<Id> &o)
{
    std::string name;
    call(o.in(), [&](sadmm_world *h) {
        name = tag_calls<Id>::name(h, o.id);
        return tag_calls<Id>::set(h, o.id, tag_calls<Id>::get(h, o.id)); // STALE_ID: it was removed
    });
    return name;
}

template <class Id> nb::object user_data_of(const object_of<Id> &o)
{
    void *key = nullptr;
    call(o.in(), [&](sadmm_world *h) {
        key = tag_calls<Id>::get(h, o.id);
        return tag_calls<Id>::set(h, o.id, key);
    });
    return o.in().user_data.get((uintptr_t)key);
}

template <class Id> void set_user_data_of(const object_of<Id> &o, nb::object value)
{
    world &w = o.in();
    void *const key = (void *)w.user_data.add(w, std::move(value)), *before = nullptr;
    try {
        call(w, [&](sadmm_world *h) {
            before = tag_calls<Id>::get(h, o.id);
            return tag_calls<Id>::set(h, o.id, key);
        });
    } catch (...) {
        w.user_data.placing.erase((uintptr_t)key);
        w.user_data.drop((uintptr_t)key);
        throw;
    }
    w.user_data.placing.erase((uintptr_t)key);
    w.user_data.drop((uintptr_t)before);
}

// f(id calls, world, id, key) of every object with a key. Under the world's lock.
template <class Id, class F> void each_key_of(sadmm_world *h, F f)
{
    for (int32_t k = 0; k < tag_calls<Id>::count(h); ++k) {
        Id id;
        if (tag_calls<Id>::at(h, k, &id) != SADMM_OK) continue;
        void *const key = tag_calls<Id>::get(h, id);
        if (key) f(id, key);
    }
}
template <class F> void each_key(sadmm_world *h, F f)
{
    each_key_of<sadmm_body_id>(h, f);
    each_key_of<sadmm_shape_id>(h, f);
    each_key_of<sadmm_joint_id>(h, f);
    each_key_of<sadmm_gear_id>(h, f);
    each_key_of<sadmm_coupling_id>(h, f);
}

template <class Id> void bind_user_data(nb::class_<object_of<Id>> &c)
{
    c.def_prop_rw("user_data", &user_data_of<Id>, &set_user_data_of<Id>, nb::for_setter("value"_a.none()),
                  nb::for_getter(nb::sig("def user_data(self) -> Any")),
                  nb::for_setter(nb::sig("def user_data(self, value: Any, /) -> None")),
                  "Any object of yours, None at first. It goes with this one, clones have it too, restore() keeps it "
                  "where the\nsame object is there; it is not saved.");
}
template <class Id> void bind_tags(nb::class_<object_of<Id>> &c)
{
    c.def_prop_ro("name", &tagged_name<Id>, "The name, up to 63 bytes of UTF-8; '' where it has none.");
    bind_user_data(c);
}

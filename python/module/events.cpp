// What begins and ends between shapes.
#include "common.h"

static constexpr std::pair<const char *, sadmm_event_type> event_names[] = {
    {"contact_begun", SADMM_EVENT_CONTACT_BEGUN},
    {"contact_ended", SADMM_EVENT_CONTACT_ENDED},
    {"sensor_begun", SADMM_EVENT_SENSOR_BEGUN},
    {"sensor_ended", SADMM_EVENT_SENSOR_ENDED},
};

// As sadmm_event is in memory: numpy reads its members where they are.
static nb::object take(world &w)
{
    std::vector<sadmm_event> all;
    int64_t dropped = 0;
    call(w, [&](sadmm_world *h) {
        int32_t count;
        all.resize((size_t)sadmm_world_event_count(h));
        return sadmm_world_take_events(h, (int32_t)all.size(), all.data(), &count, &dropped);
    });
    return nb::make_tuple(nb::bytes((const char *)all.data(), all.size() * sizeof(sadmm_event)), dropped);
}

static nb::list members()
{
    nb::list out;
#define MEMBER(name, format, count) out.append(nb::make_tuple(#name, format, count, offsetof(sadmm_event, name)))
    MEMBER(step, "i8", 1);
    MEMBER(type, "i4", 1);
    MEMBER(shape_a, "u4", 2);
    MEMBER(shape_b, "u4", 2);
    MEMBER(body_a, "u4", 2);
    MEMBER(body_b, "u4", 2);
    MEMBER(position, "f8", 3);
    MEMBER(normal, "f8", 3);
    MEMBER(speed, "f8", 1);
    MEMBER(impulse, "f8", 3);
#undef MEMBER
    return out;
}

template <class Id> static Id read_id(const nb::object &given)
{
    if (!PySequence_Check(given.ptr()) || nb::len(given) != 2)
        refuse_type("id", given, "must be (slot, generation)");
    return {whole{given[0]}.as_bits("id[0]"), whole{given[1]}.as_bits("id[1]")};
}

void bind_events(nb::module_ &m, nb::class_<world> &w)
{
    static_assert(sizeof(sadmm_event_type) == 4, "members() says so");
    for (const auto &entry : event_names) {
        std::string name(entry.first);
        for (char &c : name) c = (char)toupper(c);
        m.attr(name.c_str()) = (int)entry.second;
    }
    m.attr("_event_members") = members();
    m.attr("_event_size") = sizeof(sadmm_event);
    w.def(
        "record_events",
        [](world &w, whole capacity) {
            const int most = capacity.as_int("capacity");
            call(w, [&](sadmm_world *h) { return sadmm_world_record_events(h, most); });
        },
        "capacity"_a = 65536,
        "Record the begin and end of contacts and sensor overlaps from the next step on; up to `capacity` events "
        "are kept until they are taken, the oldest are dropped. 0: stop.");
    w.def_prop_ro(
        "event_count", [](world &w) { return ask(w, [](sadmm_world *h) { return sadmm_world_event_count(h); }); },
        "Number of events that can be taken.");
    w.def("_take_events", &take);
    w.def("sensor_overlaps", [](nb::handle_t<world> self, const shape &sensor) {
        world &w = nb::cast<world &>(self);
        const sadmm_shape_id id = id_in(w, sensor, "sensor");
        std::vector<sadmm_shape_id> ids;
        call(w, [&](sadmm_world *h) {
            int32_t count = 0;
            sadmm_status status = sadmm_world_sensor_overlaps(h, id, 0, nullptr, &count);
            ids.resize((size_t)count);
            if (status == SADMM_OK && count > 0) status = sadmm_world_sensor_overlaps(h, id, count, ids.data(), &count);
            return status;
        });
        std::vector<shape> out;
        for (const sadmm_shape_id &id : ids) out.push_back(shape{nb::borrow(self), &w, id});
        return out;
    }, "sensor"_a, "Shapes that overlap a sensor now.");
    w.def("find_shape", [](nb::handle_t<world> self, nb::object id) {
        world &w = nb::cast<world &>(self);
        shape out{nb::borrow(self), &w, read_id<sadmm_shape_id>(id)};
        sadmm_shape_def def;
        call(w, [&](sadmm_world *h) { return sadmm_world_shape_def(h, out.id, &def, nullptr); });
        return out;
    }, "id"_a, "The shape with the id (slot, generation) of an event or contact. StaleId: it was removed.");
    w.def("find_body", [](nb::handle_t<world> self, nb::object id) {
        world &w = nb::cast<world &>(self);
        body out{nb::borrow(self), &w, read_id<sadmm_body_id>(id)};
        int32_t index;
        call(w, [&](sadmm_world *h) { return sadmm_world_body_index(h, out.id, &index); });
        return out;
    }, "id"_a, "The body with the id (slot, generation).");
}

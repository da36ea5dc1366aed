#include "tags.h"

nb::object kept_objects::get(uintptr_t key) const
{
    const auto found = by_key.find(key);
    return found == by_key.end() ? nb::none() : found->second;
}

uintptr_t kept_objects::add(world &w, nb::object value)
{
    if (value.is_none()) return 0;
    if (by_key.size() >= limit) {
        sweep(w);
        limit = 2 * by_key.size() + 64;
    }
    by_key.emplace(++last, std::move(value));
    placing.insert(last);
    return last;
}

void kept_objects::drop(uintptr_t key)
{
    const auto found = by_key.find(key);
    if (found == by_key.end()) return;
    const nb::object dropped = std::move(found->second); // its end may come back here
    by_key.erase(found);
}

// Objects of the world go without a word: what was theirs is let go when as much again has come.
void kept_objects::sweep(world &w)
{
    std::unordered_set<uintptr_t> used;
    const uintptr_t until = last; // another thread may add more meanwhile,
    const std::unordered_set<uintptr_t> placed_later = placing; // or be about to place what it has added
    ask(w, [&](sadmm_world *h) {
        each_key(h, [&](auto, void *key) { used.insert((uintptr_t)key); });
        return 0;
    });
    std::vector<nb::object> dropped;
    for (auto at = by_key.begin(); at != by_key.end();) {
        if (at->first > until || placed_later.count(at->first) || used.count(at->first)) {
            ++at;
            continue;
        }
        dropped.push_back(std::move(at->second));
        at = by_key.erase(at);
    }
}

// What a caller gave a world may hold the world: objects as user data, the callback for manifolds.
static int traverse_world(PyObject *self, visitproc visit, void *arg) noexcept
{
    Py_VISIT(Py_TYPE(self));
    if (!nb::inst_ready(self)) return 0;
    const world &w = *nb::inst_ptr<world>(self);
    for (const auto &[key, value] : w.user_data.by_key) Py_VISIT(value.ptr());
    Py_VISIT(w.decide.ptr());
    return 0;
}

static int clear_world(PyObject *self) noexcept
{
    if (!nb::inst_ready(self)) return 0;
    world &w = *nb::inst_ptr<world>(self);
    std::unordered_map<uintptr_t, nb::object> dropped;
    dropped.swap(w.user_data.by_key);
    end_callback(w); // no call is being made: that would hold the world
    return 0;
}

nb::type_slots collected_world()
{
    static PyType_Slot slots[] = {
        {Py_tp_traverse, (void *)&traverse_world}, {Py_tp_clear, (void *)&clear_world}, {0, nullptr}};
    return nb::type_slots(slots);
}

// Arguments: what they must be, and what is said where they are not.
#include "common.h"

static std::string said(const char *name, nb::handle given, const std::string &must_be)
{
    nb::object text = nb::steal(PyObject_Repr(given.ptr()));
    if (!text.is_valid()) throw nb::python_error();
    if (nb::len(text) > 80) text = nb::str(text[nb::slice(nb::int_(0), nb::int_(77), nb::none())]) + nb::str("...");
    return std::string(name) + " = " + nb::str(text).c_str() + ": " + must_be;
}

void refuse_type(const char *name, nb::handle given, const std::string &must_be)
{
    throw nb::type_error(said(name, given, must_be).c_str());
}

void refuse_value(const char *name, nb::handle given, const std::string &must_be)
{
    raise_status(SADMM_ERROR_INVALID_ARGUMENT, said(name, given, must_be));
}

const std::string &without_null(const char *name, const std::string &text)
{
    if (text.find('\0') != std::string::npos)
        refuse_value(name, nb::str(text.data(), text.size()), "must have no null character");
    return text;
}

nb::object vector_of(const double *values, size_t count, const char *setter)
{
    const nb::bytes numbers((const char *)values, count * sizeof *values);
    const nb::object name = setter ? nb::object(nb::str(setter)) : nb::none();
    return nb::module_::import_("subadmm.vectors").attr("made")(numbers, name);
}

// Gives false where it is no whole number of 64 bits.
static bool read_whole(const char *name, nb::handle given, const std::string &must_be, long long &x)
{
    nb::object index = nb::steal(PyNumber_Index(given.ptr()));
    if (!index.is_valid()) {
        PyErr_Clear();
        refuse_type(name, given, must_be);
    }
    int overflow = 0;
    x = PyLong_AsLongLongAndOverflow(index.ptr(), &overflow);
    return overflow == 0;
}

int64_t whole::in(const char *name, int64_t low, int64_t high) const
{
    const std::string must_be = "must be a whole number in [" + std::to_string(low) + ", " + std::to_string(high) + "]";
    long long x;
    if (!read_whole(name, given, must_be, x) || x < low || x > high) refuse_value(name, given, must_be);
    return x;
}

int whole::as_int(const char *name) const
{
    static const char must_be[] = "must be a whole number of 32 bits";
    long long x;
    if (!read_whole(name, given, must_be, x) || x < INT32_MIN || x > INT32_MAX) refuse_value(name, given, must_be);
    return (int)x;
}

// One number: a float, an int, or what numpy and others have for them; no array of one number, nothing complex.
static bool read_number(PyObject *item, double &x)
{
    if (!PyFloat_Check(item) && !PyLong_Check(item)) {
        nb::object dimensions = nb::getattr(item, "ndim", nb::int_(0)), type = nb::getattr(item, "dtype", nb::none());
        if (!dimensions.equal(nb::int_(0))) return false;
        if (nb::getattr(type, "kind", nb::str("f")).equal(nb::str("c"))) return false;
    }
    x = PyFloat_AsDouble(item);
    if (x != -1.0 || !PyErr_Occurred()) return true;
    PyErr_Clear();
    return false;
}

void read_numbers(const char *name, nb::handle given, size_t count, double *out)
{
    PyObject *o = given.ptr();
    bool fine =
        PySequence_Check(o) && !PyUnicode_Check(o) && !PyBytes_Check(o) && PySequence_Size(o) == (Py_ssize_t)count;
    for (size_t k = 0; k < count && fine; ++k) {
        nb::object item = nb::steal(PySequence_GetItem(o, (Py_ssize_t)k));
        fine = item.is_valid() && read_number(item.ptr(), out[k]);
    }
    PyErr_Clear();
    if (!fine) refuse_type(name, given, "must be " + std::to_string(count) + " numbers");
}

void set_members(nb::handle object, nb::handle values)
{
    for (auto [key, value] : nb::cast<nb::dict>(values)) {
        if (!nb::isinstance<nb::str>(key)) refuse_type("name of a member", key, "must be a string");
        const std::string name = nb::cast<std::string>(key);
        try {
            nb::setattr(object, key, value);
        } catch (nb::python_error &error) {
            if (!error.matches(PyExc_TypeError)) throw;
            const std::string why = nb::str(error.value()).c_str();
            // What reads its value itself has said so; nanobind says neither name nor value, only "(self, arg: float,
            // /)".
            if (why.compare(0, name.size() + 3, name + " = ") == 0) throw;
            const size_t at = why.find("arg: "), end = why.find_first_of(",)", at);
            if (at == std::string::npos || end == std::string::npos) throw;
            refuse_type(name.c_str(), value, "must be of type " + why.substr(at + 5, end - at - 5));
        }
    }
}

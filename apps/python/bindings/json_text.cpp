#include "apps/python/bindings/json_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace nbd::python {
namespace {

namespace py = pybind11;

constexpr int deepest =
    100;  // levels of lists and dictionaries in each other; one that holds itself has no end

/// The same of what JSON has. path: of the value, for messages.
py::object plain(py::handle value, const std::string& path, int level = 0) {
    const auto refuse = [&](const std::string& what) {
        throw std::invalid_argument(fmt::format("{}: {}", path.empty() ? "the dictionary" : path, what));
    };
    if (value.is_none() || py::isinstance<py::bool_>(value) || py::isinstance<py::str>(value) ||
        py::isinstance<py::int_>(value))
        return py::reinterpret_borrow<py::object>(value);
    if (py::isinstance<py::float_>(value)) {
        const double number = value.cast<double>();
        if (!std::isfinite(number)) refuse(fmt::format("is {}; allowed: finite numbers", number));
        return py::float_(number);
    }
    if (level > deepest)
        throw std::invalid_argument(
            fmt::format("{}: holds lists and dictionaries in each other; allowed: at most {} levels",
                        path.substr(0, path.find_first_of(".[")), deepest));
    if (py::hasattr(value, "tolist")) return plain(value.attr("tolist")(), path, level + 1);
    if (py::hasattr(value, "__fspath__")) return value.attr("__fspath__")();
    if (py::hasattr(value, "keys")) {
        py::dict result;
        for (const py::handle key : value.attr("keys")()) {
            if (!py::isinstance<py::str>(key))
                refuse(fmt::format("has the key {}; allowed: texts", std::string(py::repr(key))));
            const auto name = key.cast<std::string>();
            result[key] = plain(value[key], path.empty() ? name : path + "." + name, level + 1);
        }
        return result;
    }
    if (py::isinstance<py::sequence>(value) && !py::isinstance<py::bytes>(value)) {
        py::list result;
        std::size_t index = 0;
        for (const py::handle item : value)
            result.append(plain(item, fmt::format("{}[{}]", path, index++), level + 1));
        return result;
    }
    refuse(fmt::format("is of the type {}; allowed: what JSON has, arrays of numpy and paths",
                       py::type::of(value).attr("__name__").cast<std::string>()));
    return {};
}

}  // namespace

std::string json_text(py::handle dictionary) {
    return py::module_::import("json").attr("dumps")(plain(dictionary, "")).cast<std::string>();
}

}  // namespace nbd::python

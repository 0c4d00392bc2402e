#pragma once

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "collision/tree/bound_kind.hpp"
#include "meshing/body/material.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/surface/subdivide.hpp"

// What signatures say of arguments and results beyond their types in C++; write_stubs.py makes the types of
// the package of them.
namespace nbd::python {

namespace py = pybind11;

/// A text as an argument of a template.
template <std::size_t size>
struct Text {
    constexpr Text(const char (&given)[size]) { std::ranges::copy(given, text); }
    char text[size];
};

/// An object of Python that the signature and the stubs give this type.
template <Text type>
struct Typed : py::object {
    using py::object::object;
    Typed(py::object object) : py::object(std::move(object)) {}
    static bool check_(py::handle) { return true; }
};

/// The value with this name. Throws std::invalid_argument, naming the argument and what is allowed.
template <class Value>
Value value_named(const char* argument, const std::string& text,
                  std::span<const std::pair<const char*, Value>> values) {
    std::vector<const char*> names;
    for (const auto& [name, value] : values) {
        if (text == name) return value;
        names.push_back(name);
    }
    throw std::invalid_argument(
        fmt::format("{}: is \"{}\"; allowed: {}", argument, text, fmt::join(names, ", ")));
}

/// Names of values of an enum, which Python gives and gets as text.
template <class Enum>
struct Names;

template <>
struct Names<BoundKind> {
    static BoundKind value(const std::string& text) { return bound_kind(text); }
    static std::string text(BoundKind kind) { return std::string(name(kind)); }
};

template <>
struct Names<SubdivisionScheme> {
    static constexpr std::pair<const char*, SubdivisionScheme> all[] = {
        {"midpoint", SubdivisionScheme::midpoint}, {"loop", SubdivisionScheme::loop}};
    static SubdivisionScheme value(const std::string& text) {
        return value_named<SubdivisionScheme>("scheme", text, all);
    }
    static std::string text(SubdivisionScheme scheme) { return all[static_cast<int>(scheme)].first; }
};

template <>
struct Names<Elements> {
    static constexpr std::pair<const char*, Elements> all[] = {{"linear", Elements::linear},
                                                               {"quadratic", Elements::quadratic}};
    static Elements value(const std::string& text) { return value_named<Elements>("elements", text, all); }
    static std::string text(Elements elements) { return all[static_cast<int>(elements)].first; }
};

template <>
struct Names<MaterialLaw> {
    static MaterialLaw value(const std::string& text) {
        if (const auto law = material_law(text)) return *law;
        throw std::invalid_argument(
            fmt::format("law: is \"{}\"; allowed: corotated, stable_neo_hookean, st_venant_kirchhoff", text));
    }
    static std::string text(MaterialLaw law) { return std::string(name(law)); }
};

}  // namespace nbd::python

namespace pybind11::detail {

template <nbd::python::Text type>
struct handle_type_name<nbd::python::Typed<type>> {
    static constexpr auto name = const_name(type.text);
};

/// An enum that has Names.
template <class Enum>
struct NamesCaster {
    PYBIND11_TYPE_CASTER(Enum, const_name("str"));

    bool load(handle source, bool convert) {
        make_caster<std::string> text;
        if (!text.load(source, convert)) return false;
        value = nbd::python::Names<Enum>::value(cast_op<std::string&>(text));
        return true;
    }
    static handle cast(Enum of, return_value_policy policy, handle parent) {
        return make_caster<std::string>::cast(nbd::python::Names<Enum>::text(of), policy, parent);
    }
};
template <>
struct type_caster<nbd::BoundKind> : NamesCaster<nbd::BoundKind> {};
template <>
struct type_caster<nbd::SubdivisionScheme> : NamesCaster<nbd::SubdivisionScheme> {};
template <>
struct type_caster<nbd::Elements> : NamesCaster<nbd::Elements> {};
template <>
struct type_caster<nbd::MaterialLaw> : NamesCaster<nbd::MaterialLaw> {};

}  // namespace pybind11::detail

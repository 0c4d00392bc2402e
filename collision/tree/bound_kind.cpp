#include "collision/tree/bound_kind.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

static_assert(std::ranges::all_of(bound_kinds, [](BoundKind kind) { return traits(kind).kind == kind; }));

constexpr std::pair<std::string_view, std::string_view> gone[] = {{"modal", "nbd"},
                                                                  {"local", "learned_affine"},
                                                                  {"local_boxes", "learned_affine"},
                                                                  {"learned_spheres", "learned_affine"},
                                                                  {"learned_boxes", "learned_affine"},
                                                                  {"certified", "affine"}};

}  // namespace

std::string_view instead_of_bound(std::string_view name) noexcept {
    for (const auto& [old, instead] : gone)
        if (name == old) return instead;
    return {};
}

std::string left_out(const GoneBounds& gone) {
    return message("its ", gone.names, " bounds are gone and were left out; use ", gone.instead);
}

BoundKind bound_kind(std::string_view name) {
    std::string known;
    for (const BoundKind kind : bound_kinds) {
        if (name == nbd::name(kind)) return kind;
        known.append(known.empty() ? "" : ", ").append(nbd::name(kind));
    }
    if (const std::string_view instead = instead_of_bound(name); !instead.empty())
        throw std::invalid_argument(message("bounds \"", name, "\" are gone; write \"", instead, '"'));
    throw std::invalid_argument(message("unknown bounds \"", name, "\", known: ", known));
}

}  // namespace nbd

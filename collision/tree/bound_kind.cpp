#include "collision/tree/bound_kind.hpp"

#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

constexpr std::pair<std::string_view, std::string_view> gone[] = {{"modal", "nbd"},
                                                                  {"local", "learned_affine"},
                                                                  {"local_boxes", "learned_affine"},
                                                                  {"learned_spheres", "learned_affine"},
                                                                  {"learned_boxes", "learned_affine"},
                                                                  {"certified", "affine"}};

}  // namespace

std::string_view name(BoundKind kind) noexcept {
    switch (kind) {
        case BoundKind::exact:
            return "exact";
        case BoundKind::boxes:
            return "boxes";
        case BoundKind::bd:
            return "bd";
        case BoundKind::nbd:
            return "nbd";
        case BoundKind::learned_affine:
            return "learned_affine";
        case BoundKind::affine:
            return "affine";
        case BoundKind::automatic:
            return "auto";
    }
    return "unknown";
}

std::string_view instead_of_bound(std::string_view name) noexcept {
    for (const auto& [old, instead] : gone)
        if (name == old) return instead;
    return {};
}

std::string left_out(const GoneBounds& gone) {
    return message("its ", gone.names, " bounds are gone and were left out; use ", gone.instead);
}

BoundKind bound_kind(std::string_view name) {
    for (const BoundKind kind : bound_kinds)
        if (name == nbd::name(kind)) return kind;
    if (const std::string_view instead = instead_of_bound(name); !instead.empty())
        throw std::invalid_argument(message("bounds \"", name, "\" are gone; write \"", instead, '"'));
    throw std::invalid_argument(
        message("unknown bounds \"", name, "\", known: exact, boxes, bd, nbd, learned_affine, affine, auto"));
}

}  // namespace nbd

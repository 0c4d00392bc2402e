#include "training/files/frame_extras.hpp"

#include <fmt/format.h>

namespace nbd {

std::string edge_defect(std::span<const ContactEdge> edges, int id) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto& [face, partner, other] = edges[i];
        const auto defect = [&](const char* allowed) {
            return fmt::format("contact edge ({}, {}, {}); allowed: {}", face, partner, other, allowed);
        };
        if (face < 0) return defect("faces from 0 on");
        if (partner < unrecorded_partner && other != -1) return defect("face -1 of an obstacle");
        if (partner >= unrecorded_partner && other < 0) return defect("faces from 0 on");
        if (partner == id && other <= face) return defect("the lower face of the body itself first");
        if (i > 0 && !(edges[i - 1] < edges[i])) return defect("ascending edges, each once");
    }
    return {};
}

}  // namespace nbd

#include "apps/bench/peers/peers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace nbd {

std::vector<PairMethodEntry> peer_methods() {
    std::vector<PairMethodEntry> methods;
#ifdef NBD_WITH_EMBREE
    methods.push_back({"embree", true, false, make_embree_pairs});
    methods.push_back({"embree rebuilt", true, false, make_embree_rebuilt_pairs});
#endif
#ifdef NBD_WITH_BULLET
    methods.push_back({"bullet gimpact", true, false, make_bullet_gimpact_pairs});
    methods.push_back({"bullet dbvt", true, false, make_bullet_dbvt_pairs});
#endif
#ifdef NBD_WITH_FCL
    methods.push_back({"fcl", true, false, make_fcl_pairs});
#endif
#ifdef NBD_WITH_CGAL
    methods.push_back({"cgal", true, false, make_cgal_pairs});
#endif
    return methods;
}

std::vector<std::string> missing_peers() {
    std::vector<std::string> lines;
    const std::vector<PairMethodEntry> found = peer_methods();
    for (const auto& [method, package] : {std::pair{"embree", "libembree-dev"},
                                          {"bullet dbvt", "libbullet-dev"},
                                          {"fcl", "libfcl-dev"},
                                          {"cgal", "libcgal-dev"}})
        if (std::ranges::find(found, method, &PairMethodEntry::name) == found.end())
            lines.push_back(
                fmt::format("{}: not found when this program was built (Debian: {})", method, package));
    return lines;
}

}  // namespace nbd

#include "apps/bench/peers/peers.hpp"

namespace nbd {

std::vector<PairMethodEntry> peer_methods() {
    std::vector<PairMethodEntry> methods;
#ifdef NBD_WITH_EMBREE
    methods.push_back({"embree", true, false, make_embree_pairs});
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
#ifndef NBD_WITH_EMBREE
    lines.push_back("embree: not found when this program was built (Debian: libembree-dev)");
#endif
#ifndef NBD_WITH_BULLET
    lines.push_back("bullet: not found when this program was built (Debian: libbullet-dev)");
#endif
#ifndef NBD_WITH_FCL
    lines.push_back("fcl: not found when this program was built (Debian: libfcl-dev)");
#endif
#ifndef NBD_WITH_CGAL
    lines.push_back("cgal: not found when this program was built (Debian: libcgal-dev)");
#endif
    return lines;
}

}  // namespace nbd

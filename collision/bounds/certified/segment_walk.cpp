#include "collision/bounds/certified/segment_walk.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <map>

namespace nbd {
namespace {

constexpr double gap = 1e-9;

}  // namespace

SegmentWalk::SegmentWalk(const TetMesh& solid) : solid_(&solid) {
    std::map<std::array<int, 3>, std::pair<int, int>> open;
    for (int t = 0; t < solid.T.rows(); ++t) {
        const auto corner = [&](int a) -> Eigen::Vector3d { return solid.X.row(solid.T(t, a)); };
        Eigen::Matrix3d D;
        for (int a = 0; a < 3; ++a) D.col(a) = corner(a + 1) - corner(0);
        inverse_.push_back(D.inverse());
        neighbour_.push_back({-1, -1, -1, -1});
        for (int a = 0; a < 4; ++a) {
            std::array<int, 3> face = {solid.T(t, (a + 1) % 4), solid.T(t, (a + 2) % 4),
                                       solid.T(t, (a + 3) % 4)};
            std::ranges::sort(face);
            const auto [there, is_new] = open.try_emplace(face, t, a);
            if (is_new) continue;
            const auto [other, b] = there->second;
            neighbour_[static_cast<std::size_t>(t)][static_cast<std::size_t>(a)] = other;
            neighbour_[static_cast<std::size_t>(other)][static_cast<std::size_t>(b)] = t;
            open.erase(there);
        }
    }
}

SegmentWalk::Crossing SegmentWalk::crossing(int tet, const Eigen::Vector3d& p,
                                            const Eigen::Vector3d& q) const {
    const Eigen::Vector3d origin = solid_->X.row(solid_->T(tet, 0));
    const Eigen::Matrix3d& inverse = inverse_[static_cast<std::size_t>(tet)];
    const Eigen::Vector3d a = inverse * (p - origin), b = inverse * (q - origin);
    const Eigen::Vector4d at_p(1 - a.sum(), a[0], a[1], a[2]), at_q(1 - b.sum(), b[0], b[1], b[2]);
    Crossing result;
    for (int k = 0; k < 4; ++k) {
        const double fall = at_p[k] - at_q[k], where = at_p[k] / fall;
        if (fall > 0 && at_q[k] < -gap && where < result.out) {
            result.out = where;
            result.exit = k;
        } else if (fall < 0 && at_p[k] < 0) {
            result.in = std::max(result.in, where);
        } else if (fall == 0 && at_p[k] < 0) {
            result.in = 2;
        }
    }
    return result;
}

bool SegmentWalk::walk(int tet, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                       std::vector<Piece>& pieces) const {
    pieces.clear();
    for (double s = 0;;) {
        const Crossing here = crossing(tet, p, q);
        if (here.in > s + gap) return false;
        pieces.push_back({tet, here.out - s});
        if (here.exit < 0) return true;
        if (!(here.out > s + gap)) return false;  // an edge or a corner: the next one is ambiguous
        s = here.out;
        tet = neighbour_[static_cast<std::size_t>(tet)][static_cast<std::size_t>(here.exit)];
        if (tet < 0) return false;
    }
}

bool SegmentWalk::inside(const Eigen::Vector3d& p, const Eigen::Vector3d& q, std::span<const int> homes,
                         std::vector<Piece>& pieces) const {
    return std::ranges::any_of(homes, [&](int tet) { return walk(tet, p, q, pieces); });
}

}  // namespace nbd

#include "meshing/body/body_hints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "meshing/body/rigid_body.hpp"

namespace nbd {
namespace {

constexpr double least_size = 2e-3, most_size = 20;  // metres, of the longest side
constexpr double locking_ratio = 0.45;  // a beam four cells thick bends 24 % less there than at 0.3
constexpr double slender = 7;      // length of a body by its mean thickness from which it bends; a cube has 5
constexpr double most_thin = 0.6;  // share of a volume; with two tetrahedra across it is below 0.55

}  // namespace

std::string size_hint(const Body& body, double scale) {
    const auto& X = body.surface.X;
    const double longest = scale * (X.colwise().maxCoeff() - X.colwise().minCoeff()).maxCoeff();
    if (longest > most_size)
        return fmt::format(
            "is {:.3g} m long; if its file is in millimetres, "
            "`nbdtree mesh --scale 0.001` makes metres of them",
            longest);
    if (longest < least_size)
        return fmt::format(
            "is {:.3g} m long; if its file is in another unit than metres, "
            "`nbdtree mesh --scale` converts it",
            longest);
    return "";
}

std::string thin_hint(const TetMesh& tets) {
    if (tets.is_quadratic() || is_rigid(tets)) return "";
    const Faces boundary = boundary_faces(tets);
    std::vector<char> is_outer(tets.X.rows(), 0);
    for (const int i : boundary.reshaped()) is_outer[i] = 1;
    double all = 0, thin = 0;  // thin: from boundary to boundary in one tetrahedron
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        const double v = volume(tets, t);
        all += v;
        if (std::ranges::all_of(tets.T.row(t), [&](int i) { return is_outer[i]; })) thin += v;
    }
    const double length = (tets.X.colwise().maxCoeff() - tets.X.colwise().minCoeff()).norm(),
                 thickness = 2 * all / area(tets.X, boundary);
    if (!(thin > most_thin * all) || !(length > slender * thickness)) return "";
    return fmt::format(
        "is one linear tetrahedron thick in {:.0f} % of its volume, so it bends far too little; "
        "quadratic ones bend rightly: --elements quadratic",
        100 * thin / all);
}

std::string locking_hint(const TetMesh& tets, const Material& material,
                         const std::vector<MaterialRegion>& regions) {
    if (tets.is_quadratic()) return "";
    double largest = material.poisson;
    for (const MaterialRegion& region : regions) largest = std::max(largest, region.material.poisson);
    if (!(largest > locking_ratio)) return "";
    return fmt::format(
        "has a Poisson's ratio of {:.3g}, at which linear tetrahedra lock: it bends far less than it should; "
        "advised: --elements quadratic, or {} or less",
        largest, locking_ratio);
}

std::string corners_hint(const Body& body) {
    if (!body.tets.is_quadratic()) return "";
    const Faces boundary = boundary_faces(body.tets);
    const std::set<int> corners(boundary.data(), boundary.data() + boundary.size());
    if (body.surface.F.rows() != boundary.rows() || body.surface.X.rows() != std::ssize(corners)) return "";
    return "has a collision surface of its tetrahedra's corners alone, which does not bulge as they do: it sinks "
           "into what it touches; advised: --subdivide 1";
}

std::vector<std::string> body_hints(const Body& body) {
    std::vector<std::string> hints{size_hint(body), thin_hint(body.tets),
                                   locking_hint(body.tets, body.material, body.regions), corners_hint(body)};
    std::erase(hints, "");
    return hints;
}

}  // namespace nbd

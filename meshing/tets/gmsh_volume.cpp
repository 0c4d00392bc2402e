#include "meshing/tets/gmsh_volume.hpp"

#include <fmt/format.h>
#include <gmsh.h>
#include <sys/resource.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "meshing/progress/progress.hpp"
#include "meshing/surface/shells.hpp"

namespace nbd {
namespace {

/// A gmsh session: exclusive, silent, and without lasting effects.
class GmshSession {
 public:
    GmshSession() : lock_(mutex()) {
        getrlimit(RLIMIT_STACK, &stack_);  // gmsh raises the limit
        gmsh::initialize(0, nullptr, false);
        gmsh::option::setNumber("General.Terminal", 0);
        gmsh::option::setNumber("General.NumThreads", 1);
        gmsh::option::setNumber("Mesh.Algorithm3D", 1);
        gmsh::option::setNumber("Mesh.MeshSizeExtendFromBoundary", 0);
        gmsh::option::setNumber("Mesh.OptimizeThreshold", 0.6);
    }
    ~GmshSession() {
        try {
            gmsh::model::mesh::removeSizeCallback();
            gmsh::finalize();
        } catch (...) {
            // Nothing is left to undo.
        }
        setrlimit(RLIMIT_STACK, &stack_);
    }
    GmshSession(const GmshSession&) = delete;
    GmshSession& operator=(const GmshSession&) = delete;

 private:
    static std::mutex& mutex() {
        static std::mutex one;
        return one;
    }
    std::unique_lock<std::mutex> lock_;
    rlimit stack_{};
};

/// A power of two that scales the longest side of the box to near 1. gmsh has absolute tolerances, and
/// scaling by a power of two is exact.
double unit_scale(const Nodes& X) {
    const double side = (X.colwise().maxCoeff() - X.colwise().minCoeff()).maxCoeff();
    return side > 0 && std::isfinite(side) ? std::exp2(-std::ilogb(side)) : 1;
}

/// The surface as gmsh has it.
struct Loops {
    std::vector<int> tags;  // of a loop for each shell: first the outer one, then those of its cavities
    std::vector<int> rows;  // of X, of the vertices in the order of gmsh's tags, which begin with 1
};

/// X: the vertices, scaled. gmsh numbers all nodes anew, shell by shell, so that they get such tags at once.
Loops add_loops(const TriMesh& surface, const Nodes& X) {
    std::vector<Shell> shells = shells_of(X, surface.F);
    std::ranges::stable_sort(shells, std::ranges::greater{}, &Shell::volume);
    Loops loops;
    for (const Shell& shell : shells) {
        std::vector<int> rows;
        const TriMesh part = part_of(X, surface.F, shell.faces, &rows);
        std::vector<std::size_t> tags(rows.size()), corners(part.F.size());
        const std::size_t first = 1 + loops.rows.size();
        std::iota(tags.begin(), tags.end(), first);
        std::ranges::transform(part.F.reshaped<Eigen::RowMajor>(), corners.begin(),
                               [&](int v) { return first + v; });
        const std::vector<double> coordinates(part.X.data(), part.X.data() + part.X.size());
        const int entity = gmsh::model::addDiscreteEntity(2);
        gmsh::model::mesh::addNodes(2, entity, tags, coordinates);
        gmsh::model::mesh::addElementsByType(entity, 2, {}, corners);
        loops.tags.push_back(gmsh::model::geo::addSurfaceLoop({entity}));
        loops.rows.insert(loops.rows.end(), rows.begin(), rows.end());
    }
    return loops;
}

TetMesh run_gmsh(const TriMesh& surface, const SizeField& size, double scale) {
    const GmshSession session;
    const Nodes scaled = surface.X * scale;
    gmsh::model::add("volume");
    const Loops loops = add_loops(surface, scaled);
    gmsh::model::geo::addVolume(loops.tags);
    gmsh::model::geo::synchronize();
    int sized = 0;
    // Since 4.9 the callback is also given the size that gmsh would take.
    gmsh::model::mesh::setSizeCallback([&](int, int, double x, double y, double z, auto...) {
        if (++sized % 256 == 0) tell_progress("points of gmsh", sized, 0);
        return size(Eigen::Vector3d(x, y, z) / scale) * scale;
    });
    gmsh::model::mesh::generate(3);

    std::vector<std::size_t> node_tags, tet_tags, tet_nodes;
    std::vector<double> xyz, unused;
    gmsh::model::mesh::getNodes(node_tags, xyz, unused);
    gmsh::model::mesh::getElementsByType(4, tet_tags, tet_nodes);
    TetMesh tets;
    if (tet_tags.empty()) return tets;
    std::vector<std::size_t> order(node_tags.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return node_tags[i]; });
    std::vector<int> row_of_tag(node_tags[order.back()] + 1, -1);
    tets.X.resize(order.size(), 3);
    for (std::size_t k = 0; k < order.size(); ++k) {
        const std::size_t r = k < loops.rows.size() ? loops.rows[k] : k;
        row_of_tag[node_tags[order[k]]] = r;
        tets.X.row(r) = Eigen::Map<const Eigen::RowVector3d>(xyz.data() + 3 * order[k]) / scale;
    }
    tets.T.resize(tet_tags.size(), 4);
    std::ranges::transform(tet_nodes, tets.T.data(), [&](std::size_t tag) { return row_of_tag[tag]; });
    return tets;
}

/// The faces as a sorted set; each starts with its smallest vertex.
std::vector<std::array<int, 3>> oriented_set(const Faces& F) {
    std::vector<std::array<int, 3>> set;
    set.reserve(F.rows());
    for (int f = 0; f < F.rows(); ++f) {
        std::array<int, 3> face = {F(f, 0), F(f, 1), F(f, 2)};
        std::rotate(face.begin(), std::ranges::min_element(face), face.end());
        set.push_back(face);
    }
    std::ranges::sort(set);
    return set;
}

/// Throws unless `tets` meets every guarantee of fill_with_gmsh().
void check_filled(const TriMesh& surface, const TetMesh& tets) {
    const Eigen::Index n = surface.X.rows();
    if (tets.T.rows() == 0) throw std::runtime_error("gmsh made no tetrahedra");
    if (tets.X.rows() < n || tets.X.topRows(n) != surface.X)
        throw std::runtime_error("gmsh moved or lost vertices of the surface");
    std::vector<char> used(tets.X.rows());
    for (int t = 0; t < tets.T.rows(); ++t) {
        if (!(volume(tets, t) > 0))
            throw std::runtime_error(fmt::format("gmsh made tetrahedron {} flat or inverted", t));
        for (int c = 0; c < 4; ++c) used[tets.T(t, c)] = 1;
    }
    if (const auto lost = std::ranges::find(used, 0); lost != used.end())
        throw std::runtime_error(fmt::format("vertex {} belongs to no tetrahedron", lost - used.begin()));
    if (oriented_set(boundary_faces(tets)) != oriented_set(surface.F))
        throw std::runtime_error(
            "gmsh did not keep the surface's triangles as the boundary; "
            "check for nested shells and faces oriented inward");
}

}  // namespace

TetMesh fill_with_gmsh(const TriMesh& surface, const SizeField& size) {
    TetMesh tets;
    std::string reason = "it gives no reason";
    try {
        tets = run_gmsh(surface, size, unit_scale(surface.X));
        reason.clear();
    } catch (const std::string& error) {  // of gmsh up to 4.8
        reason = error;
    } catch (const std::runtime_error& error) {  // of later ones
        reason = error.what();
    } catch (const std::exception&) {  // memory, or the user stops
        throw;
    } catch (...) {
    }
    if (!reason.empty()) throw std::runtime_error("gmsh cannot fill the surface: " + reason);
    check_filled(surface, tets);
    return tets;
}

}  // namespace nbd

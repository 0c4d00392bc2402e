#include "meshing/body/body.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "meshing/h5/sha256.hpp"
#include "meshing/h5/sparse.hpp"
#include "meshing/surface/material_fill.hpp"
#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

const h5::Format body_format{"nbdtree body", 3};  // 2: laws and regions; 3: quadratic tetrahedra

template <class M>
h5::Shape shape(const M& m) {
    return {static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols())};
}

void write_material(h5::Writer& file, const std::string& group, const Material& material) {
    file.group(group);
    file.attribute(group, "law", name(material.law));
    file.attribute(group, "young", material.young);
    file.attribute(group, "poisson", material.poisson);
    file.attribute(group, "density", material.density);
    file.attribute(group, "rayleigh_mass", material.rayleigh_mass);
    file.attribute(group, "rayleigh_stiffness", material.rayleigh_stiffness);
}

Material read_material(const h5::Reader& file, const std::string& group) {
    Material material{.young = file.attribute<double>(group, "young"),
                      .poisson = file.attribute<double>(group, "poisson"),
                      .density = file.attribute<double>(group, "density"),
                      .rayleigh_mass = file.attribute<double>(group, "rayleigh_mass"),
                      .rayleigh_stiffness = file.attribute<double>(group, "rayleigh_stiffness")};
    if (file.format().version < 2) return material;
    const std::string text = file.attribute<std::string>(group, "law");
    const std::optional<MaterialLaw> law = material_law(text);
    if (!law)
        file.refuse(fmt::format("{} has the law \"{}\"", group, text),
                    "corotated, stable_neo_hookean, st_venant_kirchhoff");
    material.law = *law;
    return material;
}

/// Regions are numbered groups, since their names may hold any character.
void write_regions(h5::Writer& file, const std::vector<MaterialRegion>& regions) {
    for (std::size_t i = 0; i < regions.size(); ++i) {
        const std::string group = fmt::format("regions/{:03}", i);
        write_material(file, group, regions[i].material);
        file.attribute(group, "name", regions[i].name);
        file.write(group + "/tets", regions[i].tets, h5::Packing::deflate);
    }
}

std::vector<MaterialRegion> read_regions(const h5::Reader& file) {
    std::vector<MaterialRegion> regions;
    if (!file.has("regions")) return regions;
    for (const std::string& child : file.children("regions")) {
        const std::string group = "regions/" + child;
        regions.push_back({.name = file.attribute<std::string>(group, "name"),
                           .material = read_material(file, group),
                           .tets = file.read<int>(group + "/tets", {h5::any})});
    }
    return regions;
}

/// Like regions, numbered.
void write_face_groups(h5::Writer& file, const std::vector<FaceGroup>& groups) {
    for (std::size_t i = 0; i < groups.size(); ++i) {
        const std::string group = fmt::format("face_groups/{:03}", i);
        file.group(group);
        file.attribute(group, "name", groups[i].name);
        file.write(group + "/faces", groups[i].faces, h5::Packing::deflate);
    }
}

std::vector<FaceGroup> read_face_groups(const h5::Reader& file) {
    std::vector<FaceGroup> groups;
    if (!file.has("face_groups")) return groups;
    for (const std::string& child : file.children("face_groups")) {
        const std::string group = "face_groups/" + child;
        groups.push_back({.name = file.attribute<std::string>(group, "name"),
                          .faces = file.read<int>(group + "/faces", {h5::any})});
    }
    return groups;
}

/// Runs check_body() and adds the file's path to the message.
void check(const std::filesystem::path& path, const Body& body) {
    try {
        check_body(body);
    } catch (const std::invalid_argument& e) {
        throw std::runtime_error(fmt::format("{}: {}", path.string(), e.what()));
    }
}

}  // namespace

Material mean_material(const Body& body) {
    if (body.regions.empty()) return body.material;
    const auto materials = materials_of_tets(body.material, body.regions, body.tets.T.rows());
    Material mean = body.material;
    double whole = 0, young = 0, mass = 0;
    for (Eigen::Index t = 0; t < body.tets.T.rows(); ++t) {
        const double part = volume(body.tets, t) * body.tets.filled(t);
        const Material& material = *materials[t];
        whole += part;
        young += part * material.young;
        mass += part * material.density;
    }
    mean.young = young / whole;
    mean.density = mass / whole;
    return mean;
}

std::string body_hash(const Body& body) {
    const h5::SparseRows W(body.W);
    h5::Sha256 hash;
    using enum h5::Type;
    h5::add_dataset(hash, "tets/nodes", float64, shape(body.tets.X), body.tets.X.data());
    h5::add_dataset(hash, "tets/cells", int32, shape(body.tets.T), body.tets.T.data());
    h5::add_dataset(hash, "surface/vertices", float64, shape(body.surface.X), body.surface.X.data());
    h5::add_dataset(hash, "surface/faces", int32, shape(body.surface.F), body.surface.F.data());
    h5::add_dataset(hash, "embedding/rows", int32, {W.rows.size()}, W.rows.data());
    h5::add_dataset(hash, "embedding/cols", int32, {W.cols.size()}, W.cols.data());
    h5::add_dataset(hash, "embedding/values", float64, {W.values.size()}, W.values.data());
    if (body.tets.is_quadratic())
        h5::add_dataset(hash, "tets/edges", int32, shape(body.tets.E), body.tets.E.data());
    if (body.tets.fill.rows() > 0)
        h5::add_dataset(hash, "tets/fill", float64, shape(body.tets.fill), body.tets.fill.data());
    if (!body.origin.isZero(0)) h5::add_dataset(hash, "origin", float64, {3}, body.origin.data());
    return hash.hex();
}

void save_body(const std::filesystem::path& path, const Body& body) {
    check(path, body);
    using enum h5::Packing;
    h5::Writer file(path, body_format);
    file.attribute("/", "name", body.name);
    file.attribute("/", "body_sha256", body_hash(body));
    const bool is_far = !body.origin.isZero(0);
    file.attribute(
        "/", "body_sha256_of",
        std::string("tets/nodes tets/cells surface/vertices surface/faces embedding/rows embedding/cols "
                    "embedding/values") +
            (body.tets.is_quadratic() ? " tets/edges" : "") +
            (body.tets.fill.rows() > 0 ? " tets/fill" : "") + (is_far ? " origin" : ""));
    if (body.bending_error) file.attribute("/", "bending_error", *body.bending_error);
    if (is_far) file.write("origin", body.origin);
    file.write("tets/nodes", body.tets.X);
    file.write("tets/cells", body.tets.T, deflate);
    if (body.tets.is_quadratic()) file.write("tets/edges", body.tets.E, deflate);
    if (body.tets.fill.rows() > 0) file.write("tets/fill", body.tets.fill, deflate);
    file.write("surface/vertices", body.surface.X);
    file.write("surface/faces", body.surface.F, deflate);
    h5::write_sparse(file, "embedding", body.W);
    write_material(file, "material", body.material);
    write_regions(file, body.regions);
    write_face_groups(file, body.face_groups);
    if (body.modes.count() > 0) {
        file.write("modes/U", body.modes.U);
        file.write("modes/frequencies", body.modes.frequencies);
    }
    file.commit();
}

Body load_body(const std::filesystem::path& path) {
    const h5::Reader file(path, body_format);
    Body body;
    body.name = file.attribute<std::string>("/", "name");
    body.tets.X = file.matrix<Nodes>("tets/nodes", h5::any, 3);
    body.tets.T = file.matrix<Tets>("tets/cells", h5::any, 4);
    if (file.has("tets/edges"))
        body.tets.E = file.matrix<TetEdges>("tets/edges", static_cast<std::size_t>(body.tets.T.rows()), 6);
    if (file.has("tets/fill"))
        body.tets.fill = file.matrix<TetFill>("tets/fill", static_cast<std::size_t>(body.tets.T.rows()), 10);
    body.surface.X = file.matrix<Nodes>("surface/vertices", h5::any, 3);
    body.surface.F = file.matrix<Faces>("surface/faces", h5::any, 3);
    const std::size_t vertices = body.surface.X.rows();
    const std::size_t nodes = body.tets.X.rows();
    if (file.has("origin")) body.origin = file.matrix<Eigen::VectorXd>("origin", 3);
    body.W = h5::read_sparse<double>(file, "embedding", vertices, nodes);
    body.material = read_material(file, "material");
    body.regions = read_regions(file);
    body.face_groups = read_face_groups(file);
    if (file.has_attribute("/", "bending_error"))
        body.bending_error = file.attribute<double>("/", "bending_error");
    if (file.has("modes")) {
        body.modes.frequencies = file.matrix<Eigen::VectorXd>("modes/frequencies", h5::any);
        const std::size_t modes = body.modes.frequencies.size();
        body.modes.U = file.matrix<Eigen::MatrixXf>("modes/U", 3 * nodes, modes);
    }
    check(path, body);
    if (const std::string stored = file.attribute<std::string>("/", "body_sha256"), is = body_hash(body);
        stored != is)
        file.refuse(fmt::format("the SHA-256 of the content is {}", is),
                    fmt::format("{}, the value of attribute body_sha256", stored));
    return body;
}

namespace {

/// Throws naming the first non-finite row of m; `item` says what a row is.
template <class M>
void check_finite(const M& m, const char* item) {
    if (m.allFinite()) return;
    for (Eigen::Index i = 0; i < m.rows(); ++i)
        if (!m.row(i).allFinite())
            throw std::invalid_argument(fmt::format("{} {} is not finite; allowed: finite numbers", item, i));
}

template <class M>
void check_indices(const M& m, Eigen::Index count, const char* item, const char* target) {
    for (Eigen::Index i = 0; i < m.rows(); ++i)
        for (Eigen::Index k = 0; k < m.cols(); ++k)
            if (m(i, k) < 0 || m(i, k) >= count)
                throw std::invalid_argument(fmt::format("{} {} refers to {} {}; allowed: 0 to {}", item, i,
                                                        target, m(i, k), count - 1));
}

void check_edges(const TetMesh& tets) {
    if (tets.E.rows() != tets.T.rows())
        throw std::invalid_argument(fmt::format("nodes of the edges of {} tetrahedra; allowed: {}, of all",
                                                tets.E.rows(), tets.T.rows()));
    check_indices(tets.E, tets.X.rows(), "edges of tetrahedron", "node");
    std::vector<std::array<int, 3>> edges;  // corners, ascending, and node
    std::vector<char> is_corner(tets.X.rows(), 0);
    for (const int node : tets.T.reshaped()) is_corner[node] = 1;
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t)
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
            const auto [low, high] =
                std::minmax({tets.T(t, edges_of_tet[k].first), tets.T(t, edges_of_tet[k].second)});
            edges.push_back({low, high, tets.E(t, k)});
            if (is_corner[tets.E(t, k)])
                throw std::invalid_argument(
                    fmt::format("node {} is of a corner and of an edge of tetrahedron {}", tets.E(t, k), t));
        }
    std::ranges::sort(edges);
    for (std::size_t i = 1; i < edges.size(); ++i)
        if (edges[i][0] == edges[i - 1][0] && edges[i][1] == edges[i - 1][1] &&
            edges[i][2] != edges[i - 1][2])
            throw std::invalid_argument(
                fmt::format("the edge between nodes {} and {} has nodes {} and {}; allowed: one", edges[i][0],
                            edges[i][1], edges[i - 1][2], edges[i][2]));
    constexpr double rounding = 1e-6;  // of an edge
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t)
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
            const Eigen::RowVector3d a = tets.X.row(tets.T(t, edges_of_tet[k].first)),
                                     b = tets.X.row(tets.T(t, edges_of_tet[k].second));
            if (const double off = (tets.X.row(tets.E(t, k)) - (a + b) / 2).norm();
                !(off <= rounding * (b - a).norm()))
                throw std::invalid_argument(
                    fmt::format("node {} lies {:.3g} m beside the middle of its edge in tetrahedron {}; "
                                "allowed: edges that are straight at rest",
                                tets.E(t, k), off, t));
        }
}

void check_fill(const TetMesh& tets) {
    if (tets.fill.rows() != tets.T.rows())
        throw std::invalid_argument(
            fmt::format("fill of {} tetrahedra; allowed: {}, of all", tets.fill.rows(), tets.T.rows()));
    check_finite(tets.fill, "fill of tetrahedron");
    constexpr double rounding = 1e-9, least = 1e-9;
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        const double share = tets.filled(t);
        // Of places inside, no eigenvalue is negative.
        const double lowest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(
                                  coordinate_products(tets.fill.row(t)), Eigen::EigenvaluesOnly)
                                  .eigenvalues()[0];
        if (!(share >= least && share <= 1 + rounding && tets.fill.row(t).minCoeff() >= -rounding * share &&
              lowest >= -rounding * share))
            throw std::invalid_argument(fmt::format(
                "fill of tetrahedron {}: {} in all, {} the least; allowed: means of shape functions "
                "over a share of {} to 1 of it",
                t, share, tets.fill.row(t).minCoeff(), least));
    }
}

void check_tets(const TetMesh& tets) {
    if (tets.X.rows() < 4 || tets.T.rows() < 1)
        throw std::invalid_argument(fmt::format("{} nodes and {} tetrahedra; allowed: at least 4 and 1",
                                                tets.X.rows(), tets.T.rows()));
    check_finite(tets.X, "node");
    check_indices(tets.T, tets.X.rows(), "tetrahedron", "node");
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (tets.X.row(tets.T(t, k + 1)) - tets.X.row(tets.T(t, 0))).transpose();
        if (const double volume = edges.determinant() / 6; !(volume > 0))
            throw std::invalid_argument(
                fmt::format("tetrahedron {} has volume {:.3g} m3; allowed: more than 0", t, volume));
    }
    if (tets.is_quadratic()) check_edges(tets);
    if (tets.fill.rows() > 0) check_fill(tets);
}

void check_embedding(const Body& body) {
    const Embedding& W = body.W;
    if (W.rows() != body.surface.X.rows() || W.cols() != body.tets.X.rows())
        throw std::invalid_argument(
            fmt::format("embedding is {} x {}; allowed: {} x {}, surface vertices x nodes", W.rows(),
                        W.cols(), body.surface.X.rows(), body.tets.X.rows()));
    const double size = (body.surface.X.colwise().maxCoeff() - body.surface.X.colwise().minCoeff()).norm();
    for (Eigen::Index v = 0; v < W.rows(); ++v) {
        double sum = 0;
        Eigen::RowVector3d x = Eigen::RowVector3d::Zero();
        for (Embedding::InnerIterator it(W, v); it; ++it) {
            sum += it.value();
            x += it.value() * body.tets.X.row(it.col());
        }
        if (!(std::abs(sum - 1) <= 1e-6))
            throw std::invalid_argument(
                fmt::format("weights of surface vertex {} sum to {}; allowed: 1 within 1e-6", v, sum));
        if (const double off = (x - body.surface.X.row(v)).norm(); !(off <= 1e-5 * size))
            throw std::invalid_argument(fmt::format(
                "surface vertex {} lies {:.3g} m away from its embedded position; allowed: {:.3g} m", v, off,
                1e-5 * size));
    }
}

void check_modes(const ModeBasis& modes, Eigen::Index nodes) {
    if (modes.U.cols() == 0 && modes.frequencies.size() == 0) return;
    if (modes.U.rows() != 3 * nodes || modes.U.cols() != modes.frequencies.size())
        throw std::invalid_argument(
            fmt::format("modes are {} x {} with {} frequencies; allowed: {} rows, 3 per node, "
                        "and one frequency per column",
                        modes.U.rows(), modes.U.cols(), modes.frequencies.size(), 3 * nodes));
    check_finite(modes.U, "row of modes");
    for (Eigen::Index i = 0; i < modes.frequencies.size(); ++i) {
        const double f = modes.frequencies[i], last = i > 0 ? modes.frequencies[i - 1] : 0;
        if (!(f >= last) || !std::isfinite(f))
            throw std::invalid_argument(
                fmt::format("frequency {} is {} Hz; allowed: finite, at least {}, ascending", i, f, last));
    }
}

}  // namespace

void check_body(const Body& body) {
    if (!body.origin.allFinite())
        throw std::invalid_argument("the origin is not finite; allowed: finite numbers");
    check_tets(body.tets);
    if (body.surface.X.rows() < 3 || body.surface.F.rows() < 1)
        throw std::invalid_argument(
            fmt::format("surface of {} vertices and {} faces; allowed: at least 3 and 1",
                        body.surface.X.rows(), body.surface.F.rows()));
    check_finite(body.surface.X, "surface vertex");
    check_indices(body.surface.F, body.surface.X.rows(), "face", "vertex");
    check_embedding(body);
    if (body.bending_error && !std::isfinite(*body.bending_error))
        throw std::invalid_argument("the bending error is not finite; allowed: finite numbers");
    check_material(body.material);
    check_regions(body.regions, body.material, body.tets.T.rows());
    check_face_groups(body.face_groups, body.surface.F.rows());
    check_modes(body.modes, body.tets.X.rows());
}

}  // namespace nbd

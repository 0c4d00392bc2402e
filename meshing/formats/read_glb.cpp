#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/formats/glb_file.hpp"
#include "meshing/formats/surface_formats.hpp"

namespace nbd {
namespace {

using nlohmann::json;

constexpr int most_nodes = 1000;

[[noreturn]] void refuse_glb(const std::string& what) { throw std::runtime_error("glTF: " + what); }

/// `count` numbers of a node; empty without the key.
std::vector<double> numbers_of(const json& node, const char* key, std::size_t count) {
    std::vector<double> numbers;
    const auto found = node.find(key);
    if (found == node.end()) return numbers;
    if (found->is_array())
        for (const json& number : *found)
            if (number.is_number()) numbers.push_back(number.get<double>());
    if (numbers.size() != count) refuse_glb(fmt::format("\"{}\" of a node has not {} numbers", key, count));
    return numbers;
}

/// Entries that stem from rounding become zero, so that a turn by a right angle keeps every bit.
Eigen::Matrix3d without_dust(Eigen::Matrix3d A) {
    const double least = 4 * std::numeric_limits<double>::epsilon() * A.cwiseAbs().maxCoeff();
    for (double& entry : A.reshaped())
        if (std::abs(entry) <= least) entry = 0;
    return A;
}

Eigen::Affine3d transform_of(const json& node) {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    if (const auto m = numbers_of(node, "matrix", 16); !m.empty()) {
        transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
        transform.makeAffine();
        return transform;
    }
    if (const auto t = numbers_of(node, "translation", 3); !t.empty())
        transform.translation() << t[0], t[1], t[2];
    if (const auto q = numbers_of(node, "rotation", 4); !q.empty())
        transform.linear() =
            without_dust(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix());
    if (const auto s = numbers_of(node, "scale", 3); !s.empty())
        transform.linear() *= Eigen::Vector3d(s[0], s[1], s[2]).asDiagonal();
    return transform;
}

class GlbReader {
 public:
    explicit GlbReader(const std::filesystem::path& path) : file_(path) {}

    PolygonSoup read() {
        const json& all = file_.root();
        const auto nodes = all.find("nodes");
        const std::size_t count = nodes != all.end() && nodes->is_array() ? nodes->size() : 0;
        is_visited_.assign(count, false);
        std::vector<Visit> open;
        for (const std::int64_t root : roots(count)) open.push_back({root, z_up(), 1});
        std::ranges::reverse(open);
        while (!open.empty()) {
            const Visit visit = open.back();
            open.pop_back();
            const json& node = file_.item("nodes", visit.node);
            if (is_visited_[visit.node])
                refuse_glb(fmt::format(
                    "node {} is named twice; allowed: as a child of one node, or in the scene", visit.node));
            is_visited_[visit.node] = true;
            const Eigen::Affine3d transform = visit.parent * transform_of(node);
            if (node.contains("mesh")) add_mesh(json_number(node, "mesh", -1), transform);
            const std::vector<std::int64_t> below = children(node);
            if (!below.empty() && visit.depth > most_nodes)
                refuse_glb(fmt::format("nodes are nested more than {} deep", most_nodes));
            for (std::size_t i = below.size(); i-- > 0;)
                open.push_back({below[i], transform, visit.depth + 1});
        }
        return std::move(soup_);
    }

 private:
    struct Visit {
        std::int64_t node;
        Eigen::Affine3d parent;
        int depth;
    };

    static Eigen::Affine3d z_up() {
        Eigen::Affine3d turn = Eigen::Affine3d::Identity();
        turn.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
        return turn;
    }

    static std::vector<std::int64_t> children(const json& object, const char* key = "children") {
        std::vector<std::int64_t> numbers;
        const auto found = object.find(key);
        if (found == object.end()) return numbers;
        if (!found->is_array()) refuse_glb(fmt::format("\"{}\" is not an array", key));
        for (const json& number : *found) {
            if (!number.is_number_unsigned()) refuse_glb(fmt::format("\"{}\" holds what is no number", key));
            numbers.push_back(std::min(number.get<std::uint64_t>(), std::uint64_t{1} << 62));
        }
        return numbers;
    }

    /// Nodes of the scene, of the first one if none is chosen; without scenes, those without a parent.
    std::vector<std::int64_t> roots(std::size_t count) const {
        const json& all = file_.root();
        if (all.contains("scene") ||
            (all.contains("scenes") && all["scenes"].is_array() && !all["scenes"].empty()))
            return children(file_.item("scenes", json_number(all, "scene", 0)), "nodes");
        std::vector<bool> has_parent(count);
        std::vector<std::int64_t> numbers;
        for (std::size_t node = 0; node < count; ++node)
            for (const std::int64_t child : children(file_.item("nodes", node)))
                if (static_cast<std::size_t>(child) < count) has_parent[child] = true;
        for (std::size_t node = 0; node < count; ++node)
            if (!has_parent[node]) numbers.push_back(node);
        if (numbers.empty() && count > 0) refuse_glb("its nodes are children of each other");
        return numbers;
    }

    void add_mesh(std::int64_t number, const Eigen::Affine3d& transform) {
        const json& mesh = file_.item("meshes", number);
        const auto primitives = mesh.find("primitives");
        if (primitives == mesh.end() || !primitives->is_array())
            refuse_glb(fmt::format("mesh {} has no primitives", number));
        for (const json& primitive : *primitives) {
            if (!primitive.is_object())
                refuse_glb(fmt::format("a primitive of mesh {} is not an object", number));
            add_primitive(primitive, transform);
        }
    }

    void add_primitive(const json& primitive, const Eigen::Affine3d& transform) {
        constexpr int triangles = 4, fan = 6;
        const std::int64_t mode = json_number(primitive, "mode", triangles);
        if (mode < triangles) return;  // points and lines
        if (mode > fan) refuse_glb(fmt::format("a primitive has mode {}; allowed: 0 to 6", mode));
        const auto attributes = primitive.find("attributes");
        if (attributes == primitive.end() || !attributes->is_object() || !attributes->contains("POSITION"))
            return;  // which the specification lets a reader skip
        const auto X = file_.positions(json_number(*attributes, "POSITION", -1));
        std::vector<std::int64_t> corners;
        if (primitive.contains("indices")) {
            corners = file_.indices(json_number(primitive, "indices", -1));
        } else {
            corners.resize(X.size());
            for (std::size_t v = 0; v < X.size(); ++v) corners[v] = v;
        }
        const std::int64_t base = soup_.X.size();
        if (soup_.X.size() + X.size() > most || soup_.corners.size() + 3 * corners.size() > most)
            refuse_glb(fmt::format("its instances have more than {} vertices or corners", most));
        const bool is_turned = transform.linear().determinant() < 0;  // a mirror turns faces inside out
        for (const auto& [x, y, z] : X) {
            const Eigen::Vector3d p = transform * Eigen::Vector3d(x, y, z);
            soup_.X.push_back({p.x(), p.y(), p.z()});
        }
        const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
            if (is_turned) std::swap(b, c);
            for (const std::size_t k : {a, b, c}) {
                // An index beyond its own primitive must not refer to a vertex of the next one.
                if (corners[k] >= std::ssize(X))
                    refuse_glb(fmt::format("face {} refers to vertex {} of a primitive of {} vertices",
                                           soup_.face_count(), corners[k], X.size()));
                soup_.corners.push_back(base + corners[k]);
            }
            soup_.face_end.push_back(soup_.corners.size());
        };
        if (mode == triangles) {
            if (corners.size() % 3 != 0)
                refuse_glb(fmt::format("a primitive of triangles has {} corners", corners.size()));
            for (std::size_t i = 0; i + 2 < corners.size(); i += 3) add(i, i + 1, i + 2);
        } else {
            for (std::size_t i = 2; i < corners.size(); ++i)
                mode == fan ? add(0, i - 1, i) : add(i - 2 + i % 2, i - 1 - i % 2, i);
        }
    }

    static constexpr std::size_t most = std::numeric_limits<std::int32_t>::max();

    GlbFile file_;
    std::vector<bool> is_visited_;
    PolygonSoup soup_;
};

}  // namespace

PolygonSoup read_glb(const std::filesystem::path& path) { return GlbReader(path).read(); }

}  // namespace nbd

#include "apps/figures/sphere_pictures.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

#include "apps/drawing/ball_mesh.hpp"
#include "apps/drawing/picture.hpp"
#include "collision/tree/posed_tree.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

constexpr int side = 440;  // pixels per side of a tile
const Eigen::Vector3f body_colour{0.62f, 0.66f, 0.72f}, outside_colour{0.90f, 0.10f, 0.10f};

Eigen::Vector3f sphere_colour(BoundKind kind) {
    switch (kind) {
        case BoundKind::exact:
            return {0.35f, 0.56f, 0.86f};
        case BoundKind::bd:
            return {0.95f, 0.66f, 0.28f};
        case BoundKind::nbd:
            return {0.36f, 0.68f, 0.45f};
        default:
            return {0.66f, 0.48f, 0.80f};
    }
}

std::string label_of(BoundKind kind) {
    switch (kind) {
        case BoundKind::exact:
            return "exact";
        case BoundKind::bd:
            return "BD-Tree";
        case BoundKind::nbd:
            return "predicted (nbd)";
        default:
            return std::string(name(kind));
    }
}

bool lies_outside(VerticesRef x, int v, const Sphere& s) {
    return (x.row(v).transpose() - s.c).cast<double>().norm() > static_cast<double>(s.r);
}

/// The body; faces with a vertex outside their sphere have another colour.
std::vector<PictureSurface> body_surfaces(const CollisionTree& tree, const Vertices& x,
                                          const std::vector<NodeSphere>& spheres) {
    std::vector<int> inside, outside;
    for (const NodeSphere& s : spheres)
        for (const int f : tree.spheres.node_faces(s.node)) {
            const auto face = tree.faces.row(f);
            const bool out =
                s.outside > 0 && (lies_outside(x, face[0], s.sphere) || lies_outside(x, face[1], s.sphere) ||
                                  lies_outside(x, face[2], s.sphere));
            (out ? outside : inside).push_back(f);
        }
    const auto select = [&](const std::vector<int>& rows) {
        Faces F(rows.size(), 3);
        for (std::size_t i = 0; i < rows.size(); ++i) F.row(i) = tree.faces.row(rows[i]);
        return F;
    };
    return {{x, select(inside), body_colour}, {x, select(outside), outside_colour}};
}

/// Weighted mean of two pictures of one size.
Image blend(const Image& a, const Image& b, double share_of_b) {
    Image mixed = a;
    for (std::size_t i = 0; i < mixed.rgb.size(); ++i)
        mixed.rgb[i] =
            static_cast<std::uint8_t>(std::lround((1 - share_of_b) * a.rgb[i] + share_of_b * b.rgb[i]));
    return mixed;
}

/// Camera that looks from the front, the right and slightly above; y is up.
Camera camera_around(const Eigen::AlignedBox3f& box) {
    Camera camera;
    camera.up = {0, 1, 0};
    camera.forward = Eigen::Vector3f(-0.45f, -0.22f, -0.87f).normalized();
    camera.target = box.center();
    return camera;
}

/// Half the height of a picture that shows all spheres.
float reach(const Camera& camera, const std::vector<NodeSphere>& spheres) {
    float reach = 0;
    for (const NodeSphere& s : spheres) {
        const Eigen::Vector3f p = camera.seen(s.sphere.c);
        reach = std::max({reach, std::abs(p.x()) + s.sphere.r, std::abs(p.y()) + s.sphere.r});
    }
    return reach;
}

Image picture(const CollisionTree& tree, const Vertices& x, const std::vector<NodeSphere>& spheres,
              const Camera& camera) {
    std::vector<PictureSurface> surfaces = body_surfaces(tree, x, spheres);
    const Image body = draw(surfaces, {}, camera, side, side);
    for (const NodeSphere& s : spheres) {
        const TriMesh ball = ball_mesh(s.sphere.c.cast<double>(), static_cast<double>(s.sphere.r), 24);
        surfaces.push_back({ball.X.cast<float>(), ball.F, sphere_colour(s.bound)});
    }
    return blend(body, draw(surfaces, {}, camera, side, side), 0.5);
}

}  // namespace

std::vector<NodeSphere> spheres_in_pose(const std::shared_ptr<const CollisionTree>& tree, VerticesRef x,
                                        const std::vector<BoundKind>& bounds) {
    std::vector<NodeSphere> spheres;
    for (const BoundKind kind : bounds) {
        PosedTree posed(tree, kind, 0.f);
        posed.begin_pose(VertexView::as_long_as(x));
        for (int i = 0; i < std::ssize(tree->spheres.nodes); ++i) {
            const int depth = tree->spheres.nodes[i].depth;
            if (depth != 1 && depth != 3 && depth != 5 && depth != 7) continue;
            NodeSphere s{kind, depth, i, posed.sphere(i), 0};
            for (const int v : tree->spheres.node_vertices(i)) s.outside += lies_outside(x, v, s.sphere);
            spheres.push_back(s);
        }
    }
    return spheres;
}

SpherePictures draw_spheres(const std::string& title, const CollisionTree& tree, VerticesRef x,
                            const std::vector<NodeSphere>& spheres) {
    std::vector<BoundKind> bounds;
    std::vector<int> depths;
    for (const NodeSphere& s : spheres) {
        if (std::ranges::find(bounds, s.bound) == bounds.end()) bounds.push_back(s.bound);
        if (std::ranges::find(depths, s.depth) == depths.end()) depths.push_back(s.depth);
    }
    const auto of = [&](BoundKind kind, int depth) {
        std::vector<NodeSphere> own;
        std::ranges::copy_if(spheres, std::back_inserter(own), [&](const NodeSphere& s) {
            return s.bound == kind && (depth < 0 || s.depth == depth);
        });
        return own;
    };

    const Vertices pose = x;
    Eigen::AlignedBox3f box;
    for (Eigen::Index i = 0; i < pose.rows(); ++i) box.extend(Eigen::Vector3f(pose.row(i)));
    SpherePictures pictures{.title = title, .labels = {}, .tiles = {}};
    std::vector<Camera> cameras;  // [rows]
    for (const BoundKind kind : bounds) {
        cameras.push_back(camera_around(box));
        cameras.back().extent = 2.06f * reach(cameras.back(), of(kind, -1));
        const float zoom = cameras.back().extent / cameras.front().extent;
        pictures.labels.push_back(label_of(kind));
        if (zoom > 1.1f) pictures.labels.back() += fmt::format(", drawn {:.1f} times smaller", zoom);
    }
    const int columns = depths.size();
    std::vector<Image> tiles(bounds.size() * depths.size());
    parallel_for(
        tiles.size(),
        [&](int i) {
            const int row = i / columns, column = i % columns;
            tiles[i] = picture(tree, pose, of(bounds[row], depths[column]), cameras[row]);
        },
        1);
    pictures.tiles = contact_sheet(tiles, columns);
    return pictures;
}

std::string to_csv(const std::vector<NodeSphere>& spheres) {
    std::string text = "bound,depth,node,x,y,z,r,vertices_outside\n";
    for (const NodeSphere& s : spheres)
        text += fmt::format("{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{}\n", name(s.bound), s.depth, s.node,
                            s.sphere.c.x(), s.sphere.c.y(), s.sphere.c.z(), s.sphere.r, s.outside);
    return text;
}

}  // namespace nbd

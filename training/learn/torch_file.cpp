#include "training/learn/torch_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "meshing/h5/writer.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {
namespace {

const h5::Format torch_format{"nbdtree torch", 1};

/// Writes one layer's matrices, or its biases if cols is 0, of all nodes. all: NbdNetworks::weights().
/// first: offset of the layer in a node's weights.
void write_layer(h5::Writer& file, const std::string& name, std::span<const float> all, std::size_t nodes,
                 int first, int rows, int cols) {
    const std::size_t each = all.size() / nodes;
    std::vector<float> values;
    for (std::size_t node = 0; node < nodes; ++node) {
        const float* weights = all.data() + node * each + first;
        for (int row = 0; row < rows; ++row)
            for (int col = 0; col < std::max(cols, 1); ++col) values.push_back(weights[col * rows + row]);
    }
    h5::Shape shape{nodes, static_cast<std::size_t>(rows)};
    if (cols > 0) shape.push_back(static_cast<std::size_t>(cols));
    file.write("nbd/" + name, shape, std::span<const float>(values));
}

}  // namespace

void save_torch(const std::filesystem::path& path, const TreeFile& file) {
    if (!file.tree.nbd)
        throw std::runtime_error(fmt::format(
            "{}: the tree has no networks to export; allowed: one trained with nbd bounds", path.string()));
    const NbdModel& nbd = *file.tree.nbd;
    const SphereTree& spheres = file.tree.spheres;
    const std::size_t nodes = spheres.nodes.size();
    const int hidden = nbd.networks.hidden();
    const MlpShape shape{.inputs = nbd.mode_count(), .hidden = hidden};
    const std::vector<float> weights = nbd.networks.weights();
    h5::Writer out(path, torch_format);
    out.attribute("/", "body_sha256", file.facts.body_hash);
    write_layer(out, "W1", weights, nodes, shape.W1(), hidden, shape.inputs);
    write_layer(out, "b1", weights, nodes, shape.b1(), hidden, 0);
    write_layer(out, "W2", weights, nodes, shape.W2(), hidden, hidden);
    write_layer(out, "b2", weights, nodes, shape.b2(), hidden, 0);
    write_layer(out, "W3", weights, nodes, shape.W3(), MlpShape::outputs, hidden);
    write_layer(out, "b3", weights, nodes, shape.b3(), MlpShape::outputs, 0);
    Eigen::Matrix4Xf rest(4, static_cast<Eigen::Index>(nodes));
    for (std::size_t i = 0; i < nodes; ++i)
        rest.col(static_cast<Eigen::Index>(i)) << spheres.rest[i].c, spheres.rest[i].r;
    out.write("nbd/rest", rest.transpose());
    out.write("nbd/out_centre", nbd.out_centre.transpose());
    out.write("nbd/out_scale", nbd.out_scale.transpose());
    const auto m = static_cast<std::size_t>(shape.inputs);
    std::vector<float> map(3 * nodes * m, 0.f);  // rows of the transpose; zero if there is no map
    const Eigen::MatrixXf centre_map = nbd.centre_map.numbers();
    std::copy_n(centre_map.data(), centre_map.size(), map.begin());
    out.write("nbd/centre_map", {nodes, 3, m}, std::span<const float>(map));
    out.write("nbd/z_centre", nbd.z_centre);
    out.write("nbd/z_scale", nbd.z_scale);
    out.write("nbd/representatives", nbd.modes.representatives);
    out.write("nbd/w", nbd.modes.w);
    out.write("nbd/X", nbd.modes.X);
    out.write("nbd/U", nbd.modes.U.numbers());
    out.commit();
}

}  // namespace nbd

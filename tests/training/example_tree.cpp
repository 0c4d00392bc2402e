#include "tests/training/example_tree.hpp"

#include <cstddef>
#include <cstdlib>
#include <span>
#include <string_view>
#include <vector>

#include "collision/base/message.hpp"
#include "collision/flat/flat_file.hpp"
#include "collision/flat/flat_tree.hpp"
#include "tests/collision/models.hpp"

namespace nbd::test {

TreeFile example_tree(const ExampleTree& config) {
    std::srand(5);
    const int n = config.grid;
    const auto [X, F] = shapes::torus(n, n, 2, 1);
    TreeFile file;
    file.X = X;
    file.W = SurfaceEmbedding(X.rows(), X.rows());
    file.W.setIdentity();
    CollisionTree& tree = file.tree;
    tree = make_exact_tree(X, F, {.depth = config.depth, .min_leaf_faces = 4});
    const Eigen::Index nodes = tree.spheres.nodes.size();

    ClusteredModes modes;
    for (int i = 0; i < config.representatives; ++i) modes.representatives.push_back(i * 3 % (n * n));
    modes.w = Eigen::VectorXf::Random(config.representatives).array() + 2;
    modes.X = Vertices::Random(config.representatives, 3);
    modes.U = FixedMatrix(Eigen::MatrixXf::Random(3 * config.representatives, config.modes));
    tree.bd = build_bd_model(tree.spheres, Eigen::MatrixXf::Random(3 * n * n, config.modes), modes);

    tree.nbd.emplace();
    tree.nbd->modes = modes;
    tree.nbd->z_centre = Eigen::VectorXf::Random(config.modes);
    tree.nbd->z_scale = Eigen::VectorXf::Random(config.modes);
    constexpr int hidden = 32;
    const Eigen::VectorXf weights =
        Eigen::VectorXf::Random(nodes * NbdNetworks::weight_count(config.modes, hidden));
    tree.nbd->networks = NbdNetworks(config.modes, hidden, std::span(weights.data(), weights.size()));
    tree.nbd->out_centre = Eigen::MatrixXf::Random(NbdModel::outputs, nodes);
    tree.nbd->out_scale = Eigen::MatrixXf::Random(NbdModel::outputs, nodes);
    tree.nbd->centre_map = FixedMatrix(Eigen::MatrixXf::Random(config.modes, 3 * nodes));
    tree.nbd->z_mean = Eigen::VectorXf::Random(config.modes);
    tree.nbd->z_whitening = Eigen::MatrixXf::Random(config.modes, config.modes);

    hang_on_nodes(tree, file.W, X);
    tree.learned_affine = shapes::sampled_affine_model(tree, X);

    for (const BoundKind kind : {BoundKind::bd, BoundKind::nbd}) {
        Calibration& calibration = tree.calibrations[kind];
        calibration = {.miss_rate = 1e-3, .confidence = 0.9, .trajectories = 20, .poses = 1000};
        const Eigen::VectorXf margins = Eigen::VectorXf::Random(nodes).cwiseAbs();
        calibration.margins.assign(margins.begin(), margins.end());
    }
    Calibration& affine = tree.calibrations[BoundKind::learned_affine];
    affine = {.miss_rate = 1e-3, .confidence = 0.9, .trajectories = 20, .poses = 1000};
    affine.margins.assign(bound_count(tree, BoundKind::learned_affine), 0.25f);
    affine.limits.assign(affine.margins.size(), 2.5f);
    tree.calibrations[BoundKind::nbd].limits.assign(nodes, 1.25f);

    TrainingFacts& facts = file.facts;
    facts.body_hash = std::string(64, 'b');
    facts.recording_hash = std::string(64, 'c');
    facts.config = "{\"depth\": 7,\n \"modes\": 128}";
    facts.split = {{0, 2, 5}, {4, 6}, {1, 3}, ~std::uint64_t{0}, 0.1f};
    facts.poses = 1234;
    facts.node_loss = Eigen::VectorXf::Random(nodes).cwiseAbs();
    facts.z_error = 0.07;
    facts.trained_on = {{1, 5, ~std::uint64_t{0}}, {3, 4}};
    facts.calibrated_on = {{2}, {}};
    return file;
}

NbdNetworks float_networks(const NbdModel& model) {
    const NbdNetworks& networks = model.networks;
    const Eigen::VectorXf weights = Eigen::VectorXf::Random(networks.count() * networks.weight_count());
    return {networks.inputs(), networks.hidden(), std::span(weights.data(), weights.size()),
            NetworkNumbers::floats};
}

std::map<std::string, std::string> fields_of(const CollisionTree& tree) {
    std::map<std::string, std::string> fields;
    const std::vector<std::byte> file = write_flat_tree(tree);
    const FlatReader reader(file);
    for (const FlatArray& array : reader.arrays())
        fields[array.name] = message(
            array.type, ' ', array.rows, " x ", array.columns, ' ',
            std::string_view(reinterpret_cast<const char*>(array.values.data()), array.values.size()));
    return fields;
}

}  // namespace nbd::test

#include "training/files/learned_file.hpp"

#include <fmt/format.h>

namespace nbd {
namespace {

using NodeRows = Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>;   // samples, exact
using BoxRows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;  // growth, mean, inverse deviation

constexpr auto learned_packing = h5::Packing::deflate;

BoxRows to_rows(const std::vector<BoxFit>& fits) {
    BoxRows rows(static_cast<Eigen::Index>(fits.size()), 3);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const BoxFit& fit = fits[static_cast<std::size_t>(i)];
        rows.row(i) << fit.growth, fit.mean, fit.inverse_deviation;
    }
    return rows;
}

std::vector<BoxFit> to_fits(const BoxRows& rows) {
    std::vector<BoxFit> fits;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) fits.push_back({rows(i, 0), rows(i, 1), rows(i, 2)});
    return fits;
}

}  // namespace

void write_learned(h5::Writer& file, const LearnedModel& learned) {
    file.group("learned");
    file.attribute("learned", "network", static_cast<int>(learned.network));
    NodeRows nodes(static_cast<Eigen::Index>(learned.nodes.size()), 2);
    for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
        const LearnedModel::Node& node = learned.nodes[static_cast<std::size_t>(i)];
        nodes.row(i) << node.sample_count, static_cast<int>(node.exact);
    }
    file.write("learned/nodes", nodes, learned_packing);
    file.write("learned/samples", learned.samples, learned_packing);
    file.write("learned/values", learned.values, learned_packing);
    if (learned.boxes.empty()) return;
    file.write("learned/boxes", to_rows(learned.boxes), learned_packing);
}

LearnedModel read_learned(const h5::Reader& file, std::size_t nodes) {
    LearnedModel learned;
    learned.network = file.int_attribute("learned", "network") != 0;
    const auto rows = file.matrix<NodeRows>("learned/nodes", nodes, 2);
    int samples = 0, values = 0;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const int count = rows(i, 0);
        if (count < 0 || count > LearnedModel::max_samples)
            file.refuse(fmt::format("node {} of learned/nodes has {} samples", i, count),
                        fmt::format("{} to {}", LearnedModel::lanes, LearnedModel::max_samples));
        learned.nodes.push_back({samples, count, values, rows(i, 1) != 0});
        samples += count;
        values += LearnedModel::block_size(count, learned.network);
    }
    learned.samples = file.read<int>("learned/samples", {static_cast<std::size_t>(samples)});
    learned.values = file.read<float>("learned/values", {static_cast<std::size_t>(values)});
    if (!file.has("learned/boxes")) return learned;
    learned.boxes = to_fits(file.matrix<BoxRows>("learned/boxes", nodes, 3));
    return learned;
}

void write_learned_affine(h5::Writer& file, const LearnedAffineFit& fit) {
    file.write("learned_affine/samples", fit.samples, learned_packing);
    file.write("learned_affine/box_samples", fit.box_samples, learned_packing);
    file.write("learned_affine/clusters", to_rows(fit.clusters), learned_packing);
    file.write("learned_affine/residual", fit.residual, learned_packing);
    file.write("learned_affine/growth", fit.growth, learned_packing);
}

LearnedAffineFit read_learned_affine(const h5::Reader& file, const Vertices& X) {
    LearnedAffineFit fit{.X = X,
                         .samples = file.read<int>("learned_affine/samples", {h5::any}),
                         .box_samples = file.read<int>("learned_affine/box_samples", {h5::any}),
                         .clusters = to_fits(file.matrix<BoxRows>("learned_affine/clusters", h5::any, 3)),
                         .residual = file.read<float>("learned_affine/residual", {h5::any}),
                         .growth = file.read<float>("learned_affine/growth", {h5::any})};
    return fit;
}

}  // namespace nbd

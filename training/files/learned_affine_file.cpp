#include "training/files/learned_affine_file.hpp"

namespace nbd {
namespace {

using BoxRows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;  // growth, mean, inverse deviation

constexpr auto learned_packing = h5::Packing::deflate;

BoxRows to_rows(const std::vector<BoxFit>& fits) {
    BoxRows rows(fits.size(), 3);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const BoxFit& fit = fits[i];
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

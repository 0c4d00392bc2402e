#include "training/files/certified_file.hpp"

#include <stdexcept>
#include <vector>

#include "collision/bounds/certified/solid_meter.hpp"

namespace nbd {
namespace {

using CellInts = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;
using CellShapes = Eigen::Matrix<float, Eigen::Dynamic, 14, Eigen::RowMajor>;
using PairRows = Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>;

constexpr auto certified_packing = h5::Packing::deflate;

}  // namespace

void write_certified(h5::Writer& file, const CertifiedModel& model) {
    CellInts ints(static_cast<Eigen::Index>(model.cells.size()), 4);
    CellShapes shapes(ints.rows(), 14);
    for (Eigen::Index i = 0; i < ints.rows(); ++i) {
        const CertifiedModel::Cell& cell = model.cells[static_cast<std::size_t>(i)];
        ints.row(i) << cell.anchor, cell.carrier, cell.leg_begin, cell.leg_end;
        shapes.row(i) << cell.path, cell.weight, cell.m.transpose(), cell.B.reshaped().transpose();
    }
    PairRows pairs(static_cast<Eigen::Index>(model.pairs.size()), 2);
    for (Eigen::Index i = 0; i < pairs.rows(); ++i)
        pairs.row(i) << model.pairs[static_cast<std::size_t>(i)].carrier,
            model.pairs[static_cast<std::size_t>(i)].other;
    file.group("certified");
    file.attribute("certified", "rounding", model.rounding);
    file.attribute("certified", "reach", model.reach);
    file.write("certified/tet_region", model.regions.of_tet, certified_packing);
    file.write("certified/sample_begin", model.regions.sample_begin, certified_packing);
    file.write("certified/samples", model.regions.samples, certified_packing);
    file.write("certified/cell_begin", model.cell_begin, certified_packing);
    file.write("certified/cells", ints, certified_packing);
    file.write("certified/cell_shapes", shapes, certified_packing);
    std::vector<int> leg_pairs;
    std::vector<float> leg_lengths;
    for (const CertifiedModel::Leg& leg : model.legs) {
        leg_pairs.push_back(leg.pair);
        leg_lengths.push_back(leg.length);
    }
    file.write("certified/leg_pairs", leg_pairs, certified_packing);
    file.write("certified/leg_lengths", leg_lengths, certified_packing);
    file.write("certified/pairs", pairs, certified_packing);
}

CertifiedModel read_certified(const h5::Reader& file, std::size_t nodes) {
    CertifiedModel model;
    model.rounding = static_cast<float>(file.number_attribute("certified", "rounding"));
    model.reach = static_cast<float>(file.number_attribute("certified", "reach"));
    model.regions.of_tet = file.read<int>("certified/tet_region", {h5::any});
    model.regions.sample_begin = file.read<int>("certified/sample_begin", {h5::any});
    model.regions.samples = file.read<int>("certified/samples", {h5::any});
    model.cell_begin = file.read<int>("certified/cell_begin", {nodes + 1});
    const auto ints = file.matrix<CellInts>("certified/cells", h5::any, 4);
    const auto shapes =
        file.matrix<CellShapes>("certified/cell_shapes", static_cast<std::size_t>(ints.rows()), 14);
    for (Eigen::Index i = 0; i < ints.rows(); ++i)
        model.cells.push_back({.anchor = ints(i, 0),
                               .carrier = ints(i, 1),
                               .leg_begin = ints(i, 2),
                               .leg_end = ints(i, 3),
                               .path = shapes(i, 0),
                               .weight = shapes(i, 1),
                               .m = shapes.row(i).segment<3>(2).transpose(),
                               .B = Eigen::Matrix3f(shapes.row(i).tail<9>().transpose().reshaped(3, 3))});
    const auto leg_pairs = file.read<int>("certified/leg_pairs", {h5::any});
    const auto leg_lengths = file.read<float>("certified/leg_lengths", {leg_pairs.size()});
    for (std::size_t i = 0; i < leg_pairs.size(); ++i) model.legs.push_back({leg_pairs[i], leg_lengths[i]});
    const auto pairs = file.matrix<PairRows>("certified/pairs", h5::any, 2);
    for (Eigen::Index i = 0; i < pairs.rows(); ++i) model.pairs.push_back({pairs(i, 0), pairs(i, 1)});
    return model;
}

void write_solid(h5::Writer& file, const TetMesh& solid) {
    file.write("solid/nodes", solid.X, certified_packing);
    file.write("solid/tets", solid.T, certified_packing);
}

TetMesh read_solid(const h5::Reader& file) {
    TetMesh solid{file.matrix<Nodes>("solid/nodes", h5::any, 3), file.matrix<Tets>("solid/tets", h5::any, 4)};
    try {
        check_solid(solid);
    } catch (const std::invalid_argument& e) {
        file.refuse(e.what(), "finite nodes and positive volumes");
    }
    return solid;
}

}  // namespace nbd

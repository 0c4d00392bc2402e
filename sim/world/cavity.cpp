#include "sim/world/cavity.hpp"

#include <cmath>
#include <limits>

namespace nbd {
namespace {

BodyLoad press_on(const std::vector<int>& faces) {
    return {.kind = LoadKind::pressure, .pressure = 1, .faces = faces};
}

}  // namespace

Cavity::Cavity(int number, const ElasticBody& elastic, const ContactShape& shape)
    : press_(press_on(shape.cavities.at(number).faces), elastic, shape) {
    node_ = static_cast<int>(Embedding::InnerIterator(shape.W, shape.F(faces().front(), 0)).col());
}

Nodes Cavity::slope(NodesRef x) const {
    Nodes slope = Nodes::Zero(x.rows(), 3);
    press_.add(x, 1, slope);
    return slope;
}

/// A volume is a cubic form of the positions from any point on, so that its derivative times these is three
/// times the volume.
double Cavity::volume(NodesRef x, const Nodes& slope) const {
    return (x.rowwise() - x.row(node_)).cwiseProduct(slope).sum() / 3;
}

double ClosedGas::pressure(double at_volume, double time) const {
    return amount.at(time, 1) * gas.pressure * std::pow(volume / at_volume, gas.exponent) - gas.ambient;
}

double ClosedGas::stiffness(double at_volume, double time) const {
    return gas.exponent * (pressure(at_volume, time) + gas.ambient) / at_volume;
}

double ClosedGas::energy(double at_volume, double time) const {
    if (!(at_volume > 0)) return std::numeric_limits<double>::infinity();
    const double all = amount.at(time, 1) * gas.pressure * volume, share = at_volume / volume,
                 e = gas.exponent;
    const double inner = e == 1 ? -std::log(share) : std::expm1((1 - e) * std::log(share)) / (e - 1);
    return all * inner + gas.ambient * (at_volume - volume);
}

}  // namespace nbd

#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/world/body_load.hpp"

namespace nbd {

/// The hollow within a closed part of a body's surface that looks inward.
class Cavity {
 public:
    /// number: of ContactShape::cavities. shape: must outlive the cavity.
    Cavity(int number, const ElasticBody& elastic, const ContactShape& shape);

    const std::vector<int>& faces() const noexcept { return press_.load().faces; }  // ascending

    /// The derivative of the volume by the positions x of the nodes, [N, 3] m2.
    Nodes slope(NodesRef x) const;
    /// At the positions whose slope is given, m3. It may be negative: the cavity is inside out.
    double volume(NodesRef x, const Nodes& slope) const;
    double volume(NodesRef x) const { return volume(x, slope(x)); }

 private:
    LoadForces press_;  // by 1 Pa
    int node_ = 0;      // one that it hangs on
};

/// The hollow within a closed part of a body's surface.
struct CavityState {
    int body = 0, number = 0;  // of the cavity among those of the body, in the order of its faces
    double volume = 0;         // m3
    double pressure = 0;       // of its loads and its gas, Pa, above the ambient pressure
};

/// The gas in a cavity of a body.
struct ClosedGas {
    int cavity = 0;
    CavityGas gas;
    Keyed<double> amount{};  // how much of it there is, of that at the start; none: 1
    double volume = 0;       // m3, at the start
    int load = 0;            // its number among the loads of the body

    /// Above the ambient pressure, Pa.
    double pressure(double at_volume, double time) const;
    /// By how much the pressure falls where the volume grows, Pa / m3, > 0.
    double stiffness(double at_volume, double time) const;
    /// The work that it can do, up to a constant, joules; infinite without volume.
    double energy(double at_volume, double time) const;
};

}  // namespace nbd

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "meshing/body/body.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Trajectories of one kind.
struct KindVariety {
    int trajectories = 0, failed = 0;
    long frames = 0, frames_in_contact = 0;  // of the complete ones
};

/// How much the poses of a dataset differ. Failed trajectories count in `kinds` alone.
struct Variety {
    std::map<std::string, KindVariety> kinds;  // by the recipes' names
    long frames = 0, frames_in_contact = 0;
    int sampled = 0;  // frames, evenly spread, that the rest is about

    /// Principal stretches of all elements: quantiles of variety_quantiles, 1 is undeformed.
    std::vector<double> stretch;
    double least_stretch = 1, largest_stretch = 1;

    /// Displacement from the rest pose after the best rigid motion is taken out; root mean square over mass,
    /// metres.
    double displacement = 0;
    double body_length = 0;  // diagonal of the rest pose's box, metres
    /// Spread of each modal coordinate, as the root mean square displacement that it stands for, metres.
    /// Empty for a body without modes.
    std::vector<double> mode_std;
    /// Share of the squared displacement that the first 1, 2, ... modes hold. In [0, 1].
    std::vector<double> mode_share;
    std::vector<double> frequencies;  // of the modes, Hz
};
inline constexpr std::array variety_quantiles{0.01, 0.05, 0.5, 0.95, 0.99};

/// Measures a dataset shard by shard. The result depends neither on the threads nor on how trajectories are
/// divided among recordings, if they come in order of their ids.
class VarietyMeter {
 public:
    /// frames: about how many there will be; of many, some are sampled, evenly spread.
    VarietyMeter(const Body& body, long frames);

    /// Throws what RecordingReader::read does.
    void add(const RecordingReader& recording);

    Variety report() const;

 private:
    struct Sample;
    void measure(const Eigen::Ref<const Vertices>& x, Sample& sample) const;
    void take(const Sample& sample);

    const Body& body_;
    long stride_, seen_ = 0;
    Eigen::VectorXd masses_;                 // [N], kg
    Nodes rest_;                             // [N, 3] from the centre of mass
    std::vector<Eigen::Matrix3d> inverses_;  // [T] of the rest edges
    std::vector<std::int64_t> histogram_;    // of the logarithms of stretches
    Eigen::VectorXd sum_, squares_;          // [m] of modal coordinates
    double displacement_ = 0;                // sum of kg m2
    Variety counts_;
};

/// As the manifest keeps it, and back. from_json throws std::invalid_argument on what is none.
std::string to_json(const Variety& variety);
Variety variety_from_json(const std::string& text);

/// For people; and a line a mode as CSV.
std::string to_text(const Variety& variety);
std::string to_csv(const Variety& variety);

}  // namespace nbd

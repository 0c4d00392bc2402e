#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "meshing/body/body.hpp"
#include "sim/fem/elastic_body.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Counts of one kind of trajectories.
struct KindVariety {
    int trajectories = 0, failed = 0;
    // Of the complete trajectories:
    long frames = 0, frames_in_contact = 0, frames_troubled = 0, frames_self_intersecting = 0;

    KindVariety& operator+=(const KindVariety& other);
};

/// Measures of how much the poses of a dataset differ. Failed trajectories count only in `kinds`.
struct Variety {
    std::map<std::string, KindVariety> kinds;  // by the recipes' names
    KindVariety all{};                         // their sums
    int sampled = 0;                           // frames, evenly spread, on which the rest is measured

    /// Principal stretches of all elements: quantiles of variety_quantiles, 1 is undeformed.
    std::vector<double> stretch;
    double least_stretch = 1, largest_stretch = 1;

    /// Displacement from the rest pose after the best rigid motion is taken out; root mean square over mass,
    /// metres.
    double displacement = 0;
    double body_length = 0;  // diagonal of the rest pose's box, metres
    /// Standard deviation of each modal coordinate, expressed as a root mean square displacement, metres.
    /// Empty for a body without modes.
    std::vector<double> mode_std;
    /// Share of the squared displacement in the first 1, 2, ... modes, in [0, 1].
    std::vector<double> mode_share;
    std::vector<double> frequencies;  // of the modes, Hz
};
inline constexpr std::array variety_quantiles{0.01, 0.05, 0.5, 0.95, 0.99};

/// Measures a dataset shard by shard. If trajectories come in order of their ids, the result depends neither
/// on the threads nor on how trajectories are divided among recordings.
class VarietyMeter {
 public:
    /// frames: approximate total; of many frames, an evenly spread part is sampled.
    VarietyMeter(const Body& body, long frames);

    /// Throws what RecordingReader::read() throws.
    void add(const RecordingReader& recording);

    Variety report() const;

 private:
    struct Sample;
    void measure(const Eigen::Ref<const Vertices>& x, Sample& sample) const;
    void take(const Sample& sample);

    const Body& body_;
    long stride_, seen_ = 0;
    ElasticBody elastic_;
    Nodes rest_;                           // [N, 3] from the centre of mass
    std::vector<std::int64_t> histogram_;  // of logarithms of stretches
    Eigen::VectorXd sum_, squares_;        // [m] of modal coordinates
    double displacement_ = 0;              // sum of kg m2
    Variety counts_;
};

/// JSON text for the manifest, and back. variety_from_json() throws std::invalid_argument on other text.
std::string to_json(const Variety& variety);
Variety variety_from_json(const std::string& text);

/// Text for people, and CSV with one line per mode.
std::string to_text(const Variety& variety);
std::string to_csv(const Variety& variety);

}  // namespace nbd

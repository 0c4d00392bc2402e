#include "apps/dataset/variety.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {
namespace {

constexpr long max_samples = 1000;

// Bins of logarithms of stretches from -range to range, 0.1 % each.
constexpr double range = 5;
constexpr int bins = 10000;

int bin_of(double stretch) {
    const double u = (std::log(std::max(stretch, 1e-300)) + range) / (2 * range);
    return std::clamp(static_cast<int>(u * bins), 0, bins - 1);
}

double stretch_of(int bin) { return std::exp((bin + 0.5) / bins * 2 * range - range); }

/// The counts of frames of a kind, and their keys.
struct FrameCount {
    const char* key;
    long KindVariety::*count;
};
constexpr FrameCount frame_counts[]{{"frames", &KindVariety::frames},
                                    {"frames_in_contact", &KindVariety::frames_in_contact},
                                    {"frames_troubled", &KindVariety::frames_troubled},
                                    {"frames_self_intersecting", &KindVariety::frames_self_intersecting}};

std::string kind_of(const std::string& recipe) {
    const auto json = nlohmann::json::parse(recipe, nullptr, false);
    return json.is_object() && json.contains("kind") && json["kind"].is_string()
               ? json["kind"].get<std::string>()
               : "unknown";
}

}  // namespace

struct VarietyMeter::Sample {
    std::vector<std::int64_t> histogram;
    double least = 1, largest = 1, displacement = 0;
    Eigen::VectorXd modal;
};

VarietyMeter::VarietyMeter(const Body& body, long frames)
    : body_(body),
      stride_(std::max(1L, frames / max_samples)),
      elastic_(body),
      rest_(body.tets.X.rowwise() - centre_of_mass(elastic_, body.tets.X).transpose()),
      histogram_(bins, 0),
      sum_(Eigen::VectorXd::Zero(body.modes.count())),
      squares_(sum_) {
    counts_.body_length = (rest_.colwise().maxCoeff() - rest_.colwise().minCoeff()).norm();
    counts_.frequencies.assign(body.modes.frequencies.begin(), body.modes.frequencies.end());
}

void VarietyMeter::measure(const Eigen::Ref<const Vertices>& frame, Sample& sample) const {
    Nodes x = frame.cast<double>();
    x.rowwise() -= centre_of_mass(elastic_, x).transpose().eval();
    sample.histogram.assign(bins, 0);
    for (int batch = 0; batch < elastic_.batch_count(); ++batch) {
        const PrincipalLanes sigma = elastic_.principal_stretches_of(x, batch);
        for (int l = 0; l < elastic_.points_of(batch); ++l)
            for (const Lanes& of_axis : sigma) {
                const double stretch = std::abs(of_axis[l]);
                ++sample.histogram[bin_of(stretch)];
                sample.least = std::min(sample.least, stretch);
                sample.largest = std::max(sample.largest, stretch);
            }
    }
    const Eigen::Matrix3d R = rotation_of(elastic_.mass_product(x).transpose() * rest_);
    const Nodes u = x * R - rest_, momentum = elastic_.mass_product(u);
    sample.displacement = momentum.cwiseProduct(u).sum();
    const Eigen::VectorXf stacked = momentum.reshaped<Eigen::RowMajor>().cast<float>();
    sample.modal = (body_.modes.U.transpose() * stacked).cast<double>();
}

void VarietyMeter::take(const Sample& sample) {
    ++counts_.sampled;
    for (std::size_t i = 0; i < histogram_.size(); ++i) histogram_[i] += sample.histogram[i];
    counts_.least_stretch = std::min(counts_.least_stretch, sample.least);
    counts_.largest_stretch = std::max(counts_.largest_stretch, sample.largest);
    displacement_ += sample.displacement;
    sum_ += sample.modal;
    squares_ += sample.modal.cwiseAbs2();
}

void VarietyMeter::add(const RecordingReader& recording) {
    constexpr std::size_t frames_at_once = 16;
    const auto& infos = recording.trajectories();
    const Eigen::Index nodes = body_.tets.X.rows();
    for (int i = 0; i < std::ssize(infos); ++i) {
        const TrajectoryInfo& info = infos[i];
        KindVariety& kind = counts_.kinds[kind_of(info.recipe)];
        ++kind.trajectories;
        if (!info.failure.empty()) {
            ++kind.failed;
            continue;
        }
        const auto positive = [](const std::vector<std::int32_t>& counts) {
            return std::ranges::count_if(counts, [](int count) { return count > 0; });
        };
        const FrameFacts& facts = recording.facts(i);
        kind.frames += info.frames;
        kind.frames_in_contact += positive(facts.contacts);
        kind.frames_troubled += positive(facts.troubled);
        kind.frames_self_intersecting += positive(facts.self_intersections);

        std::vector<int> chosen;
        for (int frame = 0; frame < info.frames; ++frame)
            if (seen_++ % stride_ == 0) chosen.push_back(frame);
        for (std::size_t begin = 0; begin < chosen.size(); begin += frames_at_once) {
            const std::size_t count = std::min(frames_at_once, chosen.size() - begin);
            std::vector<Vertices> frames(count);
            std::vector<Sample> samples(count);
            for (std::size_t k = 0; k < count; ++k) recording.read(i, chosen[begin + k], 1, frames[k]);
            const auto measure_one = [&](int k) {
                const std::size_t slot = k;
                if (frames[slot].rows() == nodes) measure(frames[slot], samples[slot]);
            };
            parallel_for(count, measure_one, 1);
            for (const Sample& sample : samples)
                if (!sample.histogram.empty()) take(sample);
        }
    }
}

KindVariety& KindVariety::operator+=(const KindVariety& other) {
    trajectories += other.trajectories;
    failed += other.failed;
    for (const FrameCount& f : frame_counts) this->*f.count += other.*f.count;
    return *this;
}

Variety VarietyMeter::report() const {
    Variety variety = counts_;
    for (const auto& [name, kind] : variety.kinds) variety.all += kind;
    if (variety.sampled == 0) return variety;
    std::int64_t total = 0;
    for (const std::int64_t count : histogram_) total += count;
    for (const double quantile : variety_quantiles) {
        std::int64_t below = 0;
        int bin = 0;
        while (bin < bins - 1 && (below += histogram_[bin]) < quantile * static_cast<double>(total)) ++bin;
        variety.stretch.push_back(stretch_of(bin));
    }
    const double mass = elastic_.mass(), n = variety.sampled;
    variety.displacement = std::sqrt(displacement_ / n / mass);
    double held = 0;
    for (Eigen::Index k = 0; k < sum_.size(); ++k) {
        const double mean = sum_[k] / n;
        variety.mode_std.push_back(std::sqrt(std::max(0., squares_[k] / n - mean * mean) / mass));
        held += squares_[k];
        variety.mode_share.push_back(displacement_ > 0 ? held / displacement_ : 0);
    }
    return variety;
}

namespace {

void write_frames(nlohmann::ordered_json& json, const KindVariety& kind) {
    for (const FrameCount& f : frame_counts) json[f.key] = kind.*f.count;
}

/// Manifests of earlier versions have fewer counts.
void read_frames(const nlohmann::json& json, KindVariety& kind) {
    kind.frames = json.at("frames");
    for (const FrameCount& f : frame_counts) kind.*f.count = json.value(f.key, 0L);
}

/// Calls use() with the key and the place of each measure of the sampled frames.
template <class V, class Use>
void for_each_measure(V& v, const Use& use) {
    use("stretch", v.stretch);
    use("least_stretch", v.least_stretch);
    use("largest_stretch", v.largest_stretch);
    use("body_length", v.body_length);
    use("displacement", v.displacement);
    use("mode_std", v.mode_std);
    use("mode_share", v.mode_share);
    use("frequencies_hz", v.frequencies);
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

}  // namespace

std::string to_json(const Variety& v) {
    nlohmann::ordered_json json;
    json["kinds"] = nlohmann::ordered_json::object();
    for (const auto& [name, kind] : v.kinds) {
        nlohmann::ordered_json& entry = json["kinds"][name];
        entry = {{"trajectories", kind.trajectories}, {"failed", kind.failed}};
        write_frames(entry, kind);
    }
    write_frames(json, v.all);
    json["sampled_frames"] = v.sampled;
    json["stretch_quantiles"] = variety_quantiles;
    for_each_measure(v, [&](const char* key, const auto& measure) { json[key] = measure; });
    return json.dump();
}

Variety variety_from_json(const std::string& text) try {
    const nlohmann::json json = nlohmann::json::parse(text);
    Variety v;
    for (const auto& [name, entry] : json.at("kinds").items()) {
        KindVariety& kind = v.kinds[name];
        kind = {.trajectories = entry.at("trajectories"), .failed = entry.at("failed")};
        read_frames(entry, kind);
        v.all += kind;
    }
    json.at("sampled_frames").get_to(v.sampled);
    for_each_measure(v, [&](const char* key, auto& measure) { json.at(key).get_to(measure); });
    if ((!v.stretch.empty() && v.stretch.size() != variety_quantiles.size()) ||
        v.mode_std.size() != v.mode_share.size() ||
        (!v.mode_std.empty() && v.frequencies.size() != v.mode_std.size()))
        throw std::invalid_argument("its lists have other lengths than nbdtree writes");
    return v;
} catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(error.what());
}

std::string to_text(const Variety& v) {
    std::string text = fmt::format("{:10}{:>13}{:>8}{:>8}{:>12}{:>12}{:>19}\n", "kind", "trajectories",
                                   "failed", "frames", "in contact", "troubled", "self-intersecting");
    const auto out = std::back_inserter(text);
    const auto row = [&](const std::string& name, const KindVariety& kind) {
        fmt::format_to(
            out, "{:10}{:>13}{:>8}{:>8}{:>10.1f} %{:>10.1f} %{:>17.1f} %\n", name, kind.trajectories,
            kind.failed, kind.frames, percent(kind.frames_in_contact, kind.frames),
            percent(kind.frames_troubled, kind.frames), percent(kind.frames_self_intersecting, kind.frames));
    };
    for (const auto& [name, kind] : v.kinds) row(name, kind);
    row("all", v.all);
    if (v.stretch.empty()) return text;
    fmt::format_to(out, "principal stretches ({} frames):", v.sampled);
    for (std::size_t i = 0; i < v.stretch.size(); ++i)
        fmt::format_to(out, " {:.3g} % below {:.3f},", 100 * variety_quantiles[i], v.stretch[i]);
    fmt::format_to(out, " all from {:.3f} to {:.3f}\n", v.least_stretch, v.largest_stretch);
    fmt::format_to(out, "displacement without rigid motion: {:.2f} % of the body's length\n",
                   percent(v.displacement, v.body_length));
    if (v.mode_std.empty()) {
        fmt::format_to(out, "no modal coordinates: the body has no modes");
        return text;
    }
    fmt::format_to(out, "share of it in the first modes:");
    for (std::size_t count = 1; count < v.mode_share.size(); count *= 2)
        fmt::format_to(out, " {}: {:.1f} %,", count, 100 * v.mode_share[count - 1]);
    fmt::format_to(out, " all {}: {:.1f} %\n", v.mode_share.size(), 100 * v.mode_share.back());
    fmt::format_to(out, "spread of modal coordinates, % of the body's length:");
    for (std::size_t k = 0; k < std::min<std::size_t>(8, v.mode_std.size()); ++k)
        fmt::format_to(out, " {:.2f}", percent(v.mode_std[k], v.body_length));
    if (v.mode_std.size() > 8) fmt::format_to(out, " ... {:.3f}", percent(v.mode_std.back(), v.body_length));
    return text;
}

std::string to_csv(const Variety& v) {
    std::string text = "mode,frequency_hz,std_m,share_of_squared_displacement\n";
    for (std::size_t k = 0; k < v.mode_std.size(); ++k)
        fmt::format_to(std::back_inserter(text), "{},{},{},{}\n", k, v.frequencies[k], v.mode_std[k],
                       v.mode_share[k] - (k > 0 ? v.mode_share[k - 1] : 0));
    return text;
}

}  // namespace nbd
